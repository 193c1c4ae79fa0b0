"""Step as Zienkiewicz, Wood and Taylor do, with independent displacement and velocity.

Linear u and v over the step, weighted residual with weight phi (docs/reference/sources.md [2]):

    (u1 - u0)/dt = (1 - phi) v0 + phi v1
    M (v1 - v0)/dt + C (u1 - u0)/dt + K ((1 - phi) u0 + phi u1) = f(t0 + phi dt) - B_nᵀ r̄_n
    gap(u1) >= 0

In x = u1:  A = M/(phi dt)² + C/(phi dt) + K,  scale = 1/phi, r_n = r̄_n/phi (phi = ½: as the
boundary method has it).

Order 2 at phi = ½, else 1; unconditionally stable for phi >= ½. Energy at phi = ½: it changes only
by work of loads, damping and contact, and contact with gap >= 0 at the end of the step never
creates energy. At phi = ½ it is the midpoint rule, SS22(½, ½) and Newmark(¼, ½) in (u, v). No
accelerations are stored, so nothing restarts after an impact.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from ..core.arguments import check_fields
from ..core.internal import remembers
from ..core.problem import ContactProblem
from ..core.quantities import Between
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from .base import SingleStep, end_state, position_stage
from .consistent_data import replace_in_bodies


@dataclass(frozen=True)
class ZienkiewiczWoodTaylor(SingleStep):
    """Step by the module's equations.

    Attributes:
        phi: weight of the end of the step.
    """

    by_rows: ClassVar[bool] = True
    takes_joints: ClassVar[bool] = True
    takes_ends: ClassVar[bool] = True
    takes_massless_bodies: ClassVar[bool] = True

    phi: Annotated[
        float, Between(0.5, 1.0, remedy="give a weight from 0.5 to 1, less is unstable")
    ] = 0.5

    def __post_init__(self) -> None:
        check_fields(self)

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the balance at t0 + phi dt, in d = u1 - u0 - dt v0.

        There u = u0 + phi (dt v0 + d), v = v0 + d/dt and a = d/(phi dt²).

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,), or rows (k, n) of several runs.
            dt: size of the step [s].
        """
        phi = self.phi
        way = dt * state.v

        # Where the stress depends on the past it is known at the ends of steps alone: the mean of
        # both ends takes the place of the stress at the displacement of the stage.
        old = None
        end = 1.0
        if remembers(problem.equations.internal):
            old = (1.0 - phi, state.u)
            end = phi
        return position_stage(
            problem,
            state,
            dt,
            guess=state.u + way,
            u=Affine(state.u + phi * way, phi),
            v=Affine(state.v, 1.0 / dt),
            a=Affine(None, 1.0 / (phi * dt**2)),
            load=problem.equations.load_at(state.t + phi * dt),
            scale=1.0 / phi,
            old=old,
            end=end,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with v1 = v0 + d/(phi dt).

        Unknowns without mass get the mean velocity of the step, v0 + d/dt: no equation reads the
        other, which would swing.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = u1 (n,) [m], and the mean reactions [N].
            dt: size of the step [s].
        """
        v = state.v + answer.d / (self.phi * dt)
        v = replace_in_bodies(problem, v, state.v + answer.d / dt)
        return end_state(stage, answer, answer.x, v)
