"""Integrate the dual mortar coupling of sides in space, of triangles or quadrilaterals, in any mixture of both sides.

A node of side 1 looks along its own normal, so that what it faces lies on that normal and normal forces have no moment.
Along it, its facets and those of side 2 are seen as polygons of a plane (``sight``); what each two of them share is cut
out and integrated. On a facet

    psi_s = D_s b(x)ᵀ (∫ b bᵀ)⁻¹ b(x_s),   D_s = ∫ phi_s   over its part in front of side 2

with b = phi if that is all of it (biorthogonal functions, of distorted quadrilaterals too) and b = (1, x, y) if it is a
part: bilinear functions, carried on from a strip of a facet to its far nodes, grow without bound as the strip thins.
Both keep sum_s psi_s = 1, ∫ psi_s = D_s > 0 and ∫ psi_s x = D_s x_s, and are the same on triangles."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from .clipping import areas, hats, rule, triangles, turns
from .matching import Side, common_nodes
from .sight import WHOLE, Looks, Pieces, facets_of, looks_of, opposite

LEAST_COVERED = 1e-3  # of a facet: less of it in front of side 2 is no contact
BLOCK = 512  # facets that are cut at once
MOST_POINTS = 20  # of Gauss a way
POINTS = 2**18  # at which functions are held at once, a few for each triangle of a piece


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
