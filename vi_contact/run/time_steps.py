"""Plan how long the steps of a run are.

This is a constant dt [s], a ``Schedule``, or steps halved where contact closes, where their error
is too large, or where points slip too far.

Changing dt changes neither u nor v, and so no energy. A scheme that carries its past restarts it
from them (``start``). ``steps``, ``t_end``, ``checkpoint_every`` and progress count *base steps*:
of the plan, halved or not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import ceil, inf, isfinite
from typing import Annotated, Any

from ..core.checks import number, quote, whole
from ..core.errors import InputError
from ..core.quantities import Unit

HALVINGS = 20  # at most: a millionth of the base step
SLACK = 1e-6  # of a step: round-off of the times t + dt + … of a run does not add a step to a piece
LARGEST = 10**9  # steps of a run: beyond, dt is a mistake
LONGEST = (
    1e100  # [s] and its inverse: squares of dt, with masses and stiffnesses as factors, are numbers
)


@dataclass(frozen=True)
class Schedule:
    """Plan pieces (dt [s], until [s]) with steps of dt until that time.

    The last piece is usually (dt, math.inf).

    A piece ends with the first step that reaches its time, even if the piece is not a whole number
    of steps long. InputError if there are no pieces, if a dt is not positive, or if the times do
    not increase.
    """

    pieces: Annotated[tuple[tuple[float, float], ...], Unit("s")]

    def __post_init__(self) -> None:
        try:
            pairs = [(dt, float(until)) for dt, until in self.pieces]
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"Schedule pieces are {quote(self.pieces)}: give pairs ((dt, until), …) in seconds"
            ) from None
        if not pairs:
            raise InputError(
                "Schedule has no pieces: give at least one (dt, until); until may be math.inf"
            )
        object.__setattr__(self, "pieces", tuple((_read_dt(dt), until) for dt, until in pairs))
        for (_, before), (_, until) in pairwise([(0.0, -inf), *self.pieces]):
            if not until > before:
                raise InputError(
                    f"Schedule: the piece until {until:g} s does not end after {before:g} s: give "
                    "increasing times, and math.inf as the last one only"
                )


@dataclass(frozen=True)
class HalvedAtImpact:
    """Plan steps of ``dt`` [s], or of a Schedule, halved at impacts.

    A step that closes an open contact point is computed again in halves.

    The halves may be halved again, down to dt/2**halvings, which resolves the time of an impact.
    Every accepted part is a certified step like any other. At most one matrix is factorised for
    each of the halvings + 1 lengths of a piece. InputError if dt is not positive, or if halvings is
    not a whole number from 0 to 20.
    """

    dt: Annotated[float | Schedule, Unit("s")]
    halvings: int = 3

    def __post_init__(self) -> None:
        if not isinstance(self.dt, Schedule):
            object.__setattr__(self, "dt", _read_dt(self.dt))
        remedy = (
            f"HalvedAtImpact halvings is {quote(self.halvings)}: give a whole number from 0 to "
            f"{HALVINGS}"
        )
        object.__setattr__(self, "halvings", _read(whole, self.halvings, remedy, most=HALVINGS))


@dataclass(frozen=True)
class ErrorControlled:
    """Plan steps of ``dt`` [s], or of a Schedule, halved where their error is too large.

    The error of a step is found by doubling: it is made once whole and once in two halves, from the
    same state, and

        error = max |u_whole - u_halves| / max |u|

    where the second maximum is over all steps so far. The halves are accepted if the error is at
    most ``relative``; otherwise each half is judged in the same way, down to dt/2**halvings. The
    part with an impact goes down alone, and the next base step begins whole again, so that step
    sizes do not chatter. A base step costs three steps for two that are accepted. At most one
    matrix is factorised for each of the halvings + 1 lengths of a piece.

    Raises:
        InputError: dt or relative is not positive, or halvings is not a whole number from 1 to 20.
    """

    dt: Annotated[float | Schedule, Unit("s")]
    relative: float = 1e-3
    halvings: int = 6

    def __post_init__(self) -> None:
        if not isinstance(self.dt, Schedule):
            object.__setattr__(self, "dt", _read_dt(self.dt))
        remedy = (
            f"ErrorControlled halvings is {quote(self.halvings)}: give a whole number from 1 to "
            f"{HALVINGS}"
        )
        halvings = _read(whole, self.halvings, remedy, least=1, most=HALVINGS)
        object.__setattr__(self, "halvings", halvings)
        remedy = (
            f"ErrorControlled relative is {quote(self.relative)}: give a positive part of the "
            "largest displacement, such as 1e-3"
        )
        object.__setattr__(self, "relative", _read(number, self.relative, remedy, positive=True))


@dataclass(frozen=True)
class BySlipRate:
    """Plan steps of ``dt`` [s], or of a Schedule, in which no point slips more than ``slip`` [m].

    Before a step the largest slip rate V of all contact points is read. While V times its length is
    above ``slip`` the step is cut into halves, down to dt/2**halvings. A step at whose end V times
    its length is above twice ``slip`` is thrown away, and its halves are made. So a fault that
    creeps for years and slips within seconds goes in one run. With ``RateAndState`` a quarter of dc
    is a good slip: the period of stick-slip is then right to a thousandth. At most one matrix is
    factorised for each of the halvings + 1 lengths of a piece.

    Raises:
        InputError: dt or slip is not positive, or halvings is not a whole number from 1 to 20.
    """

    dt: Annotated[float | Schedule, Unit("s")]
    slip: Annotated[float, Unit("m")]
    halvings: int = 10

    def __post_init__(self) -> None:
        if not isinstance(self.dt, Schedule):
            object.__setattr__(self, "dt", _read_dt(self.dt))
        remedy = (
            f"BySlipRate slip is {quote(self.slip)}: give the longest slip of a step in metres, "
            "such as a quarter of dc"
        )
        object.__setattr__(self, "slip", _read(number, self.slip, remedy, positive=True))
        remedy = (
            f"BySlipRate halvings is {quote(self.halvings)}: give a whole number from 1 to "
            f"{HALVINGS}"
        )
        halvings = _read(whole, self.halvings, remedy, least=1, most=HALVINGS)
        object.__setattr__(self, "halvings", halvings)


Halved = HalvedAtImpact | ErrorControlled | BySlipRate  # plans that a run refines while it goes
TimeSteps = float | Schedule | Halved


def describe_plan(plan: TimeSteps) -> float | str:
    """Return, for checkpoint and summary, a constant dt as the number it is, a plan in words."""
    if isinstance(plan, Schedule | Halved):
        return repr(plan)
    return plan


def list_pieces(plan: TimeSteps) -> tuple[tuple[float, float], ...]:
    """Return the pieces (dt, until) of a plan, endless for a constant dt [s].

    Raises:
        InputError: there is no dt.
    """
    dt = plan.dt if isinstance(plan, Halved) else plan
    return dt.pieces if isinstance(dt, Schedule) else ((_read_dt(dt), inf),)


@dataclass(frozen=True)
class StepPlan:
    """Hold the base steps of one run.

    These are parts (dt, number of steps), how often each may be halved, and the error or the slip
    [m] above which it is; without both, it is halved where contact closes.
    """

    parts: tuple[tuple[float, int], ...]
    halvings: int = 0
    error: float | None = None
    slip: float | None = None

    @cached_property
    def steps(self) -> int:
        """Return the number of base steps."""
        return sum(steps for _, steps in self.parts)

    @property
    def length(self) -> float:
        """Return the duration of all of them together [s]."""
        return sum(dt * steps for dt, steps in self.parts)

    def dt(self, base: int) -> float:
        """Return the length of a base step, counted from 0; beyond the end, of the last one."""
        for dt, steps in self.parts:
            if base < steps:
                return dt
            base -= steps
        return self.parts[-1][0]


def plan_steps(
    plan: TimeSteps, steps: int | None, t_end: float | None, t0: float = 0.0
) -> StepPlan:
    """Return the base steps from t0 to t_end, or so many.

    Counted from the times of the plan, not from those of the run, whose round-off accumulates: a
    restart, which builds it from the same t0, has the same steps. A step shorter than a millionth
    of dt would be round-off of these times, at the end of a piece and of the run alike, and is not
    made.

    Args:
        plan: how long the steps are [s].
        steps: how many there are; None when t_end says it.
        t_end: where they end [s]; None when ``steps`` says it.
        t0: where they begin [s].

    Raises:
        InputError: plan, steps or t_end make no sense, or there are more than 1e9 steps.
    """
    halvings = plan.halvings if isinstance(plan, Halved) else 0
    error = plan.relative if isinstance(plan, ErrorControlled) else None
    slip = plan.slip if isinstance(plan, BySlipRate) else None
    pieces = list_pieces(plan)
    left = _limit_steps(steps, t_end, t0)
    parts: list[tuple[float, int]] = []
    t = t0
    total = 0
    for size, until in pieces:
        # So many steps of this piece as reach its end or t_end, and as are left of ``steps``.
        last = t_end is not None and t_end <= until + SLACK * size
        end = t_end if last and t_end is not None else until
        count = int(min(_count_steps(end - t, size), left, LARGEST + 1))
        total += count
        if total > LARGEST:
            goal = "the run" if t_end is None else f"the run to t_end = {t_end:g} s"
            raise InputError(
                f"{goal} has more than {LARGEST:.0e} steps of dt = {size:g} s: give a larger dt or "
                "end earlier"
            )
        if count or not parts:
            parts.append((size, count))
        left = 0 if last else left - count
        if left == 0:
            return StepPlan(tuple(parts), halvings, error, slip)
        # The next piece begins where the plan says, or where the last step went beyond that.
        t += count * size
        if abs(t - until) <= SLACK * size:
            t = until
    rest = f"t_end = {t_end:g} s" if t_end is not None else f"the {left:g} steps that are left"
    raise InputError(
        f"the last piece of the Schedule ends at {pieces[-1][1]:g} s, before {rest}: end it at "
        "math.inf"
    )


def _count_steps(span: float, size: float) -> float:
    """Return how many steps of a size [s] reach over a span [s], infinite for an endless one."""
    quotient = span / size
    if not isfinite(quotient):
        return inf
    return max(ceil(quotient - max(SLACK, 1e-12 * quotient)), 0)


def _limit_steps(steps: int | None, t_end: float | None, t0: float) -> float:
    """Return how many steps there are at most, infinite when t_end [s] counts.

    Raises:
        InputError: both are given or none, ``steps`` is no number of steps, or t_end is before t0
            [s].
    """
    if (steps is None) == (t_end is None):
        raise InputError("give either steps or t_end, and not both")
    if t_end is not None:
        remedy = (
            f"the run goes from {t0:g} s to t_end = {quote(t_end)} s: give a finite t_end "
            "after the start"
        )
        if _read(number, t_end, remedy) < t0:
            raise InputError(remedy)
        return inf
    remedy = f"steps is {quote(steps)}: give a whole number of steps >= 0, or t_end in seconds"
    return int(_read(whole, steps, remedy))


def _read_dt(dt: Any) -> float:
    """Return a time step [s] as a float; InputError for what is none."""
    plans = "a Schedule, HalvedAtImpact, ErrorControlled or BySlipRate"
    remedy = f"dt is {quote(dt)}: give a positive time step in seconds, {plans}"
    size = float(_read(number, dt, remedy, positive=True))
    if not 1.0 / LONGEST < size < LONGEST:
        raise InputError(
            f"dt is {size:g} s: give a time step between {1.0 / LONGEST:g} and {LONGEST:g} s"
        )
    return size


def _read(check: Callable[..., Any], value: Any, remedy: str, **limits: Any) -> Any:
    """Return what the check makes of the value.

    Args:
        check: one of ``core.checks``, whose own sentence is not wanted.
        value: the user's.
        remedy: the sentence of the InputError when the check refuses.
        limits: of the check.
    """
    try:
        return check("", "", value, **limits)
    except InputError:
        raise InputError(remedy) from None
