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

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..core.algebra import EffectiveMatrix
from ..core.checks import quote, real
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import Balance, State, StepProblem, StepResult
from .base import SingleStep, balance_means, end_step, position_step


@dataclass(frozen=True)
class SS22(SingleStep):
    """Step by the module's equations; InputError is raised unless theta2 >= theta1 >= ½.

    Other weights are stable for small steps only.

    Attributes:
        theta1: mean of tau/dt.
        theta2: mean of (tau/dt)².
    """

    by_rows: ClassVar[bool] = True

    theta1: float = 0.5
    theta2: float = 0.5

    def __post_init__(self) -> None:
        if not np.inf > real(self.theta2) >= real(self.theta1) >= 0.5:
            raise InputError(
                f"SS22 weights theta1={quote(self.theta1)}, theta2={quote(self.theta2)}: give "
                "theta2 >= theta1 >= 0.5, the unconditionally stable range"
            )

    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix:
        """Return A = 2/(theta2 dt²) M + 2 theta1/(theta2 dt) C + K."""
        m = 2.0 / (self.theta2 * dt**2)
        c = 2.0 * self.theta1 / (self.theta2 * dt)
        return problem.equations.effective(m=m, c=c, k=1.0)

    def step(
        self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float
    ) -> StepProblem:
        """Return the step with b = A (u0 + dt v0) + (f - C v0 - K (u0 + theta1 dt v0))/theta2.

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,), or rows (k, n) of several runs.
            A: 2/(theta2 dt²) M + 2 theta1/(theta2 dt) C + K (n, n) [N/m].
            dt: size of the step [s].

        Returns:
            The step in x = u1 [m], with b and reactions 1/theta2 times newtons.
        """
        system = problem.equations

        # The equation is one for alpha = 2 (u1 - guess)/dt², where guess is free flight. A times
        # u1 - guess balances, over theta2, what is left of the forces there.
        guess = state.u + dt * state.v
        u_mean = state.u + self.theta1 * dt * state.v
        force = system.load_at(state.t + self.theta1 * dt) - system.K @ u_mean
        if system.C is not None:
            force -= system.C @ state.v
        b = A @ guess + force / self.theta2
        return position_step(problem, state, A, dt, b=b, scale=1.0 / self.theta2, guess=guess)

    def finish(
        self,
        problem: ContactProblem,
        state: State,
        step: StepProblem,
        result: StepResult,
        dt: float,
    ) -> State:
        """Return the state with alpha = 2 (u1 - u0 - dt v0)/dt², v1 = v0 + dt alpha.

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            step: what ``step`` returned for it; its guess is u0 + dt v0.
            result: its answer, x = u1 (n,) [m]; the state gets theta2 times its reactions [N].
            dt: size of the step [s].
        """
        v = state.v + 2.0 * (result.x - step.guess) / dt
        return end_step(step, result, result.x, v)

    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance:
        """Return the averages of the residual equation, with the mean values of tau and tau².

        Args:
            problem: the problem that is marched.
            old: the state at t0.
            new: the state at t1, before the impact law.
            dt: size of the step [s].
        """
        alpha = (new.v - old.v) / dt
        u = old.u + self.theta1 * dt * old.v + 0.5 * self.theta2 * dt**2 * alpha
        f = problem.equations.load_at(old.t + self.theta1 * dt)
        balance = balance_means(problem, old, new, dt, u=u, f=f)
        return replace(balance, v=old.v + self.theta1 * dt * alpha)
