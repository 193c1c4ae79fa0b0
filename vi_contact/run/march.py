"""March: the one time loop, a generator over certified steps.

A *base step* is one of the plan (``time_steps``). ``HalvedAtImpact`` may make it in halves, which
are certified steps like any other. Every step is made in the order that ``core.step`` states:

    scheme.stage -> pose -> solver.solve with its certificate -> scheme.finish -> impact law ->
    scheme.jump

Whatever a user's own function raises on one rank within ``with together(comm)`` is raised on all
ranks at its end.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ..core.algebra import EffectiveMatrix, freeze
from ..core.collective import call_user, together, together_if_own
from ..core.problem import ContactProblem
from ..core.protocols import Impact
from ..core.stage import average, complete, make_matrix, pose
from ..core.state_checks import initial_state
from ..core.step import Report, Scheme, Solver, State
from ..solvers.certified import TOLERANCE, CertifiedSolver
from .method import Method, choose_method
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
        dt: constant [s], or a Schedule, or HalvedAtImpact.
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


class March:
    """Step along a plan, and keep the books of it.

    Attributes, at the time a step is handed out:
        method: scheme, solvers and tolerance.
        step_plan: all base steps of the run.
        state: at its end.
        base: base steps done.
        ended: whether this step ended one, so that a restart may begin here.
        dt: the length of this step [s]; nan before the first.
        halved: attempts that were thrown away.
        prepared: length of a step [s] -> its effective matrix and solver, one factor each.
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
        self.method = method
        self.step_plan = step_plan
        self.state = state
        self.base = base
        self.halved = halved
        self.ended = True
        self.dt = float("nan")
        self.prepared: dict[float, tuple[EffectiveMatrix, CertifiedSolver]] = {}

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

            # The scheme's memory of earlier steps is for steps of one length.
            self.state = self._convert_state(dt)
            self.dt = dt

            # The parts of the base step that are left, last first: how often each was halved. A
            # part that closes a point is thrown away, and its two halves take its place.
            levels = [0]
            while levels:
                level = levels.pop()
                report = self._attempt(sizes[level], final=level == self.step_plan.halvings)
                if report is None:
                    self.halved += 1
                    levels += [level + 1, level + 1]
                    continue
                self.state = report.new
                self.dt = sizes[level]
                self.ended = not levels
                if self.ended:
                    self.base += 1
                yield report.new, report

    def _convert_state(self, dt: float) -> State:
        """Return the state, with the scheme's memory of a past in steps of dt [s]."""
        if dt == self.dt:
            return self.state
        method = self.method
        with together(method.problem.surface.comm):  # it may ask for loads, which are the user's
            return method.scheme.start(method.problem, self.state, dt)

    def _attempt(self, dt: float, *, final: bool) -> Report | None:
        """Return a step of dt [s]; None when it closes a point and is to be halved.

        The march is then as it was before. Loads, motions and laws are the user's, and may fail on
        one rank: all ranks are asked once, at its end.

        Args:
            dt: the length of the step [s].
            final: whether it is accepted in any case, as the plan allows no more halves.
        """
        with together(self.method.problem.surface.comm):
            return self._make_step(dt, final=final)

    def _make_step(self, dt: float, *, final: bool) -> Report | None:
        """Do the work of ``_attempt``, in its frame of all ranks."""
        problem = self.method.problem
        scheme = self.method.scheme
        state = self._convert_state(dt)

        # The scheme says where the balance holds: one inequality A d = b with contact.
        with together_if_own(problem.surface.comm, scheme):
            stage = scheme.stage(problem, state, dt)
        if dt not in self.prepared:
            method = self.method
            A = make_matrix(problem.equations, stage)
            solver = CertifiedSolver(problem, A, stage.scale, method.solvers, method.tolerance)
            self.prepared[dt] = (A, solver)
        A, solver = self.prepared[dt]
        step = pose(problem, stage, A)
        if hasattr(scheme, "press"):  # a law of its own at the contact
            with together_if_own(problem.surface.comm, scheme):
                stage = scheme.press(problem, state, stage, step, dt)
            step = pose(problem, stage, A)

        # It is solved with a certificate, and thrown away if it is too long for an impact, which is
        # where a point closes that was open before.
        if problem.surface.watched:
            problem.surface.refuse_driven(step.t)
        certified = solver.solve(step)
        result = certified.result
        if not final and problem.surface.some(result.active & ~state.active):
            return None

        # Displacements and velocities at its end: of the scheme, then of the impact law.
        answer = complete(stage, step, result, certified.image)
        with together_if_own(problem.surface.comm, scheme):
            free = scheme.finish(problem, state, stage, answer, dt)
        with together_if_own(problem.surface.comm, problem.impact or scheme):
            new = after_impact(problem, scheme, state, free, dt)
        for vector in (free.u, free.v, new.u, new.v):
            freeze(vector)  # states are handed out, and the next step is made of them

        return Report(
            problem=problem,
            old=state,
            new=new,
            v_minus=free.v,
            step=step,
            result=result,
            certificate=certified.certificate,
            # formed only if some recorder asks for it
            averages=partial(average, problem, stage, step, answer),
            escalated=certified.escalated,
        )


def after_impact(
    problem: ContactProblem, scheme: Scheme, old: State, new: State, dt: float
) -> State:
    """Return the state with the impact law applied: its velocities, after the step.

    The law says which normal velocities closed points have after an impact, from those before the
    step; nan leaves a point alone. ``law.apply`` finds the velocities v of all unknowns with these,
    by an impulse at the points, and the scheme writes the jump into its state. Points on massless
    supports (springs) do not collide.

    Args:
        problem: whose law it is.
        scheme: which writes the jump of velocities into its state.
        old: the state before the step.
        new: the one after it, without impact.
        dt: the length of the step [s].
    """
    law = problem.impact
    surface = problem.surface
    if law is None:
        return new
    active = new.active & surface.rigid
    if not surface.some(active):
        return new
    impact = Impact(
        before=surface.normal_values(old.v),
        v_n=surface.normal_values(new.v),
        active=active,
        closing=active & ~old.active,
    )
    target = call_user(
        f"the impact law {type(law).__name__}",
        lambda: law.target(impact),
        np.full(surface.count, np.nan),
    )
    if not surface.some(~np.isnan(target)):
        return new
    v = law.apply(problem.equations, surface, new.v, target)
    return scheme.jump(problem, new, v, dt)
