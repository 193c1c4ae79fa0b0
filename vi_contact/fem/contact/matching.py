"""Find the nodes of side 2 that a contact node of side 1 faces: u_2 at the point opposite node s is sum_j P_sj u_j.

The rows of P sum to one, so that a common translation of both bodies opens and closes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ...core.algebra import Array, Indices
from ...core.checks import attributes
from ...core.errors import InputError
from .nodes import Nodes, at

DISTANCE_ROWS = 256  # rows of the tables of distances


@dataclass(frozen=True, eq=False)
class Side:
    """Hold a boundary that may touch another, the same on every rank: name, nodes, facets as rows of places among
    them."""

    name: str
    nodes: Nodes
    facets: Indices


@dataclass(frozen=True, eq=False)
class Matched:
    """Hold the m nodes of side 1 that face side 2: ``rows`` among those of side 1, P (m, nodes of side 2), the weights
    [m] or [m²] of their shares of the interface, and by how much the sides may overlap there [m] and count as touching.
    """

    rows: Indices
    P: sp.csr_matrix
    weights: Array
    overlap: Array

    def pick(self, rows: Any) -> Matched:
        """Return the matched nodes of these rows."""
        return Matched(self.rows[rows], self.P[rows], self.weights[rows], self.overlap[rows])


class Matching(Protocol):
    """Find what the nodes of side 1 face. InputError when they do not."""

    def match(self, one: Side, two: Side, size: float) -> Matched:
        """Return what the nodes of side ``one`` face on side ``two``; ``size``: of the mesh [m]."""
        ...


@dataclass(frozen=True)
class NodeToNode:
    """Match conforming sides: every node of side 1 has one node of side 2 at its place, or opposite along its normal.

    ``tolerance``: how far beside the normal the partner may lie, as a share of the distance to the next node of side 1.
    InputError for nodes without a partner, two nodes with the same one, and sides that do not face each other.
    """

    tolerance: float = 0.01

    def __post_init__(self) -> None:
        attributes(self, positive=("tolerance",))

    def match(self, one: Side, two: Side, size: float) -> Matched:
        partner = self._partners(one, two, size)
        missing = np.flatnonzero(partner < 0)
        if len(missing):
            raise InputError(
                f"{len(missing)} of {len(partner)} nodes of '{one.name}' have no node of '{two.name}' opposite, the "
                f"first at {at(one.nodes.points[missing[0]])}: mesh both sides alike, make the smaller side the first, "
                "or use matching=DualMortar()"
            )
        first, counts = np.unique(partner, return_counts=True)
        if counts.max() > 1:
            raise InputError(
                f"several nodes of '{one.name}' face the node of '{two.name}' at "
                f"{at(two.nodes.points[first[counts.argmax()]])}: mesh both sides alike, or use matching=DualMortar()"
            )
        m = len(partner)
        P = sp.csr_matrix((np.ones(m), (np.arange(m), partner)), shape=(m, len(two.nodes.points)))
        return Matched(np.arange(m), P, one.nodes.weights, np.zeros(m))

    def _partners(self, one: Side, two: Side, size: float) -> Indices:
        """Place of the nearest node opposite among those of side 2, -1 for none."""
        x, normals, reach = one.nodes.points, one.nodes.normals, self.tolerance * _spacing(one.nodes.points, size)
        partner = np.full(len(x), -1, dtype=np.int64)
        facing = np.zeros(len(x), dtype=bool)
        for first in range(0, len(x), DISTANCE_ROWS):
            rows = slice(first, first + DISTANCE_ROWS)
            offset = two.nodes.points[None, :, :] - x[rows, None, :]
            along = np.einsum("ijk,ik->ij", offset, normals[rows])
            beside = np.linalg.norm(offset - along[:, :, None] * normals[rows, None, :], axis=2)
            near = beside <= reach[rows, None]
            faces = normals[rows] @ two.nodes.normals.T < 0.0
            distance = np.where(near & faces, np.abs(along), np.inf)
            nearest = distance.argmin(axis=1)
            found = np.isfinite(distance[np.arange(len(nearest)), nearest])
            partner[rows] = np.where(found, nearest, -1)
            facing[rows] = ~near.any(axis=1) | (near & faces).any(axis=1)
        if not facing.all():
            refuse_same_way(one.name, two.name, x[np.flatnonzero(~facing)[0]])
        return partner


def refuse_same_way(one: str, two: str, point: Array) -> None:
    """Raise InputError for sides whose outward normals point the same way."""
    raise InputError(
        f"'{two}' does not face '{one}' at {at(point)}, the outward normals of both point the same way there: choose "
        "the two boundaries between the bodies"
    )


def _spacing(points: Array, size: float) -> Array:
    """Distance of each node to the next one of the same side [m]; the size of the mesh for a single node."""
    if len(points) == 1:
        return np.array([size])
    return np.asarray(cKDTree(points).query(points, k=2)[0][:, 1])
