"""Solve the contact problem of one step.

It is condensed to the contact points, or solved in the volume with PETSc. Take ``Condensed()``;
``Volume()`` and ``Iterative()`` are for large bodies. The other names are their methods, without
friction (``normal/``) and with it (``friction/``): docs/guide/solvers.md.

>>> import numpy as np
>>> from vi_contact.solvers import ActiveSet  # r >= 0, q + G r >= 0, one of them zero in every row
>>> ActiveSet().prepare(2.0 * np.eye(2), np.zeros(2, dtype=bool)).solve(np.array([-1.0, 1.0])).r
array([0.5, 0. ])
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
