"""Store the symmetric matrices of large systems compactly.

This is one half, and after a change of basis what it changed.

Half of K in blocks of nodes takes 0.2 kB an unknown on tetrahedra where AIJ takes 0.53, and its
product half the time; of M, whose components are not coupled along the axes, only what is not zero
is stored. A change of basis that is the identity but for the contact nodes changes few rows: the
others are shared with the matrix it was made from.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Indices, Matrix, largest, total, upper_blocks
from ..mesh.communicators import give_back
from .petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra, as_petsc, triple_product
from .petsc_rows import aij_of, rows_of

COMPACT = 20_000  # unknowns in space from which on it pays: those that are solved iteratively
WASTE = 1.8  # entries of blocks over those that are not zero: with more, no blocks
SAMPLE = 1000  # nodes at which these are counted


class Half(PetscMatrix):
    """Hold one half of a symmetric matrix (SBAIJ)."""

    @property
    def mat(self) -> Any:
        """Return the whole matrix, made anew."""
        whole = self.stored.convert("aij", PETSc.Mat())
        whole.setBlockSize(1)
        return whole

    @property
    def bytes(self) -> float:
        """Return the bytes of the half that is stored."""
        return super().bytes * (2.0 + self.stored.getBlockSize() ** -2) / 3.0

    def transpose_apply(self, x: Array) -> Array:
        """Return A x, which is Aᵀ x."""
        return self @ x


class Replaced(PetscMatrix):
    """Hold a symmetric matrix that is another but for ``part``, some owned rows.

    ``alike``: same places.
    """

    def __init__(self, base: PetscMatrix, rows: Indices, part: Any, alike: bool) -> None:
        super().__init__(part)
        self._base = base
        self._rows = rows
        self._alike = alike

    @property
    def rows(self) -> int:
        """Return how many rows this rank owns."""
        return self._base.rows

    @property
    def mat(self) -> Any:
        """Return the whole matrix, made anew."""
        whole = self._base.mat
        part = rows_of(self.stored)
        kind = PETSc.IntType
        whole = whole.copy() if whole is self._base.stored else whole
        if self._alike:
            rows = (whole.getOwnershipRange()[0] + self._rows).astype(kind)
            whole.setValuesIJV(
                part.indptr.astype(kind), part.indices.astype(kind), part.data, rowmap=rows
            )
            whole.assemble()
            return whole
        both = sp.vstack([rows_of(whole), part], format="csr")
        order = np.arange(self.rows)
        whole.destroy()
        order[self._rows] = self.rows + np.arange(len(self._rows))
        return aij_of(both[order], self.stored.comm)

    def __matmul__(self, x: Array) -> Array:
        if x.ndim == 2:
            return self._rows_by(x)
        y = self._base @ x
        y[self._rows] = super().__matmul__(x)
        return y

    def transpose_apply(self, x: Array) -> Array:
        """Return A x, which is Aᵀ x."""
        return self @ x

    def diagonal(self) -> Array:
        """Return the diagonal entries of the owned rows."""
        values = self._base.diagonal()
        part = rows_of(self.stored)
        row = np.repeat(self._rows, np.diff(part.indptr))
        own = part.indices == self.stored.getOwnershipRangeColumn()[0] + row
        values[self._rows] = 0.0
        values[row[own]] = part.data[own]
        return values


class CompactAlgebra(PetscAlgebra):
    """Make compact matrices of symmetric ones; nodes have ``dimension`` unknowns."""

    def __init__(self, comm: Any, dimension: int) -> None:
        super().__init__(comm)
        self._dimension = dimension

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        """Return Tᵀ K T."""
        P = as_petsc(T).mat
        A = as_petsc(K).mat
        rows = self._find_changed_rows(P, A)
        if total(self.comm, len(rows)) > 0.5 * A.getSize()[0]:
            return self.store(triple_product(A, P))
        first, last = A.getOwnershipRange()
        chosen = PETSc.IS().createGeneral((first + rows).astype(PETSc.IntType), comm=A.comm)
        every = PETSc.IS().createStride(last - first, first, 1, comm=A.comm)
        before = A.createSubMatrix(chosen, every)
        moved = before.matMult(P)
        product = P.createSubMatrix(chosen, chosen).transposeMatMult(moved)
        part = product.duplicate(copy=True)
        alike = all(map(np.array_equal, before.getValuesCSR()[:2], part.getValuesCSR()[:2]))
        del A, before, moved, product
        give_back(self.comm.mpi)
        return Replaced(as_petsc(K), rows, part, alike=not largest(self.comm, not alike))

    def store(self, mat: Any) -> PetscMatrix:
        """Return the matrix stored compactly; the given one is destroyed."""
        give_back(self.comm.mpi)
        rows = rows_of(mat)
        first = mat.getOwnershipRange()[0]
        width = self._dimension
        n, size = rows.shape
        kind = PETSc.IntType
        mat.destroy()
        odd, wasted = self.comm.sum(
            np.array([n % width, 0.0 if n % width or size % width else _count_waste(rows, width)])
        )
        if odd or wasted > 0.0:
            width = 1
            kept = rows.data != 0.0
            every = np.arange(n, dtype=kind)
            # and the diagonal, as PETSc expects
            row = np.append(np.repeat(every, np.diff(rows.indptr))[kept], every)
            values = np.append(rows.data[kept], np.zeros(n))
            columns = np.append(rows.indices[kept], first + every)
            del rows
            rows = sp.csr_matrix((values, (row, columns)), shape=(n, size))
            del values, row, columns, kept
        ends, columns, values = upper_blocks(rows, width, first)
        del rows
        arrays = (ends.astype(kind), columns.astype(kind), values)
        made = PETSc.Mat().createSBAIJ(
            ((n, None), (n, None)), width, csr=arrays, comm=self.comm.mpi
        )
        made.assemble()
        del arrays, ends, columns, values
        give_back(self.comm.mpi)
        return Half(made)

    def _find_changed_rows(self, P: Any, A: Any) -> Indices:
        """Return the owned rows in which PᵀAP may differ from A, ascending. Collective."""
        rows = rows_of(P)
        first = P.getOwnershipRange()[0]
        changed = np.flatnonzero(np.diff(sp.csr_matrix(rows - sp.eye(*rows.shape, k=first)).indptr))
        reached = [self.entries(PetscMatrix(one), changed).indices for one in (P, A)]
        columns = np.unique(np.concatenate([first + changed, *reached])).astype(PETSc.IntType)
        marks = A.createVecLeft()
        marks.setValues(columns, np.ones(len(columns)))
        marks.assemble()
        return np.flatnonzero(marks.array_r)


def algebra_for(
    comm: Any, dimension: int, unknowns: int, *, symmetric: bool = True
) -> PetscAlgebra:
    """Return the algebra for the matrices of a body of this size.

    Args:
        comm: the communicator.
        dimension: unknowns of a node.
        unknowns: how many there are on all ranks.
        symmetric: whether all matrices are.
    """
    if not symmetric:
        return UnsymmetricAlgebra(comm)
    return (
        CompactAlgebra(comm, dimension)
        if dimension == 3 and unknowns >= COMPACT
        else PetscAlgebra(comm)
    )


def _count_waste(rows: sp.csr_matrix, width: int) -> float:
    """Return how many of the entries in blocks are too many, by some nodes all over the rows.

    ``width``: unknowns of a node, which a block is of.
    """
    nodes = (
        np.unique(np.linspace(0, rows.shape[0] // width - 1, SAMPLE).astype(int))
        if rows.shape[0]
        else []
    )
    some = rows[(width * np.asarray(nodes, dtype=int)[:, None] + np.arange(width)).ravel()]
    return float(some.tobsr((width, width)).nnz - WASTE * np.count_nonzero(some.data))
