"""Say from which neighbours a contact node without a condition takes its pressure in pictures.

Such a node is held, shared by both sides, or hardly covered: no reaction of its own tells the
pressure there. The mean of its neighbours on the facets around it is right up to the size of a
facet, where zero is wrong by all of it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, from_each, largest


@dataclass(frozen=True, eq=False)
class Borrowed:
    """Hold nodes of this rank that take the values of others.

    Attributes:
        numbers: (t,) those of the nodes.
        lenders: (q,) numbers of those that lend, of all ranks.
        shares: (t, q), with rows that sum to one.
    """

    numbers: Indices
    lenders: Indices
    shares: sp.csr_matrix

    def values(self, space: Any, nodal: Array) -> Array:
        """Return the values (t, c) that the nodes take of owned nodal values (k, c). Collective."""
        return np.asarray(self.shares @ space.at_nodes(self.lenders, nodal))


def borrow(space: Any, facets: Any, without: Indices, having: Indices) -> Borrowed | None:
    """Return what nodes without a pressure of their own borrow of those with one. Collective.

    Args:
        space: the body's unknowns.
        facets: those of the contact.
        without: numbers of nodes without pressure, of any rank, as this rank knows them.
        having: the like of nodes with one, which counts where both name a node.

    Returns:
        what nodes of this rank borrow, or None where no node borrows.
    """
    # a node has its condition on the rank that owns it: most boundaries end here, and nothing is
    # gathered
    if not largest(space.comm, len(np.setdiff1d(without, having))):
        return None
    asking = np.unique(np.concatenate(from_each(space.comm, without)))
    lending = np.unique(np.concatenate(from_each(space.comm, having)))
    asking = np.setdiff1d(asking, lending)
    rows = space.corners_of_facets(facets.indices)
    if not (len(asking) and len(lending)):
        return None
    # pairs of one that asks and one that lends on a facet; each rank keeps those of its own nodes
    v = rows.shape[1]
    pairs = np.column_stack([np.repeat(rows, v, axis=1).ravel(), np.tile(rows, v).ravel()])
    pairs = pairs[np.isin(pairs[:, 0], asking) & np.isin(pairs[:, 1], lending)]
    pairs = np.unique(np.concatenate(from_each(space.comm, pairs)), axis=0)
    if len(pairs):
        pairs = pairs[space.blocks_of(pairs[:, 0]) >= 0]
    numbers, row = np.unique(pairs[:, 0], return_inverse=True)
    shares = sp.csr_matrix(
        (np.ones(len(pairs)), (row.ravel(), np.searchsorted(lending, pairs[:, 1]))),
        shape=(len(numbers), len(lending)),
    )
    # the mean of all neighbours
    count = np.asarray(shares.sum(axis=1)).ravel()
    if len(count):
        shares = sp.diags(1.0 / count) @ shares
    return Borrowed(numbers, lending, sp.csr_matrix(shares))
