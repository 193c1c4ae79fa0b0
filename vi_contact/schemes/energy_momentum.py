"""Step bodies that turn: energy, momentum and spin are kept by steps of any length.

    u1 - u0 = ½ dt (v0 + v1)
    M (v1 - v0)/dt + ½ C (v0 + v1) + p̄(u0, u1) = f(t0 + ½ dt) - B_nᵀ r̄_n - B_tᵀ r̄_t
    0 <= r̄_n  ⊥  gap0 - B_n u1 >= 0,    |r̄_t| <= limit(r̄_n) along B_t (u1 - u0)

p̄ is the internal force of both ends (``core.internal.TwoEndForce``): its work is the change of the
stored energy, and it has no moment about the middle places. So in free flight

    ½ v1·M v1 + W(u1) = ½ v0·M v0 + W(u0),   Σ m y1 x v1 = Σ m y0 x v0,   y = X + u

to round-off. Of a linear body p̄ = ½ K (u0 + u1), and the scheme is the midpoint rule. In x = u1:
A = 4/dt² M + 2/dt C + K,  scale = 2; passes of a step have a tangent in the place of K.

Order 2, unconditionally stable, no damping of any frequency. A closure loses r̄_n times the gap
that was closed: contact never creates energy. Contact nodes have their mass, so their forces ring.
Source: Simo and Tarnow, Z. angew. Math. Phys. 43 (1992) 757-792.
"""

from dataclasses import dataclass
from typing import ClassVar

from ..core.errors import InputError
from ..core.internal import turns
from ..core.problem import ContactProblem
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from .base import SingleStep, end_state, position_stage


@dataclass(frozen=True)
class EnergyMomentum(SingleStep):
    """Step by the module's equations.

    Attributes:
        for_turning: whether bodies that turn may be stepped by it.
    """

    for_turning: ClassVar[bool] = True

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for massless unknowns, and an internal force of one end alone."""
        super().check(problem)
        internal = problem.equations.internal
        if internal is not None and not turns(internal):
            raise InputError(
                "EnergyMomentum() needs the internal force of both ends of a step, and that of the "
                "system has none: give fem.assemble a material of bodies that turn, such as "
                "SaintVenantKirchhoff(…), or march with Midpoint()"
            )

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the balance of the step, in d = u1 - u0 - dt v0.

        In the middle u = u0 + ½ (dt v0 + d), v = v0 + d/dt and a = 2 d/dt².

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,).
            dt: size of the step [s].
        """
        system = problem.equations
        way = dt * state.v
        return position_stage(
            problem,
            state,
            dt,
            guess=state.u + way,
            u=Affine(state.u + 0.5 * way, 0.5),
            v=Affine(state.v, 1.0 / dt),
            a=Affine(None, 2.0 / dt**2),
            load=system.load_at(state.t + 0.5 * dt),
            scale=2.0,
            between=None if system.internal is None else state.u,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with v1 = v0 + 2 d/dt.

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = u1 (n,) [m], and the mean reactions [N].
            dt: size of the step [s].
        """
        return end_state(stage, answer, answer.x, state.v + 2.0 * answer.d / dt)
