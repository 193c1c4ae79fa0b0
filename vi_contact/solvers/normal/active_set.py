"""Solve dense contact problems by the primal-dual active-set method with a finite fallback: the default.

Guess which rows are active, solve  G_aa r_a = -q_a  with r = 0 elsewhere, move every row with the wrong sign (r < 0 in
the set, w < 0 out of it) to the other side, repeat until no sign is wrong: then r solves the problem exactly. This is
the semismooth Newton method for  r = max(0, r - c w)  of Hintermüller, Ito and Kunisch (SIAM J. Optim. 13, 2002); after
the first guess r or w is zero in every row, so that c drops out. The same iteration is Newton-min and full exchange.

It ends in at most m changes for M-matrices but may cycle for others from m = 3 on (Ben Gharbia and Gilbert, Math.
Program. 134, 2012), or wander when G is ill-conditioned. When a set comes back, or the count of wrong signs has not
fallen below its minimum for PATIENCE changes, the method of Lawson and Hanson (Solving Least Squares Problems, 1974,
ch. 23, there for least squares) takes over: it admits one row at a time and keeps r >= 0, so that ½ rᵀG r + qᵀr falls
at every set it completes. No such set can return: it ends, in practice after about as many changes as there are rows.
(Murty's single exchanges, the other finite fallback, took up to 1000 changes where this one took 150.)
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Mask, lowest
from ...core.checks import attributes
from ...core.errors import ViContactError
from .lcp import EPS, Found, LCPResult, PreparedLCP, ScaledLCP, cholesky, failure, scaled_dense

EXCHANGES = 4  # of several runs together, before each goes on alone
KEPT = 256  # factors of sets that they share
PATIENCE = 10  # Júdice and Pires, Comput. Oper. Res. 21, 1994


@dataclass(frozen=True)
class ActiveSet:
    """Hold the settings. ``max_iterations``: set changes allowed; ``tolerance``: residual above which it refuses.

    In the result ``iterations`` is the number of changes of the set (0: the guess was right) and ``history`` the number
    of rows that changed sides in each.
    """

    tolerance: float = 1e-9
    max_iterations: int = 1000

    def __post_init__(self) -> None:
        attributes(self, positive=("tolerance",), counts=("max_iterations",))

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check and factor G (m, m) once for many right-hand sides. InputError when it is not SPD.

        The factor of the last set is remembered: a step on the same set costs triangular solves only.
        """
        scaled = scaled_dense(G, bilateral)
        cholesky(scaled.matrix)  # if the whole is positive definite, so is every part
        return PreparedLCP(self, scaled, _Sets(self, scaled).search)


class _Sets:
    """The sets of one G, with the factor of the last one."""

    def __init__(self, method: ActiveSet, scaled: ScaledLCP) -> None:
        self.method, self._scaled, self._bilateral = method, scaled, scaled.bilateral
        self._factor = _Factor(np.zeros(scaled.bilateral.size, dtype=bool), scaled.matrix)

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> Found:
        """Start from the guess, or the signs of guessed reactions; without one, from gap < 0."""
        active = gap < 0.0 if guess is None else (guess > 0) & (gap < np.inf)
        history: list[float] = []
        r, w = self._exchange(active | self._bilateral, gap, history)
        residual = self._scaled.complementarity(r, w) / unit
        if len(history) > self.method.max_iterations:
            history.pop()
            advice = "take a smaller step of time or load, or raise max_iterations"
        elif residual > self.method.tolerance:
            advice = "G is too ill-conditioned; remove contacts that nearly depend on others"
        else:
            return r, residual, len(history), history
        raise failure(self.method, iterations=len(history), residual=residual, advice=advice)

    def _exchange(self, active: Mask, gap: Array, history: list[float]) -> tuple[Array, Array]:
        """The r and w of the first set without wrong signs; adds to ``history`` how many rows each change moved."""
        seen: set[bytes] = set()
        fewest, patience = gap.size + 1, PATIENCE
        while True:
            r, w = self._on_set(active, gap)
            wrong = self._wrong(active, r, w)
            count = np.count_nonzero(wrong)
            if count == 0:
                return self._cut(r, w, gap)
            fewest, patience = (count, PATIENCE) if count < fewest else (fewest, patience - 1)
            if patience == 0 or active.tobytes() in seen:
                return self._descend(self._positive(r), gap, history)
            seen.add(active.tobytes())
            history.append(float(count))
            if len(history) > self.method.max_iterations:
                return r, w
            active = active ^ wrong

    def _descend(self, r: Array, gap: Array, history: list[float]) -> tuple[Array, Array]:
        """Lawson–Hanson from an admissible r; adds to ``history``."""
        active = (r > 0.0) | self._bilateral
        while True:
            target, w = self._on_set(active, gap)
            leaving = active & ~self._bilateral & (target < 0.0)
            if leaving.any():  # go only as far as the first reaction that vanishes
                share = np.full(r.size, np.inf)
                share[leaving] = r[leaving] / (r[leaving] - target[leaving])
                change: Mask = share == share.min()
                r = self._positive(np.where(change, 0.0, r + share.min() * (target - r)))
            else:
                r = target
                if not self._wrong(active, r, w).any():
                    return r, w
                change = np.arange(r.size) == np.argmin(np.where(active, np.inf, w))
            history.append(float(np.count_nonzero(change)))
            if len(history) > self.method.max_iterations:
                return r, w
            active = active ^ change

    def _on_set(self, active: Mask, gap: Array) -> tuple[Array, Array]:
        if self._factor.key != active.tobytes():
            self._factor = _Factor(active, self._scaled.matrix)
        return self._factor.solve(gap)

    def _wrong(self, active: Mask, r: Array, w: Array) -> Mask:
        """Rows whose sign is wrong by more than rounding: grazing rows (r = w = 0) fit either side."""
        wrong = np.where(active, r, w) < -self._scaled.rounding(r)
        return wrong if self._scaled.unilateral else wrong & ~self._bilateral

    def _positive(self, r: Array) -> Array:
        return np.where(self._bilateral, r, np.maximum(r, 0.0))

    def _cut(self, r: Array, w: Array, gap: Array) -> tuple[Array, Array]:
        """Cut reactions that are negative by rounding, so that r >= 0 holds exactly."""
        if lowest(r) <= 0.0:
            return r, w
        cut = self._positive(r)
        return (cut, gap + self._scaled.matrix @ cut) if (cut != r).any() else (r, w)


class ManySets:
    """Solve the problems of several gaps with one G: rows on the same set are solved together, and the first exchanges
    are those of ``ActiveSet``, which goes on with the others one by one."""

    def __init__(self, prepared: PreparedLCP) -> None:
        self._prepared, self._method = prepared, cast(ActiveSet, prepared.method)
        self._kept: dict[bytes, _Factor] = {}

    def solve(self, q: Array, guess: Mask) -> list[LCPResult | ViContactError]:
        """Return the answers to the rows of q with these guesses (k, m), or what they raise."""
        scaled, limit = self._prepared.scaled, 4.0 * EPS * self._prepared.scaled.norm
        gap, held, free = q * scaled.scale, scaled.bilateral, scaled.unilateral
        unit = np.abs(np.minimum(gap, 0.0) if free else np.where(held, gap, np.minimum(gap, 0.0))).max(1, initial=0.0)
        r, changes, left = np.zeros_like(gap), [0] * len(q), np.flatnonzero(unit != 0.0)
        active, gap = (guess[left] & (gap[left] < np.inf)) | held, gap[left]
        for change in range(EXCHANGES):
            if not len(left):
                break
            r_i, w_i = self._on_sets(active, gap)
            signs, least = np.where(active, r_i, w_i), np.minimum(r_i, w_i)
            if not free:
                signs[:, held], least[:, held] = 0.0, w_i[:, held]
            wrong = signs < -limit * np.abs(r_i).max(1)[:, None]
            again = wrong.any(1)
            good = ~again & (np.where(active, signs, 0.0).min(1) >= 0.0)
            good &= np.abs(least).max(1) <= self._method.tolerance * unit[left]
            for row, found, other in zip(left.tolist(), good.tolist(), again.tolist(), strict=True):
                changes[row] = change if found else change + 1 if other else -1
            r[left[good]] = r_i[good]
            left, active, gap = left[again], active[again] ^ wrong[again], gap[again]
        for row in left.tolist():
            changes[row] = -1
        closed, r = (r > 0.0) | held, r * scaled.scale
        return [LCPResult(r[row], closed[row], count, 0.0, self._method) if count >= 0
                else self._searched(q[row], guess[row]) for row, count in enumerate(changes)]

    def _on_sets(self, active: Mask, gap: Array) -> tuple[Array, Array]:
        alike: dict[bytes, list[int]] = {}
        for row, key in enumerate(map(bytes, active)):
            alike.setdefault(key, []).append(row)
        r, w = np.empty_like(gap), np.empty_like(gap)
        for key, rows in alike.items():
            if key not in self._kept:
                if len(self._kept) >= KEPT:
                    self._kept.clear()
                self._kept[key] = _Factor(active[rows[0]], self._prepared.scaled.matrix)
            r[rows], w[rows] = self._kept[key].solve(gap[rows])
        return r, w

    def _searched(self, q: Array, guess: Mask) -> LCPResult | ViContactError:
        try:
            return self._prepared.solve(q, guess)
        except ViContactError as error:
            return error


class _Factor:
    """Cholesky factor of G_aa of one set, and the rows of G that carry its reactions to all gaps."""

    def __init__(self, active: Mask, matrix: Array) -> None:
        self.key = active.tobytes()
        self._index = active.nonzero()[0]
        self._rows = matrix[self._index]
        self._lower = cholesky(self._rows[:, self._index]) if self._index.size else None

    def solve(self, gap: Array) -> tuple[Array, Array]:
        """r (m,) with r = 0 off the set, and w = gap + G r; rows of both for rows of gaps.

        No iterative refinement: the residual of Cholesky is at rounding level already (measured gain below a factor 2
        for conditions up to 1e10).
        """
        r = np.zeros(gap.shape)
        if self._lower is None:
            return r, gap.copy()
        r.T[self._index] = part = lapack.dpotrs(self._lower, -gap.T[self._index], lower=1)[0]
        return r, gap + part.T @ self._rows
