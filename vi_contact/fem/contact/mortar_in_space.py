"""Integrate the dual mortar coupling of sides in space, of triangles and quadrilaterals.

A node of side 1 looks along its own normal, so that what it faces lies on that normal and normal
forces have no moment. Along it, its facets and those of side 2 are seen as polygons of a plane
(``sight``); what each two of them share is cut out and integrated. On a facet

    psi_s = D_s b(x)ᵀ (∫ b bᵀ)⁻¹ b(x_s),   D_s = ∫ phi_s   over its part in front of side 2

with b = phi if that is all of it (biorthogonal functions, of distorted quadrilaterals too) and b =
(1, x, y) if it is a part: bilinear functions, carried on from a strip of a facet to its far nodes,
grow without bound as the strip thins. Both keep sum_s psi_s = 1, ∫ psi_s = D_s > 0 and ∫ psi_s x =
D_s x_s, and are the same on triangles.

The steps of ``in_space``: looks and pieces some at a time (``_Block``), the integrals of each
block, what all of them cover (``covering``), and D and M from the blocks. Letters in shapes: v
nodes of a facet of side 1, w of side 2, m and n nodes of the sides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from .clipping import areas, hats, rule, triangles, turns
from .covering import Carried, Coupled, Covered, couple, extrapolation
from .curves import FARTHER, curvatures, may_overlap
from .matching import Side, common_nodes
from .sight import WHOLE, Facets, Looks, Pieces, facets_of, looks_of, opposite

PLANE = 1e-12  # turning of a facet's normals in radians: less is round-off
ROUND_OFF = 1e-6  # of a facet: less of it in front of side 2 is nothing
BLOCK = 512  # facets that are cut at once
MOST_POINTS = 20  # of Gauss a way
POINTS = 2**18  # at which functions are held at once, a few for each triangle of a piece


def integrate(looks: Looks, pieces: Pieces) -> tuple[Array, Array]:
    """Integrate products of shape functions over what looks share with facets of side 2.

    Args:
        looks: those of side 1.
        pieces: what they share.

    Returns:
        ∫ phi phiᵀ (looks, v, v) of the functions of side 1, summed over the pieces of a look, and
        ∫ phi_i phi_j (pieces, v, w) of the functions of both sides by piece [m²].
    """
    k = len(looks.nodes)
    v = looks.polygons.shape[1]
    w = pieces.seen.shape[1]
    own = np.zeros((len(pieces.look), v * v))
    mixed = np.zeros((len(pieces.look), v * w))
    orders = np.maximum(order_of(looks.polygons)[pieces.look], order_of(pieces.seen))
    for group in _groups_of(orders):
        # triangles of the pieces, and the points of the rule in them
        part, corners = triangles(pieces.polygons[group])
        piece = group[part]
        look = pieces.look[piece]
        places, weights = rule(int(orders[group[0]]))
        points = np.einsum("qc,kcx->kqx", places, corners)
        # functions of both sides at these points; areas are those on the facet of side 1
        phi = hats(looks.polygons[look], points)
        other = hats(pieces.seen[piece], points)
        weighted = phi * (weights[:, None] * (areas(corners) / looks.slant[look])[:, None, None])
        weighted = weighted.swapaxes(1, 2)
        own += sum_rows(piece, weighted @ phi, len(own))
        mixed += sum_rows(piece, weighted @ other, len(own))
    return sum_rows(pieces.look, own, k).reshape(k, v, v), mixed.reshape(-1, v, w)


def _groups_of(orders: Indices) -> Iterator[Indices]:
    """Yield groups of pieces of one order (k,), few enough to hold functions at their points."""
    for order in np.unique(orders):
        same = np.flatnonzero(orders == order)
        yield from np.array_split(same, 1 + len(same) * order**2 // POINTS)


def order_of(polygons: Array) -> Indices:
    """Return how many Gauss points a way (k,) integrate products of the shape functions of facets.

    They do so exactly on triangles and parallelograms, to round-off on distorted quadrilaterals, on
    which the functions are no polynomials.
    """
    if polygons.shape[1] == 3:
        return np.full(len(polygons), 2)
    # how unlike the determinants at the corners of a quadrilateral are: 0 of a parallelogram
    corner = turns(polygons)
    low = corner.min(axis=1)
    high = corner.max(axis=1)
    distorted = np.maximum((high - low) / (high + low), 1e-16)
    # measured: an error of 1e-11 of the integrals where a piece is a whole facet, less on smaller
    # pieces
    return np.asarray(
        np.clip(np.ceil(2.0 - 8.5 / np.log(distorted)), 3, MOST_POINTS).astype(np.int64)
    )


def sum_rows(place: Indices, values: Array, count: int) -> Array:
    """Return sums of rows of values that have the same place.

    Args:
        place: (n,) the row of the sum to which each row of values belongs.
        values: (n, ...) rows.
        count: how many sums there are.

    Returns:
        (count, size of a row).
    """
    ones = sp.csr_matrix(
        (np.ones(len(place)), (place, np.arange(len(place)))), shape=(count, len(place))
    )
    return np.asarray(ones @ values.reshape(len(place), int(np.prod(values.shape[1:]))))


def make_dual(looks: Looks, own: Array, whole: Mask) -> Array:
    """Return A (looks, v, v) of the dual functions psi = A phi of looks.

    Args:
        looks: those of side 1.
        own: (looks, v, v) ∫ phi phiᵀ over their parts in front of side 2.
        whole: (looks,) those that are in front of side 2 as a whole: b = phi there, else b = (1,
            x, y).
    """
    linear, inverse, _ = linear_functions(looks, own)
    A = linear @ inverse @ linear.swapaxes(1, 2)
    A[whole] = np.linalg.inv(own[whole])
    return own.sum(axis=2)[:, :, None] * A


def linear_functions(looks: Looks, own: Array) -> tuple[Array, Array, Array]:
    """Return what is to be known of b = (1, x, y) on looks.

    x and y are measured from the middle of what is in front of side 2, over the reach of the facet,
    so that the entries of ∫ b bᵀ are of one size.

    Args:
        looks: those of side 1.
        own: (looks, v, v) ∫ phi phiᵀ over their parts in front of side 2.

    Returns:
        b at the nodes (looks, v, 3), (∫ b bᵀ)⁻¹ (looks, 3, 3), and these middles (looks, 1, 2) [m].
    """
    D = own.sum(axis=2)
    middle = np.einsum("kv,kvc->kc", D, looks.polygons) / D.sum(axis=1)[:, None]
    linear = np.concatenate([np.ones((*D.shape, 1)), looks.polygons - middle[:, None, :]], axis=2)
    linear[:, :, 1:] /= looks.reach[:, None, None]
    return linear, np.linalg.inv(linear.swapaxes(1, 2) @ own @ linear), middle[:, None, :]


def sum_entries(values: Array, rows: Indices, columns: Indices, m: int, n: int) -> sp.coo_matrix:
    """Return the matrix (m, n) of values, summed where several have one row and column.

    Args:
        values: (k, v, w).
        rows: (k, v).
        columns: (k, w), -1 for none.
        m: how many rows there are.
        n: how many columns.
    """
    places = [place.ravel() for place in np.broadcast_arrays(rows[:, :, None], columns[:, None, :])]
    used = places[1] >= 0
    return sp.csr_matrix(
        (values.ravel()[used], tuple(place[used] for place in places)), shape=(m, n)
    ).tocoo()


def hand_over(functions: Array, D: Array, common: Mask) -> tuple[Array, Array, Array]:
    """Let nodes of both sides hand their functions to the others of their facets (``mortar``).

    Args:
        functions: (k, v, v) A of psi = A phi.
        D: (k, v) ∫ psi.
        common: (k, v) nodes t of both sides.

    Returns:
        A and D, in which others share the functions of common nodes, and forces (k, v, v): shares
        of ∫ psi_t, which the others pass to t.
    """
    if not common.any():
        return functions, D, np.zeros_like(functions)
    share = ~common / np.maximum(np.sum(~common, axis=1), 1)[:, None]
    lost = np.sum(functions * common[:, :, None], axis=1)
    forces = share[:, :, None] * (D * common)[:, None, :]
    return (
        functions * ~common[:, :, None] + share[:, :, None] * lost[:, None, :],
        D * ~common,
        forces,
    )


@dataclass(frozen=True, eq=False)
class _Block:
    """Hold some looks with something in front of them.

    Attributes:
        looks: those of side 1.
        pieces: what they share with side 2.
        covered: (looks,) share of each that is covered.
        own: (looks, v, v) ∫ phi phiᵀ of the functions of side 1 [m²].
        mixed: (pieces, v, w) ∫ phi_i phi_j of those of both sides [m²].
    """

    looks: Looks
    pieces: Pieces
    covered: Array
    own: Array
    mixed: Array

    def inside(self) -> Mask:
        """Return which nodes (looks, v) of the facets are in front of side 2 themselves."""
        phi = hats(self.looks.polygons[self.pieces.look], self.pieces.polygons)
        # a corner of a piece is a node where its function is one
        largest = np.zeros(self.looks.nodes.shape)
        np.maximum.at(largest, self.pieces.look, phi.max(axis=1))
        return np.asarray(largest >= 1.0 - WHOLE)

    def middles(self) -> Array:
        """Return the middles (looks, 3) of the covered parts.

        They are means of those of the pieces, weighted with areas.
        """
        size = areas(self.pieces.polygons)
        looks = self.looks
        seen = sum_rows(
            self.pieces.look, size[:, None] * self.pieces.polygons.mean(axis=1), len(looks.nodes)
        )
        seen /= sum_rows(self.pieces.look, size[:, None], len(looks.nodes))
        return looks.middles + np.einsum("kic,kc->ki", looks.frames, seen)


def in_space(side1: Side, side2: Side) -> Coupled:
    """Couple sides of solid bodies: what do looks see, what do they cover, then D and M."""
    ours = facets_of(side1, 1)
    theirs = facets_of(side2, -1)
    from scipy.spatial import cKDTree  # late: it takes a while

    tree = cKDTree(theirs.middles)
    looks = looks_of(ours, side1.nodes)
    blocks = []
    # cut and integrate some looks at a time; those with nothing in front of them are left out
    for rows in np.array_split(np.arange(len(looks.nodes)), 1 + len(looks.nodes) // BLOCK):
        if not len(rows):
            continue
        some = looks.pick(rows)
        pieces, covered = opposite(some, theirs, tree)
        pieces = pieces.pick(np.flatnonzero((covered > ROUND_OFF)[pieces.look]))
        # number the looks anew that have pieces
        with_pieces, look = np.unique(pieces.look, return_inverse=True)
        if not len(with_pieces):
            continue
        some = some.pick(with_pieces)
        pieces = replace(pieces, look=look.ravel())
        own, mixed = integrate(some, pieces)
        blocks.append(_Block(some, pieces, covered[with_pieces], own, mixed))
    covered_parts = _measure_cover(ours, blocks, common_nodes(side1, side2) >= 0)
    return couple(covered_parts, lambda carried: _assemble(side1, side2, theirs, blocks, carried))


def _measure_cover(ours: Facets, blocks: Sequence[_Block], common: Mask) -> Covered:
    """Measure what is covered of the looks of these blocks, of each for the nodes that ask.

    Args:
        ours: the facets of side 1.
        blocks: their looks, some at a time.
        common: (m,) nodes of side 1 that are nodes of side 2 too.
    """
    v = ours.nodes.shape[1]
    weights = []
    full = []
    inside = []
    for block in blocks:
        looks = block.looks
        weights.append(block.own.sum(axis=2) * looks.asking)
        full.append(_whole_weights(looks) * looks.asking)
        inside.append(block.inside() & looks.asking)
    nodes = [block.looks.nodes for block in blocks]
    none = np.zeros((0, v))
    return Covered(
        facets=np.concatenate([none.astype(np.int64), *nodes]),
        middles=np.concatenate([np.zeros((0, 3)), *(block.middles() for block in blocks)]),
        weights=np.concatenate([none, *weights]),
        full=np.concatenate([none, *full]),
        inside=np.concatenate([none > 0.0, *inside]),
        parts=np.concatenate([none[:, 0], *(block.covered for block in blocks)]),
        common=common,
    )


def _whole_weights(looks: Looks) -> Array:
    """Return integrals (looks, v) of the functions of the nodes over whole facets [m²]."""
    k, v = looks.nodes.shape
    piece, corners = triangles(looks.polygons)
    places, weights = rule(3)
    phi = hats(looks.polygons[piece], np.einsum("qc,kcx->kqx", places, corners))
    sizes = areas(corners) / looks.slant[piece]
    return sum_rows(piece, np.einsum("q,kqv,k->kv", weights, phi, sizes), k).reshape(k, v)


def _assemble(
    side1: Side, side2: Side, theirs: Facets, blocks: Sequence[_Block], carried: Carried
) -> tuple[Array, sp.csr_matrix, Array]:
    """Return D (m,), M (m, n) and by how much facets of one curved face may overlap (m,) [m].

    Args:
        side1: side 1, of m nodes.
        side2: side 2, of n nodes.
        theirs: the facets of side 2.
        blocks: the looks of side 1, some at a time.
        carried: nodes that others carry.
    """
    m = len(side1.nodes.points)
    n = len(side2.nodes.points)
    partner = common_nodes(side1, side2)
    D = np.zeros(m)
    overlap = np.zeros(m)
    parts = [sp.coo_matrix((m, n))]  # of M
    start = 0  # of the rows of ``carried`` that are those of a block
    points = side1.nodes.points
    H = curvatures(theirs.corners, theirs.nodes, theirs.normals)
    curved = bool(np.any(np.linalg.norm(H, axis=(1, 2)) * theirs.reach > PLANE))
    for block in blocks:
        some = block.looks
        pieces = block.pieces
        own = block.own
        rows = slice(start, start + len(some.nodes))
        by = carried.by[rows]
        used = carried.used[rows, None]
        start = rows.stop
        # functions of the nodes that ask, are used, and are not carried by others
        borne = carried.nodes[some.nodes] & some.asking
        asking = (some.asking & used & ~borne)[:, :, None]
        common = partner[some.nodes]
        functions = make_dual(some, own, (block.covered >= 1.0 - WHOLE) & ~borne.any(axis=1))
        functions, own_D, forces = hand_over(functions, own.sum(axis=2), common >= 0)
        # their share in M and D, and what they pass to nodes of both sides
        values = (functions * asking)[pieces.look] @ block.mixed
        parts.append(sum_entries(values, some.nodes[pieces.look], theirs.nodes[pieces.facet], m, n))
        if (common >= 0).any():
            parts.append(sum_entries(-forces * asking, some.nodes, common, m, n))
        np.add.at(D, some.nodes, own_D * asking[:, :, 0])
        # what facets of one curved face may overlap, also where functions are carried on
        if curved:
            piece = _find_overlap(points[some.nodes], theirs, H, block)[:, None]
            np.maximum.at(overlap, some.nodes[pieces.look], piece * some.asking[pieces.look])
            np.maximum.at(
                overlap, by[pieces.look], FARTHER * piece * borne.any(axis=1)[pieces.look, None]
            )
        if borne.any():
            parts.append(_carry(D, side1.nodes.points, theirs, block, by, borne, n))
    values = np.concatenate([part.data for part in parts])
    rows_of_values = np.concatenate([part.row for part in parts])
    columns = np.concatenate([part.col for part in parts])
    return D, sp.csr_matrix((values, (rows_of_values, columns)), shape=(m, n)), overlap


def _find_overlap(corners: Array, theirs: Facets, H: Array, block: _Block) -> Array:
    """Return by how much the pieces (k,) of looks may overlap facets of one curved face [m].

    It is the most at the corners and in the middle of each.

    Args:
        corners: (looks, v, 3) of the facets of side 1 [m].
        theirs: the facets of side 2.
        H: (facets, 3, 3) their curvature [1/m].
        block: the looks and their pieces.
    """
    looks = block.looks
    pieces = block.pieces
    points = np.concatenate([pieces.polygons, pieces.polygons.mean(axis=1, keepdims=True)], axis=1)
    facet1 = hats(looks.polygons[pieces.look], points), corners[pieces.look]
    facet2 = hats(pieces.seen, points), theirs.corners[pieces.facet]
    return may_overlap(H[pieces.facet], facet1, facet2)


def _carry(
    D: Array, points: Array, theirs: Facets, block: _Block, by: Indices, borne: Mask, n: int
) -> sp.coo_matrix:
    """Add to D what nodes of other facets carry, and return what belongs to it in M (``covering``).

    Args:
        D: (m,) ∫ psi of each node of side 1; it is added to.
        points: (m, 3) nodes of side 1 [m].
        theirs: the facets of side 2.
        block: looks and their pieces.
        by: (looks, v) nodes of the facet that carries.
        borne: (looks, v) which nodes are carried.
        n: how many nodes side 2 has.
    """
    looks = block.looks
    pieces = block.pieces
    rows = np.flatnonzero(borne.any(axis=1))
    some = looks.pick(rows)
    place = np.full(len(looks.nodes), -1)
    place[rows] = np.arange(len(rows))
    own = block.own[rows]
    # E of the nodes that carry, as the look sees them, and their weights D_k = sum_t E_tk D_t
    offset = points[by[rows]] - some.middles[:, None, :]
    seen = np.einsum("kvi,kic->kvc", offset, some.frames)
    shares = extrapolation(seen, some.polygons) * borne[rows][:, :, None]
    weights = np.einsum("kpv,kp->kv", shares, own.sum(axis=2))
    np.add.at(D, by[rows], weights)
    # psi_k = D_k b(x)ᵀ G⁻¹ b(x_k), in the functions of the facet: b(x) = sum_i b(x_i) phi_i
    nodal, inverse, middles = linear_functions(some, own)
    ones = np.ones((*seen.shape[:2], 1))
    beyond = np.concatenate([ones, (seen - middles) / some.reach[:, None, None]], axis=2)
    functions = weights[:, :, None] * (beyond @ inverse @ nodal.swapaxes(1, 2))
    among = np.flatnonzero(place[pieces.look] >= 0)
    look = place[pieces.look[among]]
    values = functions[look] @ block.mixed[among]
    return sum_entries(values, by[rows][look], theirs.nodes[pieces.facet[among]], len(points), n)
