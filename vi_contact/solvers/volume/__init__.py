"""Solve the step in the volume, with PETSc's variational-inequality solvers: the whole u, no condensation."""

from contextlib import suppress

from ...core.lazy import lazy

with suppress(ImportError):  # a PETSc from PyPI finds the MPI that mpi4py has loaded; others need none
    import mpi4py.MPI  # noqa: F401

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
