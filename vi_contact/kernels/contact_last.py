"""Factorise P A Pᵀ = L Lᵀ with given unknowns c last, by CHOLMOD; METIS orders the rest i, or AMD.

    L = (L_ii    0  )      y = L⁻¹ P b, one forward substitution:    x_c = L_cc⁻ᵀ y_c,
        (L_ci  L_cc )      and after it one backward substitution:   x_i = L_ii⁻ᵀ (y_i - L_ciᵀ x_c)

L_cc L_ccᵀ is A condensed onto c (the Schur complement), so its inverse is the block c of A⁻¹, and
any x_c that contact asks for may be put in between the two substitutions: with it the rest is in
equilibrium.

Loads, answers and contact values may also be of several runs, a row for each: L is then read once
for eight of them.
"""

import ctypes
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import blas

from ..core.algebra import Array, Indices
from .compiler import locate_arrays

FORWARD = 4  # CHOLMOD_L of cholmod.h: a substitution with L
BACKWARD = 5  # CHOLMOD_Lt: one with Lᵀ
FEW_ROWS = 5_000  # below, minimum degree fills as little as METIS, in a quarter of the time
AT_ONCE = 8  # loads that are substituted together
# entries of L a column: 2D has fewer, and is substituted column by column, 3D by supernodes
SHORT_COLUMNS = 120.0


class ContactLast:
    """Hold the factor of a symmetric positive definite matrix, with some unknowns in its last rows.

    Vectors of c are in the order in which ``last`` names the unknowns. Every rank may hold a copy
    of the factor.

    Attributes:
        rows: number of unknowns of all ranks.
        corner: L_cc, lower triangular (m, m).
        bytes: memory of the factor.
    """

    def __init__(
        self,
        library: Any,
        A: sp.csr_matrix,
        last: Indices,
        *,
        whole: Callable[[Array], Array] | None = None,
        mine: slice = slice(None),
    ) -> None:
        """Factorise.

        Args:
            library: the compiled functions (``compiler.load_cholmod``).
            A: the whole matrix (rows, rows).
            last: (m,), the unknowns c.
            whole: gathers a vector of owned entries on every rank; None on one rank.
            mine: the rows that this rank owns.

        Raises:
            ArithmeticError: A is not positive definite, or too large for 32 bits.
        """
        A = _with_short_indices(A)
        self._library = library
        self._whole = whole
        self._mine = mine
        self.rows = A.shape[0]
        inner = self.rows - len(last)
        self._inner = inner
        self._order = _order(library, A, np.asarray(last))
        factor = _factorise(library, A, self._order)
        self._y = np.zeros(self.rows)
        self._c = self._y[inner:]  # a view: y_c, or x_c between the substitutions
        self._many = np.zeros(0)
        self.corner: Array = np.zeros((len(last), len(last)), order="F")

        # Short columns of L are copied out of CHOLMOD's supernodes, which are then freed: without
        # the zeros that supernodes store a substitution reads less memory. Long columns stay where
        # they are, as dense blocks are faster there; only the corner is copied.
        entries = library.columns(factor, inner, None, None, None, None)
        self._columns: tuple[NDArray[Any], ...] = ()
        if entries <= SHORT_COLUMNS * max(inner, 1):
            self._copy_columns(factor, entries)
            library.release(factor)
        else:
            library.columns(factor, inner, None, None, None, *locate_arrays(self.corner))
            self._factor = factor
            weakref.finalize(self, library.release, factor)
        self.bytes = 12.0 * entries + 8.0 * self.corner.size

    def _copy_columns(self, factor: Any, entries: int) -> None:
        """Copy L column by column: without the zeros that supernodes store."""
        starts = np.empty(self._inner + 1, np.int64)
        rows = np.empty(entries, np.int32)
        values = np.empty(entries)
        to = locate_arrays(starts, rows, values, self.corner)
        self._library.columns(factor, self._inner, *to)
        self._columns = starts, rows, values
        self._arguments = (self._inner, *locate_arrays(starts, rows, values, self._y))

    def forward(self, b: Array) -> Array:
        """Return y_c of the load b; y_i is kept for ``backward``. Collective.

        Args:
            b: owned entries (n,) of a load, or rows (k, rows) of several on one rank.
        """
        if b.ndim == 2:
            return self._forward_many(b)
        load = b if self._whole is None else self._whole(b)
        load.take(self._order, out=self._y, mode="clip")
        if self._columns:
            # It substitutes with the columns of i. What is left at c is still a load on the
            # condensed matrix: the corner comes after it.
            self._library.forward(*self._arguments)
            return self.reduce(self._c)
        self._substitute(FORWARD)
        return self._c.copy()

    def backward(self, x_c: Array) -> Array:
        """Return x, the owned entries, whose contact unknowns are exactly x_c.

        The other unknowns are in equilibrium with them under the load of the last ``forward``.

        Args:
            x_c: (m,) values of c, or rows (k, m) after ``forward`` of as many loads.
        """
        if x_c.ndim == 2:
            return self._backward_many(x_c)
        if self._columns:
            # The compiled function starts above the corner: it reads x_c and leaves it as it is.
            self._c[:] = x_c
            self._library.backward(*self._arguments)
        else:
            # CHOLMOD substitutes with all of Lᵀ: given L_ccᵀ x_c it finds x_c, up to rounding.
            self._c[:] = blas.dtrmv(self.corner, x_c, lower=1, trans=1) if len(x_c) else x_c
            self._substitute(BACKWARD)
            self._c[:] = x_c
        x = np.empty(self.rows)
        x[self._order] = self._y
        return x if self._whole is None else x[self._mine].copy()

    def forget_load(self) -> None:
        """Forget the load: that of the next ``backward`` is zero."""
        self._y[:] = 0.0

    def solve_corner(self, y_c: Array) -> Array:
        """Return x_c = L_cc⁻ᵀ y_c."""
        if y_c.ndim == 2:
            return _multiply_rows(blas.dtrsm, self.corner, y_c, trans=1)
        return np.asarray(blas.dtrsv(self.corner, y_c, lower=1, trans=1)) if len(y_c) else y_c

    def reduce(self, r_c: Array) -> Array:
        """Return L_cc⁻¹ r_c, by which a force on the contact unknowns changes y_c."""
        if r_c.ndim == 2:
            return _multiply_rows(blas.dtrsm, self.corner, r_c)
        return np.asarray(blas.dtrsv(self.corner, r_c, lower=1)) if len(r_c) else r_c.copy()

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b. Collective."""
        return self.backward(self.solve_corner(self.forward(b)))

    def _substitute(self, system: int, y: Array | None = None) -> None:
        """Substitute by supernodes, forward or backward, in place."""
        y = self._y if y is None else y
        (place,) = locate_arrays(y)
        if self._library.substitute(self._factor, system, y.size // self.rows, place):
            raise MemoryError("CHOLMOD has no memory left for a substitution")

    def _forward_many(self, b: Array) -> Array:
        """Return y_c (k, m) of loads (k, rows), on one rank."""
        if not self._columns:
            self._many = np.take(b, self._order, axis=1)
            self._substitute(FORWARD, self._many)
            return self._many[:, self._inner :].copy()

        # Room for the loads side by side, in groups of ``AT_ONCE``, the last of which may be partly
        # empty.
        room = self.rows * AT_ONCE * (1 + len(b) // AT_ONCE)
        if self._many.size != room:
            self._many = np.empty(room)
            self._constant = (self.rows, *self._arguments[:-1], *locate_arrays(self._order))
        b = np.ascontiguousarray(b)
        y_c = np.empty((len(b), len(self._c)))
        self._library.forward_many(len(b), *self._constant, *locate_arrays(b, self._many, y_c))
        return self.reduce(y_c)

    def _backward_many(self, x_c: Array) -> Array:
        """Return x (k, rows) with contact unknowns x_c (k, m), on one rank."""
        x_c = np.ascontiguousarray(x_c)
        x = np.empty((len(x_c), self.rows))
        if self._columns:
            self._library.backward_many(len(x), *self._constant, *locate_arrays(x_c, self._many, x))
            return x
        self._many[:, self._inner :] = _multiply_rows(blas.dtrmm, self.corner, x_c, trans=1)
        self._substitute(BACKWARD, self._many)
        self._many[:, self._inner :] = x_c
        x[:, self._order] = self._many
        return x


def _multiply_rows(routine: Any, corner: Array, rows: Array, trans: int = 0) -> Array:
    """Return what a routine of BLAS makes of the triangle and of every row.

    Args:
        routine: dtrsm, which solves, or dtrmm, which multiplies.
        corner: lower triangular (m, m).
        rows: (k, m).
        trans: 1 for the transposed triangle.
    """
    if not rows.size:
        return rows.copy()
    return np.asarray(routine(1.0, corner, rows.T, lower=1, trans_a=trans).T)


def _order(library: Any, A: sp.csr_matrix, last: Indices) -> NDArray[np.int32]:
    """Return the rows of A in the order of elimination: those of little fill, then ``last``.

    Args:
        library: the compiled functions.
        A: the whole matrix (rows, rows).
        last: (m,) the unknowns c, which keep their order.

    Raises:
        ArithmeticError: CHOLMOD finds no order.
    """
    # CHOLMOD orders the rows i alone, in numbers of their own.
    is_inner = np.ones(A.shape[0], dtype=bool)
    is_inner[last] = False
    inner = np.flatnonzero(is_inner)
    number = np.full(len(is_inner), -1, dtype=np.int32)  # among the inner rows
    number[inner] = np.arange(len(inner))
    order = np.empty(len(inner), dtype=np.int32)
    arrays = locate_arrays(A.indptr, A.indices, number)
    dissect = len(is_inner) > FEW_ROWS
    for by_metis in (dissect, False):  # a CHOLMOD without METIS has minimum degree
        if not library.order(len(is_inner), *arrays, by_metis, *locate_arrays(order)):
            return np.concatenate([inner[order], last]).astype(np.int32)
    raise ArithmeticError("CHOLMOD cannot order the matrix")


def _factorise(library: Any, A: sp.csr_matrix, order: NDArray[np.int32]) -> Any:
    """Return the factor, an object of the library.

    Args:
        library: the compiled functions.
        A: the whole matrix (rows, rows).
        order: (rows,) the order of elimination.

    Raises:
        ArithmeticError: A has entries that are not finite, or is not positive definite.
    """
    factor = ctypes.c_void_p()
    arrays = locate_arrays(A.indptr, A.indices, A.data, order)
    is_finite = np.isfinite(A.data).all()
    if not is_finite or library.factorise(len(order), *arrays, ctypes.byref(factor)):
        raise ArithmeticError("CHOLMOD cannot factorise the matrix")
    return factor


def _with_short_indices(A: sp.csr_matrix) -> sp.csr_matrix:
    """Return a symmetric matrix with the sorted 32 bit indices that CHOLMOD reads."""
    if A.nnz > np.iinfo(np.int32).max:
        raise ArithmeticError("the matrix has too many entries for 32 bits")
    values = A.data.astype(float, copy=False)
    indices = A.indices.astype(np.int32, copy=False)
    starts = A.indptr.astype(np.int32, copy=False)
    short = sp.csr_matrix((values, indices, starts), shape=A.shape)
    return short if short.has_sorted_indices else short.sorted_indices()
