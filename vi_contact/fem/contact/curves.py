"""Say by how much two meshes of one curved face may overlap, although the face itself does not.

Facets leave a curve of radius R by up to h²/(8R). Nodes of side 1 lie on the curve, and so do those
of side 2; what a mean gap may lack is how far the facets of side 2 are from the function that is
linear on each facet of side 1 and has the values of the curve at its nodes. With the curvature H of
side 2, estimated from how its facets turn, that is

    delta = ½ q(mu, facet of side 2) - ½ q(lambda, facet of side 1)
    q(w, X) = sum_i w_i x_i·H x_i - x·H x,   x = sum_i w_i x_i

with the shape functions lambda and mu at a point. Plane sides have H = 0 and sides with the same
facets delta = 0: they may overlap by round-off only.
"""

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.corners import FEATURE_ANGLE

# CHOSEN: dual functions take 5/3 of delta at most in a mean; the rest is for curvatures that vary
MARGIN = 2.0
# CHOSEN: times as much where functions are carried on beyond their facet, to twice its length
FARTHER = 4.0
# least over largest moment of the nodes of a facet: directions in which it has no extent
FLAT = 1e-2


def curvatures(corners: Array, facets: Indices, normals: Array) -> Array:
    """Return the curvature H (k, d, d) [1/m] of a side at each of its facets.

    It is positive where the side bulges outwards: normals turn by H x over a way x. The normal of a
    face at a node is the mean of those of the facets that turn by less than the feature angle; H is
    the fit of normals to nodes. Facets at the rim of a face see half of the turning only, so that
    theirs is doubled.

    Args:
        corners: (k, v, d) of the facets.
        facets: (k, v) their nodes.
        normals: (k, d) outward unit normals.
    """
    # the fit n = H x of the normals at the nodes of each facet, in the directions that it has
    nodal, rim = _nodal_normals(facets, normals)
    x = corners - corners.mean(axis=1, keepdims=True)
    n = nodal - nodal.mean(axis=1, keepdims=True)
    moments = np.einsum("kvi,kvj->kij", x, x)
    H = np.einsum("kvi,kvj->kij", n, x) @ np.linalg.pinv(moments, rcond=FLAT, hermitian=True)
    return np.asarray(np.where(rim[:, None, None], 2.0, 1.0) * H)


def left_out(H: Array, weights: Array, corners: Array) -> Array:
    """Return q (k, p): twice the distance of a curved face from a facet, at points.

    Args:
        H: (k, d, d).
        weights: (k, p, v) shape functions at the points.
        corners: (k, v, d) of the facet.
    """
    x = corners - corners.mean(axis=1, keepdims=True)
    nodal = np.einsum("kvi,kij,kvj->kv", x, H, x)
    points = weights @ x
    return np.asarray(
        (weights @ nodal[:, :, None])[:, :, 0] - np.einsum("kpi,kij,kpj->kp", points, H, points)
    )


def may_overlap(H: Array, facet1: tuple[Array, Array], facet2: tuple[Array, Array]) -> Array:
    """Return by how much (k,) [m] pieces of facets may overlap: the most at their points.

    It is ``MARGIN`` times |delta|, as the head of this module states it.

    Args:
        H: (k, d, d) of side 2 at each piece.
        facet1: shape functions (k, p, v) at the points, and corners (k, v, d), of facets of side 1.
        facet2: the same of the facets of side 2.
    """
    delta = 0.5 * (left_out(H, *facet2) - left_out(H, *facet1))
    return np.asarray(MARGIN * np.abs(delta).max(axis=1, initial=0.0))


def _nodal_normals(facets: Indices, normals: Array) -> tuple[Array, Mask]:
    """Return normals of smooth faces at the nodes of facets, and which facets are at a rim.

    Args:
        facets: (k, v) nodes.
        normals: (k, d) outward unit normals.

    Returns:
        (k, v, d) unit normals, and which facets (k,) are at a rim of a face.
    """
    k, v = facets.shape
    node = facets.ravel()
    facet = np.repeat(np.arange(k), v)
    sums = normals[facet].copy()
    alone = np.ones(k * v, dtype=bool)
    turned = np.zeros(k * v, dtype=bool)
    order = np.argsort(node, kind="stable")
    # all pairs of facets at one node: sorted by nodes they are 1, 2, … places apart
    for apart in range(1, int(np.unique(node, return_counts=True)[1].max(initial=1))):
        same = node[order[:-apart]] == node[order[apart:]]
        first = order[:-apart][same]
        second = order[apart:][same]
        cosine = np.sum(normals[facet[first]] * normals[facet[second]], axis=1)
        close = cosine > np.cos(FEATURE_ANGLE)
        # both of a pair get the normal of the other, unless an edge lies between them
        for own, other in ((first, second), (second, first)):
            turned[own[~close]] = True
            sums[own[close]] += normals[facet[other[close]]]
            alone[own[close]] = False
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    rim = (alone | turned).reshape(k, v).any(axis=1) | _at_border(facets)
    return (sums / length).reshape(k, v, -1), rim


def _at_border(facets: Indices) -> Mask:
    """Return a mask (k,) of the facets that have a node on the outline of their side in space.

    An edge of one facet only is on the outline. In the plane the outline are nodes of one facet
    only, which ``_nodal_normals`` knows already.

    Args:
        facets: (k, v) nodes, in order round each facet.
    """
    if facets.shape[1] == 2:
        return np.zeros(len(facets), dtype=bool)
    edges = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    unique, place, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    border = np.unique(unique[count == 1])
    return np.asarray(np.isin(facets, border).any(axis=1))
