"""Solve the step in the volume by conjugate gradients, without any factor: one row of a mask is a contact condition."""

from contextlib import suppress

from ...core.lazy import lazy

with suppress(ImportError):  # a PETSc from PyPI finds the MPI that mpi4py has loaded; others need none
    import mpi4py.MPI  # noqa: F401

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
