"""Order contact conditions of many bodies by nested dissection, from where the bodies lie.

Two conditions share an entry of G = B A⁻¹ Bᵀ where they share a body. So bodies are halved, again
and again, by a cut across their middles: conditions between both halves are the separator, and
conditions of one half share nothing with those of the other. The elimination of a plane wall of n
bodies then costs n^1.5 (George, SIAM J. Numer. Anal. 10, 1973, 345-363).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, Indices

SMALL = 30  # conditions that are not parted any more: a dense block of them takes no time


@dataclass(frozen=True, eq=False)
class Part:
    """Hold conditions that are eliminated together.

    Attributes:
        conditions: (k,) their numbers.
        children: numbers of the parts below it, which stand before it.
    """

    conditions: Indices
    children: tuple[int, ...]


def dissect(touches: sp.csr_matrix, points: Array) -> list[Part]:
    """Return the parts of conditions in the order of elimination, the separators last.

    Args:
        touches: (m, b) not zero where a condition reads a body, or must be eliminated as if it did.
        points: (m, dimension) where the conditions are [m].
    """
    by_body = sp.csr_matrix(touches.T.astype(bool).astype(float))
    weights = np.asarray(by_body.sum(axis=1)).ravel()
    middles = (by_body @ points) / np.maximum(weights, 1.0)[:, None]
    touches = sp.csr_matrix(touches.astype(bool).astype(float))
    count = np.asarray(touches.sum(axis=1)).ravel()
    parts: list[Part] = []

    def add(conditions: Indices, children: tuple[int, ...]) -> tuple[int, ...]:
        """Add a part with its conditions joint by joint; without conditions its children stay."""
        if not len(conditions):
            return children
        own = touches[conditions]
        own.sort_indices()
        firsts = [own.indices[own.indptr[:-1]], own.indices[own.indptr[1:] - 1]]
        parts.append(Part(conditions[np.lexsort(firsts)], children))
        return (len(parts) - 1,)

    def part(bodies: Indices, conditions: Indices) -> tuple[int, ...]:
        """Add the parts of bodies and of the conditions that touch no others."""
        if len(conditions) <= SMALL or len(bodies) == 1:
            return add(conditions, ())

        # Of the cuts across each axis the one with the smallest separator.
        least = None
        for x in middles[bodies].T:
            order = bodies[np.argsort(x, kind="stable")]
            grown = np.cumsum(weights[order])
            cut = int(np.searchsorted(grown, 0.5 * grown[-1])) + 1
            cut = min(cut, len(order) - 1)
            is_left = np.zeros(len(middles))
            is_left[order[:cut]] = 1.0
            left = touches[conditions] @ is_left
            crosses = (left > 0.0) & (left < count[conditions])
            crossing = int(np.count_nonzero(crosses))
            if least is None or crossing < least[0]:
                least = (crossing, order, cut, left, crosses)
        assert least is not None
        _, order, cut, left, crosses = least
        one = part(order[:cut], conditions[~crosses & (left > 0.0)])
        other = part(order[cut:], conditions[~crosses & (left == 0.0)])
        return add(conditions[crosses], one + other)

    # Conditions that touch nothing are cut off first.
    idle = np.flatnonzero(count == 0.0)
    for i in idle:
        parts.append(Part(np.array([i]), ()))
    part(np.arange(len(middles)), np.flatnonzero(count > 0.0))
    return parts
