"""Couple tied boundaries, of first or second order, by dual Lagrange multipliers.

Facets of first order are those of ``mortar``. On a facet of second order in the plane or in space

    psi = A phi,   A = diag(c) (∫ phi phiᵀ)⁻¹,   c_s = ∫ phi_s,   D_s = c_s,   P = D⁻¹ M

over all of it, with the quadratic functions phi of all nodes: every quadratic field is matched
exactly on boundaries that lie in each other. At a vertex of a triangle ∫ phi_s is zero. There c_s
is the mean share of the area: psi_s matches u_s, and no constant stress asks for it, as sum_s psi_s
= 1 over the other nodes. So a constant stress passes exactly.

Facets are projected along their own normals, curved ones as what their vertices span: then
quadratic fields and constant stresses pass up to the error of the mesh, and totals stay exact
(``body.blending``).

Source: Wohlmuth and Popp et al., SIAM J. Sci. Comput. 34 (2012), B421-B446, on dual multipliers of
second order.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.checks import describe_point
from ...core.errors import InputError
from ..body.blending import TiedSide
from .clipping import areas, hats, rule, triangles
from .matching import Matching, Side
from .mortar_in_space import ROUND_OFF, order_of, sum_entries, sum_rows
from .nodes import Nodes
from .segments import cut_segment, find_normals
from .sight import Facets, Looks, facets_of, looks_of, opposite

PLANE_POINTS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(3)[0]  # on [0, 1]: of degree 5
PLANE_WEIGHTS = 0.5 * np.polynomial.legendre.leggauss(3)[1]
SECOND_ORDER = 2  # points a way that products of second order need more than those of first
# CHOSEN: covered share of a facet of second order from which on the integrals of all its functions
# over what is covered are safely positive; they are from 3/4 on
ENOUGH = 0.9
LITTLE = 0.1  # CHOSEN: of the mean share of a facet: less is the zero of a vertex of a triangle


def couple_sides(
    matching: Matching, side: TiedSide, other: TiedSide, tied: Indices
) -> tuple[Indices, sp.csr_matrix, float]:
    """Return the rows of P, P itself, and the covered share of the side (``Coupling``).

    Args:
        matching: that of facets of first order.
        side: the boundary whose nodes follow.
        other: the one that they follow.
        tied: (k,) places on ``other`` of nodes that move as one there does, -1 for the others.

    Raises:
        InputError: boundaries that do not face each other, and facets of second order of which a
            part has nothing in front of it.
    """
    if (tied >= 0).all():
        return np.zeros(0, dtype=np.int64), sp.csr_matrix((0, len(other.numbers))), 1.0
    own = _as_side(side, tied)
    opposite_side = _as_side(other)
    measure = float(own.nodes.weights.sum())
    if side.facets.shape[1] > side.vertices:
        return _couple_second_order(side, own, other, opposite_side, tied)
    matched = matching.match(own, opposite_side, 0.0)
    return matched.rows, matched.P, float(matched.weights.sum()) / measure


def _as_side(side: TiedSide, tied: Indices | None = None) -> Side:
    """Return the vertices' facets of a tied boundary, with normals and weights of its nodes."""
    corners = side.points[side.facets[:, : side.vertices]]
    if corners.shape[1] == 2:
        size = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    else:
        # half the product of two sides of a triangle, or of the diagonals of a quadrilateral, whose
        # vertices are a grid of two rows
        ends = ((1, 0), (2, 0)) if side.vertices == 3 else ((3, 0), (2, 1))
        first, second = (corners[:, end] - corners[:, start] for end, start in ends)
        size = 0.5 * np.linalg.norm(np.cross(first, second), axis=1)
    sums = np.zeros_like(side.points)
    weights = np.zeros(len(sums))
    for column in side.facets.T:
        np.add.at(sums, column, size[:, None] * side.outward)
        np.add.at(weights, column, size / side.facets.shape[1])
    length = np.linalg.norm(sums, axis=1)[:, None]
    nodes = Nodes(
        side.numbers,
        side.points,
        sums / np.maximum(length, np.finfo(float).tiny),
        weights,
        side.held,
        np.full(side.held.shape, -1),
    )
    return Side(side.name, nodes, side.facets[:, : side.vertices], tied)


# Second order
# --------------------------------------------------------------------------------------------------


def _couple_second_order(
    side: TiedSide, own: Side, other: TiedSide, opposite_side: Side, tied: Indices
) -> tuple[Indices, sp.csr_matrix, float]:
    """Return what ``couple_sides`` does, of facets of second order.

    Args:
        side: the boundary whose nodes follow.
        own: its vertices.
        other: the one that they follow.
        opposite_side: its vertices.
        tied: as of ``couple_sides``.
    """
    integrate = _integrate_in_plane if side.points.shape[1] == 2 else _integrate_in_space
    nodes, covered, products, mixed = integrate(side, own, other, opposite_side)
    part = np.flatnonzero(covered > ROUND_OFF)
    for facet in part[covered[part] < ENOUGH]:
        where = describe_point(side.points[nodes[facet]].mean(axis=0))
        raise InputError(
            f"a part of the facet of '{side.name}' at {where} has nothing of '{other.name}' in "
            "front of it: facets of second order are tied as a whole, so mesh the tied boundary to "
            "its edge, or use degree=1"
        )
    if not len(part):
        raise InputError(
            f"no part of '{other.name}' lies opposite '{side.name}', along the normals of the "
            "latter: choose the two boundaries between the bodies"
        )
    facets = nodes[part]
    # psi = A phi on each facet, and what nodes that move as another one hand to the others
    phi = products[part].sum(axis=2)
    mean = phi.sum(axis=1, keepdims=True) / phi.shape[1]
    counts: Mask = phi > LITTLE * mean
    D: Array = np.where(counts, phi, mean)
    functions = D[:, :, None] * np.linalg.inv(products[part])
    functions, D, forces = _hand_over(functions, D, tied[facets] >= 0, counts)

    m = len(side.numbers)
    n = len(other.numbers)
    place = np.full(len(nodes), -1)
    place[part] = np.arange(len(part))
    facet, columns, values = mixed
    used = np.flatnonzero(place[facet] >= 0)
    own_functions = functions[place[facet[used]]]
    M = sum_entries(own_functions @ values[used], nodes[facet[used]], columns[used], m, n)
    M = sp.csr_matrix(M) + sp.csr_matrix(sum_entries(-forces, facets, tied[facets], m, n))
    total = np.zeros(m)
    np.add.at(total, facets, D)
    rows = np.flatnonzero(total > 0.0)
    P = sp.csr_matrix(sp.diags([1.0 / total[rows]], [0]) @ M[rows])
    return rows, P, float(products.sum()) / float(own.nodes.weights.sum())


def _hand_over(
    functions: Array, D: Array, common: Mask, counts: Mask
) -> tuple[Array, Array, Array]:
    """Let nodes of both sides hand their functions to others of their facets (``mortar``).

    Args:
        functions: (k, v, v) A of psi = A phi.
        D: (k, v) ∫ psi.
        common: (k, v) nodes that move as one of side 2.
        counts: (k, v) nodes whose functions add up to one.

    Returns:
        A and D, in which others share the functions of common nodes, and forces (k, v, v): shares
        of ∫ psi, which the others pass to these.
    """
    takes = ~common & counts
    share = takes / np.maximum(takes.sum(axis=1), 1)[:, None]
    gone = (common & counts)[:, :, None]
    lost = np.sum(functions * gone, axis=1)
    forces = share[:, :, None] * (D * (common & counts))[:, None, :]
    kept = functions * ~common[:, :, None] + share[:, :, None] * lost[:, None, :]
    return kept, D * ~common, forces


# facets (f, v) of nodes; the covered share of each (f,); ∫ phi phiᵀ (f, v, v) [m], [m²]; and of
# pieces the facet of each (p,), nodes of side 2 (p, w) and ∫ phi_i phi_j (p, v, w)
Integrals = tuple[Indices, Array, Array, tuple[Indices, Indices, Array]]


def _integrate_in_plane(
    side: TiedSide, own: Side, other: TiedSide, opposite_side: Side
) -> Integrals:
    """Integrate products of the functions of segments of second order, piece by piece."""
    ends1 = side.points[own.facets]
    ends2 = other.points[opposite_side.facets]
    normals1 = find_normals(own, ends1)
    normals2 = find_normals(opposite_side, ends2)
    covered = np.zeros(len(ends1))
    products = np.zeros((len(ends1), 3, 3))
    facets = []
    columns = []
    values = []
    for facet, (ends, normal) in enumerate(zip(ends1, normals1, strict=True)):
        length = float(np.linalg.norm(ends[1] - ends[0]))
        for low, high, segment, across in cut_segment(ends, normal, ends2, normals2):
            covered[facet] += high - low
            weights = length * (high - low) * PLANE_WEIGHTS
            phi = _quadratics(low + PLANE_POINTS * (high - low))
            theirs = _quadratics(across[0] + PLANE_POINTS * (across[1] - across[0]))
            products[facet] += phi.T @ (weights[:, None] * phi)
            facets.append(facet)
            columns.append(other.facets[segment])
            values.append(phi.T @ (weights[:, None] * theirs))
    pieces = (
        np.array(facets, dtype=np.int64),
        np.array(columns, dtype=np.int64).reshape(-1, 3),
        np.array(values).reshape(-1, 3, 3),
    )
    return side.facets, covered, products, pieces


def _quadratics(x: Array) -> Array:
    """Return the quadratic functions (q, 3) of both ends and the middle at x (q,) in [0, 1]."""
    return np.column_stack([(1.0 - x) * (1.0 - 2.0 * x), x * (2.0 * x - 1.0), 4.0 * x * (1.0 - x)])


def _integrate_in_space(
    side: TiedSide, own: Side, other: TiedSide, opposite_side: Side
) -> Integrals:
    """Integrate products of the functions of faces of second order, piece by piece."""
    from scipy.spatial import cKDTree  # late: it takes a while

    ours = facets_of(own, 1)
    theirs = facets_of(opposite_side, -1)
    looks = _look_along_own_normals(ours)
    pieces, covered = opposite(looks, theirs, cKDTree(theirs.middles))
    nodes = _arrange(side, looks.nodes)
    columns = _arrange(other, theirs.nodes)

    # triangles of the pieces, and the points of the rule in them
    part, corners = triangles(pieces.polygons)
    orders = np.concatenate([order_of(looks.polygons), order_of(pieces.seen)])
    places, weights = rule(int(orders.max()) + SECOND_ORDER)
    points = np.einsum("qc,kcx->kqx", places, corners)
    phi = _second_order(hats(looks.polygons[pieces.look[part]], points))
    phi2 = _second_order(hats(pieces.seen[part], points))
    weighted = (phi * (weights[:, None] * areas(corners)[:, None, None])).swapaxes(1, 2)
    v = phi.shape[2]
    sizes = sum_rows(part, weighted @ phi, len(pieces.look))
    products = sum_rows(pieces.look, sizes, len(nodes)).reshape(-1, v, v)
    mixed = sum_rows(part, weighted @ phi2, len(pieces.look)).reshape(-1, v, v)
    return nodes, covered, products, (pieces.look, columns[pieces.facet], mixed)


def _look_along_own_normals(ours: Facets) -> Looks:
    """Return one look a facet, along its own normal, in the order of the facets."""
    # nodes of every facet by itself have its normal
    v = ours.nodes.shape[1]
    alone = replace(ours, nodes=np.arange(ours.nodes.size).reshape(-1, v))
    normals = np.repeat(ours.normals, v, axis=0)
    count = len(normals)
    nodes = Nodes(
        np.arange(count),
        ours.corners.reshape(-1, 3),
        normals,
        np.ones(count),
        np.zeros((count, 3), dtype=bool),
        np.full((count, 3), -1),
    )
    return replace(looks_of(alone, nodes), nodes=ours.nodes)


def _arrange(side: TiedSide, corners: Indices) -> Indices:
    """Return nodes of faces (f, v): vertices as given, mid-points of the sides that follow each.

    The middle of a quadrilateral comes last.

    Args:
        side: the boundary.
        corners: (f, c) vertices of each of its facets, round it.
    """
    points = side.points[corners]
    mids = side.facets[:, side.vertices :]
    where = [0.5 * (points + np.roll(points, -1, axis=1))]
    if side.vertices == 4:
        where.append(points.mean(axis=1, keepdims=True))
    apart = np.linalg.norm(
        np.concatenate(where, axis=1)[:, :, None, :] - side.points[mids][:, None, :, :], axis=3
    )
    return np.concatenate([corners, np.take_along_axis(mids, apart.argmin(axis=2), axis=1)], axis=1)


def _second_order(h: Array) -> Array:
    """Return functions of second order (k, q, 6 or 9) of the shape functions of first order.

    Those of vertices come first, then those of the mid-points of the sides that follow each, and
    that of the middle of a quadrilateral.

    Args:
        h: (k, q, 3 or 4) the shape functions of ``hats``, at the vertices round the facet.
    """
    if h.shape[2] == 3:
        return np.concatenate([h * (2.0 * h - 1.0), 4.0 * h * np.roll(h, -1, axis=2)], axis=2)
    # x and y in [0, 1]: products of the three functions along both
    x, y = h[..., 1] + h[..., 2], h[..., 2] + h[..., 3]
    along_x, along_y = (_quadratics(axis.ravel()).reshape(*axis.shape, 3) for axis in (x, y))
    places = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (1, 2), (2, 1), (0, 2), (2, 2)]
    return np.stack([along_x[..., i] * along_y[..., j] for i, j in places], axis=-1)
