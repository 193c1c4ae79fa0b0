"""Average strains over cells."""

import numpy as np
import ufl

from ...core.algebra import Array
from .. import compat
from ..body.space import FemSpace
from ..matrices.petsc_algebra import PetscMatrix


class CellStrains:
    """Average small strains over the cells of a mesh: eps = ∫ sym grad u dx / volume of the cell.

    The integrals of all cells are one matrix times the nodal displacements, which is assembled
    once.
    """

    def __init__(self, space: FemSpace) -> None:
        """Assemble ∫ eps(phi_j) over each cell, and the volumes of the cells. Collective."""
        V = space.V
        d = space.dimension
        self._components = d * d
        # tested with tensors that are constant on a cell, the strains are integrated cell by cell
        tensors = compat.lagrange(V.mesh, 0, (d, d), continuous=False)
        q = ufl.TestFunction(tensors)
        eps = ufl.sym(ufl.grad(ufl.TrialFunction(V)))
        form = compat.compile_form(ufl.inner(q, eps) * ufl.dx)
        self._integrals = PetscMatrix(compat.assemble_matrix(form))
        volumes = compat.assemble_vector(compat.compile_form(q[0, 0] * ufl.dx)).array_r
        self._volumes = np.array(volumes).reshape(-1, self._components)[:, :1]
        # The rows of the matrix are in the order of the tensors, which need not be that of cells.
        self._order = compat.cell_blocks(tensors)[: len(self._volumes), 0]

    def __len__(self) -> int:
        """Return how many cells this rank owns."""
        return len(self._volumes)

    def mean(self, u: Array) -> Array:
        """Return mean strains (owned cells, d²), the rows of each tensor in turn. Collective.

        Args:
            u: (owned nodes d,) displacements as ``FemSpace.expand`` gives them, flattened [m].
        """
        integrals = (self._integrals @ u).reshape(len(self), self._components)
        return np.asarray((integrals / self._volumes)[self._order])
