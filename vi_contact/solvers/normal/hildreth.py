"""Solve the quadratic program of eq.

49 of the boundary method row after row, to convergence: Hildreth and d'Esopo.

Primal (eqs. 46, 49 there; D = G⁻¹):   v_i <- min(bound_i, v_i + (z - D v)_i / D_ii)
Dual (eq. 42 there; Hildreth 1957):    r_i <- max(0, r_i - (q + G r)_i / G_ii)

Both are projected Gauss–Seidel: every sweep lowers the objective. They converge for every SPD
matrix, linearly, and slowly when contacts are strongly coupled. The primal is written in s = x_free
- v = G r, the displacement that the reactions take back, because s carries no digits of the gap:
min ½ sᵀD s over s >= -q, which is (49) up to the constant ½ x_freeᵀ D x_free.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Mask, max_abs
from ...core.arguments import check_fields
from ...core.quantities import Positive
from .lcp import EPS, Found, PreparedLCP, ScaledLCP, cholesky, failure, scaled_dense


@dataclass(frozen=True)
class Hildreth:
    """Hold the settings. ``primal``: sweep over displacements (eq. 49) or over reactions (eq. 42).

    Ends when the largest change of a sweep, relative to the largest unknown, and the residual are
    below ``tolerance`` (or at rounding level). In the result ``iterations`` counts sweeps; with
    ``record``, ``history`` holds the objective [J] after each: ½ sᵀD s or ½ rᵀG r + qᵀr, whose
    minima differ in sign only.
    """

    primal: bool = True
    tolerance: Annotated[float, Positive] = 1e-13
    max_sweeps: Annotated[int, Positive] = 10_000
    record: bool = False

    def __post_init__(self) -> None:
        check_fields(self)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check G (m, m), and invert it for the primal form. InputError when it is not SPD."""
        scaled = scaled_dense(G, bilateral)
        return PreparedLCP(self, scaled, _Sweeps(self, scaled).search)


class _Sweeps:
    """Hold the sweeps for one G.

    They solve min ½ xᵀHx + cᵀx over x >= lower, with H scaled to unit diagonal, for x = s or x = r.
    """

    def __init__(self, method: Hildreth, scaled: ScaledLCP) -> None:
        self.method, self._scaled, bilateral = method, scaled, scaled.bilateral
        factor = cholesky(scaled.matrix)
        self._H, self._unit = (
            _inverse(factor) if method.primal else (scaled.matrix, np.ones(bilateral.size))
        )
        fixed = bilateral & method.primal  # s = -q there; in the dual form r is free there
        self._rows = [(i, self._H[i]) for i in np.flatnonzero(~fixed).tolist()]

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> Found:
        """Sweep from the guess; without one, from zero."""
        scaled, method = self._scaled, self.method
        lower = self._lower(gap)
        x = self._start(gap, lower, guess)
        gradient = self._gradient(x, gap)
        history: list[float] = []
        for sweeps in range(1, method.max_sweeps + 1):
            change = sweep(self._rows, x, lower, gradient)
            if method.record:
                history.append(self._objective(x, gap))
            if (
                change > method.tolerance * max(abs(value) for value in x)
                and sweeps < method.max_sweeps
            ):
                continue
            # afresh: the updates of a sweep accumulate rounding errors
            gradient = self._gradient(x, gap)
            r = self._reaction(np.array(x), np.array(lower), gradient)
            error = scaled.complementarity(r, gap + scaled.matrix @ r)
            if error <= max(method.tolerance * unit, self._rounding(x, r)):
                return r, error / unit, sweeps, history
        advice = "the contacts are strongly coupled: use ActiveSet, or the other form of Hildreth"
        raise failure(method, iterations=method.max_sweeps, residual=error / unit, advice=advice)

    def _lower(self, gap: Array) -> list[float]:
        lower = (
            -gap / self._unit
            if self.method.primal
            else np.where(self._scaled.bilateral, -np.inf, 0.0)
        )
        return list(lower.tolist())

    def _start(self, gap: Array, lower: list[float], guess: Array | Mask | None) -> list[float]:
        r = self._scaled.reaction(guess, gap)
        if not self.method.primal:
            return list(r.tolist())
        s = np.maximum(self._scaled.matrix @ r / self._unit, lower)
        return list(np.where(self._scaled.bilateral, lower, s).tolist())

    def _gradient(self, x: list[float], gap: Array) -> Array:
        image: Array = self._H @ np.array(x)
        return image if self.method.primal else gap + image

    def _reaction(self, x: Array, lower: Array, gradient: Array) -> Array:
        """Return the scaled r.

        It is x itself, or r = D s where s is at its bound (elsewhere r = 0 by complementarity).
        """
        if not self.method.primal:
            return x
        r = gradient / self._unit
        return np.where(self._scaled.bilateral, r, np.where(x == lower, np.maximum(r, 0.0), 0.0))

    def _objective(self, x: list[float], gap: Array) -> float:
        at = np.array(x)
        # q = inf where r = 0
        linear = 0.0 if self.method.primal else float(at[at != 0.0] @ gap[at != 0.0])
        return 0.5 * float(at @ (self._H @ at)) + linear

    def _rounding(self, x: list[float], r: Array) -> float:
        """Return the gaps that the form in use cannot tell from zero.

        w = q + G D s has passed through both G and D.
        """
        if not self.method.primal:
            return self._scaled.rounding(r)
        product = np.abs(self._H).sum(axis=1) * max_abs(np.array(x)) / self._unit
        return 4.0 * EPS * self._scaled.norm * max_abs(product)


def sweep(
    rows: list[tuple[int, Array]], x: list[float], lower: list[float], gradient: Array
) -> float:
    """Sweep once over ``rows`` (index, row of H with unit diagonal), in place.

    Returned is the largest |change|.

    Keeps gradient = H x + c up to date by columns, so that rows at rest cost a comparison.
    """
    largest_change = 0.0
    for i, row in rows:
        old = x[i]
        new = max(lower[i], old - gradient.item(i))
        if new != old:
            x[i] = new
            gradient += (new - old) * row
            largest_change = max(largest_change, abs(new - old))
    return largest_change


def _inverse(factor: Array) -> tuple[Array, Array]:
    """D = G⁻¹ scaled to unit diagonal, e D e, and e = D_ii^(-1/2)."""
    inverse = lapack.dpotri(factor, lower=1)[0] if factor.size else factor
    inverse = np.tril(inverse) + np.tril(inverse, -1).T
    e = np.diagonal(inverse) ** -0.5
    return np.ascontiguousarray(e[:, None] * inverse * e), e
