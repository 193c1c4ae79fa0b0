"""Eliminate the components of nodes that are held, and those that follow others through ties.

    u = P u_free + U(t),    PᵀAP of a matrix A,    Pᵀf of a force f

P has a one for each free component, and one for each component that follows a free one; U(t) are
the values of the held components, zero elsewhere. Without ties PᵀAP is a part of A, and no P is
made. Components that follow several others (``blending``) have weights in their rows of P, and U
has there what they follow of held ones: U = (I + L) times the values of the held components.
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
        self,
        comm: MpiComm,
        free: Mask,
        held: Mask,
        *,
        followed: Indices | None,
        unknowns: int,
        blended: tuple[sp.csr_matrix, sp.csr_matrix] | None = None,
    ) -> None:
        """Make P where components follow others. Collective.

        Args:
            comm: the communicator of the matrices.
            free: (full,) mask of the owned free components.
            held: (full,) mask of the owned prescribed components.
            followed: (full,) which unknown of all ranks each owned component is or follows, -1
                where it is held; None without ties.
            unknowns: how many free components there are on all ranks.
            blended: rows (full,) of components that follow several others: of the free components
                of all ranks, and of all components, of which held ones alone count; None on all
                ranks without such.
        """
        self.free = free
        self.held = held
        self.others = 0
        self._P: PetscMatrix | None = None
        self._L: PetscMatrix | None = None
        if followed is not None:
            rows = _make_selection(free, followed, unknowns)
            if blended is not None:
                rows = rows + blended[0]
                self._L = PetscMatrix(aij_of(blended[1], comm.mpi))
            self._P = PetscMatrix(aij_of(rows, comm.mpi, int(free.sum())))

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
        of_nodes = u[: len(u) - self.others]
        values = self.lift(values)
        if self._P is None:
            values[self.free] = of_nodes
        else:
            values += self._P @ of_nodes
        return values

    def lift(self, values: Array) -> Array:
        """Return (I + L) values (full,): what follows held components in the mean moves too."""
        return values if self._L is None else values + self._L @ values

    def pull(self, force: Array) -> Array:
        """Return Pᵀ f, forces on the free components; tied nodes count at their partners."""
        pulled = force[self.free] if self._P is None else self._P.transpose_apply(force)
        return self._make_room(pulled)

    def reduce(self, full: Any) -> Any:
        """Return PᵀAP of a PETSc matrix of all components, a new one. Collective."""
        if self._P is not None:
            return triple_product(full, self._P.mat)
        return _take_part(full, self.free, self.free)

    def take_held_columns(self, full: Any) -> Any:
        """Return A (I + L) of a matrix of all components, with the columns of held ones only.

        Collective.
        """
        every = np.ones_like(self.free)
        if self._L is None:
            return _take_part(full, every, self.held)
        lifted = full.matMult(self._L.mat)
        lifted.axpy(1.0, full)
        part = _take_part(lifted, every, self.held)
        lifted.destroy()
        return part


def _make_selection(free: Mask, followed: Indices, unknowns: int) -> sp.csr_matrix:
    """Return rows of P: one 1 per free component, and one for each that follows another.

    Args:
        free: (full,) mask of the owned free components.
        followed: (full,) the unknown that each owned component is or follows, -1 where it is held.
        unknowns: how many there are on all ranks.
    """
    moving = np.flatnonzero(followed >= 0)
    entries = (np.ones(len(moving)), (moving, followed[moving]))
    return sp.csr_matrix(entries, shape=(len(free), unknowns))


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
