"""Offer collective operations on MPI, communicators that last, and the end of PETSc's objects."""

from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ...core.algebra import Array
from ...core.timing import release_memory


class MpiComm:
    """Offer the operations of ``core.algebra.Comm`` on an MPI communicator, ``mpi``."""

    def __init__(self, comm: Any) -> None:
        self.mpi = comm
        self.rank: int = comm.rank
        self.size: int = comm.size

    def _reduce(self, x: Array, operation: Any) -> Array:
        """Return x reduced over the ranks, entry by entry, the same on every rank."""
        if self.size == 1:
            return x
        total = np.empty_like(x)
        self.mpi.Allreduce(np.ascontiguousarray(x), total, op=operation)
        return total

    def sum(self, x: Array) -> Array:
        """Return the sum of x over the ranks, entry by entry."""
        return self._reduce(x, MPI.SUM)

    def max(self, x: Array) -> Array:
        """Return the largest x of the ranks, entry by entry."""
        return self._reduce(x, MPI.MAX)

    def bcast(self, value: Any) -> Any:
        """Return the value of rank 0 on every rank."""
        return self.mpi.bcast(value, root=0)

    def gather(self, value: Any) -> list[Any] | None:
        """Return the values of all ranks on rank 0; None on the others."""
        return self.mpi.gather(value, root=0)


def keep_communicator(comm: Any) -> Any:
    """Return a communicator of the same ranks that lasts as long as the program.

    Collective the first time. PETSc objects that Python drops wait on their communicator for
    ``give_back``. A mesh frees its own at its end: what waits there would wait for ever.
    """
    for lasting in _LASTING:
        if MPI.Comm.Compare(lasting, comm) in (MPI.IDENT, MPI.CONGRUENT):
            return lasting
    lasting = comm.Dup()
    _LASTING.append(lasting)
    return lasting


_LASTING: list[Any] = []


def give_back(comm: Any) -> None:
    """Free the PETSc objects that nobody holds any more. Collective.

    PETSc keeps them until all ranks ask it to.
    """
    for _ in range(2):  # what one held may be free only after it
        PETSc.garbage_cleanup(comm)
    release_memory()
