"""Let the nodes of a tied boundary follow several nodes of another one, meshed in any way.

A mortar coupling (``Coupling``) gives the rows P_sj of the nodes s of one boundary,

    u_s = sum_j P_sj u_j + (gradient of n·u_2 along the face) (-d_s),   d_s = x_s - sum_j P_sj x_j

Rows of P add up to one, so that forces balance. Where both boundaries lie in each other d_s is
rounding. Polygons of one curve, and bodies with a gap between them, are a distance d_s = |d_s| n
apart. There the second term turns d_s with the face of side 2: u_s is exact for every rigid motion
of it, and the moments of the forces balance too. The gradient is the least-squares plane through
n·u_j of the nodes j of the row. Boundaries that are farther apart than their facets are long are
the sides of one period of a body: what lies between them is not turned.

Nodes that some support holds, that are on several ties, or that stand on the edge of a tied
boundary may coincide with a node of the other one: they move as it does, and hand their multiplier
to the others of their facets (``fem.contact.mortar``). Elsewhere what is held stays held, and
follows nothing.

Source: Puso, Int. J. Numer. Methods Engrg. 59 (2004), 315-336, for rigid motions and curved
boundaries; Wohlmuth, SIAM J. Numer. Anal. 38 (2000), 989-1012, for dual multipliers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.errors import InputError

APART = 1e-10  # of the size of both boundaries: less is round-off
BETTER = 0.01  # CHOSEN: of a side; by so much more must the first be covered to follow the second


@dataclass(frozen=True, eq=False)
class TiedSide:
    """Hold a boundary that is tied, the same on every rank.

    Attributes:
        name: that of its group.
        numbers: (k,) of its nodes, ascending.
        points: (k, d) coordinates [m].
        held: (k, d) which components are prescribed.
        facets: (f, v) places of the nodes of its facets, vertices first.
        vertices: how many vertices a facet has.
        outward: (f, d) unit normals of the facets.
    """

    name: str
    numbers: Indices
    points: Array
    held: Any
    facets: Indices
    vertices: int
    outward: Array

    @property
    def held_unknowns(self) -> Indices:
        """Return the prescribed unknowns, node number * d + component."""
        d = self.points.shape[1]
        return np.asarray((self.numbers[:, None] * d + np.arange(d))[self.held])

    def find_edge(self) -> Mask:
        """Return which nodes (k,) stand on the edge of the boundary."""
        edge = np.zeros(len(self.numbers), dtype=bool)
        corners = self.facets[:, : self.vertices]
        # in the plane a vertex of one facet only; in space the ends of sides of one facet only
        if self.points.shape[1] == 2:
            edge[np.flatnonzero(np.bincount(corners.ravel(), minlength=len(edge)) == 1)] = True
            return edge
        # quadrilaterals list vertices as rows of a grid: 0-1, 0-2, 1-3, 2-3 are their sides
        pairs = [(0, 1), (1, 2), (2, 0)] if self.vertices == 3 else [(0, 1), (0, 2), (1, 3), (2, 3)]
        ends = np.sort(np.concatenate([corners[:, pair] for pair in pairs]), axis=1)
        single, count = np.unique(ends, axis=0, return_counts=True)
        edge[single[count == 1].ravel()] = True
        return edge

    @property
    def facet_size(self) -> float:
        """Return the largest distance of two vertices of a facet [m]."""
        corners = self.points[self.facets[:, : self.vertices]]
        apart = corners[:, :, None, :] - corners[:, None, :, :]
        return float(np.linalg.norm(apart, axis=3).max())


@runtime_checkable
class Coupling(Protocol):
    """Couple a boundary to another one in the mean."""

    def couple(self, side: TiedSide, other: TiedSide, tied: Indices) -> tuple[Any, Any, float]:
        """Return the rows of P, P itself, and the covered share of the boundary.

        Args:
            side: the boundary whose nodes follow.
            other: the one that they follow.
            tied: (k,) places on ``other`` of nodes that move as one there does, -1 for the others.

        Returns:
            (m,) places of the nodes that follow, sparse P (m, nodes of ``other``), and the share.
        """


@dataclass(frozen=True, eq=False)
class Mean:
    """Hold what one tie of unlike boundaries says.

    Attributes:
        pairs: unknowns (k,) of one boundary, and those of the other that move alike.
        followers: (m,) unknowns that follow several others.
        rows: (e,) places of the followers of the entries that follow.
        leaders: (e,) the unknowns that they follow.
        weights: (e,) their weights.
    """

    pairs: tuple[Indices, Indices]
    followers: Indices
    rows: Indices
    leaders: Indices
    weights: Array


def blend(
    matching: Coupling,
    sides: tuple[TiedSide, TiedSide],
    others: Sequence[TiedSide],
    components: Indices,
    near: float,
) -> Mean:
    """Return what follows what in one tie.

    Args:
        matching: the coupling.
        sides: both boundaries; nodes of the second follow, unless the first is covered better.
        others: boundaries of other ties.
        components: those that are tied.
        near: how far nodes at one place may be apart [m].
    """
    first, second = sides
    elsewhere = np.concatenate([np.zeros(0, dtype=np.int64), *(side.numbers for side in others)])
    ways: list[tuple[TiedSide, TiedSide, Indices, Indices, Any, float]] = []
    failure = None
    for side, other in ((second, first), (first, second)):
        partner = _find_common(side, other, elsewhere, near)
        try:
            ways.append((side, other, partner, *matching.couple(side, other, partner)))
        except InputError as error:  # a matching may need one side that is covered as a whole
            failure = failure or error
        if ways and ways[0][-1] > 1.0 - BETTER:
            break
    if not ways:
        assert failure is not None
        raise failure
    better = ways[-1][-1] > ways[0][-1] + BETTER
    side, other, partner, rows, P, _ = ways[-1 if better else 0]
    d = side.points.shape[1]

    # nodes that move as one does: in the components that supports hold on both or on neither
    common = np.flatnonzero(partner >= 0)
    common = common[other.numbers[partner[common]] != side.numbers[common]]
    there = partner[common]
    alike = (side.held[common] == other.held[there])[:, components]
    lead = other.numbers[there][:, None] * d + components
    follow = side.numbers[common][:, None] * d + components
    entries = _list_entries(side, other, rows, sp.csr_matrix(P), components)
    return Mean((lead[alike], follow[alike]), *entries)


def _find_common(side: TiedSide, other: TiedSide, elsewhere: Indices, near: float) -> Indices:
    """Return places (k,) on the other side of nodes that move as one there, -1 for all others.

    Args:
        side: the boundary whose nodes follow.
        other: the one that they follow.
        elsewhere: numbers of nodes of other ties.
        near: how far nodes at one place may be apart [m].
    """
    from scipy.spatial import cKDTree  # late: most bodies have no ties

    # nodes of both boundaries first, then special ones with a node at their place
    distance, place = cKDTree(other.points).query(side.points)
    must = side.held.any(axis=1) | np.isin(side.numbers, elsewhere)
    special = (must | side.find_edge()) & (distance <= near)
    shared = np.isin(side.numbers, other.numbers)
    # a facet keeps a multiplier of its own: one of its nodes on the edge follows in the mean
    for facet in side.facets:
        if (special | shared)[facet].all():
            free = facet[~(must | shared)[facet]]
            special[free[np.argsort(side.numbers[free])][:1]] = False
    partner = np.where(special, place, -1)
    partner[shared] = np.searchsorted(other.numbers, side.numbers[shared])
    return np.asarray(partner)


def _list_entries(
    side: TiedSide, other: TiedSide, rows: Indices, P: sp.csr_matrix, components: Indices
) -> tuple[Indices, Indices, Indices, Array]:
    """Return the followers, and for each entry its follower's place, its leader and its weight.

    Args:
        side: the boundary whose nodes follow.
        other: the one that they follow.
        rows: (m,) places of the nodes that follow.
        P: (m, nodes of ``other``).
        components: those that are tied.
    """
    d = side.points.shape[1]
    count = len(components)
    followers = side.numbers[rows][:, None] * d + components
    P.sum_duplicates()
    entry = np.repeat(np.arange(len(rows)), np.diff(P.indptr))
    own = entry[:, None] * count + np.arange(count)
    leaders = other.numbers[P.indices][:, None] * d + components
    parts = [(own, leaders, np.repeat(P.data[:, None], count, axis=1))]

    # what rigid motions need where the boundaries do not lie in each other, unless they are the
    # sides of one period
    apart = side.points[rows] - P @ other.points
    length = np.linalg.norm(apart, axis=1)
    facet_size = max(side.facet_size, other.facet_size)
    period = len(length) > 0 and float(np.median(length)) > facet_size
    if count == d and not period:
        for row in np.flatnonzero(length > APART * facet_size):
            nodes = P.indices[P.indptr[row] : P.indptr[row + 1]]
            weights = P.data[P.indptr[row] : P.indptr[row + 1]]
            turning = _turn(apart[row], other.points[nodes], np.abs(weights))
            places = row * d + np.arange(d)
            lead = other.numbers[nodes][:, None] * d + np.arange(d)
            shape = turning.shape
            parts.append(
                (
                    np.broadcast_to(places[:, None, None], shape),
                    np.broadcast_to(lead, shape),
                    turning,
                )
            )
    columns = [np.concatenate([part[k].ravel() for part in parts]) for k in range(3)]
    return followers.ravel(), columns[0], columns[1], columns[2]


def _turn(apart: Array, points: Array, weights: Array) -> Array:
    """Return what the displacements of nodes add to that of a point beside them (d, k, d).

    It is omega x apart for rigid rotations omega: -|apart| times the gradient of their normal
    displacement n·u, of the plane through it with the least squares.

    Args:
        apart: (d,) from the mean of the nodes to the point [m].
        points: (k, d) of the nodes [m].
        weights: (k,) of the least squares.
    """
    length = np.linalg.norm(apart)
    n = apart / length
    # tangents: the other columns of an orthogonal matrix whose first one is n
    tangents = np.linalg.svd(n[None, :])[2][1:].T
    y = (points - weights @ points / weights.sum()) @ tangents
    gradient = tangents @ np.linalg.pinv(y.T @ (weights[:, None] * y)) @ (weights[:, None] * y).T
    return np.asarray(-length * gradient[:, :, None] * n)


@dataclass(frozen=True, eq=False)
class Blends:
    """Hold unknowns that follow several others, none of which follows another one.

    Attributes:
        followers: (k,) unknowns that are eliminated.
        rows: (e,) places of the followers of the entries that follow.
        leaders: (e,) the unknowns that they follow.
        weights: (e,) their weights.
    """

    followers: Indices
    rows: Indices
    leaders: Indices
    weights: Array

    @classmethod
    def join(
        cls, means: Sequence[Mean], followers: Indices, leaders: Indices, held: Sequence[Indices]
    ) -> "Blends":
        """Return what follows what after all ties.

        Where ties cross, a node follows the boundary of the first tie that asks it to, and none
        follows itself through others.

        Args:
            means: what each tie of unlike boundaries says.
            followers: unknowns (k,) that follow one other.
            leaders: (k,) these.
            held: unknowns that supports hold.
        """
        leader_of = dict(zip(followers.tolist(), leaders.tolist(), strict=True))
        fixed = set(np.concatenate(held).tolist())
        rows: dict[int, dict[int, float]] = {}
        for mean in means:
            # entries of each follower in a row; those of one leader add up
            order = np.argsort(mean.rows, kind="stable")
            bounds = np.searchsorted(mean.rows[order], np.arange(len(mean.followers) + 1))
            lead = mean.leaders[order].tolist()
            weight = mean.weights[order].tolist()
            for place, unknown in enumerate(mean.followers.tolist()):
                follower = leader_of.get(unknown, unknown)
                row: dict[int, float] = {}
                for at in range(bounds[place], bounds[place + 1]):
                    leader = leader_of.get(lead[at], lead[at])
                    row[leader] = row.get(leader, 0.0) + weight[at]
                taken = follower in fixed or follower in rows
                if not taken and not _reaches(rows, row, follower):
                    rows[follower] = row

        # what followers that follow others follow, and those that follow one of these
        done: dict[int, dict[int, float]] = {}
        for follower in rows:
            _resolve(rows, follower, done)
        done |= {own: done[lead] for own, lead in leader_of.items() if lead in done}
        names = sorted(done)
        counts = [len(done[name]) for name in names]
        return cls(
            np.array(names, dtype=np.int64),
            np.repeat(np.arange(len(names)), counts),
            np.array([key for name in names for key in done[name]], dtype=np.int64),
            np.array([value for name in names for value in done[name].values()]),
        )


NO_BLENDS = Blends(
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0),
)


def _reaches(rows: dict[int, dict[int, float]], row: dict[int, float], follower: int) -> bool:
    """Return whether what a row follows, through other rows too, is this follower."""
    seen: set[int] = set()
    ahead = list(row)
    while ahead:
        unknown = ahead.pop()
        if unknown == follower:
            return True
        if unknown in rows and unknown not in seen:
            seen.add(unknown)
            ahead += rows[unknown]
    return False


def _resolve(
    rows: dict[int, dict[int, float]], follower: int, done: dict[int, dict[int, float]]
) -> dict[int, float]:
    """Return the leaders of a follower and their weights, without followers among them."""
    if follower not in done:
        row: dict[int, float] = {}
        for unknown, weight in rows[follower].items():
            end = _resolve(rows, unknown, done) if unknown in rows else {unknown: 1.0}
            for leader, share in end.items():
                row[leader] = row.get(leader, 0.0) + weight * share
        done[follower] = row
    return done[follower]
