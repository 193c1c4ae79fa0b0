"""March: the one time loop, a generator over certified steps."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ..core.algebra import EffectiveMatrix
from ..core.collective import together, together_if_own, users
from ..core.problem import ContactProblem
from ..core.products import frozen
from ..core.protocols import Impact
from ..core.state_checks import initial_state
from ..core.step import Report, Scheme, Solver, State
from ..solvers.certified import TOLERANCE, CertifiedSolver
from .method import Method, checked_method
from .time_steps import StepPlan, TimeSteps, step_plan


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

    If ``scheme`` is None, or the problem names no mass matrix, ``run.method.with_defaults`` chooses
    them, and ``report.problem`` has them. If ``solver`` is None, it is Automatic().

    ``dt`` [s] is constant, or a Schedule, or HalvedAtImpact. ``steps`` and ``t_end`` count base
    steps: the halves of a halved step are yielded one by one, and ``state.k`` counts them, but they
    are one of the ``steps``. A step whose certificate exceeds ``tolerance`` goes to the solvers of
    ``escalation`` in turn. If all of them fail, StepFailure is raised with step, time, residuals
    and advice. ``state`` is that of a static stage or a checkpoint. InputError is raised at the
    call: arguments of the wrong kind, a state of another problem or inside the obstacle.
    """
    method = checked_method(
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
    return iter(March(method, step_plan(dt, steps, t_end, state.t), state))


class March:
    """Step along a plan, and keep the books of it.

    ``prepared``: matrices and solvers by the length of their steps.

    Attributes, at the time a step is handed out:
        base: base steps done. ended: whether this step ended one, so that a restart may begin here.
        dt: the length of this step [s]. halved: attempts that were thrown away.
    """

    def __init__(
        self, method: Method, step_plan: StepPlan, state: State, base: int = 0, halved: int = 0
    ) -> None:
        self.method, self.step_plan, self.state = method, step_plan, state
        self.prepared: dict[float, tuple[EffectiveMatrix, CertifiedSolver]] = {}
        self.base, self.halved, self.ended, self.dt = base, halved, True, float("nan")

    def __iter__(self) -> Iterator[tuple[State, Report]]:
        sizes: list[float] = []
        while self.base < self.step_plan.steps:
            dt = self.step_plan.dt(self.base)
            self.method.bind()  # another run of the problem may be under way
            if not sizes or sizes[0] != dt:
                sizes = [dt / 2**level for level in range(self.step_plan.halvings + 1)]
                self.prepared = {
                    size: self.prepared[size] for size in sizes if size in self.prepared
                }
            self.state, self.dt = self._restarted(dt), dt
            levels = [0]  # how often the parts of the base step that are left were halved
            while levels:
                level = levels.pop()
                report = self._attempt(sizes[level], final=level == self.step_plan.halvings)
                if report is None:
                    self.halved += 1
                    levels += [level + 1, level + 1]
                    continue
                self.state, self.dt, self.ended = report.new, sizes[level], not levels
                self.base += self.ended
                yield report.new, report

    def _restarted(self, dt: float) -> State:
        """Return the state, with a past for this dt."""
        if dt == self.dt:
            return self.state
        method = self.method
        with together(method.problem.surface.comm):  # it may ask for loads, which are the user's
            return method.scheme.start(method.problem, self.state, dt)

    def _attempt(self, dt: float, *, final: bool) -> Report | None:
        """Return a step of dt; None when it closes a point and is to be halved.

        Nothing has happened then.

        Its loads, motions and laws are the user's, and may fail on one rank: all ranks are asked
        once, at its end.
        """
        with together(self.method.problem.surface.comm):
            return self._attempted(dt, final=final)

    def _attempted(self, dt: float, *, final: bool) -> Report | None:
        problem, scheme, state = self.method.problem, self.method.scheme, self._restarted(dt)
        A, solver = self.prepared.get(dt, (None, None))
        with together_if_own(problem.surface.comm, scheme):
            A = scheme.effective_matrix(problem, dt) if A is None else A
            step = scheme.step(problem, state, A, dt)
        if solver is None:
            solver = CertifiedSolver(
                problem, A, step.scale, self.method.solvers, self.method.tolerance
            )
            self.prepared[dt] = A, solver
        if problem.surface.watched:
            problem.surface.refuse_driven(step.t)
        result, certificate, escalated = solver.solve(step)
        if not final and problem.surface.some(result.active & ~state.active):
            return None
        with together_if_own(problem.surface.comm, scheme):
            free = scheme.finish(problem, state, step, result, dt)
        with together_if_own(problem.surface.comm, problem.impact or scheme):
            new = after_impact(problem, scheme, state, free, dt)
        for vector in (free.u, free.v, new.u, new.v):
            frozen(vector)  # what is known of them stays true
        averages = partial(scheme.balance, problem, state, free, dt)
        return Report(problem, state, new, free.v, step, result, certificate, averages, escalated)


def after_impact(
    problem: ContactProblem, scheme: Scheme, old: State, new: State, dt: float
) -> State:
    """Return the state with the impact law applied.

    Points on massless supports (springs) do not collide.
    """
    law, surface = problem.impact, problem.surface
    if law is None:
        return new
    active = new.active & surface.rigid
    if not surface.some(active):
        return new
    impact = Impact(
        surface.normal_values(old.v), surface.normal_values(new.v), active, active & ~old.active
    )
    target = users(
        f"the impact law {type(law).__name__}",
        lambda: law.target(impact),
        np.full(surface.count, np.nan),
    )
    if not surface.some(~np.isnan(target)):
        return new
    return scheme.jump(problem, new, law.apply(problem.equations, surface, new.v, target), dt)
