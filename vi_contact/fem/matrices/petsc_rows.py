"""Turn PETSc matrices into rows of scipy, each rank its own, and back."""

from typing import Any

import scipy.sparse as sp
from petsc4py import PETSc


def rows_of(mat: Any) -> sp.csr_matrix:
    """Return a copy of the owned rows of a PETSc AIJ matrix, columns numbered over all ranks."""
    ends, columns, values = mat.getValuesCSR()
    return sp.csr_matrix((values, columns, ends), shape=(mat.getLocalSize()[0], mat.getSize()[1]))


def transfer(mat: Any, comm: Any) -> Any:
    """Return an AIJ matrix on another communicator of the same ranks; ``mat`` is destroyed.

    Assembled matrices live on the communicator of their mesh, which ends with it; those of a system
    have to outlive it (``mesh.communicators.keep_communicator``). Collective.
    """
    rows = rows_of(mat)
    columns = mat.getLocalSize()[1]
    mat.destroy()
    return aij_of(rows, comm, columns)


def aij_of(rows: sp.spmatrix, comm: Any, columns: int | None = None) -> Any:
    """Return the PETSc AIJ matrix with these rows of this rank. Collective.

    Args:
        rows: (n, columns of all ranks) owned rows, columns numbered over all ranks.
        comm: the communicator.
        columns: how many of the columns this rank owns; n when None.
    """
    entries = sp.csr_matrix(rows)
    kind = PETSc.IntType
    n = rows.shape[0]
    csr = (entries.indptr.astype(kind), entries.indices.astype(kind), entries.data)
    mat = PETSc.Mat().createAIJ(
        ((n, None), (n if columns is None else columns, None)), csr=csr, comm=comm
    )
    mat.assemble()
    return mat
