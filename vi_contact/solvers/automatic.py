"""Choose the route by the size of the problem: condensed where it is faster, iterative where it is not.

Condensing costs one factor of A, once per dt, and a step then one forward and one backward substitution; the iterative
route costs some tens of products with A every step, and next to nothing before. In the plane factors stay sparse, in
space they do not: the rule and what it was measured on are in docs/guide/solvers.md.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

from ..core.algebra import EffectiveMatrix, Matrix, SerialMatrix, total
from ..core.checks import provides
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, Solver
from ..core.surfaces import ContactSurface
from .condensed import Condensed

log = logging.getLogger(__name__)
IN_SPACE = 20_000  # unknowns in three dimensions from which on a few hundred steps are faster without a factor
CONDITIONS = 5_000  # contact unknowns d m: their dense matrix takes 200 MB on every rank


@dataclass(frozen=True)
class Automatic:
    """Solve by ``condensed`` or by ``iterative``, whichever the size of the problem makes the faster one.

    The iterative route is taken in three dimensions from 20 000 unknowns on, and wherever d m contact unknowns are more
    than 5000; elsewhere, and without finite elements, the condensed one. The log says which. ``iterative`` None is
    Iterative(), which needs PETSc.
    """

    condensed: Solver = field(default_factory=Condensed)
    iterative: Solver | None = None

    def __post_init__(self) -> None:
        for name in ("condensed", "iterative"):
            if getattr(self, name) is not None:
                provides("Automatic", name, getattr(self, name), ("check", "prepare"), "give a solver, or leave it out")

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the chosen route cannot treat. Collective."""
        self.route(problem.system.K, problem.surface).check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver:
        """Choose, and prepare what was chosen. Collective."""
        route = self.route(A.matrix, surface)
        if surface.comm.rank == 0:
            log.info("Automatic: %s for %d contact points", type(route).__name__, surface.total)
        return route.prepare(A, surface, scale)

    def route(self, matrix: Matrix, surface: ContactSurface) -> Solver:
        """Return the solver for a matrix of this size and this surface. Collective."""
        if isinstance(matrix, SerialMatrix):
            return self.condensed
        dimension = surface.points.shape[1]
        in_space = dimension == 3 and total(surface.comm, matrix.rows) >= IN_SPACE
        if not in_space and dimension * surface.total <= CONDITIONS:
            return self.condensed
        if self.iterative is not None:
            return self.iterative
        from .iterative import Iterative  # needs petsc4py, which small problems do without

        return Iterative()
