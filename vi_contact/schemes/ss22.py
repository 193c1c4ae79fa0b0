"""Step by SS22, the single-step form of Zienkiewicz, Wood and Taylor with two weights.

    u(tau) = u0 + v0 tau + ½ alpha tau²
    weighted residual with mean values of tau/dt (theta1) and (tau/dt)² (theta2):
    (M + theta1 dt C + ½ theta2 dt² K) alpha
        = f(t0 + theta1 dt) - C v0 - K (u0 + theta1 dt v0) - B_nᵀ r̄_n - B_tᵀ r̄_t
    u1 = u0 + dt v0 + ½ dt² alpha,   v1 = v0 + dt alpha,   gap(u1) >= 0

In x = u1:  A = 2/(theta2 dt²) M + 2 theta1/(theta2 dt) C + K,  scale = 1/theta2.
Same amplification as Newmark(beta = theta2/2, gamma = theta1): unconditionally stable for
theta2 >= theta1 >= ½, order 2 at theta1 = ½. Energy: as the midpoint rule at theta1 = theta2 = ½;
dissipates for theta1 > ½.
Source: Zienkiewicz, Wood and Taylor, in the form with two weights: docs/reference/sources.md [2].
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..core.checks import quote, real
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from .base import SingleStep, end_state, position_stage


@dataclass(frozen=True)
class SS22(SingleStep):
    """Step by the module's equations; InputError is raised unless theta2 >= theta1 >= ½.

    Other weights are stable for small steps only.

    Attributes:
        theta1: mean of tau/dt.
        theta2: mean of (tau/dt)².
    """

    by_rows: ClassVar[bool] = True
    takes_joints: ClassVar[bool] = True

    theta1: float = 0.5
    theta2: float = 0.5

    def __post_init__(self) -> None:
        if not np.inf > real(self.theta2) >= real(self.theta1) >= 0.5:
            raise InputError(
                f"SS22 weights theta1={quote(self.theta1)}, theta2={quote(self.theta2)}: give "
                "theta2 >= theta1 >= 0.5, the unconditionally stable range"
            )

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the weighted residual, in d = u1 - u0 - dt v0 = ½ dt² alpha.

        Its means are u = u0 + theta1 dt v0 + theta2 d, v = v0 + 2 theta1 d/dt and a = 2 d/dt².

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,), or rows (k, n) of several runs.
            dt: size of the step [s].
        """
        way = dt * state.v
        return position_stage(
            problem,
            state,
            dt,
            guess=state.u + way,
            u=Affine(state.u + self.theta1 * way, self.theta2),
            v=Affine(state.v, 2.0 * self.theta1 / dt),
            a=Affine(None, 2.0 / dt**2),
            load=problem.equations.load_at(state.t + self.theta1 * dt),
            scale=1.0 / self.theta2,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with v1 = v0 + dt alpha = v0 + 2 d/dt.

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = u1 (n,) [m], and the mean reactions [N].
            dt: size of the step [s].
        """
        return end_state(stage, answer, answer.x, state.v + 2.0 / dt * answer.d)
