"""Import PETSc for the solvers, after MPI.

The PETSc of PyPI finds the MPI library that mpi4py has loaded before.
"""

from contextlib import suppress

with suppress(ImportError):  # other builds of PETSc need no mpi4py
    import mpi4py.MPI  # noqa: F401

from petsc4py import PETSc

__all__ = ["PETSc"]
