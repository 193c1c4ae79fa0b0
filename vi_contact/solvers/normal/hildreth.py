"""Solve the quadratic program of the boundary method row after row: Hildreth and d'Esopo.

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
from .lcp import EPS, PreparedLCP, ScaledAnswer, ScaledLCP, factorise, make_failure, scale_dense


@dataclass(frozen=True)
class Hildreth:
    """Hold the settings of the sweeps.

    In the result ``iterations`` counts sweeps.

    Attributes:
        primal: True to sweep over displacements (eq. 49), False over reactions (eq. 42).
        tolerance: it ends when the largest change of a sweep, relative to the largest unknown, and
            the residual are below this, or at rounding level.
        max_sweeps: number of sweeps, at most.
        record: whether ``history`` of the result holds the objective [J] after each sweep: ½ sᵀD s
            or ½ rᵀG r + qᵀr, whose minima differ in sign only.
    """

    primal: bool = True
    tolerance: Annotated[float, Positive] = 1e-13
    max_sweeps: Annotated[int, Positive] = 10_000
    record: bool = False

    def __post_init__(self) -> None:
        check_fields(self)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedLCP:
        """Check G, and invert it for the primal form.

        Args:
            G: the Delassus operator (m, m).
            bilateral: (m,) which rows are bilateral.

        Raises:
            InputError: G is not symmetric and positive definite.
        """
        scaled = scale_dense(G, bilateral)
        return PreparedLCP(self, scaled, _Sweeps(self, scaled).search)


class _Sweeps:
    """Sweep for one G.

    The sweeps solve min ½ xᵀHx + cᵀx over x >= lower, with H scaled to unit diagonal, for x = s or
    x = r.
    """

    def __init__(self, method: Hildreth, scaled: ScaledLCP) -> None:
        """Form H: the scaled G, or in the primal form its inverse, scaled once more."""
        self.method = method
        self._scaled = scaled
        factor = factorise(scaled.matrix)
        bilateral = scaled.bilateral
        if method.primal:
            self._H, self._unit = _invert(factor)
            swept = np.flatnonzero(~bilateral)  # in bilateral rows s = -q
        else:
            self._H = scaled.matrix
            self._unit = np.ones(bilateral.size)
            swept = np.arange(bilateral.size)
        self._rows = [(i, self._H[i]) for i in swept.tolist()]

    def search(self, gap: Array, guess: Array | Mask | None, unit: float) -> ScaledAnswer:
        """Sweep until the answer is found.

        Args:
            gap: (m,) scaled gaps without reactions.
            guess: (m,) reactions or set to start from; None for zero.
            unit: of the residual.

        Raises:
            StepFailure: sweeps were too many.
        """
        scaled = self._scaled
        method = self.method
        lower = self._find_bounds(gap)
        x = self._choose_start(gap, lower, guess)
        gradient = self._form_gradient(x, gap)
        history: list[float] = []
        for sweeps in range(1, method.max_sweeps + 1):
            change = sweep(self._rows, x, lower, gradient)
            if method.record:
                history.append(self._evaluate_objective(x, gap))
            x_max = max(abs(value) for value in x)
            if change > method.tolerance * x_max and sweeps < method.max_sweeps:
                continue

            # x has settled: judge it by its residual. The gradient is formed afresh, as the updates
            # of a sweep accumulate rounding errors.
            gradient = self._form_gradient(x, gap)
            r = self._recover_reaction(np.array(x), np.array(lower), gradient)
            error = scaled.complementarity(r, gap + scaled.matrix @ r)
            if error <= max(method.tolerance * unit, self._bound_rounding(x, r)):
                return ScaledAnswer(r, error / unit, sweeps, history)
        advice = "the contacts are strongly coupled: use ActiveSet, or the other form of Hildreth"
        raise make_failure(
            method, iterations=method.max_sweeps, residual=error / unit, advice=advice
        )

    def _find_bounds(self, gap: Array) -> list[float]:
        """Return the lower bounds of x: -q of s, or 0 of r, in unilateral rows."""
        if self.method.primal:
            lower = -gap / self._unit
        else:
            lower = np.where(self._scaled.bilateral, -np.inf, 0.0)
        return list(lower.tolist())

    def _choose_start(
        self, gap: Array, lower: list[float], guess: Array | Mask | None
    ) -> list[float]:
        """Return x to start from.

        Args:
            gap: (m,) scaled gaps without reactions.
            lower: (m,) bounds of x.
            guess: (m,) reactions or set; None for zero.
        """
        r = self._scaled.reaction(guess, gap)
        if not self.method.primal:
            return list(r.tolist())
        s = np.maximum(self._scaled.matrix @ r / self._unit, lower)
        return list(np.where(self._scaled.bilateral, lower, s).tolist())

    def _form_gradient(self, x: list[float], gap: Array) -> Array:
        """Return H x + c (m,)."""
        image: Array = self._H @ np.array(x)
        return image if self.method.primal else gap + image

    def _recover_reaction(self, x: Array, lower: Array, gradient: Array) -> Array:
        """Return the scaled r (m,).

        It is x itself, or r = D s where s is at its bound (elsewhere r = 0 by complementarity).

        Args:
            x: (m,).
            lower: (m,) its bounds.
            gradient: (m,) at x.
        """
        if not self.method.primal:
            return x
        r = gradient / self._unit
        return np.where(self._scaled.bilateral, r, np.where(x == lower, np.maximum(r, 0.0), 0.0))

    def _evaluate_objective(self, x: list[float], gap: Array) -> float:
        """Return ½ xᵀHx + cᵀx."""
        values = np.array(x)
        quadratic = 0.5 * float(values @ (self._H @ values))
        if self.method.primal:
            return quadratic
        carried = values != 0.0  # elsewhere q may be infinite
        return quadratic + float(values[carried] @ gap[carried])

    def _bound_rounding(self, x: list[float], r: Array) -> float:
        """Return the gap that the form in use cannot tell from zero.

        In the primal form w = q + G D s has passed through both G and D.
        """
        if not self.method.primal:
            return self._scaled.rounding(r)
        product = np.abs(self._H).sum(axis=1) * max_abs(np.array(x)) / self._unit
        return 4.0 * EPS * self._scaled.norm * max_abs(product)


def sweep(
    rows: list[tuple[int, Array]], x: list[float], lower: list[float], gradient: Array
) -> float:
    """Sweep once, in place.

    The gradient is kept up to date by columns, so that rows at rest cost a comparison.

    Args:
        rows: index and row of H, whose diagonal is one.
        x: the unknowns.
        lower: their bounds.
        gradient: H x + c.

    Returns:
        The largest |change| of an unknown.
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


def _invert(factor: Array) -> tuple[Array, Array]:
    """Return D = G⁻¹ scaled to unit diagonal, e D e, and e = D_ii^(-1/2)."""
    triangle = lapack.dpotri(factor, lower=1)[0] if factor.size else factor
    inverse = np.tril(triangle) + np.tril(triangle, -1).T
    e = np.ascontiguousarray(np.diagonal(inverse)) ** -0.5  # without gaps: see energy_scale
    return np.ascontiguousarray(e[:, None] * inverse * e), e
