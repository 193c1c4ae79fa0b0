"""Factorise PETSc matrices with contact unknowns last.

This is done by CHOLMOD, with a whole copy of the factor on every rank.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, SerialComm, largest
from ...kernels.compiler import load_cholmod, load_loops, locate_arrays
from ...kernels.contact_last import AT_ONCE, ContactLast
from .petsc_rows import rows_of


def contact_last(comm: Any, mat: Any, last: Indices) -> ContactLast | None:
    """Return the factor of an AIJ matrix on an MpiComm. Collective.

    It is None without CHOLMOD, and where it cannot: not positive definite, which PETSc says better,
    or too large.

    Args:
        comm: the ranks.
        mat: the PETSc matrix.
        last: owned unknowns that come last.
    """
    functions = load_cholmod(comm)
    if functions is None:
        return None
    rows = rows_of(mat)
    made = None
    try:
        if comm.size == 1:
            made = ContactLast(functions, rows, last)
        else:
            whole = sp.vstack(comm.mpi.allgather(rows), format="csr")
            first = mat.getOwnershipRange()
            made = ContactLast(
                functions, whole, last, whole=_gathering(comm.mpi, mat), mine=slice(*first)
            )
    except ArithmeticError:
        pass
    return None if largest(comm, made is None) else made


def product_of_rows(matrix: Any) -> Callable[[Array], Array]:
    """Return what multiplies a matrix on one rank with every row of x.

    It reads the matrix once for eight of them.
    """
    functions = load_loops(SerialComm())
    A = rows_of(matrix.mat)
    n = matrix.rows
    if functions is None or A.indices.dtype != np.int32:
        return lambda x: np.stack([matrix @ row for row in x])
    kept = A.indptr, A.indices, A.data, np.empty(AT_ONCE * n)
    *before, room = locate_arrays(*kept)

    def product(x: Array, _: Any = kept) -> Array:  # which holds what lies there
        x, made = np.ascontiguousarray(x), np.empty(x.shape)
        b, out = locate_arrays(x, made)
        functions.product_many(len(x), n, *before, b, room, out)
        return made

    return product


def _gathering(mpi: Any, mat: Any) -> Callable[[Array], Array]:
    """Return what gathers the owned entries of a vector, into one array again and again."""
    ends = mat.getOwnershipRanges()
    counts = np.diff(ends)
    x = np.empty(ends[-1])

    def whole(b: Array) -> Array:
        mpi.Allgatherv(np.ascontiguousarray(b), [x, counts])
        return x

    return whole
