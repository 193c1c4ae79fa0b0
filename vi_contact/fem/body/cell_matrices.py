"""Add up the matrices of cells to the matrix of a body, again and again on one pattern."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Indices
from ..matrices.petsc_rows import aij_of
from ..mesh.communicators import MpiComm


class CellMatrices:
    """Know where the entries of the matrices of all owned cells go."""

    def __init__(self, dofs: Indices, numbers: Indices, rows: int, comm: MpiComm) -> None:
        """Find the pattern. Collective.

        Args:
            dofs: (cells, k) local component of each row and column of a cell's matrix.
            numbers: row of all ranks of each local component, -1 for one that is left out.
            rows: how many rows this rank owns.
            comm: of the matrix.
        """
        self._comm = comm
        self._rows = rows
        size = int(comm.mpi.allreduce(rows))
        of_cell = numbers[dofs]
        k = dofs.shape[1]
        row = np.repeat(of_cell, k, axis=1).ravel()
        column = np.tile(of_cell, (1, k)).ravel()

        # Each pair of a row and a column has one place; the last place takes what is left out.
        key = np.where((row >= 0) & (column >= 0), row * size + column, size * size)
        places, self._place = np.unique(key, return_inverse=True)
        places = places[places < size * size]
        self._count = len(places)
        kind = PETSc.IntType
        self._columns = (places % size).astype(kind)
        named, counts = np.unique(places // size, return_counts=True)
        self._named = named.astype(kind)
        self._ends = np.concatenate([[0], np.cumsum(counts)]).astype(kind)
        self._pattern: Any = None

    @property
    def bytes(self) -> int:
        """Return the bytes of the pattern on this rank."""
        return self._place.nbytes + self._columns.nbytes + self._named.nbytes + self._ends.nbytes

    def add_up(self, matrices: Array) -> Any:
        """Return the PETSc matrix of the sum of matrices (cells, k, k). Collective."""
        values = np.bincount(self._place, matrices.ravel(), self._count + 1)[: self._count]
        if self._comm.size == 1:
            ends = np.zeros(self._rows + 1, dtype=PETSc.IntType)
            ends[self._named + 1] = np.diff(self._ends)
            shape = (self._rows, self._rows)
            return aij_of(
                sp.csr_matrix((values, self._columns, np.cumsum(ends)), shape=shape),
                self._comm.mpi,
            )
        if self._pattern is None:
            self._pattern = self._make_pattern()
        mat = self._pattern.duplicate()
        mat.setValuesIJV(
            self._ends,
            self._columns,
            values,
            addv=PETSc.InsertMode.ADD_VALUES,
            rowmap=self._named,
        )
        mat.assemble()
        return mat

    def _make_pattern(self) -> Any:
        """Return a matrix of zeros with all entries, those of other ranks' cells too. Collective.

        A row has its entries from the cells of several ranks: they are sent to its owner once.
        """
        mpi = self._comm.mpi
        firsts = np.array(mpi.allgather(self._rows)).cumsum()
        owner = np.searchsorted(firsts, self._named, side="right")
        parts = []
        for rank in range(self._comm.size):
            chosen = np.flatnonzero(owner == rank)
            counts = np.diff(self._ends)[chosen]
            spans = [self._columns[self._ends[i] : self._ends[i + 1]] for i in chosen]
            columns = np.concatenate(spans) if spans else self._columns[:0]
            parts.append((np.repeat(self._named[chosen], counts), columns))
        received = mpi.alltoall(parts)
        row = np.concatenate([part[0] for part in received]) - (firsts[mpi.rank] - self._rows)
        column = np.concatenate([part[1] for part in received])
        shape = (self._rows, int(firsts[-1]))
        entries = sp.csr_matrix((np.zeros(len(row)), (row, column)), shape=shape)
        return aij_of(entries, mpi)
