"""Choose what solves the contact problems that schemes pose beside the steps: at the start, of a predictor."""

from __future__ import annotations

import logging
from importlib.util import find_spec

from ..core.algebra import EffectiveMatrix
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.sizes import small
from ..core.step import Solver
from ..core.surfaces import ContactSurface
from .condensed import Condensed

log = logging.getLogger(__name__)
TOLERANCE = 1e-12  # of conjugate gradients: what starts a run should not be seen in it


def solver_beside_steps(problem: ContactProblem, A: EffectiveMatrix, surface: ContactSurface) -> Solver:
    """Return Condensed() for a problem that is small (``core.sizes``), else conjugate gradients, which factorise
    nothing: these matrices, of mass or of a layer of nodes, are well-conditioned. Collective."""
    if small(surface.comm, A.matrix.rows, surface.count) or find_spec("petsc4py") is None:
        return Condensed()
    from .iterative import Iterative

    solver = Iterative("jacobi", tolerance=TOLERANCE)
    try:
        solver.check(problem)
    except InputError as refusal:
        if surface.comm.rank == 0:
            log.warning("a large problem at the start is factorised: %s", refusal)
        return Condensed()
    return solver
