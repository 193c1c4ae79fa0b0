"""Solve by Uzawa's method: a gradient step on the reactions, then the projection onto the cone's cross-section.

Aimi, Di Credico and Gimperlein (CMAME 427, 2024), "Uzawa algorithm", with Lambda = r, U - G the gap and slip, here -w =
-(q + G r):

    r <- Pr_C(r - rho w),    Pr_C(y)_n = max(y_n, 0),    Pr_C(y)_t = y_t min(1, F/|y_t|),    F = limit(r_n)

F is Tresca's threshold, or Coulomb's limit of the r_n just found. Under Tresca's law this is the projected gradient
method for a convex function and converges for 0 < rho < 2/lambda_max(G); the best uniform factor, (k - 1)/(k + 1) with
the condition number k of G, is reached at rho = 2/(lambda_min + lambda_max), which is taken when no rho is given. G is
that of the scaled numbers of ``problem``, in which rho is dimensionless. Slow by nature: errors shrink by 1 - 2/k.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import number, optional
from .problem import Iterated, PreparedFriction, ScaledDelassus, ScaledProblem, Settings, iterated


@dataclass(frozen=True)
class Uzawa(Settings):
    """Hold the settings. ``tolerance``: largest |F| of the natural map over that of r = 0; ``rho`` > 0, or None: best.

    In the result ``iterations`` counts projections and ``history`` the residual after each. InputError for rho <= 0.
    """

    max_iterations: int = 100_000
    rho: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        optional(number, "Uzawa", "rho", self.rho, positive=True)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d)."""
        delassus = ScaledDelassus(G, bilateral)
        rho = self.rho or best_step(delassus.matrix)

        def loop(step: ScaledProblem, r: Array) -> Iterated:
            return iterated(step, r, lambda r, w: step.admissible(r - rho * w), self.tolerance, self.max_iterations)

        return PreparedFriction(self, self.tolerance, delassus, loop)


def best_step(matrix: Array) -> float:
    """Return rho = 2/(lambda_min + lambda_max)."""
    values = np.linalg.eigvalsh(matrix) if matrix.size else np.ones(1)
    return float(2.0 / (values[0] + values[-1]))
