"""Say what unknowns mean that are displacements of nodes: where these are, and on which rank.

``NodalSpace`` is what contact and output need of finite elements (``body.space``) and of own
matrices (``matrices.own_matrices``) alike. ``parts_of`` finds bodies, and other things that hang
together over ranks.
"""

from functools import cached_property
from typing import Any

import numpy as np

from ...core.algebra import Algebra, Array, Comm, Indices, Mask, from_each, largest
from ...core.checks import describe_point
from ...core.errors import InputError
from ...meshes.rows import number_parts

# of the size of a body: how far from it a point may be that stands for the nearest node
MEANT = 0.05


class NodalSpace:
    """Hold nodes and the unknowns that are components of their displacements.

    Every rank owns some of the nodes.

    Attributes:
        algebra: of the matrices of its systems.
        comm: its ranks.
        dimension: d.
        size: diagonal of the bounding box [m].
        nodes: (k,) numbers of the owned nodes.
        points: their coordinates (k, d) [m].
        free_index: (k d,) the owned unknown that a component is, -1 where it is none.
        numbers: (k, d) the same among those of all ranks, also of a component that follows another.
        held: (k, d) components that are given.
        ids: (n,) numbers of the owned unknowns on any ranks (node * d + component).
        unknowns: how many unknowns there are on all ranks.
    """

    algebra: Algebra
    comm: Comm
    dimension: int
    size: float
    nodes: Indices
    points: Array
    free_index: Indices
    numbers: Indices
    held: Mask
    ids: Indices
    unknowns: int

    @property
    def hierarchy(self) -> Any:
        """Return the change to unknowns of a hierarchy (``body.hierarchical``), or None."""
        return None

    @property
    def outlets(self) -> Mask | None:
        """Return which unknowns (n,) meet dashpots alone, which natural modes hold, or None."""
        return None

    def expand(self, u: Array, t: float, derivative: int = 0) -> Array:
        """Return the displacements of owned nodes (k, d), or their rates, of a vector of unknowns.

        Args:
            u: (n,) vector of unknowns.
            t: time [s].
            derivative: 0 for displacements, 1 and 2 for their rates.
        """
        where = self.free_index.reshape(-1, self.dimension)
        return np.where(where >= 0, u.take(where, mode="clip") if len(u) else 0.0, 0.0)

    def leaders(self, nodes: Indices) -> Indices:
        """Return the numbers of the nodes that these follow: their own, where nothing is tied."""
        return nodes

    @cached_property
    def _order(self) -> Indices:
        """Return the places of the owned nodes in the order of their numbers."""
        return np.argsort(self.nodes)

    def blocks_of(self, nodes: Indices) -> Indices:
        """Return the place (k,) of each node number among the owned nodes, -1 of other ranks'."""
        if not len(self.nodes):
            return np.full(len(nodes), -1)
        order = self._order
        blocks = order[np.minimum(np.searchsorted(self.nodes, nodes, sorter=order), len(order) - 1)]
        return np.where(self.nodes[blocks] == nodes, blocks, -1)

    def at_nodes(self, numbers: Indices, values: Array) -> Array:
        """Return values at nodes of any rank, on every rank; zero at nodes of nobody. Collective.

        Args:
            numbers: (m,) numbers of nodes, the same on every rank.
            values: (k, c) at the owned nodes.

        Returns:
            (m, c).
        """
        # each node has one owner: all others add zeros
        rows = np.zeros((len(numbers), values.shape[1]))
        where = self.blocks_of(numbers)
        rows[where >= 0] = values[where[where >= 0]]
        return self.comm.sum(rows)

    def sample(self, u: Array, nodes: Indices, t: float, derivative: int = 0) -> Array:
        """Return the displacements (k, d) at node numbers, equal on all ranks. Collective.

        Args:
            u: (n,) vector of unknowns.
            nodes: numbers of k nodes.
            t: time [s].
            derivative: 0 for displacements, 1 and 2 for their rates.
        """
        return self.at_nodes(nodes, self.expand(u, t, derivative))

    def find_nodes(self, points: Array) -> Indices:
        """Find the nodes nearest to points; of several the one of least number. Collective.

        Args:
            points: (k, d) [m].

        Returns:
            (k,) numbers of nodes, the same on all ranks.

        Raises:
            InputError: a point farther from every node than 5 % of the diagonal of the body.
        """
        numbers, _ = self.find_nearest(points)
        return numbers

    def find_nearest(
        self, points: Array, *, anywhere: bool = False, among: Indices | None = None
    ) -> tuple[Indices, Array]:
        """Find the nodes as ``find_nodes`` does, and how far they are. Collective.

        Args:
            points: (k, d) [m].
            anywhere: whether points far from all nodes are let be.
            among: numbers of the nodes that count, the same on all ranks; None: all.

        Returns:
            (k,) numbers of nodes and (k,) distances [m], the same on all ranks.

        Raises:
            InputError: as for ``find_nodes``, unless ``anywhere``.
        """
        numbers = np.empty(len(points), dtype=np.int64)
        distances = np.zeros(len(points))
        left_out = np.zeros(len(self.nodes), dtype=bool)
        if among is not None:
            left_out = ~np.isin(self.nodes, among)
        for i, point in enumerate(np.atleast_2d(np.asarray(points, dtype=float))):
            if point.shape != (self.dimension,):
                raise InputError(
                    f"point {tuple(point)} has {len(point)} coordinates: give {self.dimension}"
                )
            distance = np.linalg.norm(self.points - point, axis=1)
            distance[left_out] = np.inf
            nearest = -largest(self.comm, -np.min(distance, initial=np.inf))
            if nearest > MEANT * self.size and not anywhere:
                raise InputError(
                    f"point {describe_point(point)} is {nearest:.3g} m away from the nearest node: "
                    "give a point of the body"
                )
            close = self.nodes[distance <= nearest + 1e-9 * self.size]
            least = float(np.min(close, initial=np.iinfo(np.int64).max))
            numbers[i] = -int(largest(self.comm, -least))
            distances[i] = nearest
        return numbers, distances


def bounding_box(comm: Comm, points: Array) -> float:
    """Return the diagonal of the box around the points (k, d) of all ranks [m]. Collective."""
    low = -comm.max(-np.min(points, axis=0, initial=np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    return float(np.linalg.norm(high - low))


def parts_of(comm: Comm, first: Any, second: Any, numbers: Indices, shared: Indices) -> Indices:
    """Return which part of a graph over all ranks each thing of this rank belongs to. Collective.

    A thing has one number on all ranks. Links join things of one rank; where several ranks have a
    thing, their parts meet there and are one.

    Args:
        comm: the ranks.
        first: places of things among ``numbers``, one end of each link.
        second: places of the other ends.
        numbers: (n,) of the things of this rank.
        shared: places of things that other ranks have too.

    Returns:
        (n,) parts 0, 1, …, in the order of their least numbers.
    """
    # parts of this rank, each called by its smallest number
    part = _smallest(first, second, numbers)
    # rows (thing, what its part is called on a rank) of shared things: sorted by things, neighbours
    # with one thing are two names of one part
    meeting = np.column_stack([numbers[shared], part[shared]])
    meeting = np.unique(np.concatenate(from_each(comm, meeting)), axis=0)
    parts = np.unique(np.concatenate(from_each(comm, np.unique(part))))
    index = np.searchsorted(parts, meeting[:, 1])
    same = np.flatnonzero(meeting[1:, 0] == meeting[:-1, 0])
    body = _smallest(index[same], index[same + 1], parts)
    return np.searchsorted(np.unique(body), body[np.searchsorted(parts, part)])


def _smallest(first: Any, second: Any, numbers: Indices) -> Indices:
    """Return the smallest number (n,) among those that edges first-second join each one to.

    Args:
        first: places of things, one end of each edge.
        second: places of the other ends.
        numbers: (n,) of the things.
    """
    part = number_parts(len(numbers), first, second)
    smallest = np.full(part.max(initial=-1) + 1, np.iinfo(np.int64).max)
    np.minimum.at(smallest, part, numbers)
    return smallest[part]
