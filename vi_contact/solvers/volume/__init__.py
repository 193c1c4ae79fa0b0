"""Solve the step in the volume, with PETSc's variational-inequality solvers.

It is solved for the whole u, without condensation.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
