"""Solve the step in the volume by conjugate gradients, without any factor: one row of a mask is a contact condition."""

from contextlib import suppress

from ...core.lazy import lazy

with suppress(ImportError):  # a PETSc from PyPI finds the MPI library that mpi4py has loaded before; others need no mpi4py
    import mpi4py.MPI  # noqa: F401

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
