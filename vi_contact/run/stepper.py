"""Step as the caller says: try a step of any length, look at it, and accept it or not.

For those who own the loop: couplings with other programs, and step sizes chosen by an error. Every
attempt is a certified step in the order that ``core.step`` states:

    scheme.stage -> pose -> solver.solve with its certificate -> scheme.finish -> impact law ->
    scheme.jump

An attempt changes nothing: states are values, and what a scheme carries is in them. So a trial that
is not accepted leaves no trace but its factor, which is kept by the length of the step.
``march`` is written with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..core.algebra import freeze
from ..core.checks import instance, number
from ..core.collective import agree, call_user, together, together_if_own
from ..core.errors import InputError
from ..core.internal import remembers
from ..core.joints import pose_joint
from ..core.problem import ContactProblem
from ..core.protocols import Impact
from ..core.stage import Stage, average, complete, make_matrix, pose
from ..core.state_checks import initial_state
from ..core.step import Report, Scheme, Solver, State
from ..solvers.certified import TOLERANCE, CertifiedSolver
from ..solvers.door import refuse_nan
from ..solvers.joints import JointSolver
from ..solvers.nonlinear import NonlinearSolver
from . import joint_steps
from .materials import certify_material, remember_material, start_scheme
from .method import Method, choose_method

FACTORS = 12  # lengths of steps whose factors are kept by a Stepper
SHORT = 1e-30  # [s] a step over which no state moves, for the check of the first one


@dataclass(frozen=True)
class Trial:
    """Hold a certified step that has been made and not been accepted yet.

    Attributes:
        report: what happened in it.
        dt: its length [s].
        start: where the stepper stood. The first step of a scheme begins with ``report.old``, which
            the scheme may have made of it, as with massless nodes in equilibrium.
    """

    report: Report
    dt: float
    start: State

    @property
    def state(self) -> State:
        """Return the state at its end."""
        return self.report.new


class Stepper:
    """Step along from a state; ``attempt`` makes a step, ``accept`` goes on from its end.

    Attributes:
        method: scheme, solvers and tolerance.
        state: from which the next attempt starts.
        dt: length of the last accepted step [s]; nan before the first.
        prepared: length of a step [s] -> its solver, with one factor of its effective matrix.
        joints: the passes of a joint, beside ``prepared``.
    """

    method: Method
    state: State
    dt: float
    prepared: dict[float, CertifiedSolver | NonlinearSolver]
    joints: dict[float, JointSolver]

    def __init__(
        self,
        problem: ContactProblem,
        *,
        scheme: Scheme | None = None,
        solver: Solver | None = None,
        state: State | None = None,
        escalation: Sequence[Solver] = (),
        tolerance: float = TOLERANCE,
    ) -> None:
        """Stand at a state. Collective.

        Args:
            problem: what is stepped. If it names no mass matrix, or there is no scheme,
                ``run.method.with_defaults`` chooses them.
            scheme: the time scheme.
            solver: of the steps; None means Automatic().
            state: where to begin; None means u0 and v0 of the system.
            escalation: solvers to which a step goes in turn whose certificate exceeds
                ``tolerance``.
            tolerance: of the certificate, relative.

        Raises:
            InputError: arguments of the wrong kind, a state of another problem or inside the
                obstacle, and motions that are marched beside a run, whose time steps are a plan.
        """
        method = choose_method(
            "Stepper",
            problem,
            scheme,
            (solver, escalation),
            SHORT,
            steps=0,
            t_end=None,
            state=state,
            tolerance=tolerance,
        )
        if method.problem.system.companions or method.problem.surface.companions:
            raise InputError(
                "Stepper: the problem has motions that are marched beside a run, such as a free "
                "field, and they follow a plan of time steps: use march or simulate"
            )
        with together(method.problem.surface.comm):
            first = initial_state(method.problem) if state is None else state
        self._stand(method, first)

    def _stand(self, method: Method, state: State) -> None:
        """Stand at a state, with no factor yet.

        Args:
            method: scheme, solvers and tolerance.
            state: where to begin.
        """
        self.method = method
        self.state = state
        self.dt = float("nan")
        self.prepared = {}
        self.joints = {}
        self._has_memory = remembers(method.problem.system.internal)

    def attempt(self, dt: float) -> Trial:
        """Make a step from the state, which stays where it is. Collective.

        Args:
            dt: length of the step [s].

        Raises:
            InputError: a dt that is not positive, or not the same on all ranks.
            StepFailure: no solver could certify the step.
        """
        number("Stepper.attempt", "dt", dt, positive=True)
        agree(self.method.problem.surface.comm, "Stepper.attempt", {"dt": dt})
        while len(self.prepared) >= FACTORS and dt not in self.prepared:
            oldest = next(iter(self.prepared))
            del self.prepared[oldest]
            self.joints.pop(oldest, None)
        return Trial(self._attempt(float(dt)), float(dt), self.state)

    def accept(self, trial: Trial) -> State:
        """Go on from the end of a trial, and return the state there.

        Args:
            trial: of an attempt from the state where the stepper stands.

        Raises:
            InputError: a trial from another state.
        """
        instance("Stepper.accept", "trial", trial, Trial, "give what attempt has returned")
        start = trial.start
        if start is not self.state:
            raise InputError(
                f"Stepper.accept: the trial starts at t = {start.t:g} s, step {start.k}, and the "
                f"stepper stands at t = {self.state.t:g} s, step {self.state.k}: attempt a step "
                "from here"
            )
        self.state = trial.state
        self.dt = trial.dt
        return self.state

    def _convert_state(self, dt: float) -> State:
        """Return the state, with the scheme's memory of a past in steps of dt [s]."""
        if dt == self.dt:
            return self.state
        method = self.method
        with together(method.problem.surface.comm):  # it may ask for loads, which are the user's
            return start_scheme(method.problem, method.scheme, self.state, dt)

    def _stand_at(self, state: State) -> ContactProblem:
        """Return the problem, whose materials go on from a state where they remember."""
        problem = self.method.problem
        return problem.standing_at(state) if self._has_memory else problem

    def _attempt(self, dt: float) -> Report:
        """Return a step of dt [s].

        Loads, motions and laws are the user's, and may fail on one rank: all ranks are asked once,
        at its end.
        """
        with together(self.method.problem.surface.comm):
            return self._make_step(dt)

    def _make_step(self, dt: float) -> Report:
        """Do the work of ``_attempt``, in its frame of all ranks."""
        scheme: Any = self.method.scheme
        surface = self.method.problem.surface
        state = self._convert_state(dt)
        problem = self._stand_at(state)

        # The scheme says where the balance holds: one inequality A d = b with contact.
        with together_if_own(surface.comm, scheme):
            stage = scheme.stage(problem, state, dt)
        if surface.watched:
            surface.refuse_driven(stage.t)
        solver = self._prepare(stage, dt)
        step = pose(problem, stage, solver.A)
        if hasattr(scheme, "press"):  # a law of its own at the contact
            with together_if_own(surface.comm, scheme):
                stage = scheme.press(problem, state, stage, step, dt)
            step = pose(problem, stage, solver.A)
        if problem.joint is None:
            certified = solver.solve(step)
        else:
            refuse_nan(step, lambda: problem.equations)
            step, certified = self.joints[dt].solve(step, pose_joint(problem, state, dt))
            stage = replace(stage, bound=stage.bound - step.joint.shift)
        answer = complete(stage, step, certified.result)
        moving = answer
        if step.joint is not None:
            answer = joint_steps.release(step, answer)
            moving = joint_steps.relieve(step, answer)

        # Displacements and velocities at its end: of the scheme, then of the impact law.
        with together_if_own(surface.comm, scheme):
            free = scheme.finish(problem, state, stage, answer, dt)
        with together_if_own(surface.comm, problem.impact or scheme):
            new = after_impact(problem, scheme, state, free, dt)
        if step.joint is not None:
            new = joint_steps.commit(new, step, certified.result)
        certificate = certified.certificate
        if self._has_memory:
            new = remember_material(problem.equations, new)
            certificate = certify_material(
                problem.equations, certificate, new, self.method.tolerance
            )
        # States are handed out, and the next step is made of them.
        freeze(free.v)
        freeze(new.u)
        freeze(new.v)
        return Report(
            problem=problem,
            old=state,
            new=new,
            v_minus=free.v,
            step=step,
            result=certified.result,
            certificate=certificate,
            # formed only if some recorder asks for it
            averages=partial(average, problem, stage, moving, state, free),
            escalated=certified.escalated,
        )

    def _prepare(self, stage: Stage, dt: float) -> CertifiedSolver | NonlinearSolver:
        """Return the solver of steps of dt [s], made at the first of them.

        Args:
            stage: the balance of this step.
            dt: length of the step [s].
        """
        if dt not in self.prepared:
            method = self.method
            equations = method.problem.equations
            kind = CertifiedSolver if equations.internal is None else NonlinearSolver
            A = make_matrix(equations, stage)
            solver = kind(method.problem, A, stage.scale, method.solvers, method.tolerance)
            self.prepared[dt] = solver
            if isinstance(solver, CertifiedSolver) and method.problem.joint is not None:
                self.joints[dt] = JointSolver(solver.solve, solver.first, method.tolerance)
        return self.prepared[dt]


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
