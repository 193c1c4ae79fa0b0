"""Make conditions that are linear traces of the unknowns: those of nodes that share unknowns.

A node has one frame, in which each of its conditions has an unknown, and what it faces must not
face others (``frames``). Neither holds where a node is on side 1 of one pair and side 2 of another,
or faces two partners along one direction. There every body keeps its own unknowns along the axes,
and a condition is a row of B (``core.traces``):

    u_n = n·(u_s - sum_j P_sj u_j - sum_k P_sk e_k),    likewise along its own tangents

for the nodes j and bubbles k that node s faces. So are corners that rub on all their faces.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask, from_each, largest
from ...core.checks import describe_point
from ...core.corners import FEATURE_ANGLE, PARALLEL, make_tangent_vectors
from ...core.errors import InputError
from ...core.surfaces import group_same_nodes
from ...core.traces import Traces, make_traces
from ..mesh.nodal_space import NodalSpace
from .conditions import NodalConditions, list_faced
from .nodes import ask_alike, join_nodes


def need_traces(space: NodalSpace, parts: Sequence[NodalConditions]) -> bool:
    """Say whether some node has conditions that no frame of its own can hold. Collective.

    Args:
        space: what the unknowns mean.
        parts: this rank's conditions.
    """
    return bool(largest(space.comm, _has_parallel(parts))) or has_chains(space, parts)


def has_chains(space: NodalSpace, parts: Sequence[NodalConditions]) -> bool:
    """Say whether a node is on side 1 of a pair, or has bubbles, and on side 2 of another.

    Unknowns relative to side 2 are none there: what is faced would face others. Collective.

    Args:
        space: what the unknowns mean.
        parts: this rank's conditions.
    """
    coupled = [np.zeros(0, dtype=np.int64)]
    coupled += [part.nodes.numbers for part in parts if list_faced(part)]
    first = np.zeros((len(space.nodes), 1))
    first[space.blocks_of(np.concatenate(coupled))] = 1.0
    chained = False
    for facing in (part.facing for part in parts if part.facing is not None):
        used = np.zeros(len(facing.nodes.numbers))
        used[facing.P.indices] = 1.0
        known = space.at_nodes(space.leaders(facing.nodes.numbers), first)[:, 0]
        chained |= bool((known * space.comm.max(used)).any())
    return chained


def _has_parallel(parts: Sequence[NodalConditions]) -> bool:
    """Say whether some node faces different partners along one direction."""
    nodes = join_nodes([part.nodes for part in parts])
    directions = np.concatenate([part.directions for part in parts])
    partners = _list_partners(parts)
    for rows in group_same_nodes(nodes.numbers):
        if any(_are_apart(partners, i, j) for i, j in _find_parallel(directions, rows)):
            return True
    return False


def refuse_twice(
    numbers: Indices, points: Array, directions: Array, partners: Sequence[frozenset[int]]
) -> None:
    """Raise InputError for a node that faces the same twice along one direction.

    Args:
        numbers: (m,) nodes of the conditions.
        points: (m, d) of these [m].
        directions: (m, d) unit vectors.
        partners: of each condition, the nodes that it faces.
    """
    for rows in group_same_nodes(numbers):
        for i, j in _find_parallel(directions, rows):
            if not _are_apart(partners, i, j):
                raise InputError(
                    f"contact node {describe_point(points[i])} is on several contact surfaces with "
                    "one contact direction: list every boundary and every pair once, and join "
                    "boundaries that continue one another in one group"
                )


def _refuse_both_ways(space: NodalSpace, parts: Sequence[NodalConditions]) -> None:
    """Raise InputError for nodes of which each faces the other: pairs that are given both ways.

    Two bodies that meet at an edge may face one another along different directions. Collective.

    Args:
        space: what the unknowns mean.
        parts: this rank's conditions.
    """
    # every node and what it faces, with the direction and the place
    rows = [np.zeros((0, 2 + 2 * space.dimension))]
    for part in parts:
        if part.facing is None:
            continue
        P = part.facing.P
        of = np.repeat(np.arange(len(part.nodes.numbers)), np.diff(P.indptr))
        faced = part.facing.nodes.numbers[P.indices]
        own = (part.nodes.numbers[of], faced, part.directions[of], part.nodes.points[of])
        rows.append(np.column_stack(own))
    every = np.concatenate(from_each(space.comm, np.concatenate(rows)))
    pairs = every[:, :2].astype(np.int64)
    d = space.dimension
    known = {(s, j): row for row, (s, j) in enumerate(pairs.tolist())}
    for row, (s, j) in enumerate(pairs.tolist()):
        back = known.get((j, s))
        if back is None:
            continue
        slope = float(every[row, 2 : 2 + d] @ every[back, 2 : 2 + d])
        if s == j or slope < -np.cos(FEATURE_ANGLE):
            where = describe_point(every[row, 2 + d :])
            what = "itself" if s == j else "a node of another contact pair that faces it"
            raise InputError(
                f"contact node {where} faces {what}: give each pair once, with either side the "
                "first"
            )


def _find_parallel(directions: Array, rows: Indices) -> list[tuple[int, int]]:
    """Return the pairs of rows with the same direction."""
    cosines = directions[rows] @ directions[rows].T
    first, second = np.nonzero(np.triu(cosines > 1.0 - PARALLEL, 1))
    return list(zip(rows[first].tolist(), rows[second].tolist(), strict=True))


def _are_apart(partners: Sequence[frozenset[int]], i: int, j: int) -> bool:
    """Say whether two conditions of one node and one direction face different nodes."""
    return bool(partners[i]) and bool(partners[j]) and partners[i].isdisjoint(partners[j])


def _list_partners(parts: Sequence[NodalConditions]) -> list[frozenset[int]]:
    """Return the numbers of the nodes that each condition faces, none for those of an obstacle."""
    partners = []
    for part in parts:
        if part.facing is None:
            partners += [frozenset[int]()] * len(part.nodes.numbers)
            continue
        P = part.facing.P
        numbers = part.facing.nodes.numbers
        for start, end in zip(P.indptr[:-1], P.indptr[1:], strict=True):
            partners.append(frozenset(numbers[P.indices[start:end]].tolist()))
    return partners


def trace_conditions(space: NodalSpace, parts: Sequence[NodalConditions], slots: Indices) -> Traces:
    """Return B_n and B_t of conditions, one part after the other. Collective.

    A tangent along which the node itself is prescribed is no tangent: it carries no friction.

    Args:
        space: what the unknowns mean.
        parts: this rank's m conditions.
        slots: (m,) their numbers among those of all ranks.

    Raises:
        InputError: on all ranks, a node that faces the same twice along one direction, or itself,
            and nodes that face one another.
    """
    nodes = join_nodes([part.nodes for part in parts])
    directions = np.concatenate([part.directions for part in parts])
    partners = np.array([*_list_partners(parts), None], dtype=object)[:-1]

    def ask(*arrays: Array) -> tuple[Array, ...]:
        refuse_twice(*arrays)  # type: ignore[arg-type]
        return ()

    ask_alike(space.comm, slots, ask, nodes.numbers, nodes.points, directions, partners)
    _refuse_both_ways(space, parts)
    tangents, free = find_own_tangents(parts)
    tangents = np.where(free[:, None, :], tangents, 0.0)

    # Rows along each vector of the conditions, all normals and then all tangents.
    d = directions.shape[1]
    normal = _express(space, parts, directions)
    along = [_express(space, parts, tangents[:, :, c]) for c in range(d - 1)]
    tangential = sp.csr_matrix((0, space.unknowns))
    if along:
        side_by_side = np.arange((d - 1) * len(slots)).reshape(d - 1, -1).T.ravel()
        tangential = sp.csr_matrix(sp.csr_matrix(sp.vstack(along))[side_by_side])
    n = len(space.ids)
    first = space.algebra.first(n)
    return make_traces(space.comm, slots, (normal, tangential), width=d - 1, first=first, count=n)


def find_own_tangents(parts: Sequence[NodalConditions]) -> tuple[Array, Mask]:
    """Return the tangents of conditions as traces, as columns (m, d, d - 1), and which are free.

    Those of a condition are the tangents of its direction alone. One with a component along which
    the node is prescribed is not free.

    Args:
        parts: this rank's m conditions.
    """
    held = np.concatenate([part.nodes.held for part in parts])
    tangents = make_tangent_vectors(np.concatenate([part.directions for part in parts]), None)
    stopped = (tangents != 0.0) & held[:, :, None]
    return tangents, ~stopped.any(axis=1)


def _express(space: NodalSpace, parts: Sequence[NodalConditions], vectors: Array) -> sp.csr_matrix:
    """Return rows (m, unknowns) of vector·(u_s - what s faces), for m vectors (m, d)."""
    rows = []
    start = 0
    for part in parts:
        count = len(part.nodes.numbers)
        along = vectors[start : start + count]
        start += count
        own = _select(part.nodes.unknowns, along, space.unknowns)
        for other in list_faced(part):
            P = sp.csr_matrix(other.P)
            of = np.repeat(np.arange(count), np.diff(P.indptr))
            weighted = P.data[:, None] * along[of]
            faced = _select(other.nodes.unknowns[P.indices], weighted, space.unknowns)
            sums = sp.csr_matrix(
                (np.ones(len(of)), (of, np.arange(len(of)))), shape=(count, len(of))
            )
            own = own - sums @ faced
        rows.append(sp.csr_matrix(own))
    return sp.csr_matrix(sp.vstack(rows))


def _select(unknowns: Indices, vectors: Array, total: int) -> sp.csr_matrix:
    """Return rows (k, total) with the components of vectors (k, d) at unknowns (k, d), free ones.

    Args:
        unknowns: numbers of the unknowns, -1 for prescribed components.
        vectors: what stands there.
        total: how many unknowns there are.
    """
    k = len(unknowns)
    used = (unknowns >= 0) & (vectors != 0.0)
    row = np.broadcast_to(np.arange(k)[:, None], used.shape)
    return sp.csr_matrix((vectors[used], (row[used], unknowns[used])), shape=(k, total))
