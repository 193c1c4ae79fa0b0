"""Find equilibria with contact.

These are the static (gravity) stage where a run starts, and load histories without inertia.

In a history one stage follows another, as friction makes the equilibrium depend on the way to it.
Each stage solves the static problem with slips counted from the stage before (slip rate times time
step, implicit Euler):

    K u_k = f(t_k) - B_nᵀ r_n - B_tᵀ r_t,    r_t against B_t (u_k - u_{k-1}),    |r_t| <= limit(r_n)

so that t only orders the loads: histories of ``Traction`` and ``BodyForce``, ``Prescribed``
displacements, and obstacles that move. Without friction every stage is the equilibrium of its own
loads. Slip between stages has no rate, so a law that asks for one is refused: its value at rest
would be wrong for points in motion wherever it jumps there.
"""

import logging
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ..core.algebra import EffectiveMatrix, largest, max_abs
from ..core.certificate import Certificate
from ..core.checks import describe_point, number, quote, real
from ..core.collective import Parts, agree, together
from ..core.errors import InputError, StepFailure
from ..core.joints import pose_joint
from ..core.problem import ContactProblem
from ..core.stage import Affine, Answer, Stage, complete, pose
from ..core.state_checks import check_problem_given, check_sizes, initial_state
from ..core.step import Solver, State, StepProblem, StepResult
from ..solvers.automatic import Automatic
from ..solvers.certified import TOLERANCE, CertifiedSolver
from ..solvers.door import refuse_matrix, refuse_nan
from ..solvers.joints import JointSolver
from ..solvers.nonlinear import NonlinearSolver
from . import joint_steps
from .creeping import Creep, Creeping, NotFound, may_creep
from .materials import certify_material, keep_material, remember_material
from .method import check_methods
from .proximal import Proximal
from .settling import Settling
from .weakening import Weakening, weakens

log = logging.getLogger(__name__)
OPEN = 0.05  # of the area that touches at the start: so much may be open at rest without a warning
TOUCHING = 1e-9  # of the largest coordinate: a gap that is none
ADVICE = "try another solver, or smaller load steps, and check the data"
ADVICE_JOINT = (
    "a joint that snaps back has no equilibrium near the one before: take smaller load steps, or a "
    "dynamic stage, where inertia decides"
)
ADVICE_NONLINEAR = (
    "try smaller load steps, or march with damping where the body may buckle, and check the data"
)
ADVICE_FLOATING = (
    "check that contact stops whatever the loads drive, clamp a part of the body, or march from "
    "rest with damping"
)


def static_equilibrium(
    problem: ContactProblem,
    *,
    solver: Solver | None = None,
    t: float = 0.0,
    tolerance: float = TOLERANCE,
    state: State | None = None,
) -> State:
    """Return the gravity stage, without excitation: K u = f(t) - B_nᵀ r_n - B_tᵀ r_t with contact.

    The state has v = 0, and it has the stresses, reactions and contact set with which the dynamic
    stage starts. A body that no prescribed displacement holds is brought to rest on its contacts.
    Free rigid motions that no load drives keep the mean position of u0 (see ``proximal``).

    Args:
        problem: what stands in equilibrium.
        solver: Automatic() when None.
        t: the time [s] at which loads and prescribed displacements are taken.
        tolerance: of the certificate, relative.
        state: from where points that rub slide, and where materials that yield go on; None: the
            displacements at the start, without any past.

    Raises:
        InputError: the loads drive a rigid motion that nothing stops, so that there is no
            equilibrium.
        StepFailure: no answer has a certificate below the tolerance.
    """
    owner = "static_equilibrium"
    check_problem_given(owner, problem)
    agree(
        problem.surface.comm,
        owner,
        {"solver": solver, "t": t, "tolerance": tolerance, "state": Parts(state)},
    )
    check_methods(owner, solver, (), tolerance)
    t = number(owner, "t", t, unit="s")
    equilibria = Equilibria(problem, solver=solver, tolerance=tolerance)
    if state is None:
        with together(problem.surface.comm):
            start = initial_state(problem, t)
    else:
        check_sizes(owner, problem, state)
        start = state
    reached = equilibria.solve(start, t)
    _warn_if_open(problem, reached)
    return reached


def _warn_if_open(problem: ContactProblem, state: State) -> None:
    """Warn, on rank 0, where much of a contact that touched at the start is open at rest.

    A contact without any pressure is let be. Collective.
    """
    # Sum of reactions, area of what touched, and of what of it has opened, of all ranks.
    surface = problem.surface
    size = largest(surface.comm, max_abs(surface.points))  # of the coordinates [m]
    touching = surface.gap0 <= TOUCHING * size
    lifted = touching & ~state.active
    sums = [state.r_n.sum(), surface.weights[touching].sum(), surface.weights[lifted].sum()]
    pressed, area, lost = surface.comm.sum(np.array(sums))
    if pressed <= 0.0 or lost <= OPEN * area:
        return

    # The open point with the lowest number. One rank has it, and tells its place to all by a sum to
    # which the others add zero.
    first = -largest(surface.comm, np.max(-surface.slots[lifted].astype(float), initial=-np.inf))
    own = lifted & (surface.slots == first)
    place = surface.comm.sum(surface.points[own].sum(axis=0))
    if surface.comm.rank == 0:
        log.warning(
            "at rest at t = %g s %.3g %% of the contact area that touches at the start is open, "
            "from %s on: the loads part the bodies there, as where fill leans away from a wall, "
            "or a moment lifts the edge of a base",
            state.t,
            100.0 * lost / area,
            describe_point(place),
        )


class Equilibria:
    """Solve static stages of one problem, with one factorisation, or none, for all.

    Where prescribed displacements hold every body, K is positive definite, and a stage is one step
    of the contract (``core.step``) with A = K. Where contact alone holds one, K is singular, and
    the stage is a sequence of such steps (``proximal``; of stones, ``weakening``). That of a body
    that is not linear is a sequence of steps about where it is (``solvers.nonlinear``).

    Attributes:
        solver: of the stages.
    """

    def __init__(
        self, problem: ContactProblem, *, solver: Solver | None = None, tolerance: float = TOLERANCE
    ) -> None:
        """Factorise what the solver needs.

        Args:
            problem: what stands in equilibrium.
            solver: Automatic() when None.
            tolerance: of the certificates, relative.
        """
        solver = solver or Automatic()
        system = problem.static_load
        self._problem = problem
        self._tolerance = tolerance
        self._K = EffectiveMatrix(
            system.K, system.algebra, space=system.space, inertia=(0.0, system.M)
        )
        joint_steps.refuse_statics(problem)
        refuse_matrix(problem, self._K)
        given = (problem, self._K, 1.0, [solver], tolerance)
        self.solver: Proximal | Settling | CertifiedSolver | NonlinearSolver
        if system.internal is None and system.floating and weakens(problem, solver):
            self.solver = Weakening(problem, self._K, solver, tolerance)
        elif system.internal is None and system.floating:
            self.solver = Proximal(problem, self._K, solver, tolerance)
        elif system.internal is None:
            self.solver = CertifiedSolver(*given, advice=ADVICE)
        elif system.floating:
            self.solver = Settling(*given, advice=ADVICE_FLOATING)
        else:
            self.solver = NonlinearSolver(*given, advice=ADVICE_NONLINEAR)
        self._creeping: Creeping | None = None
        if may_creep(problem):
            self._creeping = Creeping(problem, self._K, [solver], tolerance)

        # Passes of a joint: on the contact unknowns, where the stage is one step.
        first = self.solver.first if isinstance(self.solver, CertifiedSolver) else None
        self._joints = JointSolver(self.solver.solve, first, tolerance, advice=ADVICE_JOINT)

    def _pose_stage(self, old: State, t: float) -> Stage:
        """Return the balance of forces at rest at a time, in d = u - u of the state before.

        Args:
            old: the state before.
            t: the time [s].
        """
        problem = self._problem
        return Stage(
            guess=old.u,
            u=Affine(old.u, 1.0),
            v=Affine(None, 0.0),
            a=Affine(None, 0.0),
            load=problem.static_load.load.at_rest(t),
            scale=1.0,
            bound=problem.surface.gap(t),
            slip0=problem.slip_origin(old.u, old.t, t),
            active=old.active,
            t=t,
            k=old.k,
            rate_factor=0.0,
        )

    def solve(self, old: State, t: float) -> State:
        """Return the equilibrium at a time. Collective.

        Args:
            old: the state before, from where points that rub slide, and where the solver begins.
            t: the time [s], at which loads and motions are taken.
        """
        problem = self._problem
        # loads, motions and laws of the user's may fail on one rank
        with together(problem.surface.comm):
            problem.surface.refuse_driven(t)
            if problem.static_load.internal is not None:
                return self._solve_nonlinear(old, t)
            step = StepProblem(
                A=self._K,
                b=problem.static_load.load.at_rest(t),
                bound=problem.surface.gap(t),
                scale=1.0,
                surface=problem.surface,
                guess=old.u,
                active=old.active,
                t=t,
                k=old.k,
                friction=problem.friction,
                slip0=problem.slip_origin(old.u, old.t, t),
            )
            refuse_nan(step, lambda: problem.static_load)
            if problem.joint is not None:
                return self._solve_joint(step, old)
            if isinstance(self.solver, Weakening):
                certified = self.solver.solve(step, old)
            else:
                certified = self.solver.solve(step)
        return _stand_still(problem, old, t, certified.result, certified.certificate)

    def _solve_nonlinear(self, old: State, t: float) -> State:
        """Return the equilibrium of a body that is not linear at a time.

        Args:
            old: the state before.
            t: the time [s].
        """

        def take(start: State, creep: Creep | None) -> State:
            """Return the state at the end of an increment to the time of the stage."""
            return self._take_increment(start, t, creep)

        try:
            return take(old, None)
        except NotFound as failure:
            if self._creeping is None:
                raise
            log.debug("%s", failure)
        return self._creeping.find(take, old)

    def _take_increment(self, old: State, t: float, creep: Creep | None) -> State:
        """Return the state at the end of an increment of a body that is not linear.

        Args:
            old: the state before.
            t: the time [s] at its end.
            creep: solves it with viscosity; None without.
        """
        problem = self._problem
        name = "static_load"
        old = keep_material(problem.standing_at(old, name).static_load, old, old)
        system = problem.standing_at(old, name).static_load
        stage = self._pose_stage(old, t)
        step = pose(problem, stage, self._K, system)
        try:
            certified = self.solver.solve(step) if creep is None else creep.solve(step)
        except StepFailure as failure:
            raise NotFound(str(failure)) from failure
        answer = complete(stage, step, certified.result)
        state = _stand_still(problem, old, t, answer, certified.certificate)
        state = remember_material(system, state)
        whole = certify_material(system, certified.certificate, state, self._tolerance)
        return replace(state, certificate=whole.worst)

    def _solve_joint(self, base: StepProblem, old: State) -> State:
        """Return the equilibrium of a joint, whose strength is that at the end of the stage.

        Args:
            base: the stage without its joint.
            old: the state before.
        """
        joint = pose_joint(self._problem, old, 0.0, at_end=True, t=base.t)
        step, certified = self._joints.solve(base, joint)
        result = certified.result
        total = replace(result, r_n=result.r_n - step.joint.pull)
        state = _stand_still(self._problem, old, base.t, total, certified.certificate)
        return joint_steps.commit(state, step, result)


def _stand_still(
    problem: ContactProblem,
    old: State,
    t: float,
    answer: Answer | StepResult,
    certificate: Certificate,
) -> State:
    """Return the state of an equilibrium, which has no velocity.

    Args:
        problem: what stands.
        old: the state before.
        t: the time [s].
        answer: displacements, reactions and the contact set.
        certificate: of the equilibrium.
    """
    return State(
        t,
        old.k,
        answer.x,
        np.zeros_like(old.u),
        answer.r_n,
        answer.active,
        r_t=answer.r_t,
        certificate=certificate.worst,
        turned=problem.surface.turned,
    )


def quasi_static(
    problem: ContactProblem,
    times: Iterable[float],
    *,
    solver: Solver | None = None,
    state: State | None = None,
    tolerance: float = TOLERANCE,
) -> Iterator[State]:
    """Yield the equilibrium at each of the times, from where the one before left the body.

    v = 0; k counts stages.

    A load that grows in proportion needs one step as long as all slips go one way; a cyclic one at
    least a step for every turn, and more where zones of slip grow (small steps follow the path, the
    error is that of implicit Euler). K is factorised once. Prescribed motions should have no
    velocity and acceleration: their C U' + M U'' are loads.

    Args:
        problem: what stands in equilibrium; its loads are taken at the times.
        solver: Automatic() when None.
        times: increasing, none before ``state.t``; the loads are taken there, excitations are not.
        state: where the history starts, from ``static_equilibrium`` or an earlier history; u0 at t
            = 0 without reactions when None. A body pressed without friction first: the state of
            that problem, which is made on ``surface.with_own_laws()`` where the surface has corners
            that rub later.
        tolerance: of the certificate of every answer.

    Raises:
        InputError: times that do not increase; a state of other unknowns; friction that depends on
            the slip rate; loads that drive a rigid motion which nothing stops.
        StepFailure: no answer below the certificate tolerance.
    """
    check_problem_given("quasi_static", problem)
    if isinstance(times, Iterable) and not isinstance(times, str | bytes):
        times = list(times)
    agree(
        problem.surface.comm,
        "quasi_static",
        {"times": times, "solver": solver, "state": Parts(state), "tolerance": tolerance},
    )
    check_methods("quasi_static", solver, (), tolerance)

    # A law without rates returns itself at any rate.
    if problem.friction.at(np.zeros(problem.surface.count)) is not problem.friction:
        raise InputError(
            f"load steps have no slip rate for {problem.friction}: use Coulomb with the "
            "coefficient of slow sliding, or compute the history in time by march"
        )
    if state is None:
        with together(problem.surface.comm):
            state = initial_state(problem)
    else:
        check_sizes("quasi_static", problem, state)
    stages = _check_times(times, state.t)
    equilibria = Equilibria(problem, solver=solver, tolerance=tolerance)
    return _solve_in_turn(equilibria, state, stages)


def _solve_in_turn(equilibria: Equilibria, state: State, times: Iterable[float]) -> Iterator[State]:
    """Yield the equilibrium at each of the times [s], the first after ``state``."""
    for t in times:
        state = replace(equilibria.solve(state, t), k=state.k + 1)
        yield state


def _check_times(times: Iterable[float], start: float) -> list[float]:
    """Return the times [s] as a list; InputError unless they increase from the start [s] on."""
    if not isinstance(times, Iterable) or isinstance(times, str | bytes):
        raise InputError(f"load steps at {quote(times)}: give times in seconds")
    order = [real(t) for t in times]
    spans = np.diff([start, *order])  # the first stage may be at the time of the state
    if not (np.all(np.isfinite(spans)) and np.all(spans >= 0.0) and np.all(spans[1:] > 0.0)):
        raise InputError(
            f"load steps from t = {start:g} s at {order}: give times that increase, none before "
            "the start"
        )
    return order
