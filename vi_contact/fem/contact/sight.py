"""Find what the nodes of side 1 see of side 2 in space.

It is seen along their normals, as polygons of a plane.

A facet of side 1 is seen along the normal of each of its nodes; where all nodes have its normal, on
plane sides, they look at once. What a look shares with the facets in front of it is cut out; of
several layers the nearest counts.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.checks import at
from ...core.errors import InputError
from ...core.surfaces import nodal_frames
from ...meshes.rows import connected
from .clipping import areas, cross, overlaps, stacked, turns, without
from .matching import DISTANCES, EDGE_ON, Side
from .nodes import Nodes, Rows

SHARED = 1e-13  # of a facet's area: less is nothing
WHOLE = 1e-6  # of a facet's area: round-off of what is cut out of it
SLIVER = 1e-6  # area of a facet over the square of its length: less has no reliable normal
NEARBY = 500  # facets of side 2 that are looked at first
PAIRS = 2**18  # of pieces that are cut at once


@dataclass(frozen=True, eq=False)
class Facets:
    """Hold the facets of a side.

    This is rows of nodes (k, v), corners (k, v, 3), middles, outward normals, and the largest
    distance of a corner from the middle.
    """

    nodes: Indices
    corners: Array
    middles: Array
    normals: Array
    reach: Array


def facets_of(side: Side, sense: int) -> Facets:
    """Return the facets of a side.

    They are anticlockwise (sense 1) or clockwise (-1) seen from outside.

    Raises:
        InputError: slivers, and quadrilaterals that are not convex.
    """
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
    nodes, corners = (
        np.take_along_axis(nodes, order, axis=1),
        np.take_along_axis(corners, order[:, :, None], axis=1),
    )
    seen, reach = (
        np.take_along_axis(seen, order[:, :, None], axis=1),
        np.linalg.norm(spokes, axis=2).max(axis=1),
    )
    for bad in np.flatnonzero((turns(seen) <= SLIVER * reach[:, None] ** 2).any(axis=1)):
        raise InputError(
            f"a facet of '{side.name}' at {at(middles[bad])} is a sliver or not convex: its normal "
            "cannot be trusted, so mesh this boundary again"
        )
    return Facets(nodes[:, ::sense], corners[:, ::sense], middles, normals, reach)


@dataclass(frozen=True, eq=False)
class Looks(Rows):
    """Hold facets of side 1, each seen along the normals of some of its nodes.

    Attributes:
        nodes, middles, reach: of the facets, as in `Facets`.
        asking: for which of its nodes (k, v) each is seen.
        normals: along which they are seen.
        frames: two unit vectors (k, 3, 2) beside that.
        slant: its cosine to the facet's own normal, the share of the area that is seen.
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
    asking = (
        np.concatenate([np.ones((plane.sum(), v)), np.tile(np.eye(v), ((~plane).sum(), 1))]) > 0.0
    )
    along = np.concatenate([ours.normals[plane], normals[~plane].reshape(-1, 3)])
    frames, slant = nodal_frames(along)[:, :, 1:], np.sum(along * ours.normals[facet], axis=1)
    polygons = np.einsum("kvi,kic->kvc", ours.corners[facet] - ours.middles[facet, None, :], frames)
    looks = Looks(
        ours.nodes[facet],
        ours.middles[facet],
        ours.reach[facet],
        along,
        frames,
        polygons,
        slant,
        asking,
    )
    return looks.pick(np.flatnonzero((slant > EDGE_ON) & (turns(polygons) > 0.0).all(axis=1)))


@dataclass(frozen=True, eq=False)
class Pieces(Rows):
    """Hold what looks share with facets of side 2.

    This is numbers of both, polygons (k, m, 2), the facet as it is seen (k, v, 2), and its height h
    along the look, h_0 + h_1 x + h_2 y.
    """

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
    fields = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in Pieces.__dataclass_fields__
        if name != "polygons"
    }
    return Pieces(polygons=stacked([part.polygons for part in parts]), **fields)


def shared(looks: Looks, theirs: Facets, look: Indices, facet: Indices) -> Pieces:
    """Return what these looks share with these facets of side 2.

    They do where they face each other and share something.
    """
    offset, normals = theirs.middles[facet] - looks.middles[look], looks.normals[look]
    away = np.linalg.norm(offset - np.sum(offset * normals, axis=1)[:, None] * normals, axis=1)
    slope = np.sum(theirs.normals[facet] * normals, axis=1)
    near = (slope < -EDGE_ON) & (away <= looks.reach[look] + theirs.reach[facet])
    look, facet, offset, slope = look[near], facet[near], offset[near], slope[near]
    frames = looks.frames[look]
    seen = np.einsum("kvi,kic->kvc", theirs.corners[facet] - looks.middles[look, None, :], frames)
    polygons = overlaps(seen, looks.polygons[look])
    normals = theirs.normals[facet]
    height = np.column_stack(
        [np.sum(offset * normals, axis=1), -np.einsum("kic,ki->kc", frames, normals)]
    )
    found = Pieces(look, facet, polygons, seen, height / slope[:, None])
    large = areas(polygons) > SHARED * areas(looks.polygons)[look]
    return found.pick(np.flatnonzero(large & (turns(seen) > 0.0).all(axis=1)))


def opposite(looks: Looks, theirs: Facets, tree: Any) -> tuple[Pieces, Array]:
    """Return (what looks share with the nearest facets of side 2, share of each covered).

    The facets are the nearest in front of them; ``tree``: that of the middles of the facets of side
    2.
    """
    k, size = len(looks.nodes), areas(looks.polygons)
    found, radius = nearby(looks, theirs, tree)
    sure = complete(found, looks, theirs, radius)
    found = joined(
        [
            found.pick(np.flatnonzero(sure[found.look])),
            *everything(looks, np.flatnonzero(~sure), theirs),
        ]
    )
    twice = np.bincount(found.look, areas(found.polygons), k) > (1.0 + WHOLE) * size
    found = nearest(found, twice | (layers(found, theirs, k) > 1), size)
    return found, np.bincount(found.look, areas(found.polygons), k) / size


def nearby(looks: Looks, theirs: Facets, tree: Any) -> tuple[Pieces, Array]:
    """Return (what looks share with facets of side 2 in a ball around each, the radii [m]).

    The balls are large enough for the facets next to the one with the nearest middle; where it
    holds too many nothing is looked at.
    """
    radius = (tree.query(looks.middles)[0] + looks.reach + float(theirs.reach.max())) * (
        1.0 + WHOLE
    )
    few = tree.query_ball_point(looks.middles, radius, return_length=True) <= NEARBY
    near = tree.query_ball_point(looks.middles, np.where(few, radius, 0.0))
    look = np.repeat(np.arange(len(radius)), [len(one) for one in near])
    return shared(looks, theirs, look, np.concatenate(near).astype(np.int64)), radius


def complete(found: Pieces, looks: Looks, theirs: Facets, radius: Array) -> Mask:
    """Return whether nothing that is nearer to a look can lie outside of its ball.

    It would be nearer than what was found.

    Where one layer, at most h away along the normal, covers all of a look, a nearer facet has its
    middle at most h along the normal and reach_1 + reach_2 beside it: within sqrt(h² + (reach_1 +
    reach_2)²) of the look's middle.
    """
    covered, farthest = (
        np.bincount(found.look, areas(found.polygons), len(radius)),
        np.zeros(len(radius)),
    )
    np.maximum.at(farthest, found.look, found.distances(found.polygons).max(axis=1, initial=0.0))
    whole = np.abs(covered / areas(looks.polygons) - 1.0) <= WHOLE
    inside = np.hypot(farthest, looks.reach + float(theirs.reach.max())) <= radius
    return np.asarray(whole & inside & (layers(found, theirs, len(radius)) == 1))


def everything(looks: Looks, rows: Indices, theirs: Facets) -> Iterator[Pieces]:
    """Yield what these rows of looks share with any facet of side 2.

    Rows whose normal misses a ball around all of it are left out.
    """
    middle = 0.5 * (theirs.middles.min(axis=0) + theirs.middles.max(axis=0))
    span = (
        looks.reach
        + float(theirs.reach.max())
        + np.linalg.norm(theirs.middles - middle, axis=1).max()
    )
    rows = rows[beside(looks, rows, middle) <= (1.0 + WHOLE) * span[rows]]
    for some in (
        np.array_split(rows, -(-len(rows) * len(theirs.nodes) // DISTANCES)) if len(rows) else ()
    ):
        away = beside(looks, some[:, None], theirs.middles)
        look, facet = np.nonzero(away <= (1.0 + WHOLE) * (looks.reach[some, None] + theirs.reach))
        yield shared(looks, theirs, some[look], facet)


def beside(looks: Looks, rows: Indices, points: Array) -> Array:
    """Return how far points are from the normals through the middles of these rows of looks [m]."""
    offset = points - looks.middles[rows]
    along = np.sum(offset * looks.normals[rows], axis=-1)
    return np.sqrt(np.maximum(np.sum(offset**2, axis=-1) - along**2, 0.0))


def layers(pieces: Pieces, theirs: Facets, count: int) -> Indices:
    """Return how many parts without a common node the pieces in front of each look are of.

    One may hide another.
    """
    nodes = pieces.look[:, None] * (int(theirs.nodes.max()) + 1) + theirs.nodes[pieces.facet]
    nodes = np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape)
    links = np.repeat(np.arange(len(nodes)), nodes.shape[1]), len(nodes) + nodes.ravel()
    part = connected(len(nodes) + nodes.size, *links)[: len(nodes)]
    return np.bincount(pieces.look[np.unique(part, return_index=True)[1]], minlength=count)


def nearest(pieces: Pieces, several: Mask, size: Array) -> Pieces:
    """Return the pieces, in front of looks with several layers without what lies behind others."""
    among = several[pieces.look]
    ours = pieces.pick(np.flatnonzero(among))
    ours = ours.pick(np.argsort(ours.look, kind="stable"))
    piece, other = pairs_of(ours.look)
    least, hides = SHARED * size[ours.look], np.zeros(len(piece), dtype=bool)
    for rows in np.array_split(np.arange(len(piece)), 1 + len(piece) // PAIRS):
        one, two = ours.pick(piece[rows]), ours.pick(other[rows])
        common = overlaps(one.polygons, two.polygons)
        middles, shares = common.mean(axis=1, keepdims=True), areas(common)
        hides[rows] = (shares > least[piece[rows]]) & (
            two.distances(middles) < one.distances(middles)
        )[:, 0]
    piece, other = piece[hides], other[hides]
    turn = np.arange(len(piece)) - np.searchsorted(piece, piece)
    owner, left = np.arange(len(ours.look)), ours.polygons
    # what is left of each, without the next that hides it
    for k in range(int(turn.max(initial=-1)) + 1):
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
