"""Do linear algebra on distributed vectors, seen as numpy arrays of the entries this rank owns.

Everything above this file (schemes, condensed solver, recorders) is written against the protocols
below and never asks how many ranks there are. ``SerialAlgebra`` (scipy) serves one process and
needs no finite element package; ``fem.matrices`` serves any number of ranks. Rules: a vector
is the float64 array of its owned entries; scalars returned by ``dot`` and by ``Comm`` are the same
number on every rank.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol, SupportsFloat

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

BATCH = 10_000  # nodes whose rows are put into blocks at a time: bounds the memory
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]


def max_abs(x: Array) -> float:
    """Return max |x| over the entries of this rank, 0 for none; NaN stays NaN."""
    # numpy finds the places of the extremes faster than the extremes themselves
    return float(max(x.item(x.argmax()), -x.item(x.argmin()))) if x.size else 0.0


def lowest(x: Array) -> float:
    """Return how far the smallest entry is below zero, 0 if it is not; NaN stays NaN."""
    return -min(x.item(x.argmin()), 0.0) if x.size else 0.0


class Comm(Protocol):
    """Provide the few collective operations that the package needs."""

    rank: int
    size: int

    def sum(self, x: Array) -> Array:
        """Return the sum of x over the ranks, entry by entry, the same on every rank."""

    def max(self, x: Array) -> Array:
        """Return the largest x of the ranks, entry by entry, the same on every rank."""

    def bcast(self, value: Any) -> Any:
        """Return the value of rank 0 on every rank."""

    def gather(self, value: Any) -> list[Any] | None:
        """Return the values of all ranks, in their order, on rank 0; None on the others."""


def largest(comm: Comm, value: SupportsFloat) -> float:
    """Return the largest of the ranks' values, the same on every rank. Collective.

    Of truth values it is 1 where one rank says True.
    """
    return float(value) if comm.size == 1 else float(comm.max(np.array([float(value)]))[0])


def total(comm: Comm, value: SupportsFloat) -> float:
    """Return the sum of the ranks' values, the same on every rank. Collective."""
    return float(value) if comm.size == 1 else float(comm.sum(np.array([float(value)]))[0])


def from_each(comm: Comm, value: Any) -> list[Any]:
    """Return the values of all ranks, in their order, on every rank. Collective."""
    return comm.bcast(comm.gather(value))


def on_first(comm: Comm, numbers: Indices, rows: Any) -> Any:
    """Return the rows of all ranks, by their numbers, on rank 0. Collective.

    Args:
        comm: the ranks.
        numbers: (m,) those of the rows of this rank, among all from 0 on.
        rows: (m, …) the rows of this rank.

    Returns:
        On rank 0 an array (total, …); on the others one without rows.
    """
    parts = comm.gather((numbers, rows))
    if parts is None:
        return rows[:0]
    all_numbers = np.concatenate([part[0] for part in parts])
    all_rows = np.concatenate([part[1] for part in parts])
    in_order = np.empty_like(all_rows)
    in_order[all_numbers] = all_rows
    return in_order


class Matrix(Protocol):
    """Provide products with a square sparse matrix, distributed like the vectors it multiplies."""

    @property
    def rows(self) -> int:
        """Return how many rows this rank owns."""

    def __matmul__(self, x: Array) -> Array: ...
    def transpose_apply(self, x: Array) -> Array:
        """Return Aᵀ x."""

    def diagonal(self) -> Array:
        """Return the diagonal entries of the owned rows."""


def expect_products(*matrices: Matrix | None) -> None:
    """Tell matrices that many products follow, so that those of PETSc choose their format."""
    for matrix in matrices:
        tell = getattr(matrix, "expect_products", None)
        if tell is not None:
            tell()


class Factor(Protocol):
    """Hold a factorised symmetric matrix; ``solve`` is one forward and back substitution."""

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b."""

    def solve_units(
        self, owned: Indices, slots: Indices, m: int, rows: Indices | None = None
    ) -> Array:
        """Return the columns A⁻¹ e_j of m unit vectors, one for each contact condition. Collective.

        Args:
            owned: (k,) rows of this rank in which unit vectors have their ones.
            slots: (k,) the numbers j of these vectors.
            m: number of the vectors on all ranks.
            rows: which owned rows to return, for the whole may not fit the memory; None for all.

        Returns:
            The owned rows (rows, m) of the columns, or those that were asked for.
        """


class Algebra(Protocol):
    """Make matrices out of M, C, K and their combinations.

    Attributes:
        symmetric: whether all of them are.
    """

    symmetric: bool

    @property
    def comm(self) -> Comm:
        """Return the ranks that share the matrices."""

    def combine(self, terms: Sequence[tuple[float, Matrix]]) -> Matrix:
        """Return the sum of factor times matrix over the terms (factor, matrix)."""

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        """Return Tᵀ K T."""

    def local(self, rows: Indices, columns: Indices, values: Array, n: int) -> Matrix:
        """Return the matrix of entries between unknowns of one rank.

        Args:
            rows: (k,) the rows of the entries, from 0 to n - 1.
            columns: (k,) their columns.
            values: (k,) their values; entries that are given twice add up.
            n: number of unknowns that this rank owns.
        """

    def with_identity_rows(self, A: Matrix, mask: Mask) -> Matrix:
        """Return A with the rows and columns of masked unknowns (n,) replaced by the identity's."""

    def block(self, A: Matrix, mask: Mask) -> Matrix:
        """Return the rows and columns of A of the masked unknowns (n,), which their ranks own."""

    def first(self, n: int) -> int:
        """Return the number, over all ranks, of the first of the n unknowns of this rank."""

    def entries(self, A: Matrix, rows: Indices) -> sp.csr_matrix:
        """Return rows of A that this rank owns. Collective.

        Args:
            A: the matrix.
            rows: (k,) the owned rows, ascending.

        Returns:
            The rows (k, n of all ranks), their columns numbered over all ranks.
        """

    def replace_identity_rows(self, n: int, rows: Indices, entries: sp.csr_matrix) -> Matrix:
        """Return the identity with some of its rows replaced.

        Args:
            n: number of rows that this rank owns.
            rows: (k,) those that are replaced.
            entries: what stands in them, columns numbered over all ranks.
        """

    def factor(self, A: Matrix) -> Factor:
        """Return a factor of A. Collective."""

    def contact_last(self, A: Matrix, last: Indices) -> Any:
        """Return a factor with some unknowns last, a ``kernels.contact_last.ContactLast``.

        Returns None where ``factor`` serves better, or where there is no such factor. Collective.

        Args:
            A: the matrix.
            last: the unknowns, numbered over all ranks, and the same on every rank.
        """

    def dot(self, x: Array, y: Array) -> float:
        """Return x·y over all ranks."""


class EffectiveMatrix:
    """Hold the matrix A of a step and its factor, as long as dt stays the same.

    Attributes:
        matrix: the matrix A.
        algebra: that of its matrix.
        space: what its unknowns mean (``core.system.Space``); None where that is not known.
        inertia: (m, M) of A = m M + c C + k K; None where that is not known.
    """

    def __init__(
        self,
        matrix: Matrix,
        algebra: Algebra,
        *,
        space: Any = None,
        inertia: tuple[float, Matrix] | None = None,
    ) -> None:
        self.matrix = matrix
        self.algebra = algebra
        self.space = space
        self.inertia = inertia
        self._last: tuple[Indices, Any] | None = None  # unknowns and the factor with them last

    def contact_last(self, last: Indices) -> Any:
        """Return the factor with these unknowns last (see ``Algebra``). Collective.

        Where there is one, it serves as ``factor`` too.
        """
        if self._last is None or not np.array_equal(self._last[0], last):
            factor = self.algebra.contact_last(self.matrix, last)
            self._last = (last, factor)
            if factor is not None:
                self.__dict__.setdefault("factor", factor)
        return self._last[1]

    @cached_property
    def factor(self) -> Factor:
        """Return the one factorisation of A."""
        return self.algebra.factor(self.matrix)

    @property
    def factorised(self) -> bool:
        """Say whether a factor has been made."""
        return "factor" in self.__dict__

    @cached_property
    def largest(self) -> float:
        """Return the largest diagonal entry on any rank, a measure of |A|."""
        return largest(self.algebra.comm, max_abs(self.matrix.diagonal()))

    def __matmul__(self, x: Array) -> Array:
        return self.matrix @ x


def freeze(x: Array) -> Array:
    """Return the array, which nobody can write to from now on."""
    x.flags.writeable = False
    return x


class SerialComm:
    """Serve one process: every collective operation is the identity."""

    rank = 0
    size = 1

    def sum(self, x: Array) -> Array:
        """Return x, the sum over one rank."""
        return x

    def max(self, x: Array) -> Array:
        """Return x, the largest on one rank."""
        return x

    def bcast(self, value: Any) -> Any:
        """Return the value."""
        return value

    def gather(self, value: Any) -> list[Any] | None:
        """Return the value in a list."""
        return [value]


class SerialMatrix:
    """Hold a scipy sparse matrix behind the ``Matrix`` protocol."""

    def __init__(self, matrix: Any) -> None:
        self.csr: sp.csr_matrix = sp.csr_matrix(matrix, dtype=float)

    @property
    def rows(self) -> int:
        """Return how many rows this rank owns."""
        return int(self.csr.shape[0])

    def __matmul__(self, x: Array) -> Array:
        return np.asarray(self.csr @ x)

    def transpose_apply(self, x: Array) -> Array:
        """Return Aᵀ x."""
        return np.asarray(self.csr.T @ x)

    def diagonal(self) -> Array:
        """Return the diagonal entries of the owned rows."""
        return np.asarray(self.csr.diagonal())


class SerialFactor:
    """Factorise by the sparse LU of scipy (SuperLU) with a symmetric ordering.

    Rows are exchanged where a pivot is too small.
    """

    def __init__(self, matrix: SerialMatrix) -> None:
        self._lu = splu(
            matrix.csr.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        self._rows = matrix.rows

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b."""
        return np.asarray(self._lu.solve(b))

    def solve_units(
        self, owned: Indices, slots: Indices, m: int, rows: Indices | None = None
    ) -> Array:
        """Return the columns A⁻¹ e_j of m unit vectors.

        Args:
            owned: (k,) rows in which unit vectors have their ones.
            slots: (k,) the numbers j of these vectors.
            m: number of the vectors.
            rows: which rows to return; None for all.
        """
        units = np.zeros((self._rows, m))
        units[owned, slots] = 1.0
        columns = np.asarray(self._lu.solve(units)) if m else units
        return columns if rows is None else columns[rows]


class SerialAlgebra:
    """Combine matrices of scipy.sparse on one process.

    Solvers that need symmetric ones ask for ``symmetric``.
    """

    def __init__(self, *, symmetric: bool = True) -> None:
        self.comm: Comm = SerialComm()
        self.symmetric = symmetric

    def combine(self, terms: Sequence[tuple[float, Matrix]]) -> Matrix:
        """Return the sum of factor times matrix over the terms (factor, matrix)."""
        return SerialMatrix(sum(factor * serial(matrix).csr for factor, matrix in terms))

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        """Return Tᵀ K T."""
        basis = serial(T).csr
        return SerialMatrix(basis.T @ serial(K).csr @ basis)

    def local(self, rows: Indices, columns: Indices, values: Array, n: int) -> Matrix:
        """Return the matrix of entries between unknowns.

        Args:
            rows: (k,) the rows of the entries.
            columns: (k,) their columns.
            values: (k,) their values; entries that are given twice add up.
            n: number of unknowns.
        """
        return SerialMatrix(sp.coo_matrix((values, (rows, columns)), shape=(n, n)))

    def with_identity_rows(self, A: Matrix, mask: Mask) -> Matrix:
        """Return A with the rows and columns of masked unknowns replaced by the identity's."""
        free = sp.diags([(~mask).astype(float)], [0])
        return SerialMatrix(free @ serial(A).csr @ free + sp.diags([mask.astype(float)], [0]))

    def block(self, A: Matrix, mask: Mask) -> Matrix:
        """Return the rows and columns of A of the masked unknowns."""
        return SerialMatrix(serial(A).csr[mask][:, mask])

    def first(self, n: int) -> int:
        """Return the number of the first of the n unknowns that this rank owns."""
        return 0

    def entries(self, A: Matrix, rows: Indices) -> sp.csr_matrix:
        """Return these owned rows of A, their columns numbered over all ranks."""
        return serial(A).csr[rows]

    def replace_identity_rows(self, n: int, rows: Indices, entries: sp.csr_matrix) -> Matrix:
        """Return the identity with some of its rows replaced.

        Args:
            n: number of rows.
            rows: (k,) those that are replaced.
            entries: (k, n) what stands in them.
        """
        return SerialMatrix(build_identity_with_rows(n, rows, entries, first=0))

    def factor(self, A: Matrix) -> Factor:
        """Return a factor of A."""
        return SerialFactor(serial(A))

    def contact_last(self, A: Matrix, last: Indices) -> None:
        """Return None: there is no factor with these unknowns last."""
        return None

    def dot(self, x: Array, y: Array) -> float:
        """Return x·y."""
        return float(x @ y)


def serial(matrix: Matrix) -> SerialMatrix:
    """Return the matrix as a SerialMatrix; TypeError when it belongs to another algebra."""
    if not isinstance(matrix, SerialMatrix):
        raise TypeError(f"SerialAlgebra got a {type(matrix).__name__}; give a SerialMatrix")
    return matrix


def take_upper_blocks(
    rows: sp.csr_matrix, width: int, first: int
) -> tuple[Indices, Indices, Array]:
    """Return the upper triangle of a symmetric matrix as blocks, in compressed rows.

    Args:
        rows: the rows of the matrix that this rank owns.
        width: number of unknowns of a node, the size of a block.
        first: number of the first row among those of all ranks.

    Returns:
        Where the blocks of each block row end (rows / width + 1,), their columns (k,) and their
        values (k, width, width).
    """
    counts = [np.zeros(1, dtype=np.int64)]
    columns = [rows.indices[:0]]
    values = [np.zeros((0, width, width))]

    # Some nodes at a time, so that the blocks of their whole rows need little memory: of these only
    # the upper ones are kept, those from the diagonal block on.
    for start in range(0, rows.shape[0], BATCH * width):
        blocks = rows[start : start + BATCH * width].tobsr((width, width))
        # The blocks come in the order in which the rows of a node name them; PETSc counts on
        # ascending columns on several ranks.
        blocks.sort_indices()
        row = np.repeat(np.arange(len(blocks.indptr) - 1), np.diff(blocks.indptr))
        upper = blocks.indices >= (first + start) // width + row
        counts.append(np.bincount(row[upper], minlength=len(blocks.indptr) - 1))
        columns.append(blocks.indices[upper])
        values.append(blocks.data[upper])
    return np.cumsum(np.concatenate(counts)), np.concatenate(columns), np.concatenate(values)


def build_identity_with_rows(
    n: int, rows: Indices, entries: sp.csr_matrix, *, first: int
) -> sp.coo_matrix:
    """Return rows of the identity, some of them replaced.

    Args:
        n: number of rows.
        rows: (k,) those that are replaced.
        entries: (k, columns) what stands in them.
        first: column in which row 0 of the identity has its one.
    """
    # Entries as (row, column, value): those of the identity first, then those that replace it.
    others = np.setdiff1d(np.arange(n), rows)
    row = np.concatenate([others, np.repeat(rows, np.diff(entries.indptr))])
    column = np.concatenate([first + others, entries.indices])
    values = np.concatenate([np.ones(len(others)), entries.data])
    return sp.coo_matrix((values, (row, column)), shape=(n, entries.shape[1]))
