"""Step by the generalised-alpha method of Chung and Hulbert, the core of HHT and Newmark too.

    u1 = u0 + dt v0 + dt² ((½ - beta) a0 + beta a1),    v1 = v0 + dt ((1 - gamma) a0 + gamma a1)
    M a_m + C v_f + K u_f = (1 - alpha_f) f1 + alpha_f f0 - B_nᵀ r_n,f - B_tᵀ r_t,f
    a_m = (1 - alpha_m) a1 + alpha_m a0,    (u, v, r_n, r_t)_f = (1 - alpha_f) (…)1 + alpha_f (…)0
    0 <= r_n1  ⊥  gap0 - B_n u1 >= 0,    |r_t1| <= limit(r_n1) along B_t (u1 - u0)

Divided by 1 - alpha_f, in x = u1:

    A = (1 - alpha_m)/((1 - alpha_f) beta dt²) M + gamma/(beta dt) C + K,  scale = 1

with r the reaction at the end of the step.

Order 2 at gamma = ½ - alpha_m + alpha_f, else 1. Unconditionally stable for alpha_m <= alpha_f <=
½, gamma >= ½ - alpha_m + alpha_f and beta >= gamma/2, all that is accepted.
``spectral_radius(rho_inf)``: the members of order 2 with amplification rho_inf at infinite
frequency and the least damping of low ones, alpha_m = (2 rho - 1)/(1 + rho), alpha_f = rho/(1 +
rho), beta = ¼ (1 - alpha_m + alpha_f)².

Start, and restart after every velocity jump: the acceleration that fits (``consistent_data``).
Unknowns without mass (mass.Redistributed) have no acceleration, the mean velocity of the step, and
are in equilibrium at its ends. Energy: the ledger closes with the weights of the equation above,
its algorithmic part is the damping of high frequencies. Contact stands in the balance of forces and
creates energy when it opens. Unless rho_inf is near 0 the damping does not make up for it where a
wave crosses many elements in a step, nor on consistent mass where dt resolves the highest frequency
of the mesh: docs/guide/schemes.md has numbers. Impulses: sum of dt r_n,f over a contact with free
flight before and after is the change of momentum; in single steps it is not, unless the member is
Newmark. Source: Chung and Hulbert, J. Appl. Mech. 60 (1993) 371-375.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from ..core.algebra import Array, EffectiveMatrix
from ..core.arguments import check_arguments
from ..core.checks import quote, real
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.quantities import Between
from ..core.step import Balance, State, StepProblem, StepResult
from .base import BalanceStep, position_step
from .consistent_data import consistent_acceleration, equilibrate, replace_massless

SLACK = 1e-12  # round-off in the conditions of stability


class AlphaStep(BalanceStep, ABC):
    """Step by the module's equations, with the weights of a member.

    The memory of its states is "a", the acceleration (n,) [m/s²], "reaction", Bᵀr (n,) [N] at the
    same time, and "of", the alpha_m, alpha_f and t that they belong to.
    """

    by_rows: ClassVar[bool] = True

    @property
    @abstractmethod
    def weights(self) -> "GeneralisedAlpha":
        """Return the member of generalised-alpha that the scheme is, with all four weights."""

    def _owner_of_memory(self, t: float) -> Array:
        """Return what memory at time t [s] belongs to: the array "of"."""
        return np.array([self.weights.alpha_m, self.weights.alpha_f, t])

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state with its acceleration, and massless nodes in equilibrium.

        On a restart, and for a new dt, the state is good as it is.

        Args:
            problem: the problem that is marched.
            state: the state to go on from. Its memory counts where "of" holds the alpha_m and
                alpha_f of this member and the time of the state.
            dt: size of the next steps [s], over which friction looks ahead.
        """
        if np.array_equal(state.memory.get("of", ()), self._owner_of_memory(state.t)):
            return state
        return self._restart(problem, equilibrate(problem, state), dt)

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the acceleration that fits the new velocity.

        Args:
            problem: the problem that is marched.
            state: the state before the impact.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s], over which friction looks ahead.
        """
        return self._restart(problem, state.with_velocity(v), dt)

    def _restart(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state with the acceleration that fits it."""
        a, reaction = consistent_acceleration(problem, state, dt)
        owner = self._owner_of_memory(state.t)
        return replace(state, memory={"a": a, "reaction": reaction, "of": owner})

    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix:
        """Return A of the module's equations."""
        w = self.weights
        inertia = (1.0 - w.alpha_m) / ((1.0 - w.alpha_f) * w.beta * dt**2)
        return problem.equations.effective(m=inertia, c=w.gamma / (w.beta * dt), k=1.0)

    def _compute_rates_at_zero(self, state: State, dt: float) -> tuple[Array, Array]:
        """Return v1 [m/s] and a1 [m/s²] for u1 = 0: what the state before the step fixes of them.

        For any u1 they are  v1 + gamma/(beta dt) u1  and  a1 + u1/(beta dt²).
        """
        w = self.weights
        a0 = state.memory["a"]
        a = (w.beta - 0.5) / w.beta * a0 - (state.u + dt * state.v) / (w.beta * dt**2)
        v = state.v + dt * ((1.0 - w.gamma) * a0 + w.gamma * a)
        return v, a

    def step(
        self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float
    ) -> StepProblem:
        """Return the step with b of the equation at u1 = 0.

        b = f1 - C v1 - (M a_m - alpha_f (f0 - C v0 - K u0 - Bᵀr0))/(1 - alpha_f).

        Args:
            problem: the problem that is marched.
            state: u [m], v [m/s], "a" [m/s²] and "reaction" [N] at t0, (n,), or rows (k, n) of
                several runs.
            A: that of the module's equations (n, n) [N/m].
            dt: size of the step [s].

        Returns:
            The step in x = u1 [m], with b and reactions in newtons.
        """
        system = problem.equations
        w = self.weights
        v, a = self._compute_rates_at_zero(state, dt)
        mean = ((1.0 - w.alpha_m) * a + w.alpha_m * state.memory["a"]) / (1.0 - w.alpha_f)
        b = system.load_at(state.t + dt) - system.M @ mean

        # The share of the old forces; Newmark's member has none, and saves the products.
        if w.alpha_f != 0.0:
            ratio = w.alpha_f / (1.0 - w.alpha_f)
            f0 = system.load_at(state.t)
            b += ratio * (f0 - system.product("K", state.u) - state.memory["reaction"])
            v = v + ratio * state.v
        if system.C is not None:
            b -= system.C @ v
        return position_step(problem, state, A, dt, b=b, scale=1.0)

    def finish(
        self,
        problem: ContactProblem,
        state: State,
        step: StepProblem,
        result: StepResult,
        dt: float,
    ) -> State:
        """Return the state with a1 and v1 from u1.

        Massless unknowns get no acceleration and the mean velocity of the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            step: what ``step`` returned for it.
            result: its answer, x = u1 (n,) [m] and reactions at the end [N].
            dt: size of the step [s].
        """
        w = self.weights
        v, a = self._compute_rates_at_zero(state, dt)
        v += w.gamma / (w.beta * dt) * result.x
        a += result.x / (w.beta * dt**2)
        v = replace_massless(problem, v, (result.x - state.u) / dt)
        memory = {
            "a": replace_massless(problem, a, 0.0),
            "reaction": problem.surface.reaction_load(result.r_n, v.shape[-1], result.r_t),
            "of": self._owner_of_memory(step.t),
        }
        return State(step.t, step.k, result.x, v, result.r_n, result.active, memory, result.r_t)

    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance:
        """Return the step's own equation of motion: M a_m + C v_f + K u_f = f_f - Bᵀr_f.

        Args:
            problem: the problem that is marched.
            old: the state at t0.
            new: the state at t1, before the impact law.
            dt: size of the step [s]; not read.
        """
        return balance_ends(problem, old, new, self.weights.alpha_m, self.weights.alpha_f)


def balance_ends(
    problem: ContactProblem, old: State, new: State, m: float, f: float, level: str = ""
) -> Balance:
    """Return the equation of a step with weighted means of its ends.

    Args:
        problem: the problem that is marched.
        old: the state before the step.
        new: the state after it.
        m: weight of the old acceleration; the new one has 1 - m.
        f: weight of all else at the old end; the new end has 1 - f.
        level: how the names "a" and "reaction" end in the memory of the states: "_0" in that of
            ``LinearMultistep``.
    """
    # The old reactions come from the memory: after an impact they fit the new velocity, and those
    # of the state itself do not.
    load_at = problem.equations.load_at
    surface = problem.surface
    reaction = old.memory[f"reaction{level}"]
    r_t = None
    if new.r_t is not None:
        r_t = (1.0 - f) * new.r_t + f * surface.tangential_values(reaction)
    return Balance(
        u=(1.0 - f) * new.u + f * old.u,
        v=(1.0 - f) * new.v + f * old.v,
        a=(1.0 - m) * new.memory[f"a{level}"] + m * old.memory[f"a{level}"],
        f=(1.0 - f) * load_at(new.t) + f * load_at(old.t),
        r_n=(1.0 - f) * new.r_n + f * surface.normal_values(reaction),
        r_t=r_t,
    )


@dataclass(frozen=True)
class GeneralisedAlpha(AlphaStep):
    """Step by the module's equations; ``spectral_radius`` chooses good weights.

    Weights that are not unconditionally stable raise InputError.

    Attributes:
        alpha_m: weight of the old acceleration.
        alpha_f: weight of the old forces.
        beta: Newmark's weight of a1 in u1.
        gamma: Newmark's weight of a1 in v1.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    def __post_init__(self) -> None:
        alpha_m = real(self.alpha_m)
        alpha_f = real(self.alpha_f)
        beta = real(self.beta)
        gamma = real(self.gamma)
        least = 0.5 - alpha_m + alpha_f
        stable = alpha_m <= alpha_f + SLACK and alpha_f <= 0.5 + SLACK and gamma >= least - SLACK
        stable = stable and np.inf > beta >= 0.5 * gamma - SLACK
        if not stable or not np.isfinite(least + gamma):
            weights = ", ".join(f"{name}={quote(value)}" for name, value in vars(self).items())
            raise InputError(
                f"{weights} are not unconditionally stable, and contact has no highest frequency "
                "to choose dt by: give alpha_m <= alpha_f <= 1/2, gamma >= 1/2 - alpha_m + "
                "alpha_f, beta >= gamma/2"
            )

    @property
    def weights(self) -> "GeneralisedAlpha":
        """Return itself."""
        return self

    @classmethod
    @check_arguments
    def spectral_radius(
        cls,
        rho_inf: Annotated[
            float,
            Between(
                0.0,
                1.0,
                remedy="give the amplification at infinite frequency, from 0 to 1 (no damping)",
            ),
        ] = 0.8,
    ) -> "GeneralisedAlpha":
        """Return the member of order 2 with this amplification at infinite frequency.

        0 damps all of it, 1 nothing.
        """
        alpha_m = (2.0 * rho_inf - 1.0) / (1.0 + rho_inf)
        alpha_f = rho_inf / (1.0 + rho_inf)
        apart = alpha_f - alpha_m
        return cls(alpha_m, alpha_f, beta=0.25 * (1.0 + apart) ** 2, gamma=0.5 + apart)
