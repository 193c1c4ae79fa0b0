"""Blocks whose cells grow away from a contact, pressed by their far side: half-plane problems on a
finite mesh."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log
from typing import Any

import numpy as np
from fem_problems import block

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import Obstacle
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed


def growing(h: float, length: float, *, growth: float = 1.15) -> Array:
    """Nodes on [0, length]: the first cell at most h, each ``growth`` times the one before."""
    count = ceil(log(1.0 + length / h * (growth - 1.0)) / log(growth))
    nodes = np.append(0.0, np.cumsum(growth ** np.arange(count)))
    return np.asarray(nodes * (length / nodes[-1]))


def even_then_growing(h: float, even: float, length: float, *, growth: float = 1.15) -> Array:
    """Nodes on [0, length]: cells of about h as far as ``even``, then growing."""
    count = round(even / h)
    return np.append(
        np.linspace(0.0, even, count + 1), even + growing(h, length - even, growth=growth)[1:]
    )


@dataclass(frozen=True)
class Pressed:
    """Contact nodes from the axis outwards: x [m], weights, nodal forces [N/m], of one half of the
    body."""

    x: Array
    weights: Array
    r_n: Array

    @property
    def pressure(self) -> Array:
        """r_n / weight [Pa]."""
        return self.r_n / self.weights


def pressed_half(
    comm: Any,
    x: Array,
    y: Array,
    *,
    material: LinearElastic,
    obstacle: Obstacle,
    force: float,
    simplices: bool = False,
) -> Pressed:
    """One half (x > 0) of a plane strain body between its obstacle (below) and a uniform pressure
    on its top.

    ``force`` [N/m] on the whole body. Rollers on the plane of symmetry only: contact alone carries
    the vertical load.
    """

    def placed(points: Array) -> Array:
        axes = [
            np.interp(points[:, i], np.linspace(0.0, 1.0, len(nodes)), nodes)
            for i, nodes in enumerate((x, y))
        ]
        return np.column_stack(axes)

    mesh, tags = block(comm, divisions=(len(x) - 1, len(y) - 1), simplices=simplices, deform=placed)
    system = assemble(
        mesh,
        material,
        prescribed=Prescribed(tags["left"], components=(0,)),
        loads=Traction(tags["top"], (0.0, -0.5 * force / x[-1])),
    )
    surface = contact_surface(system, tags["bottom"], obstacle=obstacle)
    state = static_equilibrium(ContactProblem(system, surface), solver=Condensed())
    every = surface.whole()
    order = np.argsort(every.points[:, 0])
    return Pressed(
        every.points[order, 0], every.weights[order], surface.everywhere(state.r_n)[order]
    )
