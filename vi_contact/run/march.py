"""March: the one time loop, a generator over certified steps.

A *base step* is one of the plan (``time_steps``). ``HalvedAtImpact``, ``ErrorControlled`` and
``BySlipRate`` may make it in halves, which are certified steps like any other. Each is an attempt
of a ``Stepper``, which is accepted or made again in halves.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ..core.algebra import max_abs
from ..core.collective import together
from ..core.errors import StepFailure
from ..core.joints import read_committed
from ..core.problem import ContactProblem
from ..core.state_checks import initial_state
from ..core.step import Report, Scheme, Solver, State
from ..solvers.certified import TOLERANCE
from .method import Method, choose_method
from .stepper import Stepper
from .time_steps import StepPlan, TimeSteps, plan_steps


def march(
    problem: ContactProblem,
    *,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    dt: TimeSteps,
    steps: int | None = None,
    t_end: float | None = None,
    state: State | None = None,
    escalation: Sequence[Solver] = (),
    tolerance: float = TOLERANCE,
) -> Iterator[tuple[State, Report]]:
    """Yield (state, report) after every certified step.

    Args:
        problem: what is marched. If it names no mass matrix, or there is no scheme,
            ``run.method.with_defaults`` chooses them, and ``report.problem`` has them.
        scheme: the time scheme.
        solver: of the steps; None means Automatic().
        dt: constant [s], or a Schedule, HalvedAtImpact, ErrorControlled or BySlipRate.
        steps: the number of base steps. The halves of a halved step are yielded one by one, and
            ``state.k`` counts them, but they are one of the ``steps``.
        t_end: the time [s] at which the base steps end; give it or ``steps``.
        state: that of a static stage or a checkpoint; None means u0 and v0 of the system.
        escalation: solvers to which a step goes in turn whose certificate exceeds ``tolerance``.
        tolerance: of the certificate, relative.

    Raises:
        InputError: at the call, for arguments of the wrong kind, and a state of another problem or
            inside the obstacle.
        StepFailure: no solver could certify a step; with step, time, residuals and advice.
    """
    method = choose_method(
        "march",
        problem,
        scheme,
        (solver, escalation),
        dt,
        steps=steps,
        t_end=t_end,
        state=state,
        tolerance=tolerance,
    )
    with together(method.problem.surface.comm):
        state = initial_state(method.problem) if state is None else state
    return iter(March(method, plan_steps(dt, steps, t_end, state.t), state))


class March(Stepper):
    """Step along a plan, and keep the books of it.

    Attributes, at the time a step is handed out, beside those of ``Stepper``:
        step_plan: all base steps of the run.
        base: base steps done.
        ended: whether this step ended one, so that a restart may begin here.
        halved: attempts that were thrown away.
        largest: displacement so far [m], by which errors are measured.
    """

    def __init__(
        self, method: Method, step_plan: StepPlan, state: State, base: int = 0, halved: int = 0
    ) -> None:
        """Stand before the next step.

        Args:
            method: scheme, solvers and tolerance.
            step_plan: all base steps of the run.
            state: at the end of the last one.
            base: how many have been made.
            halved: attempts that have been thrown away.
        """
        self._stand(method, state)
        self.step_plan = step_plan
        self.base = base
        self.halved = halved
        self.ended = True
        self.largest = 0.0

    def __iter__(self) -> Iterator[tuple[State, Report]]:
        """Make base steps, whole or in halves, until the plan ends."""
        sizes: list[float] = []
        while self.base < self.step_plan.steps:
            dt = self.step_plan.dt(self.base)
            self.method.bind()  # another run of the problem may be under way
            if not sizes or sizes[0] != dt:
                # A new piece of the plan, with the sizes of its halves by level: dt, dt/2, dt/4, …
                # Factors of other sizes may be let go.
                sizes = [dt / 2**level for level in range(self.step_plan.halvings + 1)]
                self.prepared = {
                    size: self.prepared[size] for size in sizes if size in self.prepared
                }
                self.joints = {size: self.joints[size] for size in sizes if size in self.joints}

            # The scheme's memory of earlier steps is for steps of one length.
            self.state = self._convert_state(dt)
            self.dt = dt

            if self.step_plan.error is not None:
                reports = self._halve_by_error(sizes)
            elif self.step_plan.slip is not None:
                reports = self._halve_by_slip(sizes, self.step_plan.slip)
            else:
                reports = self._halve_at_impact(sizes)
            for report, size, ended in reports:
                self.state = report.new
                self.dt = size
                self.ended = ended
                if ended:
                    self.base += 1
                yield report.new, report

    def _halve_at_impact(self, sizes: list[float]) -> Iterator[tuple[Report, float, bool]]:
        """Yield the parts of a base step, their lengths [s] and whether each ends it.

        Args:
            sizes: lengths of its parts by how often they were halved [s].
        """
        # The parts of the base step that are left, last first: how often each was halved. A part
        # that closes a point, or that no solver can do, is thrown away, and its two halves take its
        # place.
        levels = [0]
        while levels:
            level = levels.pop()
            report = self._try(sizes[level], may_halve=level < self.step_plan.halvings)
            if report is None:
                self.halved += 1
                levels += [level + 1, level + 1]
                continue
            yield report, sizes[level], not levels

    def _halve_by_error(self, sizes: list[float]) -> Iterator[tuple[Report, float, bool]]:
        """Yield the parts of a base step as ``_halve_at_impact`` does, by step doubling.

        Args:
            sizes: lengths of its parts by how often they were halved [s].
        """
        # The parts that are left, last first, each with its whole attempt where there is one.
        parts: list[tuple[int, Report | None]] = [(0, None)]
        while parts:
            level, report = parts.pop()
            if level == self.step_plan.halvings:
                report = report or self._attempt(sizes[level])
                yield report, sizes[level], not parts
                continue

            # The same way once whole and once in halves, from the same state.
            report = report or self._attempt_or_none(sizes[level])
            first, second = self._attempt_halves(sizes[level + 1])
            if report is None or second is None or not self._agree(report.new, second.new):
                # The first half, which has been made, is now a whole part of the next level.
                self.halved += 1
                parts += [(level + 1, None), (level + 1, first)]
                continue
            if first is not None:
                yield first, sizes[level + 1], False
            yield second, sizes[level + 1], not parts

    def _halve_by_slip(
        self, sizes: list[float], slip: float
    ) -> Iterator[tuple[Report, float, bool]]:
        """Yield the parts of a base step as ``_halve_at_impact`` does, by the slip rate.

        Args:
            sizes: lengths of its parts by how often they were halved [s].
            slip: the longest of a part [m].
        """
        levels = [0]
        while levels:
            level = levels.pop()
            may_halve = level < self.step_plan.halvings
            if may_halve and self._find_slip_rate(self.state) * sizes[level] > slip:
                levels += [level + 1, level + 1]
                continue
            report = self._attempt_or_none(sizes[level]) if may_halve else None
            if may_halve and self._slips_far(report, sizes[level], slip):
                self.halved += 1
                levels += [level + 1, level + 1]
                continue
            report = report or self._attempt(sizes[level])
            yield report, sizes[level], not levels

    def _slips_far(self, report: Report | None, dt: float, slip: float) -> bool:
        """Tell whether a step has no answer, or ends with a rate that needed shorter ones.

        Args:
            report: of the step; None where no solver can do it.
            dt: its length [s].
            slip: the longest of a part [m].
        """
        return report is None or self._find_slip_rate(report.new) * dt > 2.0 * slip

    def _find_slip_rate(self, state: State) -> float:
        """Return the largest slip rate [m/s] of all contact points. Collective."""
        problem = self.method.problem
        surface = problem.surface
        rates = np.linalg.norm(surface.tangential_values(state.v), axis=1)
        if problem.joint is not None:
            # Of a law of rates it is that of the last step, without the ringing of velocities.
            rates = read_committed(problem, state).get("speed", rates)
        return float(surface.comm.max(np.array([max_abs(rates)]))[0])

    def _attempt_or_none(self, dt: float) -> Report | None:
        """Return a step of dt [s] from the state; None where no solver can do it."""
        try:
            return self._attempt(dt)
        except StepFailure:
            return None

    def _attempt_halves(self, dt: float) -> tuple[Report | None, Report | None]:
        """Return two steps of dt [s] one after the other; None for one that cannot be done.

        The march stands where it stood.
        """
        start = self.state
        before = self.dt
        first = self._attempt_or_none(dt)
        second = None
        if first is not None:
            self.state = first.new
            self.dt = dt
            second = self._attempt_or_none(dt)
        self.state = start
        self.dt = before
        return first, second

    def _agree(self, whole: State, halves: State) -> bool:
        """Tell whether two ends of the same way are as near as the plan asks. Collective.

        Args:
            whole: after one step.
            halves: after two steps.
        """
        comm = self.method.problem.surface.comm
        apart = max_abs(whole.u - halves.u)
        apart, size = comm.max(np.array([apart, max_abs(halves.u)]))
        self.largest = max(self.largest, float(size))
        return bool(apart <= (self.step_plan.error or 0.0) * self.largest)

    def _try(self, dt: float, *, may_halve: bool) -> Report | None:
        """Return a step of dt [s]; None when it is to be halved.

        The march is then as it was before.

        Args:
            dt: the length of the step [s].
            may_halve: whether the plan allows halves of it; else it is accepted in any case.
        """
        if not may_halve:
            return self._attempt(dt)
        try:
            report = self._attempt(dt)
        except StepFailure:
            return None
        closes = report.result.active & ~report.old.active
        return None if self.method.problem.surface.some(closes) else report
