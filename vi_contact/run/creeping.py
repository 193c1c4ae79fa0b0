"""Let a body creep to an equilibrium where load steps find none near the state before.

Materials that flow with less dilatancy than friction (psi < phi) may lose an equilibrium on the
way: there are several answers then, or the next one is some way off, and passes go round about it.
Such a stage is gone in increments with a viscous force of the elastic stiffness,

    p(u_k + d) + theta K d = f - B_nᵀ r_n - B_tᵀ r_t,    contact conditions on u_k + d

each from the state u_k that the one before has left, with what its points remember: implicit Euler
of a body that creeps with the viscosity theta K, which has one way to go where theta is large
enough. theta falls as the body comes to rest. The answer is certified without viscosity. It is that
of the body which creeps slowly; another one may exist. The viscous force of a body that gives way
does not fall, and such a stage is refused.

Sources: viscosity that makes flow unique, P. Perzyna, Adv. Appl. Mech. 9 (1966) 243-377; what less
dilatancy takes from uniqueness, D. Bigoni and T. Hueckel, Int. J. Solids Struct. 28 (1991) 197-213.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Matrix, largest
from ..core.checks import describe_point
from ..core.errors import StepFailure
from ..core.internal import remembers
from ..core.problem import ContactProblem
from ..core.step import Solver, State, StepProblem
from ..solvers.nonlinear import NonlinearSolver
from ..solvers.passes import Certified
from .rigid_bodies import make_body_springs
from .settling import SprungForces, add_springs

log = logging.getLogger(__name__)
VISCOSITIES = (0.3, 0.1, 0.03, 0.01, 0.003)  # theta, in the order in which they are tried
MOST = 40  # increments, at most
FALLEN = 1.0 / 3.0  # of the viscous force since the last search for the equilibrium
HALF = 0.5  # of the viscous force since a viscosity was too small: it is tried again
STEADY = 0.98  # of the least viscous force: one that hardly falls
PATIENCE = 6  # increments in which it hardly falls: the body gives way
ADVICE = (
    "the soil bears less than its loads, or flow with psi < phi has no equilibrium near: lower the "
    "load, or take smaller load steps, integration='bbar', psi nearer to phi, or time steps with "
    "damping"
)


class NotFound(StepFailure):
    """Say that no balance was found; a law that is wrong is another failure, and no creep mends."""


@dataclass(frozen=True)
class Creep:
    """Solve increments with one viscosity.

    Attributes:
        solver: of the increments.
        viscous: theta K.
        springs: theta K, and weak springs of bodies that contact alone holds.
    """

    solver: NonlinearSolver
    viscous: Matrix
    springs: Matrix

    def solve(self, step: StepProblem) -> Certified:
        """Return the certified answer of an increment, x = d. Collective.

        Args:
            step: the stage from the state before, without viscosity.

        Raises:
            StepFailure: no answer is certified.
        """
        forces: Any = step.forces
        nothing = np.zeros_like(step.guess)
        sprung = SprungForces(forces.system, forces.stage, self.springs, nothing)
        return self.solver.solve(
            replace(step, A=self.solver.A, b=sprung.find_rest(nothing), forces=sprung)
        )


# Return the state at the end of an increment from a state; without viscosity for None.
Take = Callable[[State, Creep | None], State]


class Creeping:
    """Creep to the equilibrium of stages of one problem."""

    def __init__(
        self,
        problem: ContactProblem,
        K: EffectiveMatrix,
        solvers: Sequence[Solver],
        tolerance: float,
    ) -> None:
        """Hold the problem; factors are made where a body creeps.

        Args:
            problem: what stands in equilibrium.
            K: its reference stiffness.
            solvers: of linear steps, and the methods to escalate to.
            tolerance: of the certificates, relative.
        """
        self._problem = problem
        self._K = K
        self._solvers = solvers
        self._tolerance = tolerance

    def find(self, take: Take, old: State) -> State:
        """Return the equilibrium to which the body creeps from a state. Collective.

        Args:
            take: takes an increment.
            old: the state before the stage.

        Raises:
            StepFailure: the body gives way, or is not at rest after ``MOST`` increments.
        """
        state = old
        before = state
        level = 0
        creep = self._make(level)
        least = np.inf  # of the viscous forces so far
        asked = np.inf  # the force at the last search for the equilibrium
        enough = np.inf  # the force from which on less viscosity is tried
        vain = 0  # increments in a row in which the force has hardly fallen
        for count in range(1, MOST + 1):
            try:
                new = take(state, creep)
            except NotFound:
                # More viscosity has an answer sooner; with the most of it there is no way on.
                if level == 0:
                    break
                level -= 1
                enough = HALF * least
                creep = self._make(level)
                continue
            before = state
            state = new
            force = self._measure(creep, state.u - before.u)
            vain = vain + 1 if force > STEADY * least else 0
            least = min(least, force)
            if asked == np.inf:
                asked = force
            if force <= FALLEN * asked:
                asked = force
                found = _try(take, state)
                if found is not None:
                    self._tell(found, count)
                    return found
            if vain == PATIENCE:
                break
            if force <= enough and level < len(VISCOSITIES) - 1:
                level += 1
                creep = self._make(level)
        raise StepFailure(
            f"the static stage at t = {state.t:.6g} s has no equilibrium to which the body creeps"
            f"{self._describe_flow(before, state)}: {ADVICE}"
        )

    def _make(self, level: int) -> Creep:
        """Return the creep with a viscosity. Collective."""
        system = self._problem.static_load
        algebra = system.algebra
        viscous = algebra.combine([(VISCOSITIES[level], system.K)])
        springs = viscous
        if system.floating:
            springs = algebra.combine([(1.0, viscous), (1.0, make_body_springs(self._problem))])
        A = add_springs(self._K, algebra, springs)
        solver = NonlinearSolver(self._problem, A, 1.0, self._solvers, self._tolerance)
        return Creep(solver, viscous, springs)

    def _measure(self, creep: Creep, way: Array) -> float:
        """Return the size of the viscous force of an increment (n,) [N]. Collective."""
        force = creep.viscous @ way
        return float(np.sqrt(self._problem.static_load.algebra.dot(force, force)))

    def _tell(self, state: State, count: int) -> None:
        """Log, on rank 0, that a stage was reached by creeping."""
        if self._problem.surface.comm.rank == 0:
            log.warning(
                "at t = %g s flow with psi < phi has lost its equilibrium on the way: the body "
                "crept to the next one in %d increments, and others may exist",
                state.t,
                count,
            )

    def _describe_flow(self, before: State, state: State) -> str:
        """Return words on where points have yielded most between two states. Collective."""
        place = _find_flow(self._problem, before, state)
        return "" if place is None else f"; it yields most near {describe_point(place)}"


def may_creep(problem: ContactProblem) -> bool:
    """Say whether the flow of a body may lose its equilibrium: whether psi < phi somewhere."""
    internal: Any = problem.system.internal
    return remembers(internal) and not getattr(internal, "symmetric", True)


def _try(take: Take, state: State) -> State | None:
    """Return the equilibrium without viscosity; None where none is found. Collective."""
    try:
        return take(state, None)
    except NotFound:
        return None


def _find_flow(problem: ContactProblem, before: State, state: State) -> Array | None:
    """Return the middle (d,) [m] of the cell whose plastic strain has grown most. Collective.

    None where no material tells its plastic strain as alpha.

    Args:
        problem: what stands.
        before: a state.
        state: a later one.
    """
    internal: Any = problem.system.internal
    comm = problem.surface.comm
    most = 0.0
    place = np.zeros(problem.system.influence.shape[1])
    for name in sorted(state.memory):
        if not name.endswith("_alpha") or name not in before.memory:
            continue
        grown = state.memory[name] - before.memory[name]
        if len(grown):
            each = grown.reshape(len(grown), -1).max(axis=1)
            row = int(np.argmax(each))
            if each[row] > most:
                most = float(each[row])
                place = internal.find_middles(name)[row]
    # One rank has the largest growth, and tells its place to all; of several the first one does.
    top = largest(comm, most)
    if top <= 0.0:
        return None
    first = -largest(comm, -float(comm.rank) if most == top else -np.inf)
    return np.asarray(comm.sum(place if comm.rank == first else np.zeros_like(place)))
