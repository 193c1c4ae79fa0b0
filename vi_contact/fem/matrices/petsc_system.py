"""Make the system of a user's own PETSc matrices, on any number of ranks."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from ...core.algebra import Array
from ...core.checks import array, on_all, quote
from ...core.errors import InputError
from ...core.system import Load, SemiDiscreteSystem
from ..mesh.communicators import MpiComm, keep_communicator
from .own_matrices import own_system
from .petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from .petsc_rows import aij_of, rows_of

OWNER = "system_from_matrices"


def system_from_matrices(
    M: Any,
    C: Any,
    K: Any,
    *,
    coordinates: Any,
    unknowns: Any = None,
    clamped: Any = (),
    load: Load | Sequence[float] | Array | None = None,
    u0: Any = None,
    v0: Any = None,
) -> SemiDiscreteSystem:
    """Make the system M u'' + C u' + K u = f of PETSc matrices, on the ranks of these. Collective.

    The arguments are those of ``vc.system_from_arrays``, each rank giving them for the rows that it
    owns and for the nodes of these. Matrices are copied. Nodes are numbered in the order of ranks
    and coordinates: where it changes with the number of ranks, as that of DOLFINx does,
    ``system.space.find_nodes`` finds them, and restarts keep that number.

    Args:
        M: mass, an AIJ matrix of the layout of K; also a Vec or (n,) where lumped.
        C: damping, an AIJ matrix of the layout of K, or None.
        K: stiffness, an AIJ matrix.
        coordinates: (nodes of this rank, d) [m], or a DOLFINx function space of displacements, of
            any degree.
        unknowns: (n, 2) this rank's node (0, 1, … on every rank) and component of each of its rows.
        clamped: its rows that stand still, counted from 0 on every rank.
        load: as of ``system_from_arrays``, on its rows.
        u0: initial displacement [m] on its rows, zero when None.
        v0: initial velocity [m/s] on its rows, zero when None.

    Raises:
        InputError: matrices of another type, layout or communicator; what ``system_from_arrays``
            refuses.
    """
    arguments = {
        "coordinates": coordinates,
        "unknowns": unknowns,
        "clamped": clamped,
        "load": load,
        "u0": u0,
        "v0": v0,
    }
    if not isinstance(K, PETSc.Mat):
        raise InputError(
            f"{OWNER}: K is {quote(K)}; give a PETSc.Mat, or scipy matrices to "
            "vc.system_from_arrays"
        )
    comm = keep_communicator(K.comm.tompi4py())
    named = {"M": M, "K": K}
    if C is not None:
        named["C"] = C

    # copies on a communicator that lasts; on one rank a matrix may be wrong, and all ranks raise
    rows = on_all(
        MpiComm(comm), OWNER, lambda: {name: _copy_rows(name, A, K) for name, A in named.items()}
    )
    matrices = {name: PetscMatrix(aij_of(own, comm)) for name, own in rows.items()}

    # of a function space, the points of the owned nodes
    if hasattr(coordinates, "tabulate_dof_coordinates"):
        count = coordinates.dofmap.index_map.size_local
        d = coordinates.mesh.geometry.dim
        arguments["coordinates"] = coordinates.tabulate_dof_coordinates()[:count, :d]
    return own_system(OWNER, PetscAlgebra(comm), UnsymmetricAlgebra(comm), matrices, arguments)


def _copy_rows(name: str, A: Any, K: Any) -> sp.csr_matrix:
    """Return a copy of this rank's rows of a matrix with the layout of K.

    Args:
        name: "M", "C" or "K".
        A: what was given.
        K: the matrix whose layout counts.

    Raises:
        InputError: another type or layout.
    """
    n, _ = K.getLocalSize()
    _, columns = K.getSize()
    first = K.getOwnershipRangeColumn()[0]
    if name == "M" and not isinstance(A, PETSc.Mat):
        masses = array(OWNER, name, A.array_r if isinstance(A, PETSc.Vec) else A, (n,), unit="kg")
        return sp.csr_matrix((masses, (np.arange(n), first + np.arange(n))), shape=(n, columns))
    defect = ""
    if not isinstance(A, PETSc.Mat):
        defect = f"is {quote(A)}; give a PETSc.Mat"
    elif A.getType() not in ("seqaij", "mpiaij"):
        defect = f"is of type {A.getType()}; give AIJ, A.convert('aij')"
    elif not A.isAssembled():
        defect = "is not assembled; call its assemble()"
    elif MPI.Comm.Compare(A.comm.tompi4py(), K.comm.tompi4py()) not in (MPI.IDENT, MPI.CONGRUENT):
        defect = "and K are on different communicators; make them on one"
    elif A.getLocalSize() != (n, n):
        defect = (
            f"has {A.getLocalSize()} rows and columns on this rank and K {n} rows; give square "
            "ones of one layout"
        )
    elif np.dtype(PETSc.ScalarType).kind == "c":
        defect = "is complex, as all matrices of this PETSc; use one with real numbers"
    if defect:
        raise InputError(f"{OWNER}: {name} {defect}")
    return rows_of(A)
