"""Step with the general linear multistep operators of the boundary method, its eqs. 11a,b.

    sum_r a[r] u(p-r)     = dt    sum_r b[r] u'(p-r)          (11a)
    sum_r gamma[r] u(p-r) = mu dt² sum_r b[r] u''(p-r)        (11b)     r = 0..q, b[0] != 0

Solved for the newest velocity and acceleration and put into M u'' + C u' + K u = f - B_nᵀ r_n -
B_tᵀ r_t at t_p:

    A = gamma[0]/(mu dt² b[0]) M + a[0]/(dt b[0]) C + K,   x = u(p),   scale = 1
    |r_t| <= limit(r_n) along B_t du

(The text prints -A u on the right of the semi-discrete equation; with A > 0 the sign is +.) Start,
and restart after every velocity jump or change of dt: the past is filled in with constant
acceleration, which makes Newmark's two-step form reproduce its one-step form exactly and keeps
second order for the other members. After a jump it is the one that fits the state without the
reaction of the collision (``consistent_data``): kept, that would act for another step, and throw
off what the impact law has just stopped. A change of dt keeps both. Unknowns without mass
(mass.Redistributed) have no acceleration and the mean velocity of the step. Energy: the ledger
closes with the means of both ends. Unlike the midpoint form, contact in the acceleration balance at
t_p can *gain* energy on consistent mass, booked as algorithmic or contact loss of negative sign.
Impulses: those over a contact with free flight before and after are the change of momentum.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, ClassVar

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import array, number
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.quantities import RATIO, Finite
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from .base import BalanceStep, end_state, position_stage
from .consistent_data import consistent_acceleration, equilibrate, replace_massless
from .generalised_alpha import balance_at

FREQUENCIES = np.logspace(-2.0, 3.0, 61)  # natural frequency times dt, for the stability check
DAMPING = (0.0, 0.1, 1.0)  # damping ratios, for the stability check
CONSISTENT = 1e-12  # relative; defects of the operators that are round-off
STABLE = 1.0 + 1e-6  # amplification: double roots on the unit circle have no more digits


@dataclass(frozen=True)
class LinearMultistep(BalanceStep):
    """Step with the coefficients of a linear multistep method.

    InputError is raised for unequal lengths, for b[0] = 0, and for operators that are not exact for
    u = 1, t and t², or not unconditionally stable.

    Attributes:
        a: factors of u in eq. 11a, the newest level first, q + 1 >= 2 of them.
        b: factors of u' in eq. 11a, and of u'' in eq. 11b, as many.
        gamma: factors of u in eq. 11b, as many.
        mu: factor of the right-hand side of eq. 11b.
    """

    by_rows: ClassVar[bool] = True
    reads_reactions: ClassVar[bool] = True

    a: tuple[float, ...]
    b: tuple[float, ...]
    gamma: tuple[float, ...]
    mu: Annotated[float, Finite, RATIO] = 1.0

    def __post_init__(self) -> None:
        for name in ("a", "b", "gamma"):
            array("LinearMultistep", name, getattr(self, name), (None,))
        check_fields(self)
        q = len(self.a) - 1
        if q < 1 or len(self.b) != q + 1 or len(self.gamma) != q + 1:
            raise InputError(
                "LinearMultistep: give a, b and gamma of one length q + 1 >= 2 (levels p, ..., p-q)"
            )
        if self.b[0] == 0.0 or self.mu == 0.0 or self.gamma[0] == 0.0:
            raise InputError(
                "LinearMultistep: give b[0], gamma[0] and mu other than zero, as only implicit "
                "schemes can hold contact"
            )

        # Consistency: what eq. 11a misses for u = 1 and t, and eq. 11b for u = 1, t and t², where
        # levels are one apart and the newest is at t = 0.
        level = -np.arange(q + 1.0)
        a, b, gamma = self._operators()
        defects = (
            a.sum(),
            a @ level - b.sum(),
            gamma.sum(),
            gamma @ level,
            gamma @ level**2 - 2.0 * self.mu * b.sum(),
        )
        scale = np.abs(a).sum() + np.abs(b).sum() + np.abs(gamma).sum()
        if not np.max(np.abs(defects)) <= CONSISTENT * scale * (q + 1) ** 2:
            raise InputError(
                "LinearMultistep coefficients are inconsistent: give some for which eq. 11a is "
                "exact for u = 1, t and eq. 11b for u = 1, t, t²"
            )
        if self.spectral_radius() > STABLE:
            raise InputError(
                f"LinearMultistep a={self.a}, b={self.b}, gamma={self.gamma} is not "
                "unconditionally stable: contact has no highest frequency to choose dt by; take "
                "other coefficients, for Newmark beta >= gamma/2 >= 1/4"
            )

    def _operators(self) -> tuple[Array, Array, Array]:
        """Return a, b and gamma as arrays (q + 1,)."""
        return (
            np.asarray(self.a, dtype=float),
            np.asarray(self.b, dtype=float),
            np.asarray(self.gamma, dtype=float),
        )

    def spectral_radius(self) -> float:
        """Return the largest amplification |z| of solutions u(p) = z^p.

        They are those of u'' + 2 xi w u' + w² u = 0 over FREQUENCIES w dt and DAMPING xi: roots of
        gamma(z)/mu + 2 xi w dt a(z) + (w dt)² b(z).
        """
        a, b, gamma = self._operators()
        polynomials = [b]  # of infinite frequency
        for w in FREQUENCIES:
            for xi in DAMPING:
                polynomials.append(gamma / (self.mu * w**2) + 2.0 * xi / w * a + b)
        radii = [np.max(np.abs(np.roots(p)), initial=0.0) for p in polynomials]
        return float(max(radii))

    @classmethod
    def newmark(cls, beta: float = 0.25, gamma: float = 0.5) -> "LinearMultistep":
        """Return Newmark(beta, gamma) as the q = 2 member.

        It is Newmark's method in two-step form: v and a are eliminated from three equations of
        motion (O. C. Zienkiewicz, 1977, A new look at the Newmark, Houbolt and other time stepping
        formulas).

        Args:
            beta: weight of a1 in u1, above zero.
            gamma: weight of a1 in v1.

        Raises:
            InputError: beta is zero or less, or the member is not unconditionally stable.
        """
        for name, value in (("beta", beta), ("gamma", gamma)):
            number("LinearMultistep.newmark", name, value)
        if beta <= 0.0:
            raise InputError(
                f"Newmark beta is {beta}: give beta > 0, as the explicit scheme cannot hold contact"
            )
        b = (beta, 0.5 + gamma - 2.0 * beta, 0.5 - gamma + beta)
        return cls(a=(gamma, 1.0 - 2.0 * gamma, gamma - 1.0), b=b, gamma=(1.0, -2.0, 1.0))

    def _differentiate_rates(self, dt: float) -> tuple[float, float]:
        """Return dv/du [1/s] and da/du [1/s²] of the newest level."""
        dv_du = self.a[0] / (dt * self.b[0])
        da_du = self.gamma[0] / (self.mu * dt**2 * self.b[0])
        return dv_du, da_du

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state with a past for this dt, and massless nodes in equilibrium.

        A state that has such a past is good as it is. For a new dt the past is filled in anew with
        the acceleration that is known.

        Args:
            problem: the problem that is marched.
            state: the state to go on from. Its memory counts where "t" is its time.
            dt: size of the next steps [s], the distance of the levels in the past.
        """
        # A past of more levels serves as well: the step reads those from 1 to q - 1 out of it.
        memory = state.memory
        if not np.array_equal(memory.get("t", ()), [state.t]):
            return self._restart(problem, equilibrate(problem, state), dt)
        if np.array_equal(memory["dt"], [dt]) and f"a_{len(self.a) - 2}" in memory:
            return state
        return self._fill_past(state, memory["a_0"], memory["reaction_0"], dt)

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the past of the new velocity.

        Args:
            problem: the problem that is marched.
            state: the state before the impact.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s].
        """
        return self._restart(problem, state.with_velocity(v), dt)

    def _restart(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state with the past of the acceleration that fits it."""
        a, reaction = consistent_acceleration(problem, state, dt)
        return self._fill_past(state, a, reaction, dt)

    def _fill_past(self, state: State, a: Array, reaction: Array, dt: float) -> State:
        """Return the state with levels 1..q before it, under constant acceleration.

        Args:
            state: the state.
            a: the acceleration (n,) [m/s²].
            reaction: Bᵀr (n,) [N] beside it.
            dt: distance of the levels [s].
        """
        past = {"a_0": a, "reaction_0": reaction, "dt": np.array([dt]), "t": np.array([state.t])}
        for r in range(1, len(self.a)):
            back = r * dt
            past[f"u_{r}"] = state.u - back * state.v + 0.5 * back**2 * a
            past[f"v_{r}"] = state.v - back * a
            past[f"a_{r}"] = a
        return replace(state, memory=past)

    def _collect_levels(self, state: State) -> dict[str, Array]:
        """Return u, v and a at the q levels before the step, of which 1 is the newest.

        What the memory of the state calls level r is level r + 1 for the step.
        """
        levels = {"u_1": state.u, "v_1": state.v, "a_1": state.memory["a_0"]}
        for r in range(2, len(self.a)):
            for name in "uva":
                levels[f"{name}_{r}"] = state.memory[f"{name}_{r - 1}"]
        return levels

    def _compute_rates_at_zero(self, levels: dict[str, Array], dt: float) -> tuple[Array, Array]:
        """Return v [m/s] and a [m/s²] of the new level for u = 0: what the past fixes of them.

        Eqs. 11c,d of the boundary method are eqs. 11a,b solved for the newest rates,

            v = (sum_r a[r] u(p-r) - dt sum_{r>0} b[r] v(p-r)) / (dt b[0])
            a = (sum_r gamma[r] u(p-r) - mu dt² sum_{r>0} b[r] a(p-r)) / (mu dt² b[0])

        here with u(p) = 0.
        """
        v = np.zeros_like(levels["u_1"])
        a = np.zeros_like(v)
        for r in range(1, len(self.a)):
            v += self.a[r] * levels[f"u_{r}"] - dt * self.b[r] * levels[f"v_{r}"]
            a += self.gamma[r] * levels[f"u_{r}"] - self.mu * dt**2 * self.b[r] * levels[f"a_{r}"]
        return v / (dt * self.b[0]), a / (self.mu * dt**2 * self.b[0])

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the balance at t_p, in d = u(p) - u0 - dt v0.

        The ledger takes the mean of the balances at both ends.

        Args:
            problem: the problem that is marched.
            state: u [m], v [m/s] and the past in its memory at t0, (n,), or rows (k, n) of several
                runs.
            dt: size of the step [s], the distance of the levels.
        """
        guess = state.u + dt * state.v
        v_at_zero, a_at_zero = self._compute_rates_at_zero(self._collect_levels(state), dt)
        dv_du, da_du = self._differentiate_rates(dt)
        return position_stage(
            problem,
            state,
            dt,
            guess=guess,
            u=Affine(guess, 1.0),
            v=Affine(v_at_zero + dv_du * guess, dv_du),
            a=Affine(a_at_zero + da_du * guess, da_du),
            load=problem.equations.load_at(state.t + dt),
            weight=0.5,
            before=partial(balance_at, problem, state, "_0"),
            of_momentum=False,
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with velocity and acceleration from eqs. 11c,d, its levels one older.

        Massless unknowns get no acceleration and the mean velocity of the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            stage: what ``stage`` returned for it; its rates are those of eqs. 11c,d.
            answer: x = u(p) (n,) [m], and the reactions at the end [N].
            dt: size of the step [s].
        """
        v = replace_massless(problem, stage.v(answer.d), (answer.x - state.u) / dt)
        a = replace_massless(problem, stage.a(answer.d), 0.0)
        memory = {
            **self._collect_levels(state),
            "a_0": a,
            "reaction_0": problem.surface.reaction_load(answer.r_n, v.shape[-1], answer.r_t),
            "dt": state.memory["dt"],
            "t": np.array([stage.t]),
        }
        return end_state(stage, answer, answer.x, v, memory)
