"""Step by Moreau and Jean's method: contact and impact are impulses on velocities.

    v_θ = (1 - theta) v0 + theta v1,    u1 = u0 + dt v_θ
    M (v1 - v0) + dt C v_θ + dt K ((1 - theta) u0 + theta u1)
        = dt ((1 - theta) f0 + theta f1) - B_nᵀ P_n - B_tᵀ P_t
    0 <= P_n  ⊥  -e B_n v0 - B_n v1 >= 0   where gap(u0 + ½ dt v0) <= 0,    P_n = 0 elsewhere
    |P_t| <= limit(P_n) along the tangential velocity B_t v1;    B_n v1 = 0 on bilateral points

In x = v1:  A = M + theta dt C + theta² dt² K,  bound = -e B_n v0 on closed points and +inf
elsewhere,  r = P [N s],  scale = dt; the state keeps the mean reactions P/dt, and its active points
are those that carry an impulse. The internal force of a body that is not linear is
p((1 - theta) u0 + theta u1). Restitution is a law for nodes: on a fine mesh it has no
macroscopic effect. Order 2 without contact at theta = ½, else 1.

Energy:  E1 - E0 = Δu·f_θ - dt v_θ·C v_θ - P·B v_θ - (theta - ½)(Δv·M Δv + Δu·K Δu)

With Newton's law P_n B_n v_θ = (1 - theta - theta e) P_n B_n v0: no energy comes from points that
approach if theta <= 1/(1 + e). From points that had begun to separate and are caught within the
step it does. They therefore get the bound -(1 - theta)/theta B_n v0, that is B_n v_θ <= 0: such a
point ends the step no deeper than it began, and is an approaching one in the next. Normal contact
then never creates energy; at theta = 1/(1 + e) there is no difference. Friction has the law at the
end of the step but the work of its mean: P_t·B_t v_θ may be negative where sliding turns.

Penetration: the condition is on velocities, so a gap closes late, by less than dt times the speed
of approach, and what it has passed by then stays while contact lasts (e = 0): a negative
``contact_min_gap`` that shrinks with dt.

Sources: Moreau in Nonsmooth Mechanics and Applications (Springer 1988), 1-82; Jean, Comput. Methods
Appl. Mech. Engng 177 (1999) 235-257; the range of theta: Acary, ZAMM 96 (2016) 585-603. The bound
of separating points is ours.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.arguments import check_fields
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.quantities import RATIO, Between
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from .base import SingleStep, end_state
from .consistent_data import ROUND_OFF

SLACK = 1e-12  # round-off in the largest theta


@dataclass(frozen=True)
class MoreauJean(SingleStep):
    """Step by the module's equations.

    Attributes:
        theta: weight of the end of the step, up to 1/(1 + e).
        e: restitution coefficient of the contact nodes.
        allow_energy_gain: accept any theta up to 1, and use Newton's law for points that separate
            too.
    """

    penetrates: ClassVar[bool] = True
    theta: Annotated[
        float, Between(0.5, 1.0, remedy="give a weight from 0.5 to 1, less is unstable")
    ] = 0.5
    e: Annotated[
        float,
        Between(0.0, 1.0, remedy="give a restitution from 0 (inelastic) to 1 (elastic)"),
        RATIO,
    ] = 0.0
    allow_energy_gain: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        most = 1.0 / (1.0 + self.e)
        if self.theta > most + SLACK and not self.allow_energy_gain:
            raise InputError(
                f"MoreauJean theta={self.theta} with e={self.e} creates energy in impacts: give "
                f"theta from 0.5 to 1/(1 + e) = {most:g}, or allow_energy_gain=True"
            )

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for massless nodes, springs, an impact law, or a bilateral gap."""
        super().check(problem)
        surface = problem.surface
        if surface.some(surface.compliance > 0.0):
            raise InputError(
                "MoreauJean has unilateral velocities, which do not fit elastic supports: use "
                "ContactStabilisedNewmark() or Midpoint() there"
            )
        if problem.impact is not None:
            raise InputError(
                f"MoreauJean has its own restitution coefficient and {problem.impact} would act on "
                "top of it: leave the impact law out, and give MoreauJean(e=…)"
            )
        if surface.some(surface.bilateral & (surface.gap0 > 0.0)):
            raise InputError(
                "MoreauJean holds the velocity of bilateral points and would never close their "
                "initial gap: let them start on the obstacle, or use another scheme"
            )

    def _mean_load(self, problem: ContactProblem, t: float, dt: float) -> Array:
        """Return f_θ = (1 - theta) f(t) + theta f(t + dt), (n,) [N]."""
        load_at = problem.equations.load_at
        return (1.0 - self.theta) * load_at(t) + self.theta * load_at(t + dt)

    def _bound(self, problem: ContactProblem, state: State, dt: float) -> Array:
        """Return the largest normal velocities (m,) [m/s] of closed points after the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            dt: size of the step [s].
        """
        surface = problem.surface
        advance = surface.advance(state.t, state.t + dt)
        obstacle = 0.0 if advance is None else -advance / dt

        # Relative to the obstacle, points that approach obey Newton's law, and points that had
        # begun to separate the bound that creates no energy (see the head of this module).
        v_n = surface.normal_values(state.v) - obstacle
        separating = -self.e if self.allow_energy_gain else -(1.0 - self.theta) / self.theta
        restitution = np.where(v_n < 0.0, separating, -self.e)
        return obstacle + np.where(surface.bilateral, 0.0, restitution * v_n)

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the mean balance of the step, in d = v1 - v0.

        Its means are u = u0 + theta dt (v0 + theta d), v = v0 + theta d and a = d/dt.

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,) each.
            dt: size of the step [s].

        Returns:
            The stage in x = v1 [m/s], with reactions in N s; ``bound`` holds normal velocities
            (m,) [m/s], infinite on open points.
        """
        surface = problem.surface

        # Points are closed that would be in the obstacle in the middle of the step if nothing
        # stopped them, and held points.
        u_middle = state.u + 0.5 * dt * state.v
        gap = surface.gap(state.t + 0.5 * dt) - surface.normal_values(u_middle)
        size = largest(surface.comm, max(max_abs(state.u), dt * max_abs(state.v)))
        closed = np.asarray((gap <= ROUND_OFF * size) | surface.bilateral)

        # The slip rate is the tangential velocity relative to the obstacle.
        sliding = surface.sliding(state.t, state.t + dt)
        slip0 = np.zeros(surface.tangents.shape) if sliding is None else sliding / dt
        way = self.theta * dt
        return Stage(
            guess=state.v,
            u=Affine(state.u + way * state.v, way * self.theta),
            v=Affine(state.v, self.theta),
            a=Affine(None, 1.0 / dt),
            load=self._mean_load(problem, state.t, dt),
            scale=dt,
            bound=np.where(closed, self._bound(problem, state, dt), np.inf),
            slip0=slip0 if problem.frictional else None,
            active=closed,
            t=state.t + dt,
            k=state.k + 1,
            rate_factor=1.0,
            turned=surface.turned,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with u1 = u0 + dt (v0 + theta d).

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = v1 (n,) [m/s], and the impulses over dt [N].
            dt: size of the step [s].
        """
        u = state.u + dt * (state.v + self.theta * answer.d)
        return end_state(stage, answer, u, answer.x)
