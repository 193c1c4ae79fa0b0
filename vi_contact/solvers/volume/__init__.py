"""Solve the step in the volume, with PETSc's variational-inequality solvers: the whole u, no
condensation.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
