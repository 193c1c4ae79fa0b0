"""Find plane cuts through walls, slabs and columns: along element sides, or through elements."""

from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from ...core.algebra import Array
from ...core.errors import InputError
from .. import compat
from ..body.space import FemSpace
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells
from .cut_cells import work_beyond
from .nodal_work import Rigid, rigid_motions

# of the length of the cut: what counts as lying on it, and how far a rectangle's angles may be from
# 90°
ON_LINE = 1e-6
UNCOVERED = 1e-3  # of the length of a cut in the plane: what the elements on it may miss


def axes_of(name: str, corners: Array) -> tuple[Array, Array]:
    """Return (unit vectors (d, d), lengths (d - 1,) of the sides) of a cut (d, d).

    The vectors are along the normal and the sides.
    """
    size = np.linalg.norm(corners[1:] - corners[0], axis=1)
    if not size.all():
        raise InputError(
            f"section '{name}' has the same point twice: give different ends or corners"
        )
    along = (corners[1:] - corners[0]) / size[:, None]
    if len(along) == 1:
        return np.vstack([[-along[0, 1], along[0, 0]], along]), size
    if abs(along[0] @ along[1]) > ON_LINE:
        raise InputError(
            f"section '{name}' is not a rectangle: give corners a, b, c with a right angle at a"
        )
    return np.vstack([np.cross(*along), along]), size


def find_cut(space: FemSpace, name: str, given: Any, group: Cells | None) -> tuple[Rigid, Array]:
    """Return (what moves on one side of a cut, the matrix that makes N, V, M, … of its work).

    The cut has ends or corners (d, d). Collective. There is an InputError, on all ranks, unless the
    cut goes through all of the group that it reaches.

    The nodes on the cut and behind it move, and the cells before them hold them; the other way
    round where sides of cells lie on the cut behind it only, as at a foot.

    Args:
        space: the body's unknowns.
        name: that of the cut.
        given: its ends or corners (d, d) [m].
        group: the cells that it cuts, all when None.
    """
    corners = np.asarray(given, dtype=float)
    mesh = space.mesh
    if len(corners) != space.dimension:
        raise InputError(
            f"section '{name}' has {len(corners)} corners: give 2 ends in the plane, 3 corners of "
            f"a rectangle in space; this mesh has {space.dimension} dimensions"
        )
    axes, size = axes_of(name, corners)
    # a rectangle may be much larger than the body
    tol = ON_LINE * min(float(size.max()), space.size)

    def level(x: Array) -> Array:
        away = (x - corners[0]) @ axes[0]
        return np.where(np.abs(away) <= tol, 0.0, away)

    x = mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, : space.dimension]
    inside = np.zeros(len(x), dtype=bool)
    inside[
        slice(None)
        if group is None
        else cells_of(f"section '{name}'", "cells", group, mesh).indices
    ] = True
    vertices = x[:, : len(compat.sub_entities(mesh, 0))]
    trace = _Trace((vertices - corners[0]) @ axes[1:].T, level(vertices), size, tol)
    inside &= trace.touches
    sides = [
        [(inside & ends & side).any() for side in (trace.left, trace.right)]
        for ends in trace.beyond
    ]
    if space.comm.max(np.array(sides, dtype=float)).all(axis=1).any():
        raise InputError(
            f"section '{name}' ends inside the group of cells: let it reach from surface to surface"
        )
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    left, right, through = space.comm.sum(trace.cover[:, :owned] @ inside[:owned])
    cover = through + max(left, right)
    if not cover > 0.0 or (space.dimension == 2 and abs(cover - size[0]) > UNCOVERED * size[0]):
        raise InputError(
            f"section '{name}': elements cover {cover:.4g} of its {size.prod():.4g} "
            f"m{'²' * (space.dimension - 2)}: let it reach from one surface of the group of cells "
            "to the other"
        )
    sign = 1.0 if left >= right else -1.0
    away = level(space.points)
    at = (space.points - corners[0]) @ axes[1:].T
    nodes = (sign * away < 0.0) & (space.degree < 2) | (
        (away == 0.0) & ((at >= -tol) & (at <= size + tol)).all(axis=1)
    )
    crossed = inside & (level(x).max(axis=1) > 0.0) & (level(x).min(axis=1) < 0.0)
    if space.degree > 1 and space.comm.max(np.array([float(crossed.any())]))[0]:
        raise InputError(
            f"section '{name}' cuts cells of degree 2: let it follow their plane sides"
        )
    middle = corners[0] + 0.5 * (corners[1:] - corners[0]).sum(axis=0)
    motions = partial(rigid_motions, centre=middle)
    beyond = (
        partial(work_beyond, space, crossed, lambda points: sign * level(points), motions)
        if through
        else None
    )
    moved = nodes[:, None], middle, inside & (trace.left if sign > 0.0 else trace.right), beyond
    return moved, -sign * block_diag(axes, axes if len(axes) == 3 else 1.0)


class _Trace:
    """Hold what the plane of a cut leaves in cells.

    It is held by boxes round it along the sides of the cut, low, high (cells, d - 1).

    left, right: cells with vertices before and behind the plane; touches: with a point of the cut;
    beyond: (2 (d - 1), cells) those of them that go on over one of its ends; cover: (3, cells) how
    much [m] of the cut (in space, [m²], of boxes round it) sides of cells on its left, of cells on
    its right, and cells that it goes through cover.
    """

    def __init__(self, s: Array, d: Array, size: Array, tol: float) -> None:
        self.left = d.max(axis=1) > 0.0
        self.right = d.min(axis=1) < 0.0
        faces = np.count_nonzero(d == 0.0, axis=1) > s.shape[2]
        low = np.full(s.shape[::2], np.inf)
        high = np.full(s.shape[::2], -np.inf)
        near = (self.left & self.right) | (d == 0.0).any(axis=1)
        s, below, above = s[near], d[near][:, :, None], d[near][:, None]  # of all pairs of vertices
        cuts = (below <= 0.0) & (above >= 0.0) & (above > below)
        share = np.divide(-below, above - below, out=np.zeros_like(below + above), where=cuts)
        at = s[:, :, None] + share[..., None] * (s[:, None] - s[:, :, None])
        low[near] = np.where(cuts[..., None], at, np.inf).min(axis=(1, 2))
        high[near] = np.where(cuts[..., None], at, -np.inf).max(axis=(1, 2))
        self.touches = ((low <= size + tol) & (high >= -tol)).all(axis=1)
        self.beyond = self.touches & np.hstack([low < -tol, high > size + tol]).T
        kinds = np.array([faces & ~self.right, faces & ~self.left, self.left & self.right])
        inner = ((low < size - tol) & (high > tol)).all(axis=1)
        self.cover = np.where(kinds & inner, (high - low).prod(axis=1), 0.0)
