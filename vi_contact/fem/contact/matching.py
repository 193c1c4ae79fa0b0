"""Find the nodes of side 2 that a contact node of side 1 faces, node by node.

The displacement u_2 at the point opposite node s is sum_j P_sj u_j. The rows of P sum to one, so
that a common translation of both bodies opens and closes nothing. What every matching takes and
returns (``Side``, ``Matched``, ``Matching``) stands here, beside ``NodeToNode``; ``mortar`` has the
other one.
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, Protocol

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.arguments import check_fields
from ...core.checks import describe_point
from ...core.errors import InputError
from ...core.quantities import Positive
from .nodes import Nodes
from .partners import Surface, choose_partners

NEARBY = 8  # nodes of side 2 that are looked at first
# cosine of the angle between a normal and what it is seen from: under less no side faces another
EDGE_ON = 0.01
BESIDE = 0.01  # of the distance to the next node: how far beside a normal a partner may lie
# of the distance that a partner may lie beside a normal: nodes as close as this coincide
ONE_PLACE = 1e-6
DISTANCES = 2**20  # in a table, where all nodes of side 2 are looked at


@dataclass(frozen=True, eq=False)
class Side:
    """Hold a boundary that may touch another, the same on every rank.

    Attributes:
        name: that of its group.
        nodes: its m nodes.
        facets: (k, v) places of their nodes.
        tied: of a side 1, (m,) places on side 2 of the nodes to which nodes are tied in all
            components, -1 for others. None: there are no such nodes.
    """

    name: str
    nodes: Nodes
    facets: Indices
    tied: Indices | None = None


def common_nodes(side1: Side, side2: Side) -> Indices:
    """Return the places (m,) on side 2 of the nodes of side 1 that are nodes of both, -1 of others.

    A node is one of both at a tip or a weld, or where it is tied to one of side 2, which is the
    same.
    """
    places = np.full(len(side1.nodes.numbers), -1) if side1.tied is None else side1.tied.copy()
    _, own, others = np.intersect1d(side1.nodes.numbers, side2.nodes.numbers, return_indices=True)
    places[own] = others
    return places


@dataclass(frozen=True, eq=False)
class Matched:
    """Hold the m nodes of side 1 that face side 2.

    Attributes:
        rows: their rows among those of side 1.
        P: (m, nodes of side 2).
        weights: (m,) of their shares of the interface [m] or [m²].
        overlap: (m,) by how much the sides may overlap there [m] and count as touching.
        covered: (m,) share of the facets around a node that is in front of side 2, where the node
            itself is not; 1 for all others, and by default.
        carried: rows of further nodes whose shares those of others contain, so that they have no
            condition.
    """

    rows: Indices
    P: sp.csr_matrix
    weights: Array
    overlap: Array
    covered: Array | None = None
    carried: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def shares(self) -> Array:
        """Return ``covered``, ones by default."""
        return np.ones(len(self.rows)) if self.covered is None else self.covered

    def pick(self, rows: Any) -> "Matched":
        """Return what is in these rows."""
        return Matched(
            rows=self.rows[rows],
            P=self.P[rows],
            weights=self.weights[rows],
            overlap=self.overlap[rows],
            covered=self.shares[rows],
            carried=self.carried,
        )


class Matching(Protocol):
    """Find what the nodes of side 1 face. InputError when they do not."""

    def match(self, side1: Side, side2: Side, size: float) -> Matched:
        """Return what the nodes of side 1 face on side 2.

        Args:
            side1: side 1.
            side2: side 2.
            size: that of the mesh [m].
        """


@dataclass(frozen=True)
class NodeToNode:
    """Match conforming sides: each node of side 1 has one of side 2 opposite, along its normal.

    Of several nodes at one place, of bodies that meet there, the partner is the one whose facets
    lie in front of all facets of the node. Where each has a part of them, as two stones under a
    third one have, the node has a condition for each, with the weight of these facets.

    Args:
        tolerance: how far beside the normal the partner may lie, as a share of the distance to the
            next node of side 1.

    Raises:
        InputError: from ``match``, nodes without a partner, several nodes at one place that share
            facets in front of the node, two nodes elsewhere with the same partner, and sides that
            do not face each other.
    """

    tolerance: Annotated[float, Positive] = BESIDE

    def __post_init__(self) -> None:
        check_fields(self)

    def match(self, side1: Side, side2: Side, size: float) -> Matched:
        """Return what every node of side 1 faces; InputError where a node has no partner.

        Args:
            side1: side 1.
            side2: side 2.
            size: that of the mesh [m].
        """
        partner, several = self._find_partners(side1, side2, size)
        missing = np.flatnonzero(partner < 0)
        if len(missing):
            raise InputError(
                f"{len(missing)} of {len(partner)} nodes of '{side1.name}' have no node of "
                f"'{side2.name}' opposite, the first at "
                f"{describe_point(side1.nodes.points[missing[0]])}: "
                "mesh both sides alike, make the smaller side the first, or use "
                "matching=DualMortar()"
            )
        _refuse_doubled(side1, side2, partner, size)

        # A row for each partner of a node, most of which have one.
        rows = []
        partners = []
        shares = []
        for row, one in enumerate(partner.tolist()):
            for place, share in several.get(row, [(one, 1.0)]):
                rows.append(row)
                partners.append(place)
                shares.append(share)
        m = len(rows)
        shape = (m, len(side2.nodes.points))
        P = sp.csr_matrix((np.ones(m), (np.arange(m), partners)), shape=shape)
        weights = side1.nodes.weights[rows] * np.array(shares)
        return Matched(np.array(rows), P, weights, np.zeros(m))

    def _find_partners(
        self, side1: Side, side2: Side, size: float
    ) -> tuple[Indices, dict[int, list[tuple[int, float]]]]:
        """Return the place of the nearest node opposite among those of side 2, -1 for none.

        Of nodes with several partners it is the first one, and all of them by their row, with their
        shares of the node's facets.

        Args:
            side1: side 1.
            side2: side 2.
            size: that of the mesh [m].
        """
        x = side1.nodes.points
        count = len(side2.nodes.points)
        spacing = _measure_spacing(side1.nodes.points, size)
        reach = self.tolerance * spacing
        together = 2.0 * min(self.tolerance, BESIDE) * spacing
        from scipy.spatial import cKDTree  # late: it takes a while

        # the nearest nodes first
        tree = cKDTree(side2.nodes.points)
        distances, nearby = tree.query(x, k=np.arange(1, min(NEARBY, count) + 1))
        partner, along, turned, crowds = _find_opposite(
            side1.nodes, side2.nodes, np.sort(nearby, axis=1), reach
        )
        # what is as near along the normal, or nearer, lies in a ball of this size: unless all of it
        # was looked at, all nodes are
        ball = (1.0 + 1e-9) * np.hypot(along + reach, reach)
        unsure = np.flatnonzero(ball >= distances[:, -1])
        whole = np.arange(count)[None, :]
        groups = max(-(-len(unsure) * count // DISTANCES), 1)
        for rows in np.array_split(unsure, groups):
            if not len(rows):
                continue
            partner[rows], _, turned[rows], more = _find_opposite(
                side1.nodes.pick(rows), side2.nodes, whole, reach[rows]
            )
            crowds |= {int(rows[row]): places for row, places in more.items()}
        # where several nodes lie at one place, facets tell which is the partner
        surface1 = Surface(x, side1.facets)
        surface2 = Surface(side2.nodes.points, side2.facets)
        several: dict[int, list[tuple[int, float]]] = {}
        for row, (crowd, apart) in sorted(crowds.items()):
            offset = side2.nodes.points[crowd] - side2.nodes.points[crowd[0]]
            alike = np.linalg.norm(offset, axis=1) <= together[row]
            chosen = choose_partners(
                surface1,
                row,
                side1.nodes.normals[row],
                surface2,
                crowd[alike],
                apart[alike],
                ONE_PLACE * reach[row],
            )
            if not chosen or (len(chosen) > 1 and x.shape[1] == 1):
                _refuse_several(side1, side2, row)
            partner[row] = chosen[0][0]
            if len(chosen) > 1:
                several[row] = chosen
        if turned.any():
            refuse_same_way(side1.name, side2.name, x[np.argmax(turned)])
        return partner, several


# row of a node -> several nodes in front of it, the first the one whose normal is the most
# opposite, and how far along the normal they are [m]
Crowds = dict[int, tuple[Indices, Array]]


def _find_opposite(
    nodes1: Nodes, nodes2: Nodes, places: Indices, reach: Array
) -> tuple[Indices, Array, Mask, Crowds]:
    """Find what each node of side 1 faces among some places on side 2.

    Args:
        nodes1: m nodes of side 1.
        nodes2: nodes of side 2.
        places: (m, k) which of these are looked at; (1, k) for the same ones at all nodes.
        reach: (m,) how far beside the normal a partner may lie [m].

    Returns:
        (m,) the nearest node opposite each one, -1 for none; (m,) how far it is along the normal
        [m], infinite for none; (m,) whether nodes are there and all face away; and by row those
        nodes that have several about as near in front of them.
    """
    # how far along its normal, and how far beside it, each node of side 2 is
    offset = nodes2.points[places] - nodes1.points[:, None, :]
    along = np.einsum("ijk,ik->ij", offset, nodes1.normals)
    beside = np.linalg.norm(offset - along[:, :, None] * nodes1.normals[:, None, :], axis=2)
    near = beside <= reach[:, None]
    slope = np.einsum("ijk,ik->ij", nodes2.normals[places], nodes1.normals)
    distance = np.where(near & (slope < -EDGE_ON), np.abs(along), np.inf)
    least = distance.min(axis=1)
    # where several bodies meet they have a node each at one place, told apart by their normals
    # first
    alike = distance <= least[:, None] + ONE_PLACE * reach[:, None]
    rows = np.arange(len(reach))
    nearest = np.where(alike, slope, np.inf).argmin(axis=1)
    any_there = np.isfinite(least)
    places = np.broadcast_to(places, distance.shape)
    partner = np.where(any_there, places[rows, nearest], -1)
    # nodes about as near as the nearest, which comes first
    crowds = {}
    for row in np.flatnonzero(
        any_there & (np.sum(distance <= (least + reach)[:, None], axis=1) > 1)
    ):
        close = np.flatnonzero(distance[row] <= least[row] + reach[row])
        close = np.concatenate([[nearest[row]], close[close != nearest[row]]])
        crowds[int(row)] = places[row, close], distance[row, close]
    return partner, distance[rows, nearest], near.any(axis=1) & ~any_there, crowds


def _refuse_doubled(side1: Side, side2: Side, partner: Indices, size: float) -> None:
    """Raise InputError for nodes of side 1 at different places that face one node of side 2.

    Args:
        side1: side 1, of m nodes.
        side2: side 2.
        partner: (m,) what they face, places on side 2.
        size: that of the mesh [m].
    """
    order = np.argsort(partner, kind="stable")
    points = side1.nodes.points[order]
    again = np.diff(partner[order]) == 0
    elsewhere = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9 * size
    for row in np.flatnonzero(again & elsewhere)[:1]:
        raise InputError(
            f"several nodes of '{side1.name}' face the node of '{side2.name}' at "
            f"{describe_point(side2.nodes.points[partner[order[row]]])}: mesh both sides alike, or "
            "use matching=DualMortar()"
        )


def _refuse_several(side1: Side, side2: Side, row: int) -> None:
    """Raise InputError for a node of side 1 that faces several nodes of side 2.

    Each of them has a part of what it faces.

    Args:
        side1: side 1.
        side2: side 2.
        row: the place of the node on side 1.
    """
    where = (
        f"the node of '{side1.name}' at {describe_point(side1.nodes.points[row])} faces several "
        f"nodes of "
        f"'{side2.name}' at one place"
    )
    d = side1.nodes.points.shape[1]
    if d == 1:
        raise InputError(f"{where}, and can touch one only: list the end of one bar on side 2")
    mortar = "matching=DualMortar()"
    if max(side1.facets.shape[1], side2.facets.shape[1]) > (2 if d == 2 else 4):
        mortar = f"degree=1 and {mortar}"
    raise InputError(f"{where}, which have no facets of their own in front of it: use {mortar}")


def refuse_same_way(name1: str, name2: str, point: Array) -> None:
    """Raise InputError for sides whose outward normals point the same way.

    Args:
        name1: name of side 1.
        name2: name of side 2.
        point: (d,) where [m].
    """
    raise InputError(
        f"'{name2}' does not face '{name1}' at {describe_point(point)}, where both outward "
        f"normals point the "
        "same way: choose the two boundaries between the bodies"
    )


def _measure_spacing(points: Array, size: float) -> Array:
    """Return the distances (m,) [m] of nodes to the next node of their side that is elsewhere.

    For a single node it is the size of the mesh.
    """
    if len(points) == 1:
        return np.array([size])
    from scipy.spatial import cKDTree

    apart, _ = cKDTree(points).query(points, k=min(NEARBY, len(points)))
    elsewhere = apart > 1e-9 * size
    next_one = np.take_along_axis(apart, elsewhere.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.asarray(np.where(elsewhere.any(axis=1), next_one, size))
