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

from ..core.algebra import Array, EffectiveMatrix
from ..core.arguments import check_fields
from ..core.problem import ContactProblem
from ..core.quantities import Between
from ..core.step import Balance, State, StepProblem, StepResult
from .base import SingleStep, balance_means, end_step, position_step


@dataclass(frozen=True)
class ZienkiewiczWoodTaylor(SingleStep):
    """Step by the module's equations.

    Attributes:
        phi: weight of the end of the step.
    """

    by_rows: ClassVar[bool] = True

    phi: Annotated[
        float, Between(0.5, 1.0, remedy="give a weight from 0.5 to 1, less is unstable")
    ] = 0.5

    def __post_init__(self) -> None:
        check_fields(self)

    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix:
        """Return A = M/(phi dt)² + C/(phi dt) + K."""
        return problem.equations.effective(
            m=1.0 / (self.phi * dt) ** 2, c=1.0 / (self.phi * dt), k=1.0, shares=True
        )

    def _mean_load(self, problem: ContactProblem, state: State, dt: float) -> Array:
        """Return f (n,) [N] at t0 + phi dt."""
        return problem.equations.load_at(state.t + self.phi * dt)

    def step(
        self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float
    ) -> StepProblem:
        """Return the step in x = u1.

        b = f/phi + M (u0 + dt v0)/(phi dt)² + C u0/(phi dt) - (1 - phi)/phi K u0.

        Args:
            problem: the problem that is marched.
            state: u [m] and v [m/s] at t0, (n,), or rows (k, n) of several runs.
            A: M/(phi dt)² + C/(phi dt) + K (n, n) [N/m].
            dt: size of the step [s].

        Returns:
            The step in x = u1 [m], with b and reactions 1/phi times newtons.
        """
        system = problem.equations
        phi = self.phi
        b = self._mean_load(problem, state, dt) / phi
        b += (system.product("M", state.u) + dt * system.product("M", state.v)) / (phi * dt) ** 2
        b -= (1.0 - phi) / phi * system.product("K", state.u)
        if system.C is not None:
            b += system.product("C", state.u) / (phi * dt)
        return position_step(problem, state, A, dt, b=b, scale=1.0 / phi)

    def finish(
        self,
        problem: ContactProblem,
        state: State,
        step: StepProblem,
        result: StepResult,
        dt: float,
    ) -> State:
        """Return the state with v1 = v0 + ((u1 - u0)/dt - v0)/phi.

        Args:
            problem: the problem that is marched; not read.
            state: the state at t0.
            step: what ``step`` returned for it.
            result: its answer, x = u1 (n,) [m]; the state gets phi times its reactions [N].
            dt: size of the step [s].
        """
        v = state.v + ((result.x - state.u) / dt - state.v) / self.phi
        return end_step(step, result, result.x, v)

    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance:
        """Return the averages of the module's equation, at t0 + phi dt.

        Args:
            problem: the problem that is marched.
            old: the state at t0.
            new: the state at t1, before the impact law.
            dt: size of the step [s].
        """
        u = old.u + self.phi * (new.u - old.u)
        f = self._mean_load(problem, old, dt)
        return balance_means(problem, old, new, dt, u=u, f=f)
