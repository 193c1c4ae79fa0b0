"""Say what the unknowns of matrices mean that a user brings: components of nodes, rotations, bodies."""

import numpy as np

from ..core.algebra import Algebra, Array, Indices, Matrix, total
from .nodal_space import NodalSpace, bounding_box, parts_of


class MatrixSpace(NodalSpace):
    """Say what the unknowns of a user's matrices mean: a component of a node each, or no displacement of a point.

    Attributes:
        coordinates: (n, d) position of the node of each unknown [m]; component: (n,), -1 for what is no displacement;
            bodies: (n,) body of each.
    """

    def __init__(self, algebra: Algebra, points: Array, block: Indices, component: Indices, K: Matrix) -> None:
        """``block``: (n,) the owned node of each unknown; nodes are numbered over the ranks. Collective."""
        self.algebra, self.comm, self.points = algebra, algebra.comm, points
        (k, d), n, first = points.shape, len(block), algebra.first(len(block))
        self.dimension, self.unknowns = d, round(total(self.comm, n))
        self.nodes, self.size = algebra.first(k) + np.arange(k), bounding_box(self.comm, points)
        self.component, moves, every = component, component >= 0, np.arange(n)
        self.free_index = np.full(k * d, -1)
        self.free_index[(block * d + component)[moves]] = every[moves]
        self.numbers = np.where(self.free_index >= 0, first + self.free_index, -1).reshape(k, d)
        self.held = self.numbers < 0
        others = d * (round(total(self.comm, k)) + first + every)  # each is a node by itself
        self.ids = np.where(moves, self.nodes[block] * d + component, others)
        self.coordinates = points[block]
        self.bodies = bodies_of(algebra, K, block)


def bodies_of(algebra: Algebra, K: Matrix, block: Indices) -> Indices:
    """Return the body (0, 1, ..., in the order of least numbers) of each owned unknown: K or a node joins those of one
    body. ``block``: (n,) the node of each, all on one rank. Collective."""
    n, first = K.rows, algebra.first(K.rows)
    entries, own = algebra.entries(K, np.arange(n)), first + np.arange(n)
    entries.eliminate_zeros()
    _, leader, node = np.unique(block, return_index=True, return_inverse=True)
    row = np.concatenate([own, np.repeat(own, np.diff(entries.indptr))])
    column = np.concatenate([first + leader[node.ravel()], entries.indices])
    numbers = np.union1d(own, column)  # those of other ranks too
    away = (column < first) | (column >= first + n)
    one, two = np.searchsorted(numbers, row), np.searchsorted(numbers, column)
    shared = np.union1d(one[away], two[away])
    return parts_of(algebra.comm, one, two, numbers, shared)[np.searchsorted(numbers, own)]
