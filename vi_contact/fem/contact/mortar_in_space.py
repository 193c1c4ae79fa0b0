"""Integrate the dual mortar coupling of sides in space, of triangles or quadrilaterals, in any mixture of both sides.

A node of side 1 looks along its own normal, so that what it faces lies on that normal and normal forces have no moment.
Along it, its facets and those of side 2 are seen as polygons of a plane; what each two of them share is cut out and
integrated. Where all nodes of a facet have its normal, on plane sides, they look at once. On a facet

    psi_s = D_s b(x)ᵀ (∫ b bᵀ)⁻¹ b(x_s),   D_s = ∫ phi_s   over its part in front of side 2

with b = phi if that is all of it (biorthogonal functions, of distorted quadrilaterals too) and b = (1, x, y) if it is a
part: bilinear functions, carried on from a strip of a facet to its far nodes, grow without bound as the strip thins.
Both keep sum_s psi_s = 1, ∫ psi_s = D_s > 0 and ∫ psi_s x = D_s x_s, and are the same on triangles.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.checks import at
from ...core.errors import InputError
from ...core.surfaces import nodal_frames
from .clipping import areas, cross, hats, overlaps, rule, stacked, triangles, turns, without
from .faces import components
from .matching import DISTANCES, EDGE_ON, Side, common_nodes
from .nodes import Nodes, Rows

LEAST_COVERED = 1e-3  # of a facet: less of it in front of side 2 is no contact
SHARED = 1e-13  # of a facet's area: less is nothing
WHOLE = 1e-6  # of a facet's area: round-off of what is cut out of it
SLIVER = 1e-6  # area of a facet over the square of its length: less has no reliable normal
NEARBY = 500  # facets of side 2 that are looked at first
BLOCK = 512  # facets that are cut at once
MOST_POINTS = 20  # of Gauss a way
POINTS = 2**18  # at which functions are held at once, a few for each triangle of a piece


@dataclass(frozen=True, eq=False)
class Facets:
    """Hold the facets of a side: rows of nodes (k, v), corners (k, v, 3), middles, outward normals, and the largest
    distance of a corner from the middle."""

    nodes: Indices
    corners: Array
    middles: Array
    normals: Array
    reach: Array


def facets_of(side: Side, sense: int) -> Facets:
    """Return the facets of a side, anticlockwise (sense 1) or clockwise (-1) seen from outside; InputError for slivers
    and for quadrilaterals that are not convex."""
    nodes = np.sort(side.facets, axis=1)
    corners = side.nodes.points[nodes]
    middles = corners.mean(axis=1)
    spokes = corners - middles[:, None, :]
    normals = np.linalg.svd(spokes)[2][:, -1]  # along which the facet extends least
    inward = np.sum(normals[:, None, :] * side.nodes.normals[nodes], axis=(1, 2)) < 0.0
    normals = np.where(inward[:, None], -normals, normals)
    seen = np.einsum("kvi,kic->kvc", spokes, nodal_frames(normals)[:, :, 1:])
    angle = np.arctan2(cross(seen[:, :1], seen), np.sum(seen[:, :1] * seen, axis=2)) % (2.0 * np.pi)
    angle[:, 0] = 0.0
    order = np.argsort(angle, axis=1)
    nodes, corners = np.take_along_axis(nodes, order, axis=1), np.take_along_axis(corners, order[:, :, None], axis=1)
    seen, reach = np.take_along_axis(seen, order[:, :, None], axis=1), np.linalg.norm(spokes, axis=2).max(axis=1)
    for bad in np.flatnonzero((turns(seen) <= SLIVER * reach[:, None] ** 2).any(axis=1)):
        raise InputError(f"a facet of '{side.name}' at {at(middles[bad])} is a sliver or not convex: no normal can be "
                         "trusted there, mesh this boundary anew")
    return Facets(nodes[:, ::sense], corners[:, ::sense], middles, normals, reach)


@dataclass(frozen=True, eq=False)
class Looks(Rows):
    """Hold facets of side 1, each seen along the normals of some of its nodes.

    Attributes:
        nodes, middles, reach: of the facets, as in `Facets`; asking: for which of its nodes (k, v) each is seen.
        normals: along which they are seen; frames: two unit vectors (k, 3, 2) beside that; slant: its cosine to the
            facet's own normal, the share of the area that is seen.
        polygons: the facets as they are seen (k, v, 2), from their middles.
    """

    nodes: Indices
    middles: Array
    reach: Array
    normals: Array
    frames: Array
    polygons: Array
    slant: Array
    asking: Mask


def looks_of(ours: Facets, nodes: Nodes) -> Looks:
    """Return the looks of all nodes of side 1, one a facet where they all look along its normal."""
    v = ours.nodes.shape[1]
    normals = nodes.normals[ours.nodes]
    plane = np.linalg.norm(normals - ours.normals[:, None, :], axis=2).max(axis=1) < 1e-12
    facet = np.concatenate([np.flatnonzero(plane), np.repeat(np.flatnonzero(~plane), v)])
    asking = np.concatenate([np.ones((plane.sum(), v)), np.tile(np.eye(v), ((~plane).sum(), 1))]) > 0.0
    along = np.concatenate([ours.normals[plane], normals[~plane].reshape(-1, 3)])
    frames, slant = nodal_frames(along)[:, :, 1:], np.sum(along * ours.normals[facet], axis=1)
    polygons = np.einsum("kvi,kic->kvc", ours.corners[facet] - ours.middles[facet, None, :], frames)
    looks = Looks(ours.nodes[facet], ours.middles[facet], ours.reach[facet], along, frames, polygons, slant, asking)
    return looks.pick(np.flatnonzero((slant > EDGE_ON) & (turns(polygons) > 0.0).all(axis=1)))


@dataclass(frozen=True, eq=False)
class Pieces(Rows):
    """Hold what looks share with facets of side 2: numbers of both, polygons (k, m, 2), the facet as it is seen
    (k, v, 2), and its height h along the look, h_0 + h_1 x + h_2 y."""

    look: Indices
    facet: Indices
    polygons: Array
    seen: Array
    height: Array

    def distances(self, points: Array) -> Array:
        """Return how far along their looks points (k, p, 2) are [m]."""
        return np.abs(self.height[:, :1] + np.einsum("kpc,kc->kp", points, self.height[:, 1:]))


def joined(parts: list[Pieces]) -> Pieces:
    """Return the pieces of all parts, one part after the other."""
    width = max(part.polygons.shape[1] for part in parts)
    fields = {name: np.concatenate([getattr(part, name) for part in parts])
              for name in Pieces.__dataclass_fields__ if name != "polygons"}
    wide = [np.pad(p.polygons, ((0, 0), (0, width - p.polygons.shape[1]), (0, 0)), "edge") for p in parts]
    return Pieces(polygons=np.concatenate(wide), **fields)


def shared(looks: Looks, theirs: Facets, look: Indices, facet: Indices) -> Pieces:
    """Return what these looks share with these facets of side 2, where they face each other and share something."""
    offset, normals = theirs.middles[facet] - looks.middles[look], looks.normals[look]
    beside = np.linalg.norm(offset - np.sum(offset * normals, axis=1)[:, None] * normals, axis=1)
    slope = np.sum(theirs.normals[facet] * normals, axis=1)
    near = (slope < -EDGE_ON) & (beside <= looks.reach[look] + theirs.reach[facet])
    look, facet, offset, slope = look[near], facet[near], offset[near], slope[near]
    frames = looks.frames[look]
    seen = np.einsum("kvi,kic->kvc", theirs.corners[facet] - looks.middles[look, None, :], frames)
    polygons = overlaps(seen, looks.polygons[look])
    normals = theirs.normals[facet]
    height = np.column_stack([np.sum(offset * normals, axis=1), -np.einsum("kic,ki->kc", frames, normals)])
    found = Pieces(look, facet, polygons, seen, height / slope[:, None])
    large = areas(polygons) > SHARED * areas(looks.polygons)[look]
    return found.pick(np.flatnonzero(large & (turns(seen) > 0.0).all(axis=1)))


def opposite(looks: Looks, theirs: Facets, tree: Any) -> tuple[Pieces, Array]:
    """Return (what looks share with the facets of side 2 that are nearest in front of them, share of each covered)."""
    k, n, largest = len(looks.nodes), len(theirs.nodes), float(theirs.reach.max())
    radius = (tree.query(looks.middles)[0] + looks.reach + largest) * (1.0 + WHOLE)
    few = tree.query_ball_point(looks.middles, radius, return_length=True) <= NEARBY
    near = tree.query_ball_point(looks.middles, np.where(few, radius, 0.0))
    look = np.repeat(np.arange(k), [len(one) for one in near])
    found, size = shared(looks, theirs, look, np.concatenate(near).astype(np.int64)), areas(looks.polygons)
    covered, farthest = np.bincount(found.look, areas(found.polygons), k) / size, np.zeros(k)
    np.maximum.at(farthest, found.look, found.distances(found.polygons).max(axis=1, initial=0.0))
    # what is nearer along the direction lies in a ball of this size: unless all of it was looked at, all facets are
    sure = (np.abs(covered - 1.0) <= WHOLE) & (np.hypot(farthest, looks.reach + largest) <= radius)
    sure &= layers(found, theirs, k) == 1
    middle = 0.5 * (theirs.middles.min(axis=0) + theirs.middles.max(axis=0))
    away = middle - looks.middles
    beside = np.linalg.norm(away - np.sum(away * looks.normals, axis=1)[:, None] * looks.normals, axis=1)
    span = looks.reach + largest + np.linalg.norm(theirs.middles - middle, axis=1).max()
    parts = [found.pick(np.flatnonzero(sure[found.look]))]
    rest = np.flatnonzero(~sure & (beside <= (1.0 + WHOLE) * span))  # others look past all of side 2
    for rows in np.array_split(rest, -(-len(rest) * n // DISTANCES)) if len(rest) else ():
        offset = theirs.middles - looks.middles[rows, None]
        along = np.einsum("knc,kc->kn", offset, looks.normals[rows])
        beside = np.einsum("knc,knc->kn", offset, offset) - along**2
        look, facet = np.nonzero(beside <= (1.0 + WHOLE) * (looks.reach[rows, None] + theirs.reach) ** 2)
        parts.append(shared(looks, theirs, rows[look], facet))
    found = joined(parts)
    twice = np.bincount(found.look, areas(found.polygons), k) > (1.0 + WHOLE) * size
    found = nearest(found, twice | (layers(found, theirs, k) > 1), size)
    return found, np.bincount(found.look, areas(found.polygons), k) / size


def layers(pieces: Pieces, theirs: Facets, count: int) -> Indices:
    """Return how many parts without a common node the pieces in front of each look are of: one may hide another."""
    nodes = pieces.look[:, None] * (int(theirs.nodes.max()) + 1) + theirs.nodes[pieces.facet]
    nodes = np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape)
    links = np.stack([np.repeat(np.arange(len(nodes)), nodes.shape[1]), len(nodes) + nodes.ravel()])
    part = components(len(nodes) + nodes.size, [links])[: len(nodes)]
    return np.bincount(pieces.look[np.unique(part, return_index=True)[1]], minlength=count)


def nearest(pieces: Pieces, several: Mask, size: Array) -> Pieces:
    """Return the pieces, in front of looks with several layers without what lies behind others."""
    among = several[pieces.look]
    ours = pieces.pick(np.flatnonzero(among))
    ours = ours.pick(np.argsort(ours.look, kind="stable"))
    piece, other = pairs_of(ours.look)
    least, hides = SHARED * size[ours.look], np.zeros(len(piece), dtype=bool)
    for rows in np.array_split(np.arange(len(piece)), 1 + len(piece) // POINTS):
        one, two = ours.pick(piece[rows]), ours.pick(other[rows])
        common = overlaps(one.polygons, two.polygons)
        middles, shares = common.mean(axis=1, keepdims=True), areas(common)
        hides[rows] = (shares > least[piece[rows]]) & (two.distances(middles) < one.distances(middles))[:, 0]
    piece, other = piece[hides], other[hides]
    turn = np.arange(len(piece)) - np.searchsorted(piece, piece)
    owner, left = np.arange(len(ours.look)), ours.polygons
    for k in range(int(turn.max(initial=-1)) + 1):  # what is left of each, without the next that hides it
        hider = np.full(len(ours.look), -1)
        hider[piece[turn == k]] = other[turn == k]
        cut_now = hider[owner] >= 0
        now = owner[cut_now]
        place, rest = without(left[cut_now], ours.polygons[hider[now]], least[now])
        owner, left = np.concatenate([owner[~cut_now], now[place]]), stacked([left[~cut_now], rest])
    return joined([pieces.pick(np.flatnonzero(~among)), replace(ours.pick(owner), polygons=left)])


def pairs_of(groups: Indices) -> tuple[Indices, Indices]:
    """Return all pairs of different places with the same number in ``groups``, which ascend."""
    _, first, counts = np.unique(groups, return_index=True, return_counts=True)
    start, count = np.repeat(first, counts), np.repeat(counts, counts)
    one = np.repeat(np.arange(len(groups)), count)
    two = np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start, count)
    return one[one != two], two[one != two]


def integrals(looks: Looks, pieces: Pieces) -> tuple[Array, Array]:
    """Return ∫ phi phiᵀ (looks, v, v) over the pieces of looks, and by piece ∫ phi_i phi_j (pieces, v, w) with the
    functions of side 2."""
    k, v, w = len(looks.nodes), looks.polygons.shape[1], pieces.seen.shape[1]
    own, mixed = np.zeros((len(pieces.look), v * v)), np.zeros((len(pieces.look), v * w))
    orders = np.maximum(order_of(looks.polygons)[pieces.look], order_of(pieces.seen))
    groups = [group for order in np.unique(orders) for same in [np.flatnonzero(orders == order)]
              for group in np.array_split(same, 1 + len(same) * order**2 // POINTS)]
    for group in groups:
        piece, corners = triangles(pieces.polygons[group])
        piece, (places, weights) = group[piece], rule(int(orders[group[0]]))
        points = np.einsum("qc,kcx->kqx", places, corners)
        phi, other = hats(looks.polygons[pieces.look[piece]], points), hats(pieces.seen[piece], points)
        weighted = phi * (weights[:, None] * (areas(corners) / looks.slant[pieces.look[piece]])[:, None, None])
        weighted = weighted.swapaxes(1, 2)
        own += summed(piece, weighted @ phi, len(own))
        mixed += summed(piece, weighted @ other, len(own))
    return summed(pieces.look, own, k).reshape(k, v, v), mixed.reshape(-1, v, w)


def order_of(polygons: Array) -> Indices:
    """Return how many Gauss points a way (k,) integrate products of the shape functions of facets: exactly on triangles
    and parallelograms, to round-off on distorted quadrilaterals, on which the functions are no polynomials."""
    if polygons.shape[1] == 3:
        return np.full(len(polygons), 2)
    corner = turns(polygons)
    low, high = corner.min(axis=1), corner.max(axis=1)
    distorted = np.maximum((high - low) / (high + low), 1e-16)
    # measured: an error of 1e-11 of the integrals where a piece is a whole facet, less on smaller pieces
    return np.asarray(np.clip(np.ceil(2.0 - 8.5 / np.log(distorted)), 3, MOST_POINTS).astype(np.int64))


def summed(place: Indices, values: Array, count: int) -> Array:
    """Return sums (count, ...) of rows of values that have the same place, as rows of numbers."""
    ones = sp.csr_matrix((np.ones(len(place)), (place, np.arange(len(place)))), shape=(count, len(place)))
    return np.asarray(ones @ values.reshape(len(place), int(np.prod(values.shape[1:]))))


def dual(looks: Looks, own: Array, whole: Mask) -> Array:
    """Return A (looks, v, v) of the functions psi = A phi of looks."""
    D = own.sum(axis=2)
    middle = np.einsum("kv,kvc->kc", D, looks.polygons) / D.sum(axis=1)[:, None]
    linear = np.concatenate([np.ones((*D.shape, 1)), looks.polygons - middle[:, None, :]], axis=2)
    linear[:, :, 1:] /= looks.reach[:, None, None]
    across = linear.swapaxes(1, 2)
    A = linear @ np.linalg.inv(across @ own @ linear) @ across
    A[whole] = np.linalg.inv(own[whole])
    return D[:, :, None] * A


def entries(values: Array, rows: Indices, columns: Indices, m: int, n: int) -> sp.coo_matrix:
    """Return values (k, v, w) summed at their rows (k, v) and columns (k, w); column -1 stands for none."""
    places = [place.ravel() for place in np.broadcast_arrays(rows[:, :, None], columns[:, None, :])]
    used = places[1] >= 0
    return sp.csr_matrix((values.ravel()[used], tuple(place[used] for place in places)), shape=(m, n)).tocoo()


def handed_over(functions: Array, D: Array, common: Mask) -> tuple[Array, Array, Array]:
    """Return (psi (k, v, v), D (k, v), forces (k, v, v)) where nodes (k, v) are ``common`` to both sides (``mortar``):
    others of their facet share their functions. ``forces``: shares of ∫ psi_t, which they pass to the former."""
    if not common.any():
        return functions, D, np.zeros_like(functions)
    share = ~common / np.maximum(np.sum(~common, axis=1), 1)[:, None]
    lost = np.sum(functions * common[:, :, None], axis=1)
    forces = share[:, :, None] * (D * common)[:, None, :]
    return functions * ~common[:, :, None] + share[:, :, None] * lost[:, None, :], D * ~common, forces


def in_space(one: Side, two: Side) -> tuple[Array, sp.csr_matrix, Array]:
    """Return D (m,), M (m, n) and the size (m,) [m] of the largest facet in front of side 2 of each node of side 1."""
    ours, theirs = facets_of(one, 1), facets_of(two, -1)
    from scipy.spatial import cKDTree  # late: it takes a while

    tree, looks = cKDTree(theirs.middles), looks_of(ours, one.nodes)
    m, n, partner = len(one.nodes.points), len(two.nodes.points), common_nodes(one, two)
    D, longest, parts = np.zeros(m), np.zeros(m), [sp.coo_matrix((m, n))]
    for rows in np.array_split(np.arange(len(looks.nodes)), 1 + len(looks.nodes) // BLOCK):
        if not len(rows):
            continue
        some = looks.pick(rows)
        pieces, covered = opposite(some, theirs, tree)
        pieces = pieces.pick(np.flatnonzero((covered > LEAST_COVERED)[pieces.look]))
        kept, look = np.unique(pieces.look, return_inverse=True)
        if not len(kept):
            continue
        some = some.pick(kept)
        pieces = replace(pieces, look=look.ravel())
        own, mixed = integrals(some, pieces)
        common, asking = partner[some.nodes], some.asking[:, :, None]
        functions = dual(some, own, covered[kept] >= 1.0 - WHOLE)
        functions, own_D, forces = handed_over(functions, own.sum(axis=2), common >= 0)
        values = (functions * asking)[pieces.look] @ mixed
        parts.append(entries(values, some.nodes[pieces.look], theirs.nodes[pieces.facet], m, n))
        if (common >= 0).any():
            parts.append(entries(-forces * asking, some.nodes, common, m, n))
        np.add.at(D, some.nodes, own_D * some.asking)
        reach = np.maximum(some.reach[pieces.look], theirs.reach[pieces.facet])
        np.maximum.at(longest, some.nodes[pieces.look], 2.0 * reach[:, None] * some.asking[pieces.look])
    values, *places = (np.concatenate([getattr(part, name) for part in parts]) for name in ("data", "row", "col"))
    return D, sp.csr_matrix((values, tuple(places)), shape=(m, n)), longest
