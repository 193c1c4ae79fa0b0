"""March several runs of one body at once.

They differ in what shakes it, how it rubs and where it starts.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from ..core.checks import several
from ..core.errors import InputError, ViContactError
from ..core.problem import ContactProblem
from ..core.state_checks import initial_state
from ..core.step import Report, Scheme, Solver, State
from ..solvers.certified import TOLERANCE
from .materials import start_scheme
from .method import choose_method, with_defaults
from .time_steps import TimeSteps, plan_steps
from .together import Together, group_runs


def march_many(
    problems: Sequence[ContactProblem],
    *,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    dt: TimeSteps,
    steps: int | Sequence[int] | None = None,
    t_end: float | Sequence[float] | None = None,
    states: Sequence[State | None] | None = None,
    escalation: Sequence[Solver] = (),
    tolerance: float = TOLERANCE,
) -> Iterator[tuple[int, Report | ViContactError]]:
    """Yield (number of the run, report) after every certified step, a step of each run in turn.

    A run that fails yields its error, last; the others go on.

    Runs step together, which reads every matrix once for eight of them, when their problems have
    the same system and surface objects, and equal mass and impact laws:
    ``dataclasses.replace(problem, excitation=…)``; when all of them have friction or none; and are
    at the same time. One whose record ends, or whose step needs the escalation, leaves the others
    and goes on alone. Alone from the beginning go runs on several MPI ranks, with HalvedAtImpact,
    with motions that are marched beside (``soil``), with schemes that do not say ``by_rows``
    (ContactStabilisedNewmark, MoreauJean), with other solvers than Condensed() of ActiveSet(), or
    of any method for friction, and without CHOLMOD.

    Args:
        problems: one for each run.
        scheme: of all runs; as of ``march``, and so are ``solver``, ``dt`` [s], ``escalation`` and
            ``tolerance``.
        solver: of all runs.
        dt: of all runs.
        steps: the number of base steps, one for all or one for each run.
        t_end: the time of their end [s], one for all or one for each run; give it or ``steps``.
        states: where each run starts, None for u0 and v0 of its system.
        escalation: of all runs.
        tolerance: of all runs.

    Raises:
        InputError: at the call, as of ``march``, and where there is not one value for each run.
    """
    checked = several("march_many", "problems", problems, "give a list of ContactProblems")
    steps_of_runs = _spread("steps", steps, len(checked))
    ends = _spread("t_end", t_end, len(checked))
    starts = _spread("states", states, len(checked))
    runs: list[Together] = []
    for problem, count, end, state in zip(checked, steps_of_runs, ends, starts, strict=True):
        problem, scheme = with_defaults(problem, scheme, [run.method.problem for run in runs])
        method = choose_method(
            "march_many",
            problem,
            scheme,
            (solver, escalation),
            dt,
            steps=count,
            t_end=end,
            state=state,
            tolerance=tolerance,
        )
        if state is None:
            state = initial_state(method.problem)
        plan = plan_steps(dt, count, end, state.t)
        first = start_scheme(method.problem, scheme, state, plan.dt(0))
        runs.append(Together(method, plan, first))
    group_runs(runs)
    return _march_in_turn(runs)


def _spread(name: str, value: Any, count: int) -> Sequence[Any]:
    """Return one value for each run.

    Args:
        name: of the argument of ``march_many``.
        value: one for all, or one for each.
        count: how many runs there are.
    """
    if not isinstance(value, Sequence):
        return [value] * count
    if len(value) != count:
        raise InputError(
            f"march_many has {len(value)} {name} for {count} problems: give one for each"
        )
    return value


def _march_in_turn(runs: Sequence[Together]) -> Iterator[tuple[int, Report | ViContactError]]:
    """Yield a step of every run in turn, until all have ended."""
    going = {number: run.reports() for number, run in enumerate(runs)}
    while going:
        for number, loop in list(going.items()):
            try:
                report = next(loop)
            except StopIteration:
                del going[number]
                continue
            except ViContactError as error:
                del going[number]
                runs[number].leave()
                yield number, error
                continue
            yield number, report
