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
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_arguments
from ..core.checks import quote, real
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.quantities import Between
from ..core.stage import Affine, Answer, Stage
from ..core.step import Balance, State
from .base import BalanceStep, end_state, position_stage
from .consistent_data import consistent_acceleration, equilibrate, replace_massless

SLACK = 1e-12  # round-off in the conditions of stability


class AlphaStep(BalanceStep, ABC):
    """Step by the module's equations, with the weights of a member.

    The memory of its states is "a", the acceleration (n,) [m/s²], "reaction", Bᵀr (n,) [N] at the
    same time, and "of", the alpha_m, alpha_f and t that they belong to.
    """

    by_rows: ClassVar[bool] = True
    reads_reactions: ClassVar[bool] = True
    takes_ends: ClassVar[bool] = True

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

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the balance of the module, divided by 1 - alpha_f, in d = beta dt² a1.

        With the predictors of Newmark's method, which have a1 = 0,

            u1 = u_p + d,    v1 = v_p + gamma d/(beta dt),    a1 = d/(beta dt²)

        Args:
            problem: the problem that is marched.
            state: u [m], v [m/s], "a" [m/s²] and "reaction" [N] at t0, (n,), or rows (k, n) of
                several runs.
            dt: size of the step [s].
        """
        system = problem.equations
        w = self.weights
        a0 = state.memory["a"]
        u = state.u + dt * state.v + (0.5 - w.beta) * dt**2 * a0
        guess = u
        v = state.v + (1.0 - w.gamma) * dt * a0
        load = system.load_at(state.t + dt)
        carried = None
        old = None

        # The share of the old forces; Newmark's member has none, and saves the products.
        if w.alpha_f != 0.0:
            ratio = w.alpha_f / (1.0 - w.alpha_f)
            u = u + ratio * state.u
            v = v + ratio * state.v
            load = load + ratio * system.load_at(state.t)
            carried = ratio * state.memory["reaction"]
            old = (ratio, state.u)
        a = None
        if w.alpha_m != 0.0:
            a = w.alpha_m / (1.0 - w.alpha_f) * a0
        return position_stage(
            problem,
            state,
            dt,
            guess=guess,
            u=Affine(u, 1.0),
            v=Affine(v, w.gamma / (w.beta * dt)),
            a=Affine(a, (1.0 - w.alpha_m) / ((1.0 - w.alpha_f) * w.beta * dt**2)),
            load=load,
            carried=carried,
            weight=self._weigh_end(),
            before=self._look_back(problem, state),
            old=old,
            of_momentum=False,
        )

    def _weigh_end(self) -> float:
        """Return the weight of the stage in the mean equation of a step."""
        return 1.0 - self.weights.alpha_f

    def _look_back(self, problem: ContactProblem, state: State) -> Callable[[], Balance] | None:
        """Return what makes the balance at the beginning, for the mean equation of a step.

        None: the stage holds what there is of it.

        Args:
            problem: the problem that is marched; not read.
            state: at t0; not read.
        """
        return None

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with a1 and v1 from d.

        Massless unknowns get no acceleration and the mean velocity of the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = u1 (n,) [m], and the reactions at the end [N].
            dt: size of the step [s].
        """
        w = self.weights
        a = answer.d / (w.beta * dt**2)
        v = state.v + dt * ((1.0 - w.gamma) * state.memory["a"] + w.gamma * a)
        v = replace_massless(problem, v, (answer.x - state.u) / dt)
        memory = {
            "a": replace_massless(problem, a, 0.0),
            "reaction": problem.surface.reaction_load(answer.r_n, v.shape[-1], answer.r_t),
            "of": self._owner_of_memory(stage.t),
        }
        return end_state(stage, answer, answer.x, v, memory)


def balance_at(problem: ContactProblem, state: State, level: str = "") -> Balance:
    """Return the balance of forces at a state whose acceleration is known.

    The reactions come from its memory: after an impact they fit the new velocity, and those of the
    state itself do not.

    Args:
        problem: the problem that is marched.
        state: with "a" and "reaction" in its memory.
        level: how these names end there: "_0" in the memory of ``LinearMultistep``.
    """
    surface = problem.surface
    system = problem.equations
    reaction = state.memory[f"reaction{level}"]
    internal = None
    if system.internal is not None:
        internal = system.internal_force(state.u)
    return Balance(
        u=state.u,
        v=state.v,
        a=state.memory[f"a{level}"],
        f=problem.equations.load_at(state.t),
        r_n=surface.normal_values(reaction),
        r_t=surface.tangential_values(reaction) if problem.frictional else None,
        internal=internal,
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
