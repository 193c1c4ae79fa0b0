"""Solve the linear problems of semismooth Newton with a sparse G by a factor that is kept.

The Jacobian J of one set of states is factorised. Those of the next sets differ from it in the rows
and columns of the conditions whose state has changed, and GMRES with the kept factor before it
(Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986) corrects this: k changed rows cost at most
k + 1 iterations, and none changed costs one. Where that takes too many the factor is made anew.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_triangular

from ...core.algebra import Array
from ..normal.lcp import EPS

# CHOSEN: conditions that may have changed; with more a factor of their own costs less
MOST = 20
FEW = 3  # the same where the states stay, as several problems with them follow
BASIS = 40  # iterations at most, after which the problem gets its own factor
LEFT = 1e-10  # of the right side, that GMRES may leave: states that come next depend on it


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Hold J = R G + D.

    Attributes:
        G: (m d, m d) sparse.
        R: (m, d, d) blocks on the diagonal.
        D: (m, d, d) the same.
    """

    G: sp.csr_matrix
    R: Array
    D: Array

    def __matmul__(self, v: Array) -> Array:
        """Return J v (m d,)."""
        shape = self.R.shape[:2]
        w = np.asarray(self.G @ v).reshape(shape)
        product = np.einsum("ijk,ik->ij", self.R, w)
        product += np.einsum("ijk,ik->ij", self.D, v.reshape(shape))
        return np.asarray(product.ravel())


class KeptFactor:
    """Keep the factor of one Jacobian for others like it.

    Attributes:
        factors: how many were made.
        iterations: of GMRES so far.
    """

    def __init__(self, factor: Any) -> None:
        """Begin without a factor.

        Args:
            factor: makes one and solves with it: ``kernels.fronts.Fronts`` or its like.
        """
        self._factor = factor
        self._marks: Array | None = None  # of the factor
        self._before: Array | None = None  # of the last problem
        self.factors = 0
        self.iterations = 0

    def solve(self, J: Jacobian, right: Array, marks: Array) -> Array | None:
        """Return J⁻¹ right, nearly; None where J is singular.

        Args:
            J: the Jacobian.
            right: (n,).
            marks: (m, …) what tells the states of the m conditions apart.
        """
        if not right.any():
            return np.zeros_like(right)
        if self._marks is not None:
            changed = np.count_nonzero((marks != self._marks).any(axis=1))
            stays = self._before is not None and np.array_equal(marks, self._before)
            if changed <= (FEW if stays else MOST):
                self._before = marks
                x, count, is_done = self._iterate(J, right)
                self.iterations += count
                if is_done:
                    return x
        if not self._factorise(J):
            return None
        self._marks = self._before = marks
        x, count, _ = self._iterate(J, right)
        self.iterations += count
        return x

    @property
    def bytes(self) -> float:
        """Return the memory of the factor."""
        return float(self._factor.bytes)

    def _factorise(self, J: Jacobian) -> bool:
        """Make the factor of J, and say whether there is one."""
        self.factors += 1
        self._marks = None
        return bool(self._factor.factorise(J.R, J.D))

    def _iterate(self, J: Jacobian, right: Array) -> tuple[Array, int, bool]:
        """Return the solution of GMRES, its iterations, and whether it reached its goal."""
        start = self._factor.solve(right)
        size = float(np.linalg.norm(start))
        if not np.isfinite(size) or size == 0.0:
            return start, 1, size == 0.0
        basis = np.empty((BASIS + 1, len(right)))
        basis[0] = start / size
        H = np.zeros((BASIS + 1, BASIS))
        left = np.zeros(BASIS + 1)  # of the least-squares problem
        left[0] = size
        turns: list[tuple[float, float]] = []
        for k in range(BASIS):
            # The next vector, at right angles to those before; twice, for its last digits.
            v = self._factor.solve(J @ basis[k])
            before = float(np.linalg.norm(v))
            for _ in range(2):
                part = basis[: k + 1] @ v
                v = v - part @ basis[: k + 1]
                H[: k + 1, k] += part
            after = float(np.linalg.norm(v))
            is_last = not after > EPS * before
            H[k + 1, k] = 0.0 if is_last else after
            if not is_last:
                basis[k + 1] = v / after

            # Rotations keep the least-squares problem triangular.
            for i, (c, s) in enumerate(turns):
                H[i : i + 2, k] = c * H[i, k] + s * H[i + 1, k], c * H[i + 1, k] - s * H[i, k]
            radius = float(np.hypot(H[k, k], H[k + 1, k]))
            if not radius > EPS * before:
                return _combine(basis, H, left, k), k + 1, False
            c, s = H[k, k] / radius, H[k + 1, k] / radius
            turns.append((c, s))
            H[k : k + 2, k] = radius, 0.0
            left[k : k + 2] = c * left[k], -s * left[k]
            if abs(left[k + 1]) <= LEFT * size or is_last:
                return _combine(basis, H, left, k + 1), k + 1, True
        return _combine(basis, H, left, BASIS), BASIS, False


def _combine(basis: Array, H: Array, left: Array, k: int) -> Array:
    """Return the sum of the first k vectors of the basis that leaves least."""
    weights = solve_triangular(H[:k, :k], left[:k])
    return np.asarray(weights @ basis[:k])
