"""Factorise P A Pᵀ = L Lᵀ with given unknowns c last, by CHOLMOD; METIS orders the rest i, or AMD.

    L = (L_ii    0  )      y = L⁻¹ P b, one forward substitution:    x_c = L_cc⁻ᵀ y_c,
        (L_ci  L_cc )      and after it one backward substitution:   x_i = L_ii⁻ᵀ (y_i - L_ciᵀ x_c)

L_cc L_ccᵀ is A condensed onto c (the Schur complement), so its inverse is the block c of A⁻¹, and any x_c that contact
asks for may be put in between the two substitutions: with it the rest is in equilibrium.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import blas

from .algebra import Array, Indices

FORWARD, BACKWARD = 4, 5  # CHOLMOD_L and CHOLMOD_Lt of cholmod.h
FEW_ROWS = 5_000  # below, minimum degree fills as little as METIS, in a quarter of the time
SHORT_COLUMNS = 120.0  # entries of L a column: 2D has fewer, and is substituted column by column, 3D by supernodes


class ContactLast:
    """Hold the factor of a symmetric positive definite matrix, with the unknowns ``last`` in the last rows of L.

    Every rank may hold a copy of it: ``whole`` gathers a vector of owned entries, ``mine`` are the owned rows. Vectors
    of c are in the order of ``last``. ``corner``: L_cc, lower triangular.
    """

    def __init__(
        self, library: Any, A: sp.csr_matrix, last: Indices, *, whole: Callable[[Array], Array] | None = None,
        mine: slice = slice(None),
    ) -> None:
        """Factorise; ArithmeticError when A is not positive definite, or too large for 32 bits."""
        self._library, self._whole, self._mine = library, whole, mine
        self.rows, A = A.shape[0], _readable(A)
        self._inner = inner = self.rows - len(last)
        self._order = _order(library, A, np.asarray(last))
        factor = _factorise(library, A, self._order)
        self._y = np.zeros(self.rows)
        self._c = self._y[inner:]
        self.corner: Array = np.zeros((len(last), len(last)), order="F")
        entries = library.columns(factor, inner, None, None, None, None)
        self._columns: tuple[NDArray[Any], ...] = ()
        if entries <= SHORT_COLUMNS * max(inner, 1):
            starts, rows, values = np.empty(inner + 1, np.int64), np.empty(entries, np.int32), np.empty(entries)
            library.columns(factor, inner, _at(starts), _at(rows), _at(values), _at(self.corner))
            library.release(factor)
            self._columns = starts, rows, values
            self._arguments = (inner, _at(starts), _at(rows), _at(values), _at(self._y))
        else:
            library.columns(factor, inner, None, None, None, _at(self.corner))
            self._factor = factor
            weakref.finalize(self, library.release, factor)
        self.bytes = 12.0 * entries + 8.0 * self.corner.size

    def forward(self, b: Array) -> Array:
        """Return y_c of the load b; y_i is kept for ``backward``. Collective."""
        (b if self._whole is None else self._whole(b)).take(self._order, out=self._y, mode="clip")
        if self._columns:
            self._library.forward(*self._arguments)
            return self.reduced(self._c)
        self._substitute(FORWARD)
        return self._c.copy()

    def backward(self, x_c: Array) -> Array:
        """Return x, the owned entries, whose contact unknowns are exactly x_c and the others in equilibrium with them
        under the load of the last ``forward``."""
        if self._columns:
            self._c[:] = x_c
            self._library.backward(*self._arguments)
        else:
            self._c[:] = blas.dtrmv(self.corner, x_c, lower=1, trans=1) if len(x_c) else x_c
            self._substitute(BACKWARD)
            self._c[:] = x_c
        x = np.empty(self.rows)
        x[self._order] = self._y
        return x if self._whole is None else x[self._mine].copy()

    def unloaded(self) -> None:
        """Forget the load: that of the next ``backward`` is zero."""
        self._y[:] = 0.0

    def free(self, y_c: Array) -> Array:
        """Return x_c = L_cc⁻ᵀ y_c."""
        return np.asarray(blas.dtrsv(self.corner, y_c, lower=1, trans=1)) if len(y_c) else y_c

    def reduced(self, r_c: Array) -> Array:
        """Return L_cc⁻¹ r_c, by which a force on the contact unknowns changes y_c."""
        return np.asarray(blas.dtrsv(self.corner, r_c, lower=1)) if len(r_c) else r_c.copy()

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b. Collective."""
        return self.backward(self.free(self.forward(b)))

    def _substitute(self, system: int) -> None:
        if self._library.substitute(self._factor, system, _at(self._y)):
            raise MemoryError("CHOLMOD has no memory left for a substitution")


def _order(library: Any, A: sp.csr_matrix, last: Indices) -> NDArray[np.int32]:
    """The rows of A in the order of elimination."""
    inner = np.ones(A.shape[0], dtype=bool)
    inner[last] = False
    rows, dissect = np.flatnonzero(inner), len(inner) > FEW_ROWS
    among, found = np.full(len(inner), -1, dtype=np.int32), np.empty(len(rows), dtype=np.int32)
    among[rows] = np.arange(len(rows))
    for way in (dissect, False):  # a CHOLMOD without METIS has minimum degree
        if not library.order(len(inner), _at(A.indptr), _at(A.indices), _at(among), way, _at(found)):
            return np.concatenate([rows[found], last]).astype(np.int32)
    raise ArithmeticError("CHOLMOD cannot order the matrix")


def _factorise(library: Any, A: sp.csr_matrix, order: NDArray[np.int32]) -> Any:
    made = ctypes.c_void_p()
    arrays = (_at(one) for one in (A.indptr, A.indices, A.data, order))
    if not np.isfinite(A.data).all() or library.factorise(len(order), *arrays, ctypes.byref(made)):
        raise ArithmeticError("CHOLMOD cannot factorise the matrix")
    return made


def _readable(A: sp.csr_matrix) -> sp.csr_matrix:
    """A symmetric matrix with the sorted 32 bit indices that CHOLMOD reads."""
    if A.nnz > np.iinfo(np.int32).max:
        raise ArithmeticError("the matrix has too many entries for 32 bits")
    indices = A.indices.astype(np.int32, copy=False), A.indptr.astype(np.int32, copy=False)
    made = sp.csr_matrix((A.data.astype(float, copy=False), *indices), shape=A.shape)
    return made if made.has_sorted_indices else made.sorted_indices()


def _at(array: NDArray[Any]) -> ctypes.c_void_p:
    """Where an array lies in memory."""
    return ctypes.c_void_p(array.ctypes.data)
