"""Let whole facets carry what is covered of facets at the edge of what side 1 has in front of it.

A node t of side 1 beyond that edge has but a share of its facets in front of side 2. A multiplier
of its own would be that of a sliver: its reaction over its weight is no pressure of the interface,
and its condition asks for the gap at t, where there is none. So t has no condition if little of its
facets is covered. Displacements and pressures of the nearest whole facet, with nodes k, are carried
on linearly to t instead:

    u(t) = sum_k E_tk u_k,   sum_k E_tk = 1,   sum_k E_tk x_k = x_t

and on the partly covered facet these nodes get D_k = sum_t E_tk D_t and the functions

    psi_k = D_k b(x)ᵀ (∫ b bᵀ)⁻¹ b(x_k),   b = (1, x) or (1, x, y)
    (∫ over its part in front of side 2)

so that sum_k psi_k = 1, ∫ psi_k = D_k and ∫ psi_k x = D_k x_k still: a uniform pressure passes
through exactly, forces and moments of both sides are in balance, and every pressure is one over a
patch that is covered. Badia, Verdugo and Martín, Comput. Methods Appl. Mech. Engrg. 336 (2018),
533-553 carry displacements on in the same way.

Words: a facet is *covered* by its share in front of side 2, and *whole* where none of its nodes is
carried; a node is *carried* by the nodes k of a whole facet, which *carries* it. ``couple`` decides
who carries whom; ``mortar`` and ``mortar_in_space`` measure what is covered and assemble.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask

# CHOSEN: a node beyond the edge with a smaller covered share of its facets is carried
LEAST_SHARE = 0.5
LEAST_COVERED = 1e-3  # of a facet: less is no contact where no other facet carries it
LEAST_WEIGHT = 0.25  # of the weight that a node has without what it carries


@dataclass(frozen=True, eq=False)
class Covered:
    """Hold what is covered of the k facets of side 1 in front of which something lies.

    Attributes:
        facets: (k, v) their nodes.
        middles: (k, d) middles of their covered parts.
        weights, full: (k, v) integrals of the functions of their nodes, over the covered part and
            over all of it.
        inside: (k, v) nodes that are in front of side 2 themselves.
        parts: (k,) covered shares of the facets.
        common: (m,) nodes of side 1 that are nodes of side 2 too.
    """

    facets: Indices
    middles: Array
    weights: Array
    full: Array
    inside: Mask
    parts: Array
    common: Mask

    def sums(self, values: Array) -> Array:
        """Return sums (m,) at the nodes of side 1 of values (k, v) at the nodes of facets."""
        sums = np.zeros(len(self.common))
        np.add.at(sums, self.facets, values)
        return sums

    @property
    def share(self) -> Array:
        """Return the covered share (m,) of the facets of each node, weighted with its function.

        It is 1 for nodes that are in front of side 2 themselves: only those beyond the edge count.
        """
        full = self.sums(self.full)
        share = self.sums(self.weights) / np.where(full > 0.0, full, 1.0)
        beyond = (full > 0.0) & (self.sums(self.inside.astype(float)) == 0.0)
        return np.asarray(np.where(beyond, share, 1.0))


@dataclass(frozen=True, eq=False)
class Carried:
    """Say which nodes of side 1 are carried, and by which facets.

    Attributes:
        nodes: (m,) which nodes are carried.
        by: (k, v) nodes of the facet that carries what each covered facet has to be carried.
        used: (k,) which facets are used at all.
    """

    nodes: Mask
    by: Indices
    used: Mask


def choose_carriers(covered: Covered, asked: Mask) -> Carried:
    """Choose which nodes are carried, and by which facets: those whose middle is the nearest.

    No node is carried where there is no whole facet to carry it, and none of a facet at a weld.

    Args:
        covered: what is covered of side 1.
        asked: (m,) mask of the nodes that should be carried.
    """
    facets = covered.facets
    common = covered.common
    # no node of a facet at a weld is carried
    nodes = asked.copy()
    nodes[facets[common[facets].any(axis=1)]] = False
    # whole facets: those none of whose nodes is carried, if there are any all in front of side 2
    inside = covered.sums(covered.inside.astype(float)) > 0.0
    apart = ~(nodes | common)[facets].any(axis=1)  # facets that carry themselves
    within = apart & inside[facets].all(axis=1)
    whole = np.flatnonzero(within if within.any() else apart)
    some = np.flatnonzero(nodes[facets].any(axis=1))
    if not len(whole):
        nodes = np.zeros_like(nodes)
        some = some[:0]
    # a facet that is hardly covered counts unless it has a node whose condition it alone would be
    alone = (covered.share < LEAST_SHARE) & ~nodes
    used = (covered.parts > LEAST_COVERED) | ~alone[facets].any(axis=1)
    if not len(some):
        return Carried(nodes, facets, used)
    from scipy.spatial import cKDTree  # late: it takes a while

    by = facets.copy()
    _, nearest = cKDTree(covered.middles[whole]).query(covered.middles[some])
    by[some] = facets[whole[nearest]]
    return Carried(nodes, by, used)


def extrapolation(corners: Array, points: Array) -> Array:
    """Return E: the shares of the corners of facets in a linear function at points, also beyond.

    Args:
        corners: (k, v, c) of facets, c coordinates [m].
        points: (k, p, c) [m].

    Returns:
        (k, p, v), of which each row has the sum one.
    """
    # the linear function that fits values at the corners best, evaluated at the points: lengths
    # are taken over the size of a facet, so that its columns are alike
    middle = corners.mean(axis=1, keepdims=True)
    size = np.abs(corners - middle).max(axis=(1, 2))[:, None, None]
    known, wanted = (
        np.concatenate([np.ones((*x.shape[:2], 1)), (x - middle) / size], axis=2)
        for x in (corners, points)
    )
    return np.asarray(wanted @ np.linalg.pinv(known))


def find_overloading(covered: Covered, carried: Carried, weights: Array) -> Mask:
    """Find carried nodes that leave too little weight to a node which carries them.

    A linear function that is positive at one node of a facet and beyond is negative at the other:
    where much is carried far, this other node has less weight, and its pressure would pull. It
    needs ``LEAST_WEIGHT`` of its own weight.

    Args:
        covered: what is covered of side 1.
        carried: which nodes are carried.
        weights: (m,) D of all nodes, with what is carried [m], [m²].

    Returns:
        (m,) mask: for each node with too little weight the heaviest of those it carries.
    """
    own = covered.sums(covered.weights)
    light = ~(carried.nodes | covered.common) & (own > 0.0) & (weights < LEAST_WEIGHT * own)
    too_much = np.zeros(len(own), dtype=bool)
    for node in np.flatnonzero(light):
        around = covered.facets[(carried.by == node).any(axis=1)].ravel()
        around = around[carried.nodes[around]]
        if len(around):
            too_much[around[np.argmax(own[around])]] = True
    return too_much


@dataclass(frozen=True, eq=False)
class Coupled:
    """Hold the coupling of two sides, of m and n nodes.

    Attributes:
        D: (m,) ∫ psi of each node [m], [m²].
        M: (m, n) ∫ psi_s phi_j [m], [m²].
        overlap: (m,) by how much polygons of one curve may overlap at each node [m] (``curves``).
        carried: (m,) nodes that others carry, which have no row in either.
        share: (m,) covered share of the facets of each node.
    """

    D: Array
    M: sp.csr_matrix
    overlap: Array
    carried: Mask
    share: Array


def couple(
    covered: Covered, assemble: Callable[[Carried], tuple[Array, sp.csr_matrix, Array]]
) -> Coupled:
    """Couple two sides, with whole facets that carry the nodes with little covered where they can.

    Args:
        covered: what is covered of side 1.
        assemble: makes D, M and the overlap of ``Coupled`` for nodes that are carried so.
    """
    share = covered.share
    asked = share < LEAST_SHARE
    # carry all, then take back what would leave a carrying node too little weight, until none does
    while True:
        carried = choose_carriers(covered, asked)
        D, M, overlap = assemble(carried)
        too_much = find_overloading(covered, carried, D)
        if not too_much.any():
            return Coupled(D, M, overlap, carried.nodes, share)
        asked = carried.nodes & ~too_much
