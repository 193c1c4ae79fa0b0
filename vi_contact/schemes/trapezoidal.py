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

import numpy as np

from ..core.algebra import Array
from ..core.checks import provides
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..core.stage import Affine, Answer, Stage
from ..core.step import State
from ..laws.mass import Redistributed
from .base import check_balance, end_state, position_stage
from .consistent_data import equilibrate, replace_massless

STARTED = {"started": np.ones(1)}  # the memory of a state that massless nodes are at rest in


@dataclass(frozen=True)
class Trapezoidal:
    """Step by the module's equations.

    The memory of its states is "started": their massless nodes are in equilibrium.

    Attributes:
        mass: the mass law for problems that do not name one.
    """

    by_rows: ClassVar[bool] = True
    takes_ends: ClassVar[bool] = True

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
            state: the state to go on from; "started" in its memory says that it has been started.
            dt: size of the next steps [s]; not read, as no memory depends on it.
        """
        if "started" in state.memory:
            return state
        return replace(equilibrate(problem, state), memory=STARTED)

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the new velocity; forces do not depend on it.

        Args:
            problem: the problem that is marched; not read.
            state: the state before the impact, whose memory stays.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s]; not read.
        """
        return state.with_velocity(v)

    def stage(self, problem: ContactProblem, state: State, dt: float) -> Stage:
        """Return the sum of the balances of both ends, in d = u1 - u0 - dt v0.

        u0 + u1 = 2 u0 + dt v0 + d,  v0 + v1 = 2 v0 + 2 d/dt,  a0 + a1 = 4 d/dt²; the reactions of
        the beginning are known. Half of it is the mean equation of the step.

        Args:
            problem: the problem that is marched.
            state: u [m], v [m/s] and reactions [N] at t0, (n,) and (m,), or rows of several runs.
            dt: size of the step [s].
        """
        system = problem.equations
        way = dt * state.v
        guess = state.u + way
        return position_stage(
            problem,
            state,
            dt,
            guess=guess,
            u=Affine(state.u + guess, 1.0),
            v=Affine(2.0 * state.v, 2.0 / dt),
            a=Affine(None, 4.0 / dt**2),
            load=system.load_at(state.t) + system.load_at(state.t + dt),
            carried=problem.surface.reaction_load(state.r_n, state.u.shape[-1], state.r_t),
            carried_reactions=(state.r_n, state.r_t),
            weight=0.5,
            old=(1.0, state.u),
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the state with v1 = v0 + 2 d/dt.

        Massless unknowns get the mean velocity of the step.

        Args:
            problem: the problem that is marched.
            state: the state at t0.
            stage: what ``stage`` returned for it.
            answer: x = u1 (n,) [m], and the reactions at the end [N].
            dt: size of the step [s].
        """
        rate = answer.d / dt
        v = replace_massless(problem, state.v + 2.0 * rate, state.v + rate)
        return end_state(stage, answer, answer.x, v, STARTED)
