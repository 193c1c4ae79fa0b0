"""Factorise Jacobians  J = R G + D  of contact by dense fronts, part after part of a dissection.

R and D are blocks (d, d) of the conditions on the diagonal, and change with their states; G and so
the places of all entries stay. Each part p is eliminated with the conditions b of later parts that
it is coupled to, its border, in one dense matrix (Duff and Reid, ACM Trans. Math. Softw. 9, 1983,
302-325):

    [F_pp F_pb]      x_p = F_pp⁻¹ (v_p - F_pb x_b)
    [F_bp F_bb]      F_bb - F_bp F_pp⁻¹ F_pb  goes to the next part

Pivots stay within a part, and the factor has single precision, which takes half the time and half
the memory. What this costs in digits is left to the iteration around it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, Indices
from .dissection import Part


@dataclass(frozen=True, eq=False)
class Front:
    """Hold where a part stands, and what never changes of it.

    Attributes:
        conditions: (k,) of the part.
        border: (l,) conditions that are eliminated later.
        pivots: (k d,) rows of the part.
        outer: (l d,) rows of the border.
        near: (l,) which of the border G itself couples to the part.
        own: (k d, k d) of G.
        right: (k d, …) of G, columns that are near.
        down: (…, k d) of G, rows that are near.
        children: numbers of the fronts below, each with the places of its border here.
    """

    conditions: Indices
    border: Indices
    pivots: Indices
    outer: Indices
    near: Indices
    own: Any
    right: Any
    down: Any
    children: tuple[tuple[int, Indices], ...]


class Fronts:
    """Hold the factor of one Jacobian after another of one G.

    Attributes:
        bytes: memory of a factor, and of G as fronts hold it.
        operations: of a factor, multiplications and additions.
        operations_of_solve: the same of a solution with it.
    """

    def __init__(self, G: sp.csr_matrix, parts: list[Part], dimension: int) -> None:
        """Find all fronts.

        Args:
            G: (m d, m d).
            parts: of a dissection of the m conditions.
            dimension: d.
        """
        m = G.shape[0] // dimension
        self._shape = (m, dimension)
        place = np.empty(m, dtype=np.int64)
        place[np.concatenate([part.conditions for part in parts])] = np.arange(m)
        entries = sp.coo_matrix(G)
        blocks = (entries.row // dimension, entries.col // dimension)
        pattern = sp.csr_matrix((np.ones(len(entries.row)), blocks), shape=(m, m))
        pattern = sp.csr_matrix(pattern + pattern.T)

        self._fronts: list[Front] = []
        self.bytes = 0.0
        self.operations = 0.0
        self.operations_of_solve = 0.0
        for part in parts:
            own = part.conditions
            last = place[own].max()
            near = np.unique(pattern[own].indices)
            near = near[place[near] > last]
            below = [self._fronts[child].border for child in part.children]
            border = np.setdiff1d(np.unique(np.concatenate([near, *below])), own)
            border = border[np.argsort(place[border])]
            front = self._make(G, part, border, np.isin(border, near))
            self._fronts.append(front)
            p = float(len(front.pivots))
            b = float(len(front.outer))
            self.operations += 2.0 * p * p * p + 2.0 * p * b * (p + b)
            self.operations_of_solve += 2.0 * p * (p + 2.0 * b)
            self.bytes += 4.0 * (p * p + 2.0 * p * b)
            self.bytes += 4.0 * (front.own.size + front.right.size)
        self._kind: Any = np.float32
        self._inverses: list[Array] = []
        self._rights: list[Array] = []
        self._downs: list[Array] = []

    def _make(self, G: sp.csr_matrix, part: Part, border: Indices, near: Any) -> Front:
        """Return the front of a part with its border (l,), some of which (l,) is near."""
        pivots = self._rows(part.conditions)
        outer = self._rows(border)
        close = self._rows(border[near])
        here = np.full(self._shape[0], -1)
        both = np.concatenate([part.conditions, border])
        here[both] = np.arange(len(both))
        children = tuple(
            (child, self._rows(here[self._fronts[child].border])) for child in part.children
        )
        # In single precision, which takes half the memory: the iteration mends the last digits.
        right = G[pivots][:, close].toarray().astype(np.float32)
        down = G[close][:, pivots].toarray().astype(np.float32)
        if np.array_equal(right, down.T):
            right = down.T
        return Front(
            part.conditions,
            border,
            pivots,
            outer,
            self._rows(np.flatnonzero(near)),
            G[pivots][:, pivots].toarray().astype(np.float32),
            right,
            down,
            children,
        )

    def _rows(self, conditions: Indices) -> Indices:
        """Return the rows of conditions."""
        d = self._shape[1]
        return np.asarray((conditions[:, None] * d + np.arange(d)).ravel())

    def factorise(self, R: Array, D: Array, *, precise: bool = False) -> bool:
        """Factorise R G + D, and say whether it is regular.

        Args:
            R: (m, d, d).
            D: (m, d, d).
            precise: in double precision, which takes twice the time and the memory.
        """
        d = self._shape[1]
        self._kind = np.float64 if precise else np.float32
        schur: list[Array | None] = []
        self._inverses, self._rights, self._downs = [], [], []
        for front in self._fronts:
            p = len(front.pivots)
            b = len(front.outer)
            F: Array = np.zeros((p + b, p + b), dtype=self._kind)

            # Rows of the part, and columns of it in the rows of its border.
            F[:p, :p] = _turn(R[front.conditions], front.own)
            F[:p, p + front.near] = _turn(R[front.conditions], front.right)
            near = front.border[front.near[::d] // d]
            F[p + front.near, :p] = _turn(R[near], front.down)
            blocks = F[:p, :p].reshape(p // d, d, p // d, d)
            one = np.arange(p // d)
            blocks[one, :, one, :] += D[front.conditions]

            # What the parts below leave.
            for child, places in front.children:
                left = schur[child]
                assert left is not None
                _add(F, left, places)
                schur[child] = None

            # Eliminate the part.
            try:
                inverse = np.linalg.inv(F[:p, :p])
            except np.linalg.LinAlgError:
                return False
            down = F[p:, :p].copy()
            right = inverse @ F[:p, p:]
            schur.append(F[p:, p:] - down @ right)
            self._inverses.append(inverse)
            self._rights.append(right)
            self._downs.append(down)
        return True

    def solve(self, v: Array) -> Array:
        """Return J⁻¹ v of v (n,) or (n, k), with the digits of the factor."""
        size = np.abs(v).max(initial=0.0) or 1.0
        x = (v / size).astype(self._kind)
        for front, inverse, down in zip(self._fronts, self._inverses, self._downs, strict=True):
            own = inverse @ x[front.pivots]
            x[front.pivots] = own
            x[front.outer] -= down @ own
        for place in range(len(self._fronts) - 1, -1, -1):
            front = self._fronts[place]
            x[front.pivots] -= self._rights[place] @ x[front.outer]
        return np.asarray(size * x.astype(float))


def _turn(R: Array, block: Any) -> Array:
    """Return R G (k d, n) of blocks R (k, d, d) and rows of G (k d, n)."""
    k, d, _ = R.shape
    if not k:
        return np.asarray(block)
    return np.asarray(R @ block.reshape(k, d, -1)).reshape(block.shape)


def _add(F: Array, left: Array, places: Indices) -> None:
    """Add a matrix (b, b) to the places (b,) of another, run after run of neighbours."""
    ends = np.flatnonzero(np.diff(places) != 1) + 1
    runs = list(zip([0, *ends], [*ends, len(places)], strict=True))
    if not len(places):
        return
    for first, last in runs:
        rows = slice(places[first], places[first] + last - first)
        for start, end in runs:
            columns = slice(places[start], places[start] + end - start)
            F[rows, columns] += left[first:last, start:end]
