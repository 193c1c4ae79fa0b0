"""Choose among several nodes of side 2 that lie at one place in front of a node of side 1.

Nodes of different bodies, or of both faces of a joint, may coincide. Which of them a node faces
follows from the facets around it: a partner must have facets of side 2 in front of them. If one
partner has all of these it is the one, and what the others have lies beside it, as in a column of
stones beside another column. If each has a part of them, as two stones under the middle of a third
one have, the node faces all of them, each with the facets in front of it.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.surfaces import make_nodal_frames

FLAT = 1e-6  # of a length: what is shorter when it is seen along a normal has no direction
BORDER = 1e-6  # radians by which a direction may leave a facet's corner and count as on its border


@dataclass(frozen=True, eq=False)
class Surface:
    """Hold a side as points and facets.

    Attributes:
        points: (k, d) of its nodes [m].
        facets: (n, v) places of their nodes.
    """

    points: Array
    facets: Indices

    def around(self, node: int) -> Array:
        """Return the points (m, v, d) [m] of the m facets at a node."""
        return self.points[self.facets[(self.facets == node).any(axis=1)]]

    def sizes_around(self, node: int) -> Array:
        """Return the sizes (m,) of the facets at a node: lengths [m], areas [m²], 1 of bars."""
        corners = self.around(node)
        edges = corners[:, 1:] - corners[:, :1]
        if corners.shape[2] == 3:
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
            if corners.shape[1] != 4:
                return areas
            # Of quadrilaterals, in any order of their vertices: the diagonals span the most.
            for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
                across = np.cross(edges[:, i], edges[:, k] - edges[:, j])
                areas = np.maximum(areas, np.linalg.norm(across, axis=1))
            return areas
        if edges.shape[1] == 0:
            return np.ones(len(corners))
        return np.asarray(np.linalg.norm(edges, axis=2).max(axis=1))


def in_front(surface1: Surface, node: int, normal: Array, surface2: Surface, partner: int) -> Mask:
    """Return a mask (m,) of the facets at a node that facets at its partner lie in front of.

    They are seen along the normal, as corners of a plane round the node. A facet at the node counts
    where its middle lies in the corner of a facet at the partner.

    Args:
        surface1: side 1.
        node: the place of the node on side 1.
        normal: (d,) its normal.
        surface2: side 2.
        partner: the place of its partner on side 2.
    """
    frame = make_nodal_frames(normal[None])[0][:, 1:]
    ways = (surface1.around(node).mean(axis=1) - surface1.points[node]) @ frame
    arms = (surface2.around(partner) - surface2.points[partner]) @ frame
    covered = np.zeros(len(ways), dtype=bool)
    for arm in arms:
        covered |= _within(ways, arm)
    return covered


def choose_partners(
    surface1: Surface,
    node: int,
    normal: Array,
    surface2: Surface,
    partners: Indices,
    apart: Array,
    close: float,
) -> list[tuple[int, float]]:
    """Choose among several nodes those that a node of side 1 faces.

    Args:
        surface1: side 1.
        node: the place of the node on side 1.
        normal: (d,) its normal.
        surface2: side 2.
        partners: (k,) places on side 2, of nodes that face this one. The first is taken where none
            has a facet in front of one of side 1, as where bodies meet at a corner only.
        apart: (k,) their distances [m]; partners that differ by up to ``close`` [m] are at one
            place.
        close: that distance [m].

    Returns:
        (place on side 2, share of the node's facets) of each partner; none where partners share a
        facet, or where one is nearer than another and neither has all facets.
    """
    seen = np.array([in_front(surface1, node, normal, surface2, partner) for partner in partners])
    facing = np.flatnonzero(seen.any(axis=1))
    if len(facing) < 2:
        return [(int(partners[facing[0] if len(facing) else 0]), 1.0)]
    nearest = facing[np.argmin(apart[facing])]
    beside = apart[facing] <= apart[nearest] + close
    if np.sum(beside) == 1:
        return [(int(partners[nearest]), 1.0)] if seen[nearest].all() else []

    # Each of several partners has the facets in front of it for itself.
    seen = seen[facing]
    if not beside.all() or (seen.sum(axis=0) > 1).any():
        return []
    sizes = seen @ surface1.sizes_around(node)
    shares = sizes / sizes.sum()
    return list(zip(partners[facing].tolist(), shares.tolist(), strict=True))


def _within(ways: Array, arm: Array) -> Mask:
    """Return a mask (m,) of the directions that lie in the corner of a facet.

    Args:
        ways: (m, d - 1) directions, in the plane that is looked at.
        arm: (v, d - 1) the nodes of the facet, from the one at the corner.
    """
    length = np.linalg.norm(arm, axis=1)
    seen = length > FLAT * length.max(initial=0.0)
    if arm.shape[1] == 0:  # a bar: its end is all there is
        return np.ones(len(ways), dtype=bool)
    if not seen.any():
        return np.zeros(len(ways), dtype=bool)
    arm = arm[seen] / length[seen, None]
    if arm.shape[1] == 1:
        return np.asarray(
            (ways * arm[:, 0] > 0.0).any(axis=1) | ((arm > 0.0).any() and (arm < 0.0).any())
        )
    middle = arm.sum(axis=0)
    if np.linalg.norm(middle) < FLAT:  # the node is in the middle of its facet
        return np.ones(len(ways), dtype=bool)
    low = np.min(_angles(middle, arm))
    high = np.max(_angles(middle, arm))
    angles = _angles(middle, ways)
    return np.asarray((angles >= low - BORDER) & (angles <= high + BORDER) & (high - low > BORDER))


def _angles(start: Array, vectors: Array) -> Array:
    """Return the angles (k,) from the direction ``start`` to plane vectors (k, 2), in (-pi, pi]."""
    across = start[0] * vectors[:, 1] - start[1] * vectors[:, 0]
    return np.arctan2(across, vectors @ start)
