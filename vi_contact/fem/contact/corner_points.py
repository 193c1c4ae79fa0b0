"""Find the points at which two bodies touch only by corners or edges.

A corner on a corner has no normal, and a corner on a face whose own faces are turned away by more
than 30° pairs with no facet. No condition is made at such points, and the list of joints says so.
Edges of two bodies in space that cross without a node of either are not noticed.
"""

import numpy as np

from ...core.algebra import Array, Indices, Mask
from .facing import Sights
from .skin import Skin


def find_corner_points(skin: Skin, pairs: Sights) -> tuple[Array, Indices]:
    """Return points (k, d) [m] of two bodies without a joint there, and the bodies (k, 2).

    Args:
        skin: the boundary of all bodies.
        pairs: of facets that face each other.
    """
    from scipy.spatial import cKDTree  # late: it takes a while

    d = skin.corners.shape[2]
    numbers, first = np.unique(skin.nodes, return_index=True)
    points = skin.corners.reshape(-1, d)[first]
    body = skin.body[first // skin.nodes.shape[1]]
    if not len(numbers):
        return points, np.zeros((0, 2), dtype=np.int64)

    # nodes that lie on facets of other bodies
    tolerance = skin.tolerances(np.arange(len(skin.body)), np.arange(len(skin.body)))
    found = cKDTree(points).query_ball_point(skin.middles, skin.reach + tolerance)
    facet = np.repeat(np.arange(len(skin.body)), [len(some) for some in found])
    node = np.concatenate([np.asarray(some, dtype=np.int64) for some in found])
    apart = body[node] != skin.body[facet]
    facet = facet[apart]
    node = node[apart]
    on = _are_on(skin, facet, points[node], tolerance[facet])
    facet = facet[on]
    node = node[on]

    # those without a joint of both bodies there; of two corners the one of the lower body counts
    theirs = skin.body[facet]
    keys = np.searchsorted(numbers, skin.nodes[pairs.looking]) * skin.bodies
    joined = np.unique(keys + skin.body[pairs.seen][:, None])
    alone = ~np.isin(node * skin.bodies + theirs, joined)
    at_corner = _are_at_corners(skin, facet, points[node], tolerance[facet])
    alone &= ~(at_corner & (body[node] > theirs))
    # edges of a node's own body that end in a joint with the other one are no corners alone
    rows = np.unique(np.column_stack([node, theirs])[alone], axis=0)
    bodies = np.sort(np.column_stack([body[rows[:, 0]], rows[:, 1]]), axis=1)
    return points[rows[:, 0]], bodies


def _are_on(skin: Skin, facet: Indices, points: Array, tolerance: Array) -> Mask:
    """Say which points (k, d) lie on their facets.

    Args:
        skin: the boundary of all bodies.
        facet: (k,) a facet for each point.
        points: (k, d) [m].
        tolerance: (k,) [m].
    """
    height = np.sum((points - skin.middles[facet]) * skin.normals[facet], axis=1)
    near = np.abs(height) <= tolerance
    flat = skin.project(facet, points[:, None])[:, 0]
    corners = skin.project(facet, skin.corners[facet])
    if flat.shape[1] == 1:
        beyond = np.abs(flat[:, 0]) - np.abs(corners[:, :, 0]).max(axis=1)
        return np.asarray(near & (beyond <= tolerance))
    edges = np.roll(corners, -1, axis=1) - corners
    away = flat[:, None] - corners
    left = edges[:, :, 0] * away[:, :, 1] - edges[:, :, 1] * away[:, :, 0]
    inside = left >= -tolerance[:, None] * np.linalg.norm(edges, axis=2)
    return np.asarray(near & inside.all(axis=1))


def _are_at_corners(skin: Skin, facet: Indices, points: Array, tolerance: Array) -> Mask:
    """Say which points (k, d) are at a corner of their facets.

    Args:
        skin: the boundary of all bodies.
        facet: (k,) a facet for each point.
        points: (k, d) [m].
        tolerance: (k,) [m].
    """
    distance = np.linalg.norm(skin.corners[facet] - points[:, None], axis=2)
    return np.asarray((distance <= 2.0 * tolerance[:, None]).any(axis=1))
