"""Solve by Uzawa's method: a gradient step on the reactions, then the projection onto the cone's cross-section.

Aimi, Di Credico and Gimperlein (CMAME 427, 2024), "Uzawa algorithm", with Lambda = r, U - G the gap and slip, here -w =
-(q + G r):

    r <- Pr_C(r - rho w),    Pr_C(y)_n = max(y_n, 0),    Pr_C(y)_t = y_t min(1, F/|y_t|),    F = limit(r_n)

F is Tresca's threshold, or Coulomb's limit of the r_n just found. Under Tresca's law this is the projected gradient
method for a convex function and converges for 0 < rho < 2/lambda_max(G); the best uniform factor, (k - 1)/(k + 1) with
the condition number k of G, is reached at rho = 2/(lambda_min + lambda_max), which is taken when no rho is given. G is
that of the scaled numbers of ``problem``, in which rho is dimensionless. Slow by nature: errors shrink by 1 - 2/k.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import attributes
from .problem import FrictionResult, ScaledDelassus


@dataclass(frozen=True)
class Uzawa:
    """Hold the settings. ``tolerance``: largest |F| of the natural map relative to r = 0; ``rho`` > 0, or None: see
    above.

    In the result ``iterations`` counts projections and ``history`` the residual after each. InputError for rho <= 0.
    """

    carries_friction: ClassVar[bool] = True
    tolerance: float = 1e-12
    max_iterations: int = 100_000
    rho: float | None = None

    def __post_init__(self) -> None:
        positive = ("tolerance",) if self.rho is None else ("tolerance", "rho")
        attributes(self, positive=positive, counts=("max_iterations",))

    def prepare(self, G: Array, bilateral: Mask) -> PreparedUzawa:
        """Check and scale G (m d, m d)."""
        return PreparedUzawa(self, G, bilateral)


class PreparedUzawa:
    """Solve for one G and many right-hand sides. ``rho`` is the one in use."""

    def __init__(self, method: Uzawa, G: Array, bilateral: Mask) -> None:
        self.method = method
        self.delassus = ScaledDelassus(G, bilateral)
        self.rho = method.rho or self._best()

    def _best(self) -> float:
        """2/(lambda_min + lambda_max)."""
        if not self.delassus.count:
            return 1.0
        values = np.linalg.eigvalsh(self.delassus.matrix)
        return float(2.0 / (values[0] + values[-1]))

    def solve(self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None) -> FrictionResult:
        """Solve the small problem; see PreparedFriction."""
        step = self.delassus.problem(q, cohesion, slope)
        r, history = step.start(guess if step.unit > 0.0 else None), [1.0]
        w = step.w(r)
        while step.unit > 0.0 and len(history) <= self.method.max_iterations:
            r = step.admissible(r - self.rho * w)
            w = step.w(r)
            residual = step.residual(r, w)
            history.append(residual / step.unit)
            if not np.isfinite(residual) or residual <= max(self.method.tolerance * step.unit, step.rounding(r)):
                break
        return step.result(
            r,
            iterations=len(history) - 1,
            method=self.method,
            tolerance=self.method.tolerance,
            history=tuple(history[1:]),
        )
