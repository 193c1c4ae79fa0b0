"""Solve the linear problems of semismooth Newton with a sparse G by a factor that is kept.

The Jacobian J₀ of one set of states is factorised. Those of the next sets differ from it in the k
rows of the conditions whose state has changed. With E the unit vectors of these rows

    J = J₀ + E V,   J⁻¹ v = y - W (1 + V W)⁻¹ V y,   y = J₀⁻¹ v,   W = J₀⁻¹ E

(Hager, SIAM Rev. 31, 1989, 221-239). Columns of W are kept as long as the factor, so that a row
costs one solution when it first changes. Where Newton's steps become small the digits of this are
enough; where not, GMRES around it (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986) mends
rounding. Where columns take too many operations the factor is made anew.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack, solve_triangular

from ...core.algebra import Array, Indices
from ..normal.lcp import EPS

BASIS = 40  # iterations at most, after which the problem gets its own factor
LEFT = 1e-3  # of the right side, that GMRES may leave: Newton's next problem mends it
# CHOSEN: of the operations of a factor, that columns may take before it is made anew
SHARE = 1.0


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
        columns: of their inverses, that were computed for rows that changed.
        iterations: of GMRES so far.
        operations: of all factors and solutions, multiplications and additions.
    """

    def __init__(self, factor: Any) -> None:
        """Begin without a factor.

        Args:
            factor: makes one and solves with it: ``kernels.fronts.Fronts`` or its like.
        """
        self._factor = factor
        self._marks: Array | None = None  # of the factor
        self._R = self._D = np.zeros(0)  # the same
        self._known = np.zeros(0, dtype=np.int64)  # conditions whose columns are there
        self._columns = np.zeros((0, 0))
        self._last: tuple[Array, Callable[[Array], Array]] | None = None  # states, what solves
        self.factors = 0
        self.columns = 0
        self.iterations = 0
        self.operations = 0.0

    def solve(
        self, J: Jacobian, right: Array, marks: Array, *, is_rough: bool = False
    ) -> Array | None:
        """Return J⁻¹ right, nearly; None where J is singular.

        Args:
            J: the Jacobian.
            right: (n,).
            marks: (m, …) what tells the states of the m conditions apart.
            is_rough: whether the digits of the factor are enough.
        """
        if not right.any():
            return np.zeros_like(right)
        if self._marks is not None:
            mend = self._find_mended(J, marks)
            if mend is not None:
                x, is_done = self._apply(J, right, mend, is_rough)
                if is_done:
                    return x
        # A factor of its own, and where single precision has not the digits one in double.
        for precise in (False, True):
            if not self._factorise(J, marks, precise=precise):
                return None
            x, is_done = self._apply(J, right, self._substitute, is_rough)
            if is_done:
                break
        return x

    def _apply(
        self, J: Jacobian, right: Array, solve: Callable[[Array], Array], is_rough: bool
    ) -> tuple[Array, bool]:
        """Return J⁻¹ right by what nearly solves with J, and whether it has the digits."""
        if is_rough:
            x = solve(right)
            return x, bool(np.isfinite(x).all())
        x, count, is_done = self._iterate(J, right, solve)
        self.iterations += count
        return x, is_done

    def _find_mended(self, J: Jacobian, marks: Array) -> Callable[[Array], Array] | None:
        """Return what solves with J by the factor kept; None where its own factor costs less.

        Newton's method ends with problems of one set of states, which share what was made for it.

        Args:
            J: the Jacobian.
            marks: (m, …) its states.
        """
        if self._last is not None and np.array_equal(self._last[0], marks):
            return self._last[1]
        mended = self._mend(J, np.flatnonzero((marks != self._marks).any(axis=1)))
        self._last = None if mended is None else (marks, mended)
        return mended

    def _mend(self, J: Jacobian, changed: Indices) -> Callable[[Array], Array] | None:
        """Return what solves with J by the factor kept; None where a factor of its own costs less.

        Args:
            J: the Jacobian.
            changed: (k,) conditions whose rows differ from those of the factor.
        """
        if not len(changed):
            return self._substitute
        m, d, _ = J.R.shape
        new = np.setdiff1d(changed, self._known)
        ready = len(self._known) + len(new)
        if ready * d * self._factor.operations_of_solve > SHARE * self._factor.operations:
            return None

        # Columns of the inverse at rows that had not changed before, all at once.
        if len(new):
            units = np.zeros((m * d, len(new) * d))
            rows = (new[:, None] * d + np.arange(d)).ravel()
            units[rows, np.arange(len(rows))] = 1.0
            columns = self._substitute(units).T
            self.columns += len(rows)
            self._known = np.concatenate([self._known, new])
            self._columns = np.vstack([self._columns.reshape(-1, m * d), columns])
        place = np.empty(m, dtype=np.int64)
        place[self._known] = np.arange(len(self._known))
        own = (place[changed][:, None] * d + np.arange(d)).ravel()
        W = self._columns[own].T

        # J = J₀ + E V, E the unit vectors of the changed rows, V = (R - R₀) G + (D - D₀) there.
        rows = (changed[:, None] * d + np.arange(d)).ravel()
        R = J.R[changed] - self._R[changed]
        D = J.D[changed] - self._D[changed]
        G = J.G[rows]

        def change(x: Array) -> Array:
            """Return V x (k d, …)."""
            moved = np.asarray(G @ x).reshape(len(changed), d, -1)
            there = x[rows].reshape(len(changed), d, -1)
            return np.asarray((R @ moved + D @ there).reshape(len(rows), *x.shape[1:]))

        small = np.eye(len(rows)) + change(W)
        lu, pivots, info = lapack.dgetrf(small)
        if info:
            return None

        def solve(v: Array) -> Array:
            """Return J⁻¹ v by the formula of Sherman, Morrison and Woodbury."""
            y = self._substitute(v)
            weights, _ = lapack.dgetrs(lu, pivots, change(y))
            return np.asarray(y - W @ weights)

        return solve

    @property
    def bytes(self) -> float:
        """Return the memory of the factor."""
        return float(self._factor.bytes)

    def _substitute(self, v: Array) -> Array:
        """Return J₀⁻¹ v of v (n,) or (n, k)."""
        self.operations += self._factor.operations_of_solve * (v.size // len(v))
        return np.asarray(self._factor.solve(v))

    def _factorise(self, J: Jacobian, marks: Array, *, precise: bool) -> bool:
        """Make the factor of J, in double precision or single, and say whether there is one."""
        self.factors += 1
        self.operations += self._factor.operations
        self._marks = self._last = None
        self._known = np.zeros(0, dtype=np.int64)
        self._columns = np.zeros((0, 0))
        self._R, self._D = J.R, J.D
        if not self._factor.factorise(J.R, J.D, precise=precise):
            return False
        self._marks = marks
        return True

    def _iterate(
        self, J: Jacobian, right: Array, solve: Callable[[Array], Array]
    ) -> tuple[Array, int, bool]:
        """Return the solution of GMRES, its iterations, and whether it reached its goal."""
        start = solve(right)
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
            v = solve(J @ basis[k])
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
