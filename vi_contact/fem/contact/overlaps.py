"""Refuse bodies that overlap by more than rounding, with place and depth.

Points are tested against the cells of other bodies, each rank those of its own cells. There are two
kinds of points:

- just below the middle of each facet, by a thousandth of its size: no other body may be there;
- of each pair of opposite facets with a gap below zero, between both: such a pair is an overlap
  where both bodies are there, and is none where a thin body lies in front of another.

Overlaps that are smaller than a facet in every direction, without any of both, are not noticed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array, Comm, Indices, Mask
from ...core.checks import describe_point
from ...core.errors import InputError
from .. import compat
from .facing import Sights
from .nodes import Rows, gather_rows
from .skin import TOUCH, Skin

BELOW = 1e-3  # of the size of a facet: depth of the points below it
# shares of the way between two facets; odd ones, which no face of a cell is likely to have
BETWEEN = (0.29, 0.71)
INSIDE = 1e-9  # of the size of a cell: so far beyond its sides a point counts as inside


@dataclass(frozen=True, eq=False)
class Deep(Rows):
    """Hold k places where bodies overlap.

    Attributes:
        first: (k,) bodies.
        second: (k,) other bodies.
        points: (k, d) where [m].
        depths: (k,) by how much [m].
    """

    first: Indices
    second: Indices
    points: Array
    depths: Array


def find_deepest(comm: Comm, mesh: Any, skin: Skin, behind: Sights) -> Deep:
    """Return the place where two bodies overlap most; none where they do not. Collective.

    Args:
        comm: the ranks.
        mesh: the DOLFINx mesh.
        skin: the boundary of all bodies.
        behind: sights of opposite facets with gaps below zero.
    """
    depth = 2.0 * BELOW * skin.reach + 2.0 * skin.left_out.max(initial=0.0)
    below = skin.middles - depth[:, None] * skin.normals
    normals = skin.normals[behind.looking]
    between = [behind.middles + share * behind.gaps[:, None] * normals for share in BETWEEN]
    points = np.concatenate([below, *between])
    point, body = _find_bodies(comm, mesh, skin, points)

    # of the points below facets: bodies but their own
    f = len(below)
    other = (point < f) & (body != np.append(skin.body, np.full(len(points) - f, -1))[point])
    own = point[other]
    deep = Deep(
        skin.body[own],
        body[other],
        skin.middles[own],
        _measure_depths(skin, own, body[other]),
    )
    # of the points between two facets: both bodies, at both points
    there = np.ones(len(behind.looking), dtype=bool)
    keys = point * max(skin.bodies, 1) + body
    for number in range(len(BETWEEN)):
        rows = f + number * len(there) + np.arange(len(there))
        for facets in (behind.looking, behind.seen):
            there &= np.isin(rows * max(skin.bodies, 1) + skin.body[facets], keys)
    pairs = Deep(
        skin.body[behind.looking],
        skin.body[behind.seen],
        behind.middles,
        -behind.gaps,
    ).pick(there)
    every = Deep.join([deep, pairs])
    # the deepest; of those alike to rounding the first
    most = every.depths.max(initial=0.0)
    return every.pick(np.flatnonzero(every.depths >= most * (1.0 - 1e-6))[:1])


def refuse_overlaps(owner: str, deep: Deep, names: list[str]) -> None:
    """Raise InputError for the place where two bodies overlap most.

    Args:
        owner: who asks.
        deep: of ``find_deepest``.
        names: of the bodies.
    """
    for first, second, point, depth in zip(
        deep.first, deep.second, deep.points, deep.depths, strict=True
    ):
        raise InputError(
            f"{owner}: {names[first]} and {names[second]} overlap by {depth:.3g} m at "
            f"{describe_point(point)}: move one of them away, or make it smaller"
        )


def _find_bodies(comm: Comm, mesh: Any, skin: Skin, points: Array) -> tuple[Indices, Indices]:
    """Return in which bodies points are, as pairs (k,), (k,) of a point and a body. Collective.

    Args:
        comm: the ranks.
        mesh: the DOLFINx mesh.
        skin: the boundary of all bodies.
        points: (p, d) [m], the same on every rank.
    """
    from scipy.spatial import cKDTree  # late: it takes a while

    d = points.shape[1]
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    vertices = len(compat.sub_entities(mesh, 0))
    corners = compat.geometry_dofmap(mesh)[:owned, :vertices]
    x = mesh.geometry.x[corners][:, :, :d]
    middles = x.mean(axis=1)
    reach = np.linalg.norm(x - middles[:, None], axis=2).max(axis=1, initial=0.0)
    cell = np.zeros(0, dtype=np.int64)
    point = np.zeros(0, dtype=np.int64)
    if owned and len(points):
        found = cKDTree(points).query_ball_point(middles, reach)
        cell = np.repeat(np.arange(owned), [len(some) for some in found])
        point = np.concatenate([np.asarray(some, dtype=np.int64) for some in found])
    inside = _are_inside(mesh, x, middles, reach, cell, points[point])
    bodies = skin.body_of_node[corners[cell[inside], 0]]
    pairs = np.unique(np.column_stack([point[inside], bodies]), axis=0)
    (pairs,) = gather_rows(comm, pairs)
    pairs = np.unique(pairs, axis=0).astype(np.int64)
    return pairs[:, 0], pairs[:, 1]


def _are_inside(
    mesh: Any, x: Array, middles: Array, reach: Array, cell: Indices, points: Array
) -> Mask:
    """Say which points (k, d) are in their cells: behind the planes of all sides.

    Args:
        mesh: the DOLFINx mesh.
        x: (c, v, d) vertices of cells [m].
        middles: (c, d) of cells [m].
        reach: (c,) largest distances of vertices from these [m].
        cell: (k,) a cell for each point.
        points: (k, d) [m].
    """
    d = points.shape[1]
    inside = np.ones(len(cell), dtype=bool)
    for side in compat.sub_entities(mesh, d - 1):
        corners = x[:, side]
        start = corners.mean(axis=1)
        along = corners[:, 1] - corners[:, 0]
        if d == 2:
            normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
        else:
            # a side may be twisted: the diagonals of a quadrilateral give its mean plane
            other = corners[:, 2] - corners[:, 0]
            if len(side) == 4:
                along = corners[:, 3] - corners[:, 0]
                other = corners[:, 2] - corners[:, 1]
            normals = np.cross(along, other)
        normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        outward = np.sum((start - middles) * normals, axis=1)
        normals = np.where(outward[:, None] < 0.0, -normals, normals)
        height = np.sum((points - start[cell]) * normals[cell], axis=1)
        inside &= height <= INSIDE * reach[cell]
    return inside


def _measure_depths(skin: Skin, facets: Indices, bodies: Indices) -> Array:
    """Return about how deep (k,) the middles of facets are in other bodies [m].

    Args:
        skin: the boundary of all bodies.
        facets: (k,) whose middles are looked at.
        bodies: (k,) the bodies that they are in.
    """
    depths = np.zeros(len(facets))
    for row, (facet, body) in enumerate(zip(facets, bodies, strict=True)):
        theirs = skin.body == body
        reach = skin.reach[theirs]
        away = skin.middles[theirs] - skin.middles[facet]
        across = np.abs(np.sum(away * skin.normals[theirs], axis=1))
        beyond = np.linalg.norm(away, axis=1) - reach
        depths[row] = np.maximum(across, beyond).min()
        # where both boundaries are one: as far as the facet has to go back to leave the body
        if depths[row] <= TOUCH * skin.reach[facet]:
            back = -away @ skin.normals[facet]
            aside = np.linalg.norm(away + back[:, None] * skin.normals[facet], axis=1)
            exits = back[(back > BELOW * reach) & (aside <= reach)]
            depths[row] = exits.min() if len(exits) else 2.0 * skin.reach[facet]
    return depths
