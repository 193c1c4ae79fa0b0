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
from .lcp import EPS, PreparedLCP, ScaledAnswer, ScaledLCP, make_failure, scale_dense

TINY = 1e-11  # of the largest entry of a column: no pivot
TIED = 1e-13  # ratios that rounding alone may tell apart
SINGULAR = 0.1 / EPS  # condition number of bilateral rows that depend on each other


@dataclass(frozen=True)
class Lemke:
    """Hold the settings of the pivoting.

    In the result ``iterations`` counts pivots (0: the guessed set was right), and ``history`` is z
    after each, over the violation of r = 0. Where (1) has several solutions the guess may choose
    among them.

    Attributes:
        tolerance: the residual above which it refuses.
        max_iterations: number of pivots, at most.
    """

    unsymmetric: ClassVar[bool] = True  # matrices are welcome
    tolerance: Annotated[float, Positive] = 1e-9
    max_iterations: Annotated[int, Positive] = 10_000

    def __post_init__(self) -> None:
        check_fields(self)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check any square G and eliminate its bilateral rows.

        Args:
            G: the Delassus operator (m, m).
            bilateral: (m,) which rows are bilateral.

        Raises:
            InputError: the bilateral rows depend on each other.
        """
        scaled = scale_dense(G, bilateral, unsymmetric=True)
        return PreparedLCP(self, scaled, _Pivots(self, scaled).search)


class _Pivots:
    """Pivot in one G, whose bilateral rows are eliminated."""

    def __init__(self, method: Lemke, scaled: ScaledLCP) -> None:
        """Eliminate the bilateral rows b: G - G_:b G_bb⁻¹ G_b:."""
        self.method = method
        self._scaled = scaled
        G = scaled.matrix
        b = scaled.bilateral
        if b.any() and np.linalg.cond(G[np.ix_(b, b)]) > SINGULAR:
            raise InputError(
                "bilateral rows of the Delassus operator depend on each other: remove constraints "
                "that act on the same motion twice"
            )
        self._carry = np.linalg.solve(G[np.ix_(b, b)].T, G[:, b].T).T
        self._matrix = G - self._carry @ G[b]

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> ScaledAnswer:
        """Try the guessed set, or that of guessed reactions; where it is wrong, pivot.

        Args:
            gap: (m,) scaled gaps without reactions.
            guess: (m,) set or reactions; None for gap < 0.
            unit: of the residual.

        Raises:
            StepFailure: there is no solution, pivots were too many, or the residual is above the
                tolerance.
        """
        history: list[float] = []
        r, residual = self._solve_on_set(gap < 0.0 if guess is None else guess > 0, gap)
        # The rounding of a huge r would allow anything, so that the tolerance has to hold as well.
        if residual > min(self._scaled.rounding(r), self.method.tolerance * unit):
            r, residual = self._solve_on_set(self._pivot(gap, unit, history), gap)
        if not residual <= self.method.tolerance * unit:
            advice = "G is too ill-conditioned: remove contacts that nearly depend on others"
            raise make_failure(
                self.method, iterations=len(history), residual=residual / unit, advice=advice
            )
        return ScaledAnswer(r, residual / unit, len(history), history)

    def _solve_on_set(self, active: Mask, gap: Array) -> tuple[Array, float]:
        """Return r >= 0 with w = 0 on the set and bilateral rows, and its residual.

        The residual is infinite where there is no such r, or more than one.
        """
        G = self._scaled.matrix
        bilateral = self._scaled.bilateral
        r = np.zeros(gap.size)
        closed = np.flatnonzero((active & (gap < np.inf)) | bilateral)
        try:
            r[closed] = np.linalg.solve(G[np.ix_(closed, closed)], -gap[closed])
        except np.linalg.LinAlgError:
            return r, np.inf
        r = np.where(bilateral, r, np.maximum(r, 0.0))
        return r, self._scaled.complementarity(r, gap + G @ r)

    def _pivot(self, gap: Array, unit: float, history: list[float]) -> Mask:
        """Return the set (m,) of a solution, by pivots.

        Args:
            gap: (m,) scaled gaps without reactions.
            unit: of the residual.
            history: gets z after each pivot.
        """
        # The problem of unilateral rows in reach; q is of size one.
        bilateral = self._scaled.bilateral
        closed = np.zeros(gap.size, dtype=bool)
        rows = np.flatnonzero(~bilateral & (gap < np.inf))
        m = len(rows)
        q = (gap[rows] - self._carry[rows] @ gap[bilateral]) / unit
        if not (q < 0.0).any():
            return closed

        # Variables are numbered: w from 0, r from m, and z. The basis begins with all w; z enters
        # in the row of the largest violation.
        basis = np.arange(m)
        z = 2 * m
        # d covers q, and is parallel to none that a model would have.
        d = 1.5 + probe(np.arange(m), 0)
        tableau = np.column_stack([np.eye(m), -self._matrix[np.ix_(rows, rows)], -d, q])
        row = m - 1 - int(np.argmin((q / d)[::-1]))
        entering = z
        leaving = -1
        while leaving != z:
            if len(history) == self.method.max_iterations:
                raise make_failure(
                    self.method,
                    iterations=len(history),
                    residual=history[-1],
                    advice="raise max_iterations",
                )
            # Pivot: the column of what enters becomes a unit vector.
            tableau[row] /= tableau[row, entering]
            others = np.where(np.arange(m) == row, 0.0, tableau[:, entering])
            tableau -= np.outer(others, tableau[row])
            leaving = int(basis[row])
            basis[row] = entering
            history.append(float(tableau[basis == z, -1].sum()))

            # The complement of what left enters next.
            entering = (leaving + m) % z
            if leaving != z:
                row = _choose_leaving_row(tableau, basis, entering, len(history))
        closed[rows[basis[basis >= m] - m]] = True
        return closed


def _choose_leaving_row(tableau: Array, basis: Indices, entering: int, pivots: int) -> int:
    """Return the row that is first at zero when a variable enters.

    Of several it is that of z, or the lexicographic minimum.

    Args:
        tableau: (m, 2 m + 2).
        basis: (m,) number of the variable of each row.
        entering: number of the variable that enters.
        pivots: so far.

    Raises:
        StepFailure: no row comes to zero.
    """
    m = len(tableau)
    column = tableau[:, entering]
    rows = np.flatnonzero(column > TINY * max_abs(column))
    if not rows.size:
        raise StepFailure(
            f"Lemke's method ended on a ray after {pivots} pivots: there is no solution, or G is "
            "not copositive-plus; take a smaller time step, a finer mesh, or a symmetric G"
        )

    # Compare by q first, and rows that tie by one column of the inverse of the basis after another.
    for place in (-1, *range(m)):
        ratio = tableau[rows, place] / column[rows]
        least = ratio.min()
        rows = rows[ratio <= least + TIED * max(1.0, abs(least))]
        is_z = basis[rows] == 2 * m
        if is_z.any():
            return int(rows[is_z][0])
        if len(rows) == 1:
            break
    return int(rows[0])
