"""Solve plane elastodynamics by space-time boundary elements.

The method is that of Aimi, Di Credico and Gimperlein (2024); it needs no DOLFINx.

In this order: a ``BoundaryMesh``, ``energetic_blocks``, ``PoincareSteklov``, ``BoundaryProblem``,
``BoundaryContact``, ``march_contact``. Theory and an example: docs/theory/bem.md; four problems:
``demos/parts/problems/boundary_elements.py``.
>>> from vi_contact.bem import circle
>>> round(circle(radius=1.0, count=64).area, 3)  # of the polygon, m²
3.137
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
