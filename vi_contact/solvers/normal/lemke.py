"""Solve the small problem of a G that is not symmetric: Lemke's complementary pivoting.

    w = q + G r + z d,    0 <= r  perpendicular to  w >= 0,    z >= 0                           (2)

With z as large as the violation of r = 0, that r solves (2). Every pivot takes the complement of
what left the basis into it, z moves, and when z leaves the basis r solves problem (1) of ``lcp``.
Ties among rows go to the lexicographic minimum of (q, inverse of the basis), so that no basis
returns; d has numbers from 1 to 2, since ones tie rows of equal q, which took m²/2 pivots. Sources:
Lemke, Management Sci. 11, 1965; Cottle, Pang and Stone, The Linear Complementarity Problem, 1992,
section 4.4.

It ends in the one solution of a P-matrix (``p_matrix``); of a copositive-plus G, which one with
positive definite symmetric part is, in a solution or, where there is none, on a ray: a basis that
nothing has to leave. For other G a ray proves nothing, and of several solutions it finds one. About
m pivots are usual, 2^m possible (Murty, Math. Program. Study 7, 1978); each costs 4 m² products on
m rows. Bilateral rows are eliminated before.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ...core.algebra import Array, Indices, Mask, max_abs
from ...core.arguments import check_fields
from ...core.errors import InputError, StepFailure
from ...core.matrix_checks import probe
from ...core.quantities import Positive
from .lcp import EPS, Found, PreparedLCP, ScaledLCP, failure, scaled_dense

TINY = 1e-11  # of the largest entry of a column: no pivot
TIED = 1e-13  # ratios that rounding alone may tell apart


@dataclass(frozen=True)
class Lemke:
    """Hold the settings.

    ``tolerance``: residual above which it refuses; ``max_iterations``: pivots allowed.

    In the result ``iterations`` counts pivots (0: the guessed set was right), ``history`` is z
    after each, over the violation of r = 0. Where (1) has several solutions the guess may choose
    among them.
    """

    unsymmetric: ClassVar[bool] = True  # matrices are welcome
    tolerance: Annotated[float, Positive] = 1e-9
    max_iterations: Annotated[int, Positive] = 10_000

    def __post_init__(self) -> None:
        check_fields(self)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check any square G (m, m) and eliminate its bilateral rows.

        InputError when those depend on each other.
        """
        scaled = scaled_dense(G, bilateral, unsymmetric=True)
        return PreparedLCP(self, scaled, _Pivots(self, scaled).search)


class _Pivots:
    """Hold the pivots of one G.

    These are its unilateral rows with bilateral ones eliminated, and what carries the q of those.
    """

    def __init__(self, method: Lemke, scaled: ScaledLCP) -> None:
        self.method, self._scaled = method, scaled
        G, b = scaled.matrix, scaled.bilateral
        if b.any() and np.linalg.cond(G[np.ix_(b, b)]) > 0.1 / EPS:
            raise InputError(
                "bilateral rows of the Delassus operator depend on each other: remove constraints "
                "that act on the same motion twice"
            )
        self._carry = np.linalg.solve(G[np.ix_(b, b)].T, G[:, b].T).T
        self._matrix = G - self._carry @ G[b]

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> Found:
        """Try the guessed set, or that of guessed reactions; where it is wrong, pivot."""
        history: list[float] = []
        r, residual = self._on_set(gap < 0.0 if guess is None else guess > 0, gap)
        # huge r round to anything
        if residual > min(self._scaled.rounding(r), self.method.tolerance * unit):
            r, residual = self._on_set(self._closed(gap, unit, history), gap)
        if not residual <= self.method.tolerance * unit:
            advice = "G is too ill-conditioned: remove contacts that nearly depend on others"
            raise failure(
                self.method, iterations=len(history), residual=residual / unit, advice=advice
            )
        return r, residual / unit, len(history), history

    def _on_set(self, active: Mask, gap: Array) -> tuple[Array, float]:
        """Return r >= 0 with w = 0 on the set and bilateral rows, and its residual.

        The residual is infinite where that has no one answer.
        """
        G, bilateral, r = self._scaled.matrix, self._scaled.bilateral, np.zeros(gap.size)
        closed = np.flatnonzero((active & (gap < np.inf)) | bilateral)
        try:
            r[closed] = np.linalg.solve(G[np.ix_(closed, closed)], -gap[closed])
        except np.linalg.LinAlgError:
            return r, np.inf
        r = np.where(bilateral, r, np.maximum(r, 0.0))
        return r, self._scaled.complementarity(r, gap + G @ r)

    def _closed(self, gap: Array, unit: float, history: list[float]) -> Mask:
        """Return the set of a solution, by pivots; add z after each to ``history``."""
        bilateral, closed = self._scaled.bilateral, np.zeros(gap.size, dtype=bool)
        rows = np.flatnonzero(~bilateral & (gap < np.inf))
        m, q = len(rows), (gap[rows] - self._carry[rows] @ gap[bilateral]) / unit
        if not (q < 0.0).any():
            return closed
        basis, z = np.arange(m), 2 * m  # numbers of w, then of r, then of z
        # covers q, and is parallel to none that a model would have
        d = 1.5 + probe(np.arange(m), 0)
        tableau = np.column_stack([np.eye(m), -self._matrix[np.ix_(rows, rows)], -d, q])
        row, entering, left = m - 1 - int(np.argmin((q / d)[::-1])), z, -1
        while left != z:
            if len(history) == self.method.max_iterations:
                raise failure(
                    self.method,
                    iterations=len(history),
                    residual=history[-1],
                    advice="raise max_iterations",
                )
            tableau[row] /= tableau[row, entering]
            others = np.where(np.arange(m) == row, 0.0, tableau[:, entering])
            tableau -= np.outer(others, tableau[row])
            left, basis[row] = int(basis[row]), entering
            history.append(float(tableau[basis == z, -1].sum()))
            entering = (left + m) % z
            if left != z:
                row = _leaving(tableau, basis, entering, len(history))
        closed[rows[basis[basis >= m] - m]] = True
        return closed


def _leaving(tableau: Array, basis: Indices, entering: int, pivots: int) -> int:
    """Return the row that is first at zero when a variable enters.

    It is that of z, or of tied rows the lexicographic minimum.
    """
    m, column = len(tableau), tableau[:, entering]
    rows = np.flatnonzero(column > TINY * max_abs(column))
    if not rows.size:
        raise StepFailure(
            f"Lemke's method ended on a ray after {pivots} pivots: there is no solution, or G is "
            "not copositive-plus; take a smaller time step, a finer mesh, or a symmetric G"
        )
    for place in (-1, *range(m)):
        ratio = tableau[rows, place] / column[rows]
        rows = rows[ratio <= ratio.min() + TIED * max(1.0, abs(ratio.min()))]
        if (basis[rows] == 2 * m).any():
            return int(rows[basis[rows] == 2 * m][0])
        if len(rows) == 1:
            break
    return int(rows[0])
