"""Find straight cuts through plane meshes along their lines: nodes and cells that a section force is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask
from ...core.errors import InputError
from .. import compat
from ..groups import cells_of
from ..mesh import Cells
from ..space import FemSpace

ON_LINE = 1e-6  # of the length of the cut: what counts as lying on it
UNCOVERED = 1e-3  # of the length of a cut: what the element sides on it may miss


@dataclass(frozen=True)
class Cut:
    """Hold nodes, an (owned,) mask; cells, a (local,) mask of one side, ``left`` of the way from a to b or right;
    along, across: unit vectors from a to b and to the left; middle: of the cut."""

    nodes: Mask
    cells: Mask
    left: bool
    along: Array
    across: Array
    middle: Array


def find_cut(space: FemSpace, name: str, ends: Array, group: Cells | None) -> Cut:
    """Find the cut from a to b, rows of ``ends`` (2, 2). InputError, on all ranks, unless it runs along element sides
    from one end of the group to the other. Collective."""
    way = ends[1] - ends[0]
    length = float(np.linalg.norm(way))
    if not length > 0.0:
        raise InputError(f"section '{name}': its two ends are the same point")
    along = way / length
    across = np.array([-along[1], along[0]])
    tol = ON_LINE * length
    x = space.mesh.geometry.x[compat.geometry_dofmap(space.mesh)][:, :, :2] - ends[0]
    inside = np.zeros(len(x), dtype=bool)
    inside[slice(None) if group is None else cells_of(f"section '{name}'", "cells", group, space.mesh).indices] = True
    sides = _Sides(x @ along, x @ across, length, tol)
    on = (np.abs(sides.d) <= tol) & (sides.s >= -tol) & (sides.s <= length + tol)
    _refuse(space, name, inside, sides)
    touching = inside & on.any(axis=1)
    owned = np.arange(len(x)) < space.mesh.topology.index_map(space.mesh.topology.dim).size_local
    left, right = touching & (sides.high > tol), touching & (sides.low < -tol)
    span = np.where(on, sides.s, -np.inf).max(axis=1) - np.where(on, sides.s, np.inf).min(axis=1)
    covered = space.comm.sum(np.array([span[owned & side].sum() for side in (left, right)]))
    use_left = covered[0] >= covered[1]
    if abs(max(covered) - length) > UNCOVERED * length:
        raise InputError(
            f"section '{name}': sides of elements cover {max(covered):.4g} m of its {length:.4g} m: lay it along lines "
            "of the mesh, from one surface of the group of cells to the other"
        )
    own = space.points - ends[0]
    nodes = (np.abs(own @ across) <= tol) & (own @ along >= -tol) & (own @ along <= length + tol)
    return Cut(nodes, left if use_left else right, bool(use_left), along, across, 0.5 * (ends[0] + ends[1]))


class _Sides:
    """Vertices of cells (cells, vertices) by their place s along the cut and their distance d to its left."""

    def __init__(self, s: Array, d: Array, length: float, tol: float) -> None:
        self.s, self.d, self.low, self.high = s, d, d.min(axis=1), d.max(axis=1)
        self.straddles = (self.low < -tol) & (self.high > tol)
        first, last = np.full(len(s), np.inf), np.full(len(s), -np.inf)
        for i in range(s.shape[1]):
            for j in range(s.shape[1]):
                rise = d[:, j] - d[:, i]
                cuts = (d[:, i] <= tol) & (d[:, j] >= -tol) & (rise > tol)
                at = s[:, i] - np.divide(d[:, i], rise, out=np.zeros_like(rise), where=cuts) * (s[:, j] - s[:, i])
                first = np.where(cuts, np.minimum(first, at), first)
                last = np.where(cuts, np.maximum(last, at), last)
        self.crossed = self.straddles & (last > tol) & (first < length - tol)
        on_line = np.abs(d) <= tol
        low, high = np.where(on_line, s, np.inf).min(axis=1), np.where(on_line, s, -np.inf).max(axis=1)
        self.beyond = np.array([  # cells with a side on the line that goes on after an end, or cut by the line there
            ((high > tol + end) & (np.abs(low - end) <= tol)) if end else ((low < -tol) & (np.abs(high) <= tol))
            for end in (0.0, length)
        ])
        self.split = self.straddles & ((np.abs(first - length) <= tol) | (np.abs(last) <= tol))
        self.left, self.right = self.high > tol, self.low < -tol


def _refuse(space: FemSpace, name: str, inside: Mask, sides: _Sides) -> None:
    """InputError for a cut that crosses elements or ends in the middle of the group."""
    flags = [(inside & sides.crossed).any(), (inside & sides.split).any()]
    flags += [(inside & beyond & side).any() for beyond in sides.beyond for side in (sides.left, sides.right)]
    found = space.comm.max(np.array(flags, dtype=float)) > 0.5
    if found[0]:
        raise InputError(f"section '{name}' crosses elements: lay it along lines of the mesh, which nodes mark")
    if found[1] or found[2:4].all() or found[4:6].all():
        raise InputError(f"section '{name}' ends inside the group of cells: let it reach from surface to surface")
