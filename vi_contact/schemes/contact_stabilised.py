"""Step by contact-stabilised Newmark: an admissible predictor keeps contact forces from ringing.

    u_p = argmin ½ (u - u0 - dt v0)ᵀ M (u - u0 - dt v0)  over  gap(u) >= 0  (= on bilateral rows)
    M (u1 - u_p) = -½ dt² [K ½(u0 + u1) + C (u1 - u0)/dt - f(t0 + ½ dt) + B_nᵀ r̄_n + B_tᵀ r̄_t]
    v1 = v0 + 2/dt (u1 - u_p)
    gap(u1) >= 0,    0 <= r̄_n  ⊥  gap(u1),    |r̄_t| <= limit(r̄_n) along the slip B_t (u1 - u0)

In x = u1:  A = 4/dt² M + 2/dt C + K,  b = 4/dt² M u_p + 2/dt C u0 - K u0 + 2 f,  scale = 2,
guess u_p. The impulse that projects the predictor moves contact nodes to the obstacle and leaves
their velocity alone: r̄ is what the body presses with, not what stops the mass of the contact
nodes. They keep the velocity of their approach till they open.

Order 2 without contact (the midpoint rule); unconditionally stable. Energy, q [N s²] the
projection's multipliers:

    E1 - E0 = Δu·f - Δu·C Δu/dt - r̄_n·gap(u0) - r̄_t·B_t Δu - 2/dt² q·gap(u1)

on rigid supports: it never increases by contact or friction. The ledger books the last term, the
price of an opening, as algorithmic loss. With C ½(v0 + v1) in the place of C Δu/dt the damping work
would have no sign.

``projected=False``: u_p = u0 + dt v0, Kane's contact-implicit form. It is ZienkiewiczWoodTaylor(½)
and SS22(½, ½).

Sources: Deuflhard, Krause and Ertel, Int. J. Numer. Meth. Engng 73 (2008) 1274-1290; Kane, Repetto,
Ortiz and Marsden, Comput. Methods Appl. Mech. Engng 180 (1999) 1-26.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.algebra import Array, Mask
from ..core.arguments import check_fields
from ..core.errors import StepFailure
from ..core.problem import ContactProblem
from ..core.protocols import Frictionless
from ..core.stage import Affine, Answer, Stage
from ..core.step import State, StepProblem
from ..solvers.automatic import solver_beside_steps
from ..solvers.certified import TOLERANCE, CertifiedSolver
from .base import SingleStep, end_state, position_stage
from .consistent_data import mass_matrix, without_springs


@dataclass(frozen=True)
class ContactStabilisedNewmark(SingleStep):
    """Step by the module's equations, which need mass at contact nodes.

    A step raises StepFailure when the projection cannot be certified.

    Attributes:
        projected: whether the predictor is projected.
    """

    projected: bool = True

    def __post_init__(self) -> None:
        check_fields(self)

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the mean balance of the step, in d = u1 - u_p.

        Its means are u = ½ (u0 + u_p + d), v = (u_p - u0 + d)/dt and a = 2 d/dt². The projection
        adds w = u_p - u0 - dt v0 to the displacement and nothing to the velocity, so that u1 - u0 =
        ½ dt (v0 + v1) + w: the ledger finds w·M (v1 - v0)/dt as algorithmic loss.

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,) each.
            dt: size of the step [s].

        Raises:
            StepFailure: the projection cannot be certified.
        """
        u_p = state.u + dt * state.v
        active = state.active
        v_p = state.v
        if self.projected:
            free = u_p
            u_p, active = project_predictor(problem, state, free, dt)
            if u_p is not free:
                v_p = (u_p - state.u) / dt
        return position_stage(
            problem,
            state,
            dt,
            guess=u_p,
            u=Affine(0.5 * (state.u + u_p), 0.5),
            v=Affine(v_p, 1.0 / dt),
            a=Affine(None, 2.0 / dt**2),
            load=problem.equations.load_at(state.t + 0.5 * dt),
            scale=2.0,
            active=active,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with v1 = v0 + 2 d/dt.

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            stage: what ``stage`` returned for it; its guess is u_p.
            answer: x = u1 (n,) [m], and the mean reactions [N].
            dt: size of the step [s].
        """
        return end_state(stage, answer, answer.x, state.v + 2.0 / dt * answer.d)


def project_predictor(
    problem: ContactProblem, state: State, u: Array, dt: float
) -> tuple[Array, Mask]:
    """Return the admissible displacement nearest to a predicted one.

        M w = -B_nᵀ q,    0 <= q  ⊥  gap0 - B_n u - B_n w >= 0,    u_p = u + w

    It is the same small problem as a step with A = M, solved in the increment w, so that nothing is
    rounded where nothing is in the way. Springs give way: their points are not projected. Only
    normal directions are projected; friction has no part in it.

    Args:
        problem: the problem that is marched.
        state: the state at the beginning of the step.
        u: predicted displacement (n,) [m] at its end.
        dt: size of the step [s].

    Returns:
        u_p (n,) [m], and the points (m,) that stopped it.

    Raises:
        StepFailure: the projection cannot be certified.
    """
    surface = problem.surface
    system = problem.equations
    rigid = surface.rigid

    # Begin with the points that the prediction puts into the obstacle. Where there are none it is
    # admissible as it is.
    gap = np.where(rigid, surface.gap(state.t + dt) - surface.normal_values(u), np.inf)
    closed = (gap < 0.0) | (surface.bilateral & rigid)
    if surface.some(np.isnan(gap)) or not surface.some(closed & (gap != 0.0)):
        return u, closed  # nothing is in the way; NaN is refused by the step itself

    # Springs are not bounds here, and nothing rubs.
    bounds: ContactProblem = system.make_once(
        "admissible predictor, bounds",
        lambda: replace(problem, surface=without_springs(surface), friction=Frictionless()),
        surface,
    )
    M = mass_matrix(problem)
    solver: CertifiedSolver = system.make_once(
        "admissible predictor",
        lambda: CertifiedSolver(
            bounds, M, 1.0, [solver_beside_steps(M, bounds.surface)], TOLERANCE
        ),
        surface,
    )
    step = StepProblem(
        A=M,
        b=np.zeros_like(u),
        bound=gap,
        surface=bounds.surface,
        scale=1.0,
        guess=np.zeros_like(u),
        active=closed,
        t=state.t + dt,
        k=state.k + 1,
    )
    try:
        result = solver.solve(step).result
    except StepFailure as failure:
        raise StepFailure(
            f"the predictor could not be brought out of the obstacle: {failure}"
        ) from failure
    return u + result.x, result.active
