"""Merge joints that share facets: two stones above a third which share one of its facets.

Each of the two joints covers but a part of such a facet. Both together cover it wholly, and a
uniform pressure passes through dual mortar exactly. So joints that hang together by common facets
become one pair, of the bodies on one side against those on the other: of a bed joint of a bonded
wall the stones below against those above. Joints of equal facets share none.
"""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ...core.algebra import Indices
from ..mesh.tagged_mesh import Facets
from .joint_list import Joint, Joints
from .matching import Matching

ALIKE = 1e-6  # of a share: numbers that differ by less are equal


def merge_joints(
    joints: Joints, matching: Matching | None
) -> Iterator[tuple[Facets, Facets, bool]]:
    """Yield the sides of pairs, and whether their facets are equal, in the order of the joints.

    Args:
        joints: that were found.
        matching: that the user asks for; None for the usual one. Only where sides may be covered
            in part are joints merged.
    """
    partial = matching is None or getattr(matching, "partial", False)
    labels = _label_shared(joints) if partial else np.arange(len(joints))
    for label in dict.fromkeys(labels.tolist()):
        members = [joints[int(place)] for place in np.flatnonzero(labels == label)]
        ways = _part_sides(members)
        if len(members) == 1 or ways is None:
            for joint in members:
                yield joint.facets1, joint.facets2, joint.alike
        else:
            yield *_join_sides(members, ways), False


def _label_shared(joints: Joints) -> Indices:
    """Return a label (n,) of each joint, the same where joints hang together by common facets."""
    numbers = []
    facets = []
    for joint in joints:
        for rows in joint.rows:
            if not joint.alike:
                numbers.append(np.full(len(rows), joint.number))
                facets.append(rows)
    if not facets:
        return np.arange(len(joints))
    row = np.concatenate(numbers)
    column = np.concatenate(facets)
    shape = (len(joints), int(column.max()) + 1)
    touches = sp.csr_matrix((np.ones(len(row)), (row, column)), shape=shape)
    _, labels = connected_components(touches @ touches.T, directed=False)
    return np.asarray(labels)


def _part_sides(members: list[Joint]) -> list[bool] | None:
    """Say which joints have their side 1 on the side of the first joint's side 1.

    Returns:
        None where a body would be on both sides.
    """
    side = {members[0].bodies[0]: True}
    # a body beyond a joint is on the other side: spread that until nothing changes
    for _ in members:
        for joint in members:
            one, other = joint.bodies
            if one in side:
                side.setdefault(other, not side[one])
            if other in side:
                side.setdefault(one, not side[other])
    if any(side[joint.bodies[0]] == side[joint.bodies[1]] for joint in members):
        return None
    return [side[joint.bodies[0]] for joint in members]


def _join_sides(members: list[Joint], ways: list[bool]) -> tuple[Facets, Facets]:
    """Return the sides of all joints together; side 1 is the side that is covered by more.

    Args:
        members: the joints.
        ways: which have their side 1 on the first side.
    """
    sides = []
    for first in (True, False):
        picked = [0 if way == first else 1 for way in ways]
        rows = np.concatenate([joint.rows[k] for joint, k in zip(members, picked, strict=True)])
        measures = np.concatenate(
            [joint.measures[k] for joint, k in zip(members, picked, strict=True)]
        )
        _, once = np.unique(rows, return_index=True)
        facets = [
            joint.facets1 if k == 0 else joint.facets2
            for joint, k in zip(members, picked, strict=True)
        ]
        sides.append((float(measures[once].sum()), len(once), _unite(facets)))
    (size, count, one), (other_size, other_count, other) = sides
    # both cover the same length: the side with less outside it is covered more; of sides alike
    # that of the smaller facets is side 1
    turned = other_size < size * (1.0 - ALIKE)
    if abs(other_size - size) <= ALIKE * size:
        turned = other_count > count
    return (other, one) if turned else (one, other)


def _unite(groups: list[Facets]) -> Facets:
    """Return facets of several groups as one, named after the first and how many follow."""
    indices = np.unique(np.concatenate([group.indices for group in groups]))
    name = groups[0].name
    if len(groups) > 1:
        name = f"{name} and {len(groups) - 1} more"
    return Facets(name, indices.astype(np.int32), groups[0].mesh)
