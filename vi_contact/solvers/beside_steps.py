"""Choose what solves the contact problems that schemes pose beside the steps: at the start, of a predictor."""

from importlib.util import find_spec

from ..core.algebra import EffectiveMatrix
from ..core.sizes import small
from ..core.step import Solver
from ..core.surfaces import ContactSurface
from .condensed import Condensed

TOLERANCE = 1e-12  # of conjugate gradients: what starts a run should not be seen in it


def solver_beside_steps(A: EffectiveMatrix, surface: ContactSurface) -> Solver:
    """Return Condensed() for a problem that is small (``core.sizes``), else conjugate gradients, which factorise
    nothing: these matrices, of mass or of a layer of nodes, are well-conditioned. Volume() for systems that are not
    symmetric. Collective."""
    if not A.algebra.symmetric:
        from .volume import Volume

        return Volume()
    if small(surface.comm, A.matrix.rows, surface.count) or find_spec("petsc4py") is None:
        return Condensed()
    from .iterative import Iterative

    return Iterative("jacobi", tolerance=TOLERANCE)
