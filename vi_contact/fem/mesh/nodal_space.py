"""Say what unknowns mean that are displacements of nodes.

This is where the nodes are, which rank has them, what is a body.
"""

from typing import Any

import numpy as np

from ...core.algebra import Algebra, Array, Comm, Indices, Mask, from_each, largest
from ...core.checks import at
from ...core.errors import InputError
from ...meshes.rows import connected

MEANT = (
    0.05  # of the size of a body: how far from it a point may be that stands for the nearest node
)


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
        unknowns: how many on all ranks.
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
        """Return the change to unknowns of a hierarchy, where contact conditions need one.

        It is None elsewhere.
        """
        return None

    def expand(self, u: Array, t: float, derivative: int = 0) -> Array:
        """Expand a vector of unknowns (n,) at time t to displacements of owned nodes (k, d).

        Or to the derivatives of these.

        Args:
            u: (n,) vector of unknowns.
            t: time [s].
            derivative: 0 for displacements, 1 and 2 for their rates.
        """
        where = self.free_index.reshape(-1, self.dimension)
        return np.where(where >= 0, u.take(where, mode="clip") if len(u) else 0.0, 0.0)

    def leaders(self, nodes: Indices) -> Indices:
        """Return these node numbers, of nodes that follow another that of the other.

        It is -1 for those tied in part.
        """
        return nodes

    def blocks_of(self, nodes: Indices) -> Indices:
        """Return the owned block of each node number, -1 when another rank owns it."""
        if not len(self.nodes):
            return np.full(len(nodes), -1)
        order = np.argsort(self.nodes)
        blocks = order[np.minimum(np.searchsorted(self.nodes, nodes, sorter=order), len(order) - 1)]
        return np.where(self.nodes[blocks] == nodes, blocks, -1)

    def at_nodes(self, numbers: Indices, values: Array) -> Array:
        """Return owned nodal values (k, c) at node numbers, on every rank. Collective.

        They are zero for nodes of nobody.
        """
        found = np.zeros((len(numbers), values.shape[1]))
        where = self.blocks_of(numbers)
        found[where >= 0] = values[where[where >= 0]]
        return self.comm.sum(found)

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
        """Find the numbers of the nodes nearest to the points (k, d), equal on all ranks.

        Collective.

        InputError for a point farther from every node than the body is large (5 % of its
        diagonal).
        """
        return self.find_nearest(points)[0]

    def find_nearest(self, points: Array, *, anywhere: bool = False) -> tuple[Indices, Array]:
        """Find the nodes as ``find_nodes`` does, and their distances (k,) [m]. Collective.

        Args:
            points: (k, d) [m].
            anywhere: whether points far from all nodes are let be.
        """
        found = np.empty(len(points), dtype=np.int64)
        distances = np.zeros(len(points))
        for i, point in enumerate(np.atleast_2d(np.asarray(points, dtype=float))):
            if point.shape != (self.dimension,):
                raise InputError(
                    f"point {tuple(point)} has {len(point)} coordinates: give {self.dimension}"
                )
            distance = np.linalg.norm(self.points - point, axis=1)
            nearest = -largest(self.comm, -np.min(distance, initial=np.inf))
            if nearest > MEANT * self.size and not anywhere:
                raise InputError(
                    f"point {at(point)} is {nearest:.3g} m away from the nearest node: give a "
                    "point of the body"
                )
            close = self.nodes[distance <= nearest + 1e-9 * self.size]
            found[i] = -int(
                largest(self.comm, -float(np.min(close, initial=np.iinfo(np.int64).max)))
            )
            distances[i] = nearest
        return found, distances


def bounding_box(comm: Comm, points: Array) -> float:
    """Return the diagonal of the box around the points (k, d) of all ranks [m]. Collective."""
    low = -comm.max(-np.min(points, axis=0, initial=np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    return float(np.linalg.norm(high - low))


def parts_of(comm: Comm, first: Any, second: Any, numbers: Indices, shared: Indices) -> Indices:
    """Return the part that each of the numbers (n,) of this rank belongs to. Collective.

    Parts are 0, 1, ..., in the order of least numbers. Links join things of this rank; where ranks
    have one thing, parts of different ranks meet and are one.

    Args:
        comm: the ranks.
        first: places of things, one end of each link.
        second: places of the other ends.
        numbers: (n,) of the things of this rank.
        shared: places of things that other ranks have too.
    """
    # parts of this rank, each called by its smallest number
    part = _smallest(first, second, numbers)
    # what things that several ranks have are called there: these parts are one
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
    part = connected(len(numbers), first, second)
    smallest = np.full(part.max(initial=-1) + 1, np.iinfo(np.int64).max)
    np.minimum.at(smallest, part, numbers)
    return smallest[part]
