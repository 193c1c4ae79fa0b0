"""Take the volumetric strain of a cell as its mean, so that first-order cells do not lock.

    K = ∫ 2 mu eps(u):eps(v) + sum over cells of  lambda / |cell| ∫ tr eps(u) ∫ tr eps(v)

All else is integrated as usual, so that an element has no other zero-energy modes than its rigid
motions. On quadrilaterals and parallelepipeds the mean is the value in the middle: selective
reduced integration, the volumetric term by one point (Hughes, Int. J. Numer. Methods Eng. 15
(1980), 1413-1418; Nagtegaal, Parks and Rice, Comput. Methods Appl. Mech. Eng. 4 (1974), 153-177).
On other hexahedra the mean passes the patch test, which one point does not.
"""

from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from ...core.algebra import Array
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc, triple_product


class MeanDilatation:
    """Compute the mean of tr eps over each cell of a vector space, and what it adds to a stiffness.

    Collective.
    """

    def __init__(self, V: Any) -> None:
        """Assemble ∫ tr eps(phi_j) over every cell, and the volumes of the cells."""
        self._cells = compat.cell_space(V.mesh)
        q = ufl.TestFunction(self._cells)
        u = ufl.TrialFunction(V)
        self._integral = PetscMatrix(
            compat.assemble_matrix(compat.compile_form(q * ufl.div(u) * ufl.dx))
        )
        self._volume: Array = np.array(
            compat.assemble_vector(compat.compile_form(q * ufl.dx)).array_r
        )
        self._means: list[tuple[Any, Any]] = []

    def add(self, matrix: Any, *moduli: Any) -> None:
        """Add sum of modulus / |cell| ∫ tr eps(u) ∫ tr eps(v) to a PETSc matrix.

        Args:
            matrix: of all components; it is added to.
            *moduli: cellwise Functions whose product is the modulus [Pa], None for 1.
        """
        # Bᵀ diag(modulus / |cell|) B with B_cj = ∫ tr eps(phi_j) over cell c
        density = 1.0 / self._volume
        for modulus in moduli:
            if modulus is not None:
                density = density * modulus.x.array[: len(density)]
        every = np.arange(len(density))
        algebra = PetscAlgebra(self._cells.mesh.comm)
        weights = as_petsc(algebra.local(every, every, density, len(density))).mat
        different = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN
        matrix.axpy(1.0, triple_product(weights, self._integral.mat), structure=different)

    def of(self, u: Any) -> Any:
        """Return the mean of tr eps of a Function on cells; ``update`` follows its values."""
        mean = compat.function(self._cells)
        self._means.append((u, mean))
        self.update(u)
        return mean

    def update(self, u: Any) -> None:
        """Compute the means of this Function anew. Collective."""
        owned = self._integral.mat.getLocalSize()[1]
        for function, mean in self._means:
            if function is not u:
                continue
            values = self._integral @ np.asarray(u.x.array[:owned])
            mean.x.array[: len(values)] = values / self._volume
            mean.x.scatter_forward()
