"""Step by the trapezoidal rule on redistributed mass: the default for dynamic contact.

    (u1 - u0)/dt = ½ (v0 + v1)
    M (v1 - v0)/dt + C (u1 - u0)/dt + ½ K (u0 + u1)
        = ½ (f0 + f1) - ½ B_nᵀ(r0 + r1) - ½ B_tᵀ(r0 + r1)
    0 <= r1_n  ⊥  gap0 - B_n u1 >= 0,    |r1_t| <= limit(r1_n) along B_t (u1 - u0)

In x = u1:  A = 4/dt² M + 2/dt C + K,
b = 4/dt² M (u0 + dt v0) + 2/dt C u0 - K u0 + f0 + f1 - Bᵀr0,  scale = 1, r the reaction at the end.
M has no inertia at contact nodes (mass.Redistributed): they are in equilibrium at both ends.

Order 2 while nothing opens or closes; unconditionally stable. Energy: changes by work of loads and
damping and by the contact work ½ (r1 g0 - r0 g1), of either sign and of order dt per event:
quasi-conservative, contact forces do not ring. On consistent mass this is Newmark(¼, ½), which
gains energy in every impact; it runs there with a warning. Source: Khenous, Laborde and Renard,
Eur. J. Mech. A 27 (2008) 918-932.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar

from ..core.algebra import Array, EffectiveMatrix
from ..core.checks import provides
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..core.step import Balance, State, StepProblem, StepResult
from ..laws.mass import Redistributed
from .base import balance_means, check_balance, end_step, position_step
from .consistent_data import equilibrate, replace_massless


@dataclass(frozen=True)
class Trapezoidal:
    """Step by the module's equations.

    The memory of its states is "force", f - K u - Bᵀr (n,) [N].

    Attributes:
        mass: the mass law for problems that do not name one.
    """

    by_rows: ClassVar[bool] = True

    mass: MassLaw = field(default_factory=Redistributed)

    def __post_init__(self) -> None:
        remedy = "give Redistributed() or ConsistentMass()"
        provides("Trapezoidal", "mass", self.mass, ("apply",), remedy, lacks=("target",))

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for an impact law on massless contact nodes, or for a second mass law.

        Warn when contact nodes have mass.
        """
        if self.mass not in (Redistributed(), problem.mass):
            raise InputError(
                f"Trapezoidal: mass={self.mass} is not read, as the problem has "
                f"mass={problem.mass}: leave one of the two out"
            )
        check_balance("Trapezoidal()", problem)

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state with massless nodes in equilibrium.

        On a restart, and for a new dt, the state is good as it is.

        Args:
            problem: the problem that is marched.
            state: the state to go on from; "force" in its memory says that it has been started.
            dt: size of the next steps [s]; not read, as no memory depends on it.
        """
        if "force" in state.memory:
            return state
        return self._remember_force(problem, equilibrate(problem, state))

    def _remember_force(self, problem: ContactProblem, state: State) -> State:
        """Return the state with f - K u - Bᵀr in its memory: the next step starts with it."""
        system = problem.equations
        reaction = problem.surface.reaction_load(state.r_n, system.rows, state.r_t)
        force = system.load_at(state.t) - system.product("K", state.u) - reaction
        return replace(state, memory={"force": force})

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the new velocity; forces do not depend on it.

        Args:
            problem: the problem that is marched; not read.
            state: the state before the impact, whose memory stays.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s]; not read.
        """
        return state.with_velocity(v)

    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix:
        """Return A = 4/dt² M + 2/dt C + K."""
        return problem.equations.effective(m=4.0 / dt**2, c=2.0 / dt, k=1.0, shares=True)

    def step(
        self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float
    ) -> StepProblem:
        """Return the step with b of the module's equations.

        Args:
            problem: the problem that is marched.
            state: u [m], v [m/s] and "force" [N] at t0, (n,), or rows (k, n) of several runs.
            A: 4/dt² M + 2/dt C + K (n, n) [N/m].
            dt: size of the step [s].

        Returns:
            The step in x = u1 [m], with b and reactions in newtons.
        """
        system = problem.equations

        # The memory holds f0 - K u0 - Bᵀr0. What is left of b are products with M and C, and f1.
        b = state.memory["force"] + system.load_at(state.t + dt)
        b += 4.0 / dt**2 * (system.product("M", state.u) + dt * system.product("M", state.v))
        if system.C is not None:
            b += 2.0 / dt * system.product("C", state.u)
        return position_step(problem, state, A, dt, b=b, scale=1.0)

    def finish(
        self,
        problem: ContactProblem,
        state: State,
        step: StepProblem,
        result: StepResult,
        dt: float,
    ) -> State:
        """Return the state with v1 = 2 (u1 - u0)/dt - v0.

        Massless unknowns get the mean velocity of the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            step: what ``step`` returned for it.
            result: its answer, x = u1 (n,) [m] and reactions at the end [N].
            dt: size of the step [s].
        """
        mean = (result.x - state.u) / dt
        v = replace_massless(problem, 2.0 / dt * (result.x - state.u) - state.v, mean)
        return self._remember_force(problem, end_step(step, result, result.x, v))

    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance:
        """Return the means of both ends.

        Args:
            problem: the problem that is marched.
            old: the state at t0.
            new: the state at t1, before the impact law.
            dt: size of the step [s].
        """
        load_at = problem.equations.load_at
        u = 0.5 * (old.u + new.u)
        f = 0.5 * (load_at(old.t) + load_at(new.t))
        balance = balance_means(problem, old, new, dt, u=u, f=f)

        # A first state may have no tangential reactions yet: they count as zero.
        r_t = None
        if new.r_t is not None:
            r_t = 0.5 * (new.r_t if old.r_t is None else old.r_t + new.r_t)
        return replace(balance, r_n=0.5 * (old.r_n + new.r_n), r_t=r_t)
