"""Solve dense contact problems by the primal-dual active-set method: the default.

Guess which rows are active, solve  G_aa r_a = -q_a  with r = 0 elsewhere, move every row with the
wrong sign (r < 0 in the set, w < 0 out of it) to the other side, repeat until no sign is wrong:
then r solves the problem exactly. This is the semismooth Newton method for  r = max(0, r - c w)  of
Hintermüller, Ito and Kunisch (SIAM J. Optim. 13, 2002); after the first guess r or w is zero in
every row, so that c drops out. The same iteration is Newton-min and full exchange.

It ends in at most m changes for M-matrices but may cycle for others from m = 3 on (Ben Gharbia and
Gilbert, Math. Program. 134, 2012), or wander when G is ill-conditioned. When a set comes back, or
the count of wrong signs has not fallen below its minimum for PATIENCE changes, the method of Lawson
and Hanson (Solving Least Squares Problems, 1974, ch. 23, there for least squares) takes over: it
admits one row at a time and keeps r >= 0, so that ½ rᵀG r + qᵀr falls at every set it completes. No
such set can return: it ends, in practice after about as many changes as there are rows. (Murty's
single exchanges, the other finite fallback, took up to 1000 changes where this one took 150.)
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, cast

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Mask, SerialComm, lowest
from ...core.arguments import check_fields
from ...core.errors import ViContactError
from ...core.quantities import Positive
from ...kernels.compiler import load_loops
from ...kernels.exchanges import Exchanges
from .lcp import (
    EPS,
    LCPResult,
    PreparedLCP,
    ScaledAnswer,
    ScaledLCP,
    factorise,
    make_failure,
    scale_dense,
)

FEW = 160  # rows up to which compiled exchanges are as fast as those of LAPACK
KEPT = 2**22  # numbers in the factors of sets that are remembered
MOST_KEPT = 16  # sets
PATIENCE = 10  # Júdice and Pires, Comput. Oper. Res. 21, 1994


@dataclass(frozen=True)
class ActiveSet:
    """Hold the settings of the active-set method.

    In the result ``iterations`` counts changes of the set (0: the guess was right), and ``history``
    the rows moved in each.

    Attributes:
        tolerance: the residual above which it refuses.
        max_iterations: number of changes of the set, at most.
    """

    tolerance: Annotated[float, Positive] = 1e-9
    max_iterations: Annotated[int, Positive] = 1000

    def __post_init__(self) -> None:
        check_fields(self)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check and factor G once for many right-hand sides.

        The factors of the last sets are remembered: a step on the same set costs triangular solves
        only.

        Args:
            G: the Delassus operator (m, m).
            bilateral: (m,) which rows are bilateral.

        Raises:
            InputError: G is not symmetric and positive definite.
        """
        scaled = scale_dense(G, bilateral)
        factorise(scaled.matrix)  # if the whole is positive definite, so is every part
        return PreparedSets(self, scaled, _Sets(self, scaled).search)


class PreparedSets(PreparedLCP):
    """Solve problem (1) of one G, or several at once, by compiled exchanges where rows are few."""

    @cached_property
    def _exchanges(self) -> Exchanges | None:
        """Return the compiled exchanges; None where rows are many, or there is no compiler."""
        scaled = self.scaled
        method = cast(ActiveSet, self.method)
        loops = load_loops(SerialComm()) if scaled.bilateral.size <= FEW else None
        if loops is None:
            return None
        return Exchanges(
            loops,
            scaled.matrix,
            scaled.scale,
            scaled.bilateral,
            rounding=4.0 * EPS * scaled.norm,
            tolerance=method.tolerance,
            most=min(PATIENCE, method.max_iterations),
        )

    def _solve(self, q: Array, guess: Array | Mask | None) -> LCPResult:
        """Solve by compiled exchanges, and where these end without an answer by the search."""
        fits = q.shape == self.scaled.bilateral.shape and (guess is None or guess.shape == q.shape)
        if fits and self._exchanges is not None:
            closed = q < 0.0 if guess is None else guess > 0
            answer = self._exchanges.solve(q, closed)
            changes = int(answer.changes[0])
            if changes >= 0:
                return LCPResult(
                    r=answer.r[0],
                    active=answer.active[0],
                    iterations=changes,
                    residual=float(answer.residual[0]),
                    method=self.method,
                    history=tuple(answer.moved[0, :changes].tolist()),
                )
        return super()._solve(q, guess)

    def solve_many(
        self, q: Array, guess: Mask
    ) -> tuple[Array, Mask, list[int], dict[int, ViContactError]]:
        """Solve several problems.

        Args:
            q: (k, m) gaps without reactions.
            guess: (k, m) sets to start from.

        Returns:
            r and active, both (k, m), the iterations of each row, and the errors of rows that have
            no answer, by their numbers.
        """
        if self._exchanges is None:
            r = np.zeros(q.shape)
            active = np.zeros(q.shape, dtype=bool)
            changes = np.full(len(q), -1)
        else:
            r, active, _, changes, _ = self._exchanges.solve(q, guess)

        # What the exchanges left without an answer is solved row by row.
        iterations = changes.tolist()
        failed: dict[int, ViContactError] = {}
        for row in np.flatnonzero(changes < 0).tolist():
            try:
                result = super()._solve(q[row], guess[row])
            except ViContactError as error:
                failed[row] = error
            else:
                r[row] = result.r
                active[row] = result.active
                iterations[row] = result.iterations
        return r, active, iterations, failed


class _Sets:
    """Search the sets of one G, with the factors of the last ones."""

    def __init__(self, method: ActiveSet, scaled: ScaledLCP) -> None:
        self.method = method
        self._scaled = scaled
        self._bilateral = scaled.bilateral
        self._factors: dict[bytes, _Factor] = {}

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> ScaledAnswer:
        """Search the set without wrong signs.

        Args:
            gap: (m,) scaled gaps without reactions.
            guess: (m,) the set to start from, or reactions whose signs give it; None for gap < 0.
            unit: of the residual.

        Raises:
            StepFailure: there were too many changes, or the residual is above the tolerance.
        """
        active = gap < 0.0 if guess is None else (guess > 0) & (gap < np.inf)
        history: list[float] = []
        r, w = self._exchange(active | self._bilateral, gap, history)
        residual = self._scaled.complementarity(r, w) / unit
        if len(history) > self.method.max_iterations:
            history.pop()
            advice = "take a smaller step of time or load, or raise max_iterations"
        elif residual > self.method.tolerance:
            advice = "G is too ill-conditioned: remove contacts that nearly depend on others"
        else:
            return ScaledAnswer(r, residual, len(history), history)
        raise make_failure(self.method, iterations=len(history), residual=residual, advice=advice)

    def _exchange(self, active: Mask, gap: Array, history: list[float]) -> tuple[Array, Array]:
        """Exchange all rows with wrong signs, until there are none.

        Args:
            active: (m,) the set to start from.
            gap: (m,) scaled gaps without reactions.
            history: gets the number of rows that each change moved.

        Returns:
            r and w of the set, or of the last one, where changes were too many.
        """
        seen: set[bytes] = set()
        fewest = gap.size + 1
        patience = PATIENCE
        while True:
            r, w = self._solve_on_set(active, gap)
            wrong = self._find_wrong(active, r, w)
            count = np.count_nonzero(wrong)
            if count == 0:
                return self._cut(r, w, gap)

            # A set that returns, or wrong signs that grow no fewer, say that it may never end.
            if count < fewest:
                fewest = count
                patience = PATIENCE
            else:
                patience -= 1
            if patience == 0 or active.tobytes() in seen:
                return self._descend(self._project(r), gap, history)
            seen.add(active.tobytes())
            history.append(float(count))
            if len(history) > self.method.max_iterations:
                return r, w
            active = active ^ wrong

    def _descend(self, r: Array, gap: Array, history: list[float]) -> tuple[Array, Array]:
        """Go down from an admissible r by the method of Lawson and Hanson.

        Args:
            r: (m,) r >= 0 in unilateral rows.
            gap: (m,) scaled gaps without reactions.
            history: gets the number of rows that each change moved.

        Returns:
            r and w of the set, or of the last one, where changes were too many.
        """
        active = (r > 0.0) | self._bilateral
        while True:
            target, w = self._solve_on_set(active, gap)
            leaving = active & ~self._bilateral & (target < 0.0)
            if leaving.any():
                # On the way to the minimum on the set reactions vanish: go as far as the first.
                share = np.full(r.size, np.inf)
                share[leaving] = r[leaving] / (r[leaving] - target[leaving])
                change: Mask = share == share.min()
                r = self._project(np.where(change, 0.0, r + share.min() * (target - r)))
            else:
                # The minimum on the set is reached: admit the row with the worst gap.
                r = target
                if not self._find_wrong(active, r, w).any():
                    return r, w
                change = np.arange(r.size) == np.argmin(np.where(active, np.inf, w))
            history.append(float(np.count_nonzero(change)))
            if len(history) > self.method.max_iterations:
                return r, w
            active = active ^ change

    def _solve_on_set(self, active: Mask, gap: Array) -> tuple[Array, Array]:
        """Return r and w with w = 0 on the set and r = 0 off it."""
        key = active.tobytes()
        factor = self._factors.pop(key, None)
        if factor is None:
            factor = _Factor(active, self._scaled.matrix)
        self._factors[key] = factor  # now the last
        most = min(max(KEPT // (1 + active.size**2), 1), MOST_KEPT)
        if len(self._factors) > most:
            del self._factors[next(iter(self._factors))]
        return factor.solve(gap)

    def _find_wrong(self, active: Mask, r: Array, w: Array) -> Mask:
        """Return the rows (m,) whose sign is wrong by more than rounding.

        Grazing rows (r = w = 0) are right on either side.

        Args:
            active: (m,) the set.
            r: (m,) reactions on the set.
            w: (m,) gaps off it.
        """
        wrong = np.where(active, r, w) < -self._scaled.rounding(r)
        return wrong if self._scaled.unilateral else wrong & ~self._bilateral

    def _project(self, r: Array) -> Array:
        """Return r with zero for what is negative in unilateral rows."""
        return np.where(self._bilateral, r, np.maximum(r, 0.0))

    def _cut(self, r: Array, w: Array, gap: Array) -> tuple[Array, Array]:
        """Cut reactions that are negative by rounding, so that r >= 0 holds exactly."""
        if lowest(r) <= 0.0:
            return r, w
        cut = self._project(r)
        if not (cut != r).any():
            return r, w
        return cut, gap + self._scaled.matrix @ cut


class _Factor:
    """Hold the Cholesky factor of G_aa of one set, and the rows of G that carry r to all gaps."""

    def __init__(self, active: Mask, matrix: Array) -> None:
        self._index = active.nonzero()[0]
        self._rows = matrix[self._index]
        self._lower = factorise(self._rows[:, self._index]) if self._index.size else None

    def solve(self, gap: Array) -> tuple[Array, Array]:
        """Return r (m,) with r = 0 off the set, and w = gap + G r.

        No iterative refinement: the residual of Cholesky is at rounding level already (measured
        gain below a factor 2 for conditions up to 1e10).
        """
        r = np.zeros(gap.size)
        if self._lower is None:
            return r, gap.copy()
        part = lapack.dpotrs(self._lower, -gap[self._index], lower=1)[0]
        r[self._index] = part
        return r, gap + part @ self._rows
