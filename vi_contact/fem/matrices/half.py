"""Store the symmetric matrices of large systems compactly: a half, and rows that a basis changed.

Half of K in blocks of nodes takes 0.2 kB an unknown on tetrahedra where AIJ takes 0.53, and its
product half the time; of M, whose components are not coupled along the axes, only what is not zero
is stored. A change of basis that is the identity but for the contact nodes changes few rows: the
others are shared with the matrix it was made from.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Indices, Matrix, largest, take_upper_blocks, total
from ..mesh.communicators import give_back
from .petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra, as_petsc, triple_product
from .petsc_rows import aij_of, rows_of

COMPACT = 20_000  # unknowns in space from which on it pays: those that are solved iteratively
WASTE = 1.8  # entries of blocks over those that are not zero: with more, no blocks
SAMPLE = 1000  # nodes at which these are counted


class Half(PetscMatrix):
    """Hold the upper half of a symmetric matrix, in blocks of nodes (PETSc's SBAIJ)."""

    @property
    def mat(self) -> Any:
        """Return the whole matrix, made anew."""
        whole = self.stored.convert("aij", PETSc.Mat())
        whole.setBlockSize(1)
        return whole

    def transpose_apply(self, x: Array) -> Array:
        """Return A x, which is Aᵀ x."""
        return self @ x


class Replaced(PetscMatrix):
    """Hold a symmetric matrix that is another one, ``base``, but for some owned rows."""

    def __init__(self, base: PetscMatrix, rows: Indices, part: Any, alike: bool) -> None:
        """Hold base and the rows that differ.

        Args:
            base: the other matrix, which is shared and not copied.
            rows: (k,) which owned rows differ, counted from 0 on this rank.
            part: (k owned rows, all columns) these rows, an AIJ matrix.
            alike: whether their entries are at the places of those of base, on all ranks.
        """
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
        if whole is self._base.stored:
            whole = whole.copy()
        # entries at the places of others are written over them; else the rows are stacked anew
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
        # of the entries of the changed rows, those whose column is their row; rows without a
        # diagonal entry have zero
        part = rows_of(self.stored)
        row = np.repeat(self._rows, np.diff(part.indptr))
        own = part.indices == self.stored.getOwnershipRangeColumn()[0] + row
        values[self._rows] = 0.0
        values[row[own]] = part.data[own]
        return values


class CompactAlgebra(PetscAlgebra):
    """Make compact matrices of symmetric ones; nodes have ``dimension`` unknowns."""

    keeps_whole = False

    def __init__(self, comm: Any, dimension: int) -> None:
        super().__init__(comm)
        self._dimension = dimension

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        """Return Tᵀ K T, which shares the rows with K that T leaves as they are. Collective."""
        P = as_petsc(T).mat
        A = as_petsc(K).mat
        rows = self._find_changed_rows(P, A)
        if total(self.comm, len(rows)) > 0.5 * A.getSize()[0]:
            return self.store(triple_product(A, P))
        # of the rows c that change, (Pᵀ A P)_c = (P_cc)ᵀ A_c P: P is the identity beside them
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
        """Return the matrix stored compactly; ``mat`` is destroyed. Collective.

        Arrays are let go as soon as they have been read: at this place a large run takes the most
        memory.

        Args:
            mat: a symmetric PETSc matrix, AIJ, that nobody else needs.
        """
        give_back(self.comm.mpi)
        rows = rows_of(mat)
        first = mat.getOwnershipRange()[0]
        width = self._dimension
        n, size = rows.shape
        kind = PETSc.IntType
        mat.destroy()

        # blocks of nodes, where every node has all its unknowns here and few entries are zeros
        divides = n % width == 0 and size % width == 0
        odd, wasted = self.comm.sum(
            np.array([n % width, _count_waste(rows, width) if divides else 0.0])
        )
        if odd or wasted > 0.0:
            # else single entries: those that are not zero, and the diagonal, as PETSc expects
            width = 1
            used = rows.data != 0.0
            every = np.arange(n, dtype=kind)
            row = np.append(np.repeat(every, np.diff(rows.indptr))[used], every)
            values = np.append(rows.data[used], np.zeros(n))
            columns = np.append(rows.indices[used], first + every)
            del rows
            rows = sp.csr_matrix((values, (row, columns)), shape=(n, size))
            del values, row, columns, used

        # the upper half of these blocks, on all ranks of one width
        ends, columns, values = take_upper_blocks(rows, width, first)
        del rows
        arrays = (ends.astype(kind), columns.astype(kind), values)
        half = PETSc.Mat().createSBAIJ(
            ((n, None), (n, None)), width, csr=arrays, comm=self.comm.mpi
        )
        half.assemble()
        del arrays, ends, columns, values
        give_back(self.comm.mpi)
        return Half(half)

    def _find_changed_rows(self, P: Any, A: Any) -> Indices:
        """Return the owned rows in which PᵀAP may differ from A, ascending. Collective.

        These are the rows in which P is not the identity, the columns that these rows of P have,
        and, as A is symmetric, the rows that A couples with them.
        """
        rows = rows_of(P)
        first = P.getOwnershipRange()[0]
        changed = np.flatnonzero(np.diff(sp.csr_matrix(rows - sp.eye(*rows.shape, k=first)).indptr))
        reached = [self.entries(PetscMatrix(matrix), changed).indices for matrix in (P, A)]
        columns = np.unique(np.concatenate([first + changed, *reached])).astype(PETSc.IntType)
        # rows of any rank are marked by the ranks that reach them
        marks = A.createVecLeft()
        marks.setValues(columns, np.ones(len(columns)))
        marks.assemble()
        return np.flatnonzero(marks.array_r)


def algebra_for(
    comm: Any, dimension: int, unknowns: int, *, symmetric: bool = True
) -> PetscAlgebra:
    """Return the algebra that stores the matrices of a body of this size best.

    Args:
        comm: the communicator.
        dimension: unknowns of a node.
        unknowns: how many there are on all ranks.
        symmetric: whether all matrices are.
    """
    if not symmetric:
        return UnsymmetricAlgebra(comm)
    if dimension == 3 and unknowns >= COMPACT:
        return CompactAlgebra(comm, dimension)
    return PetscAlgebra(comm)


def _count_waste(rows: sp.csr_matrix, width: int) -> float:
    """Return how many entries blocks would have beyond ``WASTE`` times those that are not zero.

    At most ``SAMPLE`` nodes all over the rows are counted. Blocks pay where the sum over all ranks
    is not above zero.

    Args:
        rows: (n, columns of all ranks) owned rows.
        width: unknowns of a node, the size of a block.
    """
    nodes = np.zeros(0, dtype=int)
    if rows.shape[0]:
        nodes = np.unique(np.linspace(0, rows.shape[0] // width - 1, SAMPLE).astype(int))
    sample = rows[(width * nodes[:, None] + np.arange(width)).ravel()]
    return float(sample.tobsr((width, width)).nnz - WASTE * np.count_nonzero(sample.data))
