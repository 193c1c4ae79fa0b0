"""Find plane cuts through walls, slabs and columns: along element sides, or through elements.

A cut is given by its two ends in the plane, by three corners of a rectangle in space. "Before" it
is the side to which its normal points, "behind" it the other one.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from ...core.algebra import Array, Mask
from ...core.errors import InputError
from .. import compat
from ..body.space import FemSpace
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells
from .cut_cells import work_beyond
from .nodal_work import Rigid, rigid_motions

# of the length of the cut: what counts as lying on it; also the largest cosine of the angle between
# the sides of a rectangle
ON_LINE = 1e-6
UNCOVERED = 1e-3  # of the length of a cut in the plane: what the elements on it may miss


def axes_of(name: str, corners: Array) -> tuple[Array, Array]:
    """Return the axes of a cut, and the lengths of its sides.

    Args:
        name: that of the cut.
        corners: (d, d) [m] two ends in the plane, three corners a, b, c of a rectangle in space.

    Returns:
        (d, d) unit vectors along the normal and, from a on, the sides; (d - 1,) lengths [m].

    Raises:
        InputError: two corners at one place, or no right angle at a.
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
    """Return what moves on one side of a cut, and the matrix that makes N, V, M, … of its work.

    The nodes on the cut and behind it move rigidly, and the cells before it, towards its normal,
    hold them: their work on this motion is that of the section forces. Where the cut goes through
    cells, the inertia and the loads of their parts behind it are taken away (``cut_cells``). It is
    the other way round where sides of cells lie on the cut behind it only, as at a foot.
    Collective.

    Args:
        space: the body's unknowns.
        name: that of the cut.
        given: its ends or corners (d, d) [m].
        group: the cells that it cuts, all when None.

    Returns:
        what moves (``nodal_work.Rigid``), and the matrix that turns the works on unit translations
        and rotations along the axes into forces [N] and moments [N m] of the section.

    Raises:
        InputError: on all ranks, a cut that does not go through all of the group that it reaches.
    """
    corners = np.asarray(given, dtype=float)
    mesh = space.mesh
    if len(corners) != space.dimension:
        raise InputError(
            f"section '{name}' has {len(corners)} corners: give 2 ends in the plane, 3 corners of "
            f"a rectangle in space; this mesh has {space.dimension} dimensions"
        )
    axes, size = axes_of(name, corners)
    # round-off is of the cut or, where a rectangle is much larger than the body, of the body
    tol = ON_LINE * min(float(size.max()), space.size)

    def level(x: Array) -> Array:
        away = (x - corners[0]) @ axes[0]
        return np.where(np.abs(away) <= tol, 0.0, away)

    # the cells of the group that have a point of the cut, and how they lie to it
    x = mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, : space.dimension]
    inside = np.ones(len(x), dtype=bool)
    if group is not None:
        inside[:] = False
        inside[cells_of(f"section '{name}'", "cells", group, mesh).indices] = True
    vertices = x[:, : len(compat.sub_entities(mesh, 0))]
    trace = _Trace((vertices - corners[0]) @ axes[1:].T, level(vertices), size, tol)
    inside &= trace.touches
    inside = _keep_present(space, name, inside)
    left, right, through = _measure_cover(space, name, trace, inside, size)

    # nodes that move: on the cut, and with cells of first order all behind it, so that a cell which
    # it goes through moves there as the rigid body does
    sign = 1.0 if left >= right else -1.0
    away = level(space.points)
    along = (space.points - corners[0]) @ axes[1:].T
    on_cut = (away == 0.0) & ((along >= -tol) & (along <= size + tol)).all(axis=1)
    nodes = (sign * away < 0.0) & (space.degree < 2) | on_cut
    crossed = inside & (level(x).max(axis=1) > 0.0) & (level(x).min(axis=1) < 0.0)
    if space.degree > 1 and space.comm.max(np.array([float(crossed.any())]))[0]:
        raise InputError(
            f"section '{name}' cuts cells of degree 2: let it follow their plane sides"
        )

    # they turn about the middle of the cut; what lies beyond it in crossed cells is no part
    middle = corners[0] + 0.5 * (corners[1:] - corners[0]).sum(axis=0)
    beyond = None
    if through:
        motions = partial(rigid_motions, centre=middle)
        beyond = partial(work_beyond, space, crossed, lambda points: sign * level(points), motions)
    holding = inside & (trace.left if sign > 0.0 else trace.right)
    turns = axes if len(axes) == 3 else 1.0
    return (nodes[:, None], middle, holding, beyond), -sign * block_diag(axes, turns)


def _keep_present(space: FemSpace, name: str, inside: Mask) -> Mask:
    """Return which cells of a cut are there. Collective.

    Args:
        space: the body's unknowns.
        name: that of the cut.
        inside: (local cells,) of the group with a point of the cut.

    Raises:
        InputError: on all ranks, a cut through absent bodies alone.
    """
    if space.absent is None:
        return inside
    there = inside & ~space.absent
    drawn, present = space.comm.max(np.array([inside.any(), there.any()], dtype=float))
    if drawn and not present:
        raise InputError(
            f"section '{name}' cuts bodies that are absent: record it in stages that have them"
        )
    return there


def _measure_cover(
    space: FemSpace, name: str, trace: _Trace, inside: Mask, size: Array
) -> tuple[float, float, float]:
    """Return how much of a cut cells cover with sides before it, behind it, and inside of them.

    In the plane these are lengths [m], in space areas [m²] of boxes round them. Collective.

    Args:
        space: the body's unknowns.
        name: that of the cut.
        trace: what the plane of the cut leaves in cells.
        inside: (cells,) local cells of the group with a point of the cut.
        size: (d - 1,) lengths of the sides of the cut [m].

    Raises:
        InputError: on all ranks, a cut that ends inside the group, or is not covered.
    """
    # it ends inside where cells on both sides of its plane go on over the same end
    ends = [
        [(inside & end & trace.left).any(), (inside & end & trace.right).any()]
        for end in trace.beyond
    ]
    if space.comm.max(np.array(ends, dtype=float)).all(axis=1).any():
        raise InputError(
            f"section '{name}' ends inside the group of cells: let it reach from surface to surface"
        )
    mesh = space.mesh
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    left, right, through = space.comm.sum(trace.cover[:, :owned] @ inside[:owned])
    cover = through + max(left, right)
    if not cover > 0.0 or (space.dimension == 2 and abs(cover - size[0]) > UNCOVERED * size[0]):
        raise InputError(
            f"section '{name}': elements cover {cover:.4g} of its {size.prod():.4g} "
            f"m{'²' * (space.dimension - 2)}: let it reach from one surface of the group of cells "
            "to the other"
        )
    return left, right, through


class _Trace:
    """Hold what the plane of a cut leaves in cells, as boxes round it along the sides of the cut.

    Attributes:
        left, right: (cells,) those with vertices before and behind the plane.
        touches: (cells,) those with a point of the cut.
        beyond: (2 (d - 1), cells) those of them that go on over one of its ends.
        cover: (3, cells) how much [m] of the cut (in space, [m²], of boxes round it) sides of cells
            before it, sides of cells behind it, and cells that it goes through cover.
    """

    def __init__(self, along: Array, level: Array, size: Array, tol: float) -> None:
        """Find the boxes.

        Args:
            along: (cells, vertices, d - 1) places of the vertices along the sides of the cut [m].
            level: (cells, vertices) distances from its plane [m], 0 for round-off.
            size: (d - 1,) lengths of its sides [m].
            tol: what is round-off [m].
        """
        self.left = level.max(axis=1) > 0.0
        self.right = level.min(axis=1) < 0.0
        # a side of a cell lies in the plane if more vertices do than the cut has sides
        faces = np.count_nonzero(level == 0.0, axis=1) > along.shape[2]

        # boxes round the points where the plane cuts the lines between all pairs of vertices
        low = np.full(along.shape[::2], np.inf)
        high = np.full(along.shape[::2], -np.inf)
        near = (self.left & self.right) | (level == 0.0).any(axis=1)
        s = along[near]
        below = level[near][:, :, None]
        above = level[near][:, None]
        cuts = (below <= 0.0) & (above >= 0.0) & (above > below)
        share = np.divide(-below, above - below, out=np.zeros_like(below + above), where=cuts)
        points = s[:, :, None] + share[..., None] * (s[:, None] - s[:, :, None])
        low[near] = np.where(cuts[..., None], points, np.inf).min(axis=(1, 2))
        high[near] = np.where(cuts[..., None], points, -np.inf).max(axis=(1, 2))

        # how these boxes lie to the cut
        self.touches = ((low <= size + tol) & (high >= -tol)).all(axis=1)
        self.beyond = self.touches & np.hstack([low < -tol, high > size + tol]).T
        kinds = np.array([faces & ~self.right, faces & ~self.left, self.left & self.right])
        inner = ((low < size - tol) & (high > tol)).all(axis=1)
        self.cover = np.where(kinds & inner, (high - low).prod(axis=1), 0.0)
