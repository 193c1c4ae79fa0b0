"""Choose the route by the size of the problem: condensed where that is faster, else iterative.

Condensing costs one factor of A, once per dt, and a step then one forward and one backward
substitution; the iterative route costs some tens of products with A every step, and next to nothing
before. In the plane factors stay sparse, in space they do not; with friction the small dense
problem grows faster still. What the rule was measured on is in docs/guide/solvers.md.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from ..core.algebra import EffectiveMatrix, Matrix, SerialMatrix, total
from ..core.checks import provides
from ..core.problem import ContactProblem
from ..core.sizes import is_small_problem
from ..core.step import PreparedSolver, Solver, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..kernels.compiler import load_cholmod
from .condensed import Condensed

log = logging.getLogger(__name__)
# unknowns in three dimensions from which on a few hundred steps are faster without a factor
IN_SPACE = 20_000
ALONE_IN_SPACE = 50_000  # the same on one rank, where CHOLMOD factorises
# rows of the small problem, by dimension: 5000 take 200 MB on every rank
DENSE = {3: 4_000, 2: 5_000, 1: 5_000}
# of conjugate gradients beside the steps: what starts a run should not be seen in it
TOLERANCE = 1e-12


@dataclass(frozen=True)
class Automatic:
    """Solve by the one of two solvers that is faster for the size of the problem.

    ``iterative`` solves problems in space from 50 000 unknowns on (20 000 on several ranks, or
    without CHOLMOD), and problems with more contact points (with friction: contact unknowns) than
    4000 in space or 5000 in the plane. ``condensed`` solves all others, and all problems without
    finite elements, or whose conditions share unknowns. The log says which one is used.

    Attributes:
        condensed: the solver of smaller problems.
        iterative: the solver of larger ones; None stands for Iterative(), which needs PETSc.
    """

    condensed: Solver = field(default_factory=Condensed)
    iterative: Solver | None = None

    def __post_init__(self) -> None:
        remedy = "give a solver, or leave it out"
        for name in ("condensed", "iterative"):
            solver = getattr(self, name)
            if solver is not None:
                provides("Automatic", name, solver, ("check", "prepare"), remedy)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the chosen route cannot treat. Collective."""
        self.route(problem.system.K, problem.surface, problem.frictional).check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver:
        """Return what chooses a route at the first step.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.
        """
        return PreparedAutomatic(self, A, surface, scale)

    def route(self, matrix: Matrix, surface: ContactSurface, frictional: bool) -> Solver:
        """Return the solver for a matrix of this size and this surface. Collective.

        Args:
            matrix: any matrix of the system.
            surface: the contact surface.
            frictional: whether tangential unknowns count too.
        """
        if isinstance(matrix, SerialMatrix) or surface.traces is not None:
            return self.condensed
        dimension = surface.points.shape[1]
        comm = surface.comm

        # In space from some unknowns on a factor costs more than iterations.
        has_cholmod = comm.size == 1 and load_cholmod(comm) is not None
        most = ALONE_IN_SPACE if has_cholmod else IN_SPACE
        is_large = dimension == 3 and total(comm, matrix.rows) >= most

        # From some contact unknowns on their dense matrix does.
        contact_unknowns = surface.total * (dimension if frictional else 1)
        if not is_large and contact_unknowns <= DENSE[dimension]:
            return self.condensed
        if self.iterative is not None:
            return self.iterative
        from .iterative import Iterative  # needs petsc4py, which small problems do without

        return Iterative()


class PreparedAutomatic:
    """Choose a solver at the first step, which tells whether there is friction, and keep to it."""

    def __init__(
        self, rule: Automatic, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        """Note what the chosen solver is prepared with: see ``Automatic.prepare``."""
        self._rule = rule
        self._A = A
        self._surface = surface
        self._scale = scale
        self._prepared: PreparedSolver | None = None

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer of the chosen route. Collective."""
        return self._choose(step).solve(step)

    def solve_many(self, many: StepProblem, own: Callable[[int], StepProblem]) -> Any:
        """Return the answers of the chosen route to several steps; None where it has none.

        Args:
            many: the steps; its arrays have a row for each.
            own: makes the step of one row.
        """
        solve_many = getattr(self._choose(many), "solve_many", None)
        return None if solve_many is None else solve_many(many, own)

    def make_passes(self, step: StepProblem) -> Any:
        """Return what makes the passes of steps with a joint; None where the route has none.

        Args:
            step: any step.
        """
        make_passes = getattr(self._choose(step), "make_passes", None)
        return None if make_passes is None else make_passes(step)

    def _choose(self, step: StepProblem) -> PreparedSolver:
        """Return the prepared solver, chosen by the first step. Collective."""
        if self._prepared is None:
            route = self._rule.route(step.A.matrix, step.surface, step.slip0 is not None)
            if step.surface.comm.rank == 0:
                log.info(
                    "Automatic: %s for %d contact points", type(route).__name__, step.surface.total
                )
            self._prepared = route.prepare(self._A, self._surface, self._scale)
        return self._prepared


def solver_beside_steps(A: EffectiveMatrix, surface: ContactSurface) -> Solver:
    """Return what solves the contact problems that schemes pose beside the steps. Collective.

    Schemes pose them at the start, or for a predictor. Small ones (``core.sizes``) are solved by
    Condensed(), others by conjugate gradients, which factorise nothing: these matrices, of mass or
    of a layer of nodes, are well-conditioned. Systems that are not symmetric take Volume().
    """
    if not A.algebra.symmetric:
        from .volume import Volume

        return Volume()
    is_small = is_small_problem(surface.comm, A.matrix.rows, surface.count)
    if is_small or surface.traces is not None or find_spec("petsc4py") is None:
        return Condensed()
    from .iterative import Iterative

    return Iterative("jacobi", tolerance=TOLERANCE)
