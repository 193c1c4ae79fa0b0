"""Say from which neighbours a node of a contact boundary takes its pressure.

This is a node without a condition, and its pressure in pictures and fields.

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
    """Return what nodes ``without`` pressure borrow of those ``having`` one. Collective.

    A pressure here is one of their own. It is None where there are none of either. Both are numbers
    of nodes of any rank, as this rank knows them.

    Args:
        space: the body's unknowns.
        facets: those of the contact.
        without: numbers of nodes without pressure, as this rank knows them.
        having: numbers of nodes with one.
    """
    # A node has its condition on the rank that owns it: most boundaries end here, and nothing is
    # gathered.
    if not largest(space.comm, len(np.setdiff1d(without, having))):
        return None
    asking, lending = (
        np.unique(np.concatenate(from_each(space.comm, one))) for one in (without, having)
    )
    asking = np.setdiff1d(asking, lending)
    rows = space.corners_of_facets(facets.indices)
    if not (len(asking) and len(lending)):
        return None
    # pairs of one that asks and one that lends on a facet; each rank keeps those of its own nodes
    v = rows.shape[1]
    pairs = np.column_stack([np.repeat(rows, v, axis=1).ravel(), np.tile(rows, v).ravel()])
    pairs = pairs[np.isin(pairs[:, 0], asking) & np.isin(pairs[:, 1], lending)]
    pairs = np.unique(np.concatenate(from_each(space.comm, pairs)), axis=0)
    pairs = pairs[space.blocks_of(pairs[:, 0]) >= 0] if len(pairs) else pairs
    numbers, row = np.unique(pairs[:, 0], return_inverse=True)
    shares = sp.csr_matrix(
        (np.ones(len(pairs)), (row.ravel(), np.searchsorted(lending, pairs[:, 1]))),
        shape=(len(numbers), len(lending)),
    )
    # the mean of all neighbours
    count = np.asarray(shares.sum(axis=1)).ravel()
    return Borrowed(
        numbers, lending, sp.csr_matrix(sp.diags(1.0 / count) @ shares if len(count) else shares)
    )
