"""Find the rings of contact conditions: groups whose forces may change without any effect.

Conditions are traces B of the unknowns (``core.traces``), and reactions act by Bᵀr alone. Where
Bᵀz = 0 for some z, as where stones meet at one place and their joints close a ring, or where one
node touches more walls than it can move from, the sum of forces is unique and its split is not. All
is found group by group: conditions that share unknowns, directly or by others.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ...core.algebra import Array, Indices, Mask

DEPENDENT = 1e-10  # of the largest singular value: traces that depend on one another


@dataclass(frozen=True, eq=False)
class Ring:
    """Hold a group of conditions whose traces depend on one another.

    Attributes:
        conditions: (c,) their rows among all conditions.
        B: (c d, u) their traces of the unknowns that they read, a condition's side by side.
        null: (c d, z) orthonormal forces without effect: Bᵀ null = 0.
    """

    conditions: Indices
    B: Array
    null: Array

    def places(self, width: int) -> Indices:
        """Return where the rows of these conditions stand among all, ``width`` of each."""
        return np.asarray((self.conditions[:, None] * width + np.arange(width)).ravel())


def find_rings(B: sp.csr_matrix, movable: Mask, width: int) -> list[Ring]:
    """Return the groups of conditions whose traces depend on one another.

    Args:
        B: (m width, k) the traces of m conditions, those of one side by side.
        movable: (m width,) rows that can move; the others are zero and are no trace.
        width: rows of a condition.
    """
    # Groups: two conditions are in one where they read one unknown.
    m = B.shape[0] // width
    condition = sp.csr_matrix(
        (np.ones(m * width), (np.repeat(np.arange(m), width), np.arange(m * width)))
    )
    reads = sp.csr_matrix(condition @ abs(B))
    count, group = connected_components(reads @ reads.T, directed=False)
    order = np.argsort(group, kind="stable")
    ends = np.cumsum(np.bincount(group, minlength=count))[:-1]

    rings = []
    for conditions in np.split(order, ends):
        rows = (conditions[:, None] * width + np.arange(width)).ravel()
        moves = movable[rows]
        part = B[rows]
        unknowns = np.unique(part.indices)
        dense = part[:, unknowns].toarray()
        null = np.zeros((len(rows), 0))
        if moves.any():
            columns = find_null_space(dense[moves].T)
            null = np.zeros((len(rows), columns.shape[1]))
            null[moves] = columns
        if null.shape[1]:
            rings.append(Ring(conditions, dense, null))
    return rings


def find_null_space(matrix: Array) -> Array:
    """Return orthonormal columns (n, z) on which a matrix (k, n) is zero."""
    _, values, vectors = np.linalg.svd(matrix)
    rank = int(np.sum(values > DEPENDENT * values.max(initial=0.0)))
    return np.asarray(vectors[rank:].T)
