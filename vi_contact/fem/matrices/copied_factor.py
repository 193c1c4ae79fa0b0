"""Factorise PETSc matrices by CHOLMOD, contact unknowns last, with a whole copy on every rank.

``kernels.contact_last`` holds the factor, and says why contact unknowns come last. On several ranks
each gathers the whole matrix and right-hand side, solves by itself, and keeps its own rows of the
answer, so that no result depends on the order of messages.
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
    """Return the factor of a symmetric matrix, or None where CHOLMOD makes none. Collective.

    It makes none where it is missing, where the matrix is not positive definite, which PETSc says
    better, and where the factor is too large.

    Args:
        comm: the ranks, an MpiComm.
        mat: the PETSc matrix, AIJ.
        last: owned unknowns that are eliminated last, counted from 0 on this rank.
    """
    functions = load_cholmod(comm)
    if functions is None:
        return None
    rows = rows_of(mat)
    factor = None
    try:
        if comm.size == 1:
            factor = ContactLast(functions, rows, last)
        else:
            whole = sp.vstack(comm.mpi.allgather(rows), format="csr")
            factor = ContactLast(
                functions,
                whole,
                last,
                whole=_make_gatherer(comm.mpi, mat),
                mine=slice(*mat.getOwnershipRange()),
            )
    except ArithmeticError:
        pass
    # all ranks have a factor, or none: one without would leave the others alone in a solve
    return None if largest(comm, factor is None) else factor


def make_product_of_rows(matrix: Any) -> Callable[[Array], Array]:
    """Return a function X (k, n) -> the rows A x of its rows x, (k, n), on one rank.

    The compiled loop reads A once for ``AT_ONCE`` rows of X: the product is bound by memory, and
    rows one by one would read it k times.
    """
    functions = load_loops(SerialComm())
    A = rows_of(matrix.mat)
    n = matrix.rows
    if functions is None or A.indices.dtype != np.int32:
        return lambda x: np.stack([matrix @ row for row in x])
    arrays = A.indptr, A.indices, A.data, np.empty(AT_ONCE * n)
    *entries, room = locate_arrays(*arrays)

    # the default argument keeps the arrays alive whose addresses the loop reads
    def multiply(x: Array, _: Any = arrays) -> Array:
        x = np.ascontiguousarray(x)
        products = np.empty(x.shape)
        x_address, products_address = locate_arrays(x, products)
        functions.product_many(len(x), n, *entries, x_address, room, products_address)
        return products

    return multiply


def _make_gatherer(mpi: Any, mat: Any) -> Callable[[Array], Array]:
    """Return a function that gathers a vector of all ranks. Collective when called.

    It writes into one array again and again: what it returned before is overwritten.
    """
    ends = mat.getOwnershipRanges()
    counts = np.diff(ends)
    whole = np.empty(ends[-1])

    def gather(b: Array) -> Array:
        mpi.Allgatherv(np.ascontiguousarray(b), [whole, counts])
        return whole

    return gather
