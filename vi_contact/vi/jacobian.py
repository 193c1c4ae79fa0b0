"""Assemble the Jacobian of F again and again, into matrices that are made once."""

from typing import Any

import numpy as np

from ..core.algebra import Array, Mask, largest
from ..fem import compat
from ..fem.matrices.petsc_algebra import PetscMatrix, make_index_set
from ..fem.mesh.communicators import MpiComm


class FreeJacobian:
    """Hold a Jacobian J, and its part on the free unknowns.

    Attributes:
        part: the part; it is the same object always, whose entries change.
    """

    def __init__(self, form: Any, free: Mask, comm: MpiComm) -> None:
        """Make both matrices. Collective.

        Args:
            form: the compiled bilinear form.
            free: (n,) which owned unknowns are free.
            comm: one that lasts as long as the program.
        """
        self._form = form
        self._whole = PetscMatrix(compat.create_matrix(form, comm.mpi))
        self._chosen = make_index_set(self._whole, free)
        self._comm = comm
        self.part = PetscMatrix(self._whole.mat.createSubMatrix(self._chosen, self._chosen))
        self._entries: Array | None = None

    def assemble(self) -> None:
        """Assemble J at the present values of all its coefficients. Collective."""
        compat.assemble_again(self._form, self._whole.mat)
        self._whole.mat.createSubMatrix(self._chosen, self._chosen, self.part.mat)

    def has_changed(self) -> bool:
        """Say whether an entry of the part is another one than at the last question. Collective."""
        entries = self.part.mat.getValuesCSR()[2]
        is_same = self._entries is not None and np.array_equal(entries, self._entries)
        self._entries = entries
        return bool(largest(self._comm, not is_same))

    def apply_whole(self, x: Array) -> Array:
        """Return J x of all owned unknowns, the held ones too. Collective."""
        return self._whole @ x

    def close(self) -> None:
        """Free the matrices. Collective."""
        for item in (self.part.mat, self._whole.mat, self._chosen):
            item.destroy()
