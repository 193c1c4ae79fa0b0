"""Choose the route by the size of the problem.

It is condensed where that is faster, iterative where it is not.

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
from ..core.sizes import small
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
TOLERANCE = (
    1e-12  # of conjugate gradients beside the steps: what starts a run should not be seen in it
)


@dataclass(frozen=True)
class Automatic:
    """Solve by ``condensed`` or by ``iterative``.

    It is the one that is faster for the size of the problem.

    ``iterative`` solves problems in space from 50 000 unknowns on (20 000 on several ranks, or
    without CHOLMOD), and problems with more contact points (with friction: contact unknowns) than
    4000 in space or 5000 in the plane. ``condensed`` solves all others, and all problems without
    finite elements. The log says which one is used. If ``iterative`` is None, it is Iterative(),
    which needs PETSc.
    """

    condensed: Solver = field(default_factory=Condensed)
    iterative: Solver | None = None

    def __post_init__(self) -> None:
        for name in ("condensed", "iterative"):
            if getattr(self, name) is not None:
                provides(
                    "Automatic",
                    name,
                    getattr(self, name),
                    ("check", "prepare"),
                    "give a solver, or leave it out",
                )

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the chosen route cannot treat. Collective."""
        self.route(problem.system.K, problem.surface, problem.frictional).check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver:
        """Return what chooses a route at the first step."""
        return Chosen(self, A, surface, scale)

    def route(self, matrix: Matrix, surface: ContactSurface, frictional: bool) -> Solver:
        """Return the solver for a matrix of this size and this surface. Collective."""
        if isinstance(matrix, SerialMatrix):
            return self.condensed
        dimension, comm = surface.points.shape[1], surface.comm
        alone = comm.size == 1 and load_cholmod(comm) is not None
        large = dimension == 3 and total(comm, matrix.rows) >= (
            ALONE_IN_SPACE if alone else IN_SPACE
        )
        if not large and surface.total * (dimension if frictional else 1) <= DENSE[dimension]:
            return self.condensed
        if self.iterative is not None:
            return self.iterative
        from .iterative import Iterative  # needs petsc4py, which small problems do without

        return Iterative()


class Chosen:
    """Choose at the first step, which tells whether it rubs, and solve all by what was chosen."""

    def __init__(self, rule: Automatic, *given: Any) -> None:
        self._rule, self._given = rule, given
        self._prepared: PreparedSolver | None = None

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer of the chosen route. Collective."""
        return self._chosen(step).solve(step)

    def solve_many(self, many: StepProblem, own: Callable[[int], StepProblem]) -> Any:
        """Return the answers of the chosen route to several runs; None where it has none."""
        together = getattr(self._chosen(many), "solve_many", None)
        return None if together is None else together(many, own)

    def _chosen(self, step: StepProblem) -> PreparedSolver:
        if self._prepared is None:
            route = self._rule.route(step.A.matrix, step.surface, step.slip0 is not None)
            if step.surface.comm.rank == 0:
                log.info(
                    "Automatic: %s for %d contact points", type(route).__name__, step.surface.total
                )
            self._prepared = route.prepare(*self._given)
        return self._prepared


def solver_beside_steps(A: EffectiveMatrix, surface: ContactSurface) -> Solver:
    """Return what solves the contact problems that schemes pose beside the steps.

    These are posed at the start or of a predictor.

    Condensed() for a problem that is small (``core.sizes``), else conjugate gradients, which
    factorise nothing: these matrices, of mass or of a layer of nodes, are well-conditioned.
    Volume() for systems that are not symmetric. Collective.
    """
    if not A.algebra.symmetric:
        from .volume import Volume

        return Volume()
    if small(surface.comm, A.matrix.rows, surface.count) or find_spec("petsc4py") is None:
        return Condensed()
    from .iterative import Iterative

    return Iterative("jacobi", tolerance=TOLERANCE)
