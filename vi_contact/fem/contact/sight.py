"""Find what the nodes of side 1 see of side 2 in space, along their normals.

A *look* is a facet of side 1 seen along the normal of one of its nodes, as a polygon of the plane
at right angles to it; where all nodes have the facet's own normal, as on plane sides, one look
serves them all. A *piece* is what a look shares with a facet of side 2 that is seen in the same
way. Where several layers of side 2 lie behind one another, what the nearest one hides is taken
away.

``opposite`` does the work: looks are compared with facets in a ball around them (``nearby``), and
with all facets where something nearer may lie outside (``complete``, ``everything``); then hidden
parts are cut away (``nearest``). Pairs are compared many at a time, in arrays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.checks import describe_point
from ...core.errors import InputError
from ...core.surfaces import make_nodal_frames
from ...meshes.rows import number_parts
from .clipping import areas, cross, intersect, stack, subtract, turns
from .matching import DISTANCES, EDGE_ON, Side
from .nodes import Nodes, Rows

SHARED = 1e-13  # of a facet's area: less is nothing
WHOLE = 1e-6  # of a facet's area: round-off of what is cut out of it
SLIVER = 1e-6  # area of a facet over the square of its length: less has no reliable normal
NEARBY = 500  # facets of side 2 that are looked at first
PAIRS = 2**18  # of pieces that are cut at once


@dataclass(frozen=True, eq=False)
class Facets:
    """Hold the k facets of a side.

    Attributes:
        nodes: (k, v) rows of nodes.
        corners: (k, v, 3) points of these [m].
        middles: (k, 3) means of the corners [m].
        normals: (k, 3) outward unit normals.
        reach: (k,) largest distance of a corner from the middle [m].
    """

    nodes: Indices
    corners: Array
    middles: Array
    normals: Array
    reach: Array


def facets_of(side: Side, sense: int) -> Facets:
    """Return the facets of a side.

    Args:
        side: the boundary.
        sense: 1 for corners anticlockwise as seen from outside, -1 for clockwise ones.

    Raises:
        InputError: slivers, and quadrilaterals that are not convex.
    """
    nodes = np.sort(side.facets, axis=1)
    corners = side.nodes.points[nodes]
    middles = corners.mean(axis=1)
    spokes = corners - middles[:, None, :]
    # the plane of a facet is at right angles to the direction in which it extends least, and its
    # normal on the side of those of its nodes
    normals = np.linalg.svd(spokes)[2][:, -1]
    inward = np.sum(normals[:, None, :] * side.nodes.normals[nodes], axis=(1, 2)) < 0.0
    normals = np.where(inward[:, None], -normals, normals)
    # order the corners by their angle round the middle, from that of the first one on
    seen = np.einsum("kvi,kic->kvc", spokes, make_nodal_frames(normals)[:, :, 1:])
    sine = cross(seen[:, :1], seen)
    cosine = np.sum(seen[:, :1] * seen, axis=2)
    angle = np.arctan2(sine, cosine) % (2.0 * np.pi)
    angle[:, 0] = 0.0
    order = np.argsort(angle, axis=1)
    nodes = np.take_along_axis(nodes, order, axis=1)
    corners = np.take_along_axis(corners, order[:, :, None], axis=1)
    seen = np.take_along_axis(seen, order[:, :, None], axis=1)
    reach = np.linalg.norm(spokes, axis=2).max(axis=1)
    # twice the area of the triangle at each corner is small at a sliver, negative where it is not
    # convex
    for bad in np.flatnonzero((turns(seen) <= SLIVER * reach[:, None] ** 2).any(axis=1)):
        raise InputError(
            f"a facet of '{side.name}' at {describe_point(middles[bad])} is a sliver or not "
            "convex: its normal cannot be trusted, so mesh this boundary again"
        )
    return Facets(nodes[:, ::sense], corners[:, ::sense], middles, normals, reach)


@dataclass(frozen=True, eq=False)
class Looks(Rows):
    """Hold k looks: facets of side 1, each seen along the normal of some of its nodes.

    Attributes:
        nodes: (k, v) nodes of the facet, as in `Facets`.
        middles: (k, 3) its middle [m].
        reach: (k,) largest distance of a corner from it [m].
        normals: (k, 3) unit vectors along which the facet is seen.
        frames: (k, 3, 2) two unit vectors at right angles to that.
        polygons: (k, v, 2) the facet as it is seen, from its middle, anticlockwise [m].
        slant: (k,) cosine of the look to the facet's own normal: the share of its area that is
            seen.
        asking: (k, v) for which of its nodes it is seen.
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
    """Return the looks of all nodes of side 1, one a facet where they all look along its normal.

    Looks along which a facet is seen edge on, or folded, are left out.

    Args:
        ours: the facets of side 1.
        nodes: its nodes, with their normals.
    """
    v = ours.nodes.shape[1]
    # facets whose nodes have the normal of the facet, to round-off
    normals = nodes.normals[ours.nodes]
    plane = np.linalg.norm(normals - ours.normals[:, None, :], axis=2).max(axis=1) < 1e-12
    # one look for all nodes of a plane facet, then one for each node of every other facet
    facet = np.concatenate([np.flatnonzero(plane), np.repeat(np.flatnonzero(~plane), v)])
    all_nodes = np.ones((plane.sum(), v))
    each_node = np.tile(np.eye(v), ((~plane).sum(), 1))
    asking = np.concatenate([all_nodes, each_node]) > 0.0
    along = np.concatenate([ours.normals[plane], normals[~plane].reshape(-1, 3)])
    # the facets as they are seen
    frames = make_nodal_frames(along)[:, :, 1:]
    slant = np.sum(along * ours.normals[facet], axis=1)
    polygons = np.einsum("kvi,kic->kvc", ours.corners[facet] - ours.middles[facet, None, :], frames)
    looks = Looks(
        nodes=ours.nodes[facet],
        middles=ours.middles[facet],
        reach=ours.reach[facet],
        normals=along,
        frames=frames,
        polygons=polygons,
        slant=slant,
        asking=asking,
    )
    return looks.pick(np.flatnonzero((slant > EDGE_ON) & (turns(polygons) > 0.0).all(axis=1)))


@dataclass(frozen=True, eq=False)
class Pieces(Rows):
    """Hold k pieces: what looks share with facets of side 2.

    Attributes:
        look: (k,) number of the look.
        facet: (k,) number of the facet of side 2.
        polygons: (k, m, 2) what they share, in the plane of the look, from its middle [m].
        seen: (k, v, 2) the whole facet as it is seen there [m].
        height: (k, 3) its height along the look at (x, y), h_0 + h_1 x + h_2 y [m].
    """

    look: Indices
    facet: Indices
    polygons: Array
    seen: Array
    height: Array

    def distances(self, points: Array) -> Array:
        """Return how far along their looks (k, p) [m] the facets are at points (k, p, 2)."""
        return np.abs(self.height[:, :1] + np.einsum("kpc,kc->kp", points, self.height[:, 1:]))


def join_pieces(parts: list[Pieces]) -> Pieces:
    """Return the pieces of all parts, one part after the other."""
    return Pieces(
        look=np.concatenate([part.look for part in parts]),
        facet=np.concatenate([part.facet for part in parts]),
        polygons=stack([part.polygons for part in parts]),
        seen=np.concatenate([part.seen for part in parts]),
        height=np.concatenate([part.height for part in parts]),
    )


def cut_shared(looks: Looks, theirs: Facets, look: Indices, facet: Indices) -> Pieces:
    """Return what looks share with facets of side 2, where these face each other.

    Args:
        looks: those of side 1.
        theirs: the facets of side 2.
        look: (n,) rows of looks.
        facet: (n,) the facet that each is compared with.
    """
    # pairs that can share something: opposite normals, and circles that meet
    offset = theirs.middles[facet] - looks.middles[look]
    normals = looks.normals[look]
    away = np.linalg.norm(offset - np.sum(offset * normals, axis=1)[:, None] * normals, axis=1)
    slope = np.sum(theirs.normals[facet] * normals, axis=1)
    near = (slope < -EDGE_ON) & (away <= looks.reach[look] + theirs.reach[facet])
    look = look[near]
    facet = facet[near]
    offset = offset[near]
    slope = slope[near]
    # clip the facet, as it is seen, by the look's own polygon
    frames = looks.frames[look]
    seen = np.einsum("kvi,kic->kvc", theirs.corners[facet] - looks.middles[look, None, :], frames)
    polygons = intersect(seen, looks.polygons[look])
    # the plane of the facet, n·(x - x_f) = 0, solved for the height along the look
    normals = theirs.normals[facet]
    height = np.column_stack(
        [np.sum(offset * normals, axis=1), -np.einsum("kic,ki->kc", frames, normals)]
    )
    pieces = Pieces(look, facet, polygons, seen, height / slope[:, None])
    # without what is round-off, and facets that are seen folded
    large = areas(polygons) > SHARED * areas(looks.polygons)[look]
    return pieces.pick(np.flatnonzero(large & (turns(seen) > 0.0).all(axis=1)))


def opposite(looks: Looks, theirs: Facets, tree: Any) -> tuple[Pieces, Array]:
    """Return what looks share with the nearest facets of side 2 in front of them.

    Args:
        looks: those of side 1.
        theirs: the facets of side 2.
        tree: a KD-tree of their middles.

    Returns:
        pieces, and the share (looks,) of each look that they cover.
    """
    count = len(looks.nodes)
    size = areas(looks.polygons)
    # facets in a ball first; all of side 2 only where something nearer may be outside of it
    pieces, radius = nearby(looks, theirs, tree)
    sure = complete(pieces, looks, theirs, radius)
    rest = everything(looks, np.flatnonzero(~sure), theirs)
    pieces = join_pieces([pieces.pick(np.flatnonzero(sure[pieces.look])), *rest])
    # where several layers lie behind one another, only the nearest counts
    twice = np.bincount(pieces.look, areas(pieces.polygons), count) > (1.0 + WHOLE) * size
    pieces = nearest(pieces, twice | (layers(pieces, theirs, count) > 1), size)
    return pieces, np.bincount(pieces.look, areas(pieces.polygons), count) / size


def nearby(looks: Looks, theirs: Facets, tree: Any) -> tuple[Pieces, Array]:
    """Return what looks share with facets of side 2 in a ball around each, and the radii [m].

    A ball is large enough for the facets next to the one with the nearest middle. Where one holds
    too many facets (``NEARBY``) nothing is looked at there, and ``complete`` finds the look
    uncovered.

    Args:
        looks: those of side 1.
        theirs: the facets of side 2.
        tree: a KD-tree of their middles.
    """
    farthest = tree.query(looks.middles)[0] + looks.reach + float(theirs.reach.max())
    radius = farthest * (1.0 + WHOLE)
    few = tree.query_ball_point(looks.middles, radius, return_length=True) <= NEARBY
    near = tree.query_ball_point(looks.middles, np.where(few, radius, 0.0))
    look = np.repeat(np.arange(len(radius)), [len(facets) for facets in near])
    return cut_shared(looks, theirs, look, np.concatenate(near).astype(np.int64)), radius


def complete(pieces: Pieces, looks: Looks, theirs: Facets, radius: Array) -> Mask:
    """Return for which looks nothing nearer than their pieces can lie outside of their balls.

    Where one layer, at most h away along the normal, covers all of a look, a nearer facet has its
    middle at most h along the normal and reach_1 + reach_2 beside it: within sqrt(h² + (reach_1 +
    reach_2)²) of the look's middle.

    Args:
        pieces: what looks share with facets in the balls.
        looks: those of side 1.
        theirs: the facets of side 2.
        radius: (looks,) of the balls [m].

    Returns:
        (looks,) mask.
    """
    covered = np.bincount(pieces.look, areas(pieces.polygons), len(radius))
    farthest = np.zeros(len(radius))
    np.maximum.at(farthest, pieces.look, pieces.distances(pieces.polygons).max(axis=1, initial=0.0))
    whole = np.abs(covered / areas(looks.polygons) - 1.0) <= WHOLE
    inside = np.hypot(farthest, looks.reach + float(theirs.reach.max())) <= radius
    return np.asarray(whole & inside & (layers(pieces, theirs, len(radius)) == 1))


def everything(looks: Looks, rows: Indices, theirs: Facets) -> Iterator[Pieces]:
    """Yield what these rows of looks share with any facet of side 2.

    Rows whose normal misses a ball around all of side 2 are left out.

    Args:
        looks: those of side 1.
        rows: (r,) which of them.
        theirs: the facets of side 2.
    """
    middle = 0.5 * (theirs.middles.min(axis=0) + theirs.middles.max(axis=0))
    span = (
        looks.reach
        + float(theirs.reach.max())
        + np.linalg.norm(theirs.middles - middle, axis=1).max()
    )
    rows = rows[beside(looks, rows, middle) <= (1.0 + WHOLE) * span[rows]]
    if not len(rows):
        return
    # so many rows at once that a table of their distances to all facets is not too large
    for some in np.array_split(rows, -(-len(rows) * len(theirs.nodes) // DISTANCES)):
        away = beside(looks, some[:, None], theirs.middles)
        look, facet = np.nonzero(away <= (1.0 + WHOLE) * (looks.reach[some, None] + theirs.reach))
        yield cut_shared(looks, theirs, some[look], facet)


def beside(looks: Looks, rows: Indices, points: Array) -> Array:
    """Return how far points are from the normals through the middles of these rows of looks [m].

    Args:
        looks: those of side 1.
        rows: which of them.
        points: (…, 3) [m].
    """
    offset = points - looks.middles[rows]
    along = np.sum(offset * looks.normals[rows], axis=-1)
    return np.sqrt(np.maximum(np.sum(offset**2, axis=-1) - along**2, 0.0))


def layers(pieces: Pieces, theirs: Facets, count: int) -> Indices:
    """Return how many parts of side 2 without a common node lie in front of each look.

    With more than one, one may hide another.

    Args:
        pieces: what looks share with facets.
        theirs: the facets of side 2.
        count: how many looks there are.

    Returns:
        (count,) numbers of parts.
    """
    # a node of side 2 as each look sees it is a thing of its own: link pieces to their nodes
    nodes = pieces.look[:, None] * (int(theirs.nodes.max()) + 1) + theirs.nodes[pieces.facet]
    nodes = np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape)
    links = np.repeat(np.arange(len(nodes)), nodes.shape[1]), len(nodes) + nodes.ravel()
    part = number_parts(len(nodes) + nodes.size, *links)[: len(nodes)]
    return np.bincount(pieces.look[np.unique(part, return_index=True)[1]], minlength=count)


def nearest(pieces: Pieces, several: Mask, size: Array) -> Pieces:
    """Return the pieces without what others in front of the same look hide.

    Args:
        pieces: what looks share with facets.
        several: (looks,) which looks have several layers in front of them.
        size: (looks,) areas of their polygons [m²].
    """
    among = several[pieces.look]
    ours = pieces.pick(np.flatnonzero(among))
    ours = ours.pick(np.argsort(ours.look, kind="stable"))
    least = SHARED * size[ours.look]

    # of two pieces of one look that overlap, the one that is nearer where they do hides the other
    piece, other = pairs_of(ours.look)
    hides = np.zeros(len(piece), dtype=bool)
    for rows in np.array_split(np.arange(len(piece)), 1 + len(piece) // PAIRS):
        front = ours.pick(other[rows])
        back = ours.pick(piece[rows])
        common = intersect(back.polygons, front.polygons)
        middles = common.mean(axis=1, keepdims=True)
        behind = front.distances(middles) < back.distances(middles)
        hides[rows] = (areas(common) > least[piece[rows]]) & behind[:, 0]
    piece = piece[hides]
    other = other[hides]

    # cut out of each piece what hides it, one hider of every piece at a time; what is left of a
    # piece may be several polygons: ``left``, with the numbers of their pieces in ``owner``
    turn = np.arange(len(piece)) - np.searchsorted(piece, piece)
    owner = np.arange(len(ours.look))
    left = ours.polygons
    for k in range(int(turn.max(initial=-1)) + 1):
        hider = np.full(len(ours.look), -1)
        hider[piece[turn == k]] = other[turn == k]
        hidden = hider[owner] >= 0
        cut_piece = owner[hidden]
        place, rest = subtract(left[hidden], ours.polygons[hider[cut_piece]], least[cut_piece])
        owner = np.concatenate([owner[~hidden], cut_piece[place]])
        left = stack([left[~hidden], rest])
    return join_pieces(
        [pieces.pick(np.flatnonzero(~among)), replace(ours.pick(owner), polygons=left)]
    )


def pairs_of(groups: Indices) -> tuple[Indices, Indices]:
    """Return all pairs (p,), (p,) of different places with the same number in ``groups``.

    Args:
        groups: (n,) numbers, ascending; a pair is given both ways.
    """
    _, first, counts = np.unique(groups, return_index=True, return_counts=True)
    # each member of a group of n is followed by n others, that count up from the group's first
    start = np.repeat(first, counts)
    count = np.repeat(counts, counts)
    place = np.repeat(np.arange(len(groups)), count)
    # how many pairs of this place came before, added to the first of its group
    before = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    other = before + np.repeat(start, count)
    return place[place != other], other[place != other]
