"""Couple sides of bodies that are not meshed alike: mortar coupling with dual Lagrange multipliers.

The gap is asked not at points but in the mean, weighted with functions psi_s on side 1, one per
node,

    D_s (u_1 at s) = sum_j M_sj u_j,   D_s = ∫ psi_s,   M_sj = ∫ psi_s phi_j,   P = D⁻¹ M

over the part of side 1 that faces side 2. In the plane, side 2 is projected onto each segment of
side 1 along the segment's normal, which cuts it into pieces where all functions are polynomials;
two Gauss points are exact. For space see ``mortar_in_space``. On each segment

    psi = A phi,   A = diag(∫ phi_k) (∫ phi phiᵀ)⁻¹

over its part in front of side 2 (``covering``: at the edge of what is covered, whole segments carry
parts of others), so that ∫ psi_s phi_k = 0 for the other node k (biorthogonal) and sum_s psi_s = 1.
Then every linear field is matched exactly (P x_2 = x_1 on fitting sides) and a uniform pressure
passes through exactly (the patch test). Nodes t of both sides, at the tip of a crack or beside a
weld, have no function; the other nodes of a facet share theirs and, which keeps P x_2 = x_1, pass ∫
psi_t to u_t: pressure is uniform up to the weld, which carries what a multiplier of t would.

Literature: Wohlmuth, SIAM J. Numer. Anal. 38 (2000); Hüeber and Wohlmuth, Comput. Methods Appl.
Mech. Engrg. 194 (2005); dual functions of partly covered segments: Cichosz and Bischoff, ibid. 200
(2011).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.errors import InputError
from ..body.blending import TiedSide
from .covering import Carried, Coupled, Covered, couple, extrapolation
from .curves import FARTHER, curvatures, may_overlap
from .matching import EDGE_ON, Matched, Side, common_nodes, refuse_same_way
from .mortar_in_space import ROUND_OFF, hand_over, in_space
from .segments import cut_segment, find_normals
from .tied_sides import couple_sides

POINTS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)  # of Gauss, on [0, 1], weights ½
AT_NODE = 1e-9  # of a segment: round-off of where its covered part ends


@dataclass(frozen=True)
class DualMortar:
    """Match sides of plane and solid bodies with any meshes by dual Lagrange multipliers.

    A node of side 1 beyond the edge of side 2 keeps its condition, in the mean over what is
    covered, where that is at least half of its share of the facets around it; else the nodes inside
    carry it, and it has none (``covering``). Initial gaps are means too; where facets of the same
    curved face overlap by no more than their distance from it, some h²/(8R) on a curve of radius R,
    the gap is zero (``fem.contact.curves``). Plane sides may overlap by round-off only.

    Raises:
        InputError: from ``match``, for bars, for facets of second order, for sides that do not face
            each other, in space for facets that are slivers or not convex.
    """

    partial: ClassVar[bool] = True  # parts of side 1 in front of nothing have no conditions

    def couple(
        self, side: TiedSide, other: TiedSide, tied: Indices
    ) -> tuple[Indices, sp.csr_matrix, float]:
        """Return the rows of P, P itself, and the covered share of a tied boundary.

        Args:
            side: the boundary whose nodes follow.
            other: the one that they follow.
            tied: (k,) places on ``other`` of nodes that move as one there does, -1 for the others.
        """
        return couple_sides(self, side, other, tied)

    def match(self, side1: Side, side2: Side, size: float) -> Matched:
        """Return what the nodes of side 1 face by the dual mortar coupling.

        Args:
            side1: side 1.
            side2: side 2.
            size: that of the mesh [m]; nothing here needs it.
        """
        d = side1.nodes.points.shape[1]
        if d == 1:
            raise InputError(
                "DualMortar joins sides of plane and solid bodies: use matching=NodeToNode() for "
                "bars"
            )
        if max(side1.facets.shape[1], side2.facets.shape[1]) > (2 if d == 2 else 4):
            raise InputError(
                f"DualMortar joins facets of first order and those of '{side1.name}' and "
                f"'{side2.name}' have mid-points (degree=2): mesh both sides alike for "
                "matching=NodeToNode(), or use degree=1"
            )
        coupling = in_space(side1, side2) if d == 3 else _in_plane(side1, side2)
        D = coupling.D
        if not (D > 0.0).any():
            _refuse_apart(side1, side2)
        # P = D⁻¹ M, at the nodes that have a function
        rows = np.flatnonzero(D > 0.0)
        P = sp.csr_matrix(sp.diags([1.0 / D[rows]], [0]) @ coupling.M[rows])
        carried = np.flatnonzero(coupling.carried)
        return Matched(rows, P, D[rows], coupling.overlap[rows], coupling.share[rows], carried)


def _refuse_apart(side1: Side, side2: Side) -> None:
    """Raise InputError for sides of which no part lies opposite the other."""
    some, others = (
        side.nodes.normals[:: 1 + len(side.nodes.normals) // 1000] for side in (side1, side2)
    )
    if np.all(some @ others.T > EDGE_ON):
        refuse_same_way(side1.name, side2.name, side1.nodes.points[0])
    raise InputError(
        f"no part of '{side2.name}' lies opposite '{side1.name}', along the normals of the latter: "
        "choose the two boundaries between the bodies"
    )


@dataclass(frozen=True, eq=False)
class _Segment:
    """Hold a segment of side 1 in front of side 2.

    The coordinate along a segment is 0 at its first node and 1 at its second one.

    Attributes:
        nodes: (2,) its nodes.
        ends: (2, 2) their points [m].
        pieces: its pieces in front of one segment of side 2 each: coordinates low and high where
            the piece begins and ends, number of the segment of side 2, and (2,) coordinates there
            of what lies opposite low and high.
        own: (2, 2) ∫ phi phiᵀ over the pieces [m].
        mixed: by segment of side 2, (2, 2) ∫ phi_i phi_j [m].
        overlap: by how much polygons of one curve may overlap on it [m].
    """

    nodes: Array
    ends: Array
    pieces: list[tuple[float, float, int, Array]]
    own: Array
    mixed: dict[int, Array]
    overlap: float

    @property
    def length(self) -> float:
        """Return the distance of its ends [m]."""
        return float(np.linalg.norm(self.ends[1] - self.ends[0]))

    def places(self, points: Array) -> Array:
        """Return the coordinates of points (k, 2) along the segment, 0 and 1 at its ends."""
        along = self.ends[1] - self.ends[0]
        return np.asarray((points - self.ends[0]) @ along / (along @ along))


def _in_plane(side1: Side, side2: Side) -> Coupled:
    """Couple sides of plane bodies: find pieces, see what they cover, then assemble D and M."""
    ends1 = side1.nodes.points[side1.facets]
    ends2 = side2.nodes.points[side2.facets]
    normals1 = find_normals(side1, ends1)
    normals2 = find_normals(side2, ends2)
    H = curvatures(ends2, side2.facets, normals2)

    segments = []
    # project side 2 onto each segment of side 1, and integrate over the pieces that this makes
    for facet, ends, normal in zip(side1.facets, ends1, normals1, strict=True):
        pieces = list(cut_segment(ends, normal, ends2, normals2))
        if sum(high - low for low, high, *_ in pieces) > ROUND_OFF:
            length = float(np.linalg.norm(ends[1] - ends[0]))
            overlap = _find_overlap(pieces, ends, ends2, H)
            segments.append(_Segment(facet, ends, pieces, *_integrate(pieces, length), overlap))
    covered = _measure_cover(segments, common_nodes(side1, side2) >= 0)
    return couple(covered, lambda carried: _assemble(side1, side2, segments, carried))


def _find_overlap(
    pieces: list[tuple[float, float, int, Array]], ends: Array, ends2: Array, H: Array
) -> float:
    """Return by how much the polygon of side 2 may overlap a segment of side 1 [m].

    Args:
        pieces: those of the segment.
        ends: (2, 2) its ends [m].
        ends2: (k, 2, 2) ends of the segments of side 2 [m].
        H: (k, 2, 2) their curvature [1/m].
    """
    # at both ends and in the middle of each piece, in the coordinates of both segments
    segment = [piece[2] for piece in pieces]
    share = np.array([0.0, 0.5, 1.0])
    own = np.array([low + share * (high - low) for low, high, *_ in pieces])
    other = np.array([across[0] + share * (across[1] - across[0]) for *_, across in pieces])
    facet1 = np.stack([1.0 - own, own], axis=2), np.repeat(ends[None], len(pieces), axis=0)
    facet2 = np.stack([1.0 - other, other], axis=2), ends2[segment]
    return float(may_overlap(H[segment], facet1, facet2).max())


def _measure_cover(segments: list[_Segment], common: Mask) -> Covered:
    """Measure what is covered of segments; ``common``: (m,) nodes of side 1 that side 2 has too.

    Segments without anything in front of them are not among these. There may be none at all.
    """
    spans = [_span(segment) for segment in segments]
    ends = np.array(spans).reshape(-1, 2)
    corners = np.array([segment.ends for segment in segments]).reshape(-1, 2, 2)
    weights = np.array([segment.own.sum(axis=1) for segment in segments]).reshape(-1, 2)
    lengths = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    return Covered(
        facets=np.array([segment.nodes for segment in segments], dtype=np.int64).reshape(-1, 2),
        middles=corners[:, 0] + ends.mean(axis=1)[:, None] * (corners[:, 1] - corners[:, 0]),
        weights=weights,
        full=np.repeat(0.5 * lengths[:, None], 2, axis=1),
        inside=np.column_stack([ends[:, 0] < AT_NODE, ends[:, 1] > 1.0 - AT_NODE]),
        parts=np.array([_share(segment) for segment in segments]),
        common=common,
    )


def _span(segment: _Segment) -> list[float]:
    """Return where the covered part of a segment begins and ends, in its coordinate."""
    return [min(piece[0] for piece in segment.pieces), max(piece[1] for piece in segment.pieces)]


def _share(segment: _Segment) -> float:
    """Return the covered share of a segment."""
    return sum(piece[1] - piece[0] for piece in segment.pieces)


def _assemble(
    side1: Side, side2: Side, segments: list[_Segment], carried: Carried
) -> tuple[Array, sp.csr_matrix, Array]:
    """Return D (m,), M (m, n) and by how much polygons of one curve may overlap (m,) [m].

    Args:
        side1: side 1, of m nodes.
        side2: side 2, of n nodes.
        segments: those of side 1 in front of side 2.
        carried: nodes that others carry.
    """
    m = len(side1.nodes.points)
    n = len(side2.nodes.points)
    D = np.zeros(m)
    M = sp.lil_matrix((m, n))
    overlap = np.zeros(m)
    partner = common_nodes(side1, side2)
    for part, by, used in zip(segments, carried.by, carried.used, strict=True):
        if not used:
            continue
        facet = part.nodes
        own = part.own
        overlap[facet] = np.maximum(overlap[facet], part.overlap)
        # a node that is carried has its share on the nodes of another segment
        if carried.nodes[facet].any():
            overlap[by] = np.maximum(overlap[by], FARTHER * part.overlap)
            _carry(D, M, side1.nodes.points, side2.facets, part, by, carried.nodes)
            continue
        # psi = A phi with A = diag(∫ phi) (∫ phi phiᵀ)⁻¹; nodes of both sides hand theirs over
        dual = np.diag(own.sum(axis=1)) @ np.linalg.inv(own)
        common = partner[facet]
        dual, own_D, forces = (
            array[0] for array in hand_over(dual[None], own.sum(axis=1)[None], common[None] >= 0)
        )
        # D_s = ∫ psi_s, M_sj = ∫ psi_s phi_j, and what is passed on to nodes t of both sides
        D[facet] += own_D
        for segment, values in part.mixed.items():
            for j, column in zip(side2.facets[segment], (dual @ values).T, strict=True):
                for i, value in zip(facet, column, strict=True):
                    M[i, j] += value
        for j in np.flatnonzero(common >= 0):
            M[facet[1 - j], common[j]] -= forces[1 - j, j]
    return D, sp.csr_matrix(M), overlap


def _carry(
    D: Array,
    M: sp.lil_matrix,
    points: Array,
    facets2: Indices,
    part: _Segment,
    by: Indices,
    carried: Mask,
) -> None:
    """Add the share of a segment with a carried node to D and M, as ``covering`` says.

    Args:
        D: (m,) ∫ psi of each node of side 1; it is added to.
        M: (m, n) ∫ psi_s phi_j; it is added to.
        points: (m, 2) nodes of side 1 [m].
        facets2: (k, 2) nodes of the segments of side 2.
        part: the segment.
        by: (2,) nodes of the segment that carries.
        carried: (m,) which nodes are carried.
    """
    weights = part.own.sum(axis=1)
    inverse = np.linalg.inv(part.own)
    # E: what each node that carries counts at each node of this segment
    carrying = part.places(points[by])[None, :, None]
    shares = extrapolation(carrying, part.places(part.ends)[None, :, None])[0]
    for i, (node, weight) in enumerate(zip(part.nodes, weights, strict=True)):
        # who has the condition of this node: the nodes that carry it, or itself
        carriers = zip(by, shares[i], strict=True) if carried[node] else [(node, 1.0)]
        for k, share in carriers:
            place = float(part.places(points[k]))
            D[k] += share * weight
            # psi_k = D_k b(x)ᵀ (∫ b bᵀ)⁻¹ b(x_k), with b = phi of the segment, which spans (1, x)
            psi = share * weight * _hats(place) @ inverse
            for segment, values in part.mixed.items():
                M[k, facets2[segment]] = M[k, facets2[segment]].toarray().ravel() + psi @ values


def _integrate(
    pieces: list[tuple[float, float, int, Array]], length: float
) -> tuple[Array, dict[int, Array]]:
    """Return ∫ phi phiᵀ (2, 2) [m] over the pieces, and by segment of side 2 ∫ phi_i phi_j (2, 2).

    Args:
        pieces: those of a segment of side 1.
        length: that of this segment [m].
    """
    own = np.zeros((2, 2))
    mixed: dict[int, Array] = {}
    for low, high, segment, across in pieces:
        for point in POINTS:
            weight = 0.5 * length * (high - low)
            phi = _hats(low + point * (high - low))
            phi2 = _hats(across[0] + point * (across[1] - across[0]))
            own += weight * np.outer(phi, phi)
            mixed[segment] = mixed.get(segment, np.zeros((2, 2))) + weight * np.outer(phi, phi2)
    return own, mixed


def _hats(x: float) -> Array:
    """Return the values of both linear functions of a segment at a coordinate from 0 to 1."""
    return np.array([1.0 - x, x])
