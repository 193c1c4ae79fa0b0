"""Pose the membrane over a ball for ``vi_contact.vi.solve``.

There are form, bounds and conditions of DOLFINx.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import dolfinx
import numpy as np
import ufl

from vi_contact.exact.membrane import HALF, Membrane
from vi_contact.fem import compat


@dataclass(frozen=True)
class Posed:
    """Hold what ``vi.solve((a, L), u, lower=lower, bcs=[bc])`` takes.

    With it comes the ``exact`` solution at the nodes.
    """

    a: Any
    L: Any
    u: Any
    lower: Any
    bc: Any
    exact: Any


def build(comm: Any, cells: int, unit: float = 1.0) -> Posed:
    """Return the problem on a mesh of so many squares along a side, cut into triangles."""
    on = dolfinx.mesh.create_rectangle(comm, [[-HALF, -HALF], [HALF, HALF]], [cells, cells])
    V = compat.lagrange(on, 1)
    known = Membrane(unit)
    exact, lower, u = (dolfinx.fem.Function(V) for _ in range(3))
    exact.interpolate(known.height)
    lower.interpolate(known.obstacle)
    edge = dolfinx.mesh.locate_entities_boundary(on, 1, lambda x: np.full(x.shape[1], True))
    bc = dolfinx.fem.dirichletbc(exact, dolfinx.fem.locate_dofs_topological(V, 1, edge))
    w, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    a = ufl.inner(ufl.grad(w), ufl.grad(v)) * ufl.dx
    return Posed(a, dolfinx.fem.Constant(on, 0.0) * v * ufl.dx, u, lower, bc, exact)
