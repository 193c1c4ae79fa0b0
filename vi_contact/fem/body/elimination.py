"""Eliminate the components of nodes that are held, and those that follow others through ties.

    u = P u_free + U(t),    PᵀAP of a matrix A,    Pᵀf of a force f

P has a one for each free component, and one for each component that follows a free one; U(t) are
the values of the held components, zero elsewhere. Without ties PᵀAP is a part of A, and no P is
made.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Indices, Mask
from ..matrices.petsc_algebra import PetscMatrix, triple_product
from ..matrices.petsc_rows import aij_of
from ..mesh.communicators import MpiComm


class Elimination:
    """Take vectors and matrices of all components to those of the free ones, and back.

    A "full" vector holds every owned component (block · d + component), a "free" one only those
    that the equations solve for. Nothing here knows a mesh.

    Attributes:
        free: (full,) mask of the owned free components.
        held: (full,) mask of the owned components that are prescribed.
        others: how many unknowns of this rank follow that are no components of nodes.
    """

    def __init__(
        self, comm: MpiComm, free: Mask, held: Mask, *, followed: Indices | None, unknowns: int
    ) -> None:
        """Make P where components follow others. Collective.

        Args:
            comm: the communicator of the matrices.
            free: (full,) mask of the owned free components.
            held: (full,) mask of the owned prescribed components.
            followed: (full,) which unknown of all ranks each owned component is or follows, -1
                where it is held; None without ties.
            unknowns: how many free components there are on all ranks.
        """
        self.free = free
        self.held = held
        self.others = 0
        self._P = None if followed is None else _make_selection(comm, free, followed, unknowns)

    def restrict(self, full: Array) -> Array:
        """Restrict nodal values (owned nodes, d) to the free vector."""
        return self._make_room(full.ravel()[self.free])

    def _make_room(self, values: Array) -> Array:
        """Return a free vector of components of nodes with zeros for the others."""
        return np.concatenate([values, np.zeros(self.others)]) if self.others else values

    def expand(self, u: Array, values: Array) -> Array:
        """Return P u + U, a full vector.

        Args:
            u: (n,) the free vector.
            values: (full,) U at the held components, zero elsewhere; it is overwritten.
        """
        if self._P is None:
            values[self.free] = u[: len(u) - self.others]
        else:
            values += self._P @ u
        return values

    def pull(self, force: Array) -> Array:
        """Return Pᵀ f, forces on the free components; tied nodes count at their partners."""
        if self._P is not None:
            return self._P.transpose_apply(force)
        return self._make_room(force[self.free])

    def reduce(self, full: Any) -> Any:
        """Return PᵀAP of a PETSc matrix of all components, a new one. Collective."""
        if self._P is not None:
            return triple_product(full, self._P.mat)
        return _take_part(full, self.free, self.free)

    def take_held_columns(self, full: Any) -> Any:
        """Return a matrix of all components with the columns of held ones only. Collective."""
        return _take_part(full, np.ones_like(self.free), self.held)


def _make_selection(comm: MpiComm, free: Mask, followed: Indices, unknowns: int) -> PetscMatrix:
    """Return P: one 1 per free component, and one for each that follows another. Collective.

    Args:
        comm: the communicator of the matrices.
        free: (full,) mask of the owned free components.
        followed: (full,) the unknown that each owned component is or follows, -1 where it is held.
        unknowns: how many there are on all ranks.
    """
    moving = np.flatnonzero(followed >= 0)
    ones = sp.csr_matrix(
        (np.ones(len(moving)), (moving, followed[moving])), shape=(len(free), unknowns)
    )
    return PetscMatrix(aij_of(ones, comm.mpi, int(free.sum())))


def _take_part(full: Any, rows: Mask, columns: Mask) -> Any:
    """Return the rows and columns of a PETSc matrix that masks of owned ones name. Collective.

    Args:
        full: a PETSc matrix of all components.
        rows: (full,) mask of owned rows.
        columns: (full,) mask of owned columns.
    """
    first = full.getOwnershipRange()[0]
    numbers = [(first + np.flatnonzero(mask)).astype(PETSc.IntType) for mask in (rows, columns)]
    return full.createSubMatrix(
        *(PETSc.IS().createGeneral(chosen, comm=full.comm) for chosen in numbers)
    )
