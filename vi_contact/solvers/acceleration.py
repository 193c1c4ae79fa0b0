"""Accelerate passes d -> d + delta(d) over all ranks: D. G. Anderson, J. ACM 12, 1965.

The next d is that of the affine combination of the last passes whose delta is the smallest in the
Euclidean norm over all ranks. ``solvers.friction.extrapolation`` does the like for a few unknowns
that every rank has.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..core.algebra import Array

DEPTH = 5  # differences of passes that are combined
DEPENDENT = 1e-12  # of the largest singular value: what is lost to rounding in the normal equations


@dataclass
class Anderson:
    """Extrapolate from the last few passes.

    Attributes:
        sum_over_ranks: adds up arrays over all ranks.
        points: where the last passes started.
        changes: their delta.
    """

    sum_over_ranks: Callable[[Array], Array]
    points: list[Array] = field(default_factory=list)
    changes: list[Array] = field(default_factory=list)

    def extrapolate(self, d: Array, delta: Array) -> Array:
        """Return where the next pass starts. Collective.

        Args:
            d: where this pass started (n,).
            delta: what it changed (n,).
        """
        self.points.append(d)
        self.changes.append(delta)
        del self.points[: -DEPTH - 1]
        del self.changes[: -DEPTH - 1]
        if len(self.points) == 1:
            return d + delta

        # Least squares by the normal equations of the differences, which are few. Each difference
        # counts in its own size, as the last ones are the smallest, and say the most.
        of_points = np.diff(np.array(self.points), axis=0)
        of_changes = np.diff(np.array(self.changes), axis=0)
        products = self.sum_over_ranks(
            np.column_stack([of_changes @ of_changes.T, of_changes @ delta])
        )
        sizes = np.sqrt(np.diag(products))
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        normal = products[:, :-1] / np.outer(sizes, sizes)
        weights = np.linalg.lstsq(normal, products[:, -1] / sizes, rcond=DEPENDENT)[0]
        step: Array = delta - (weights / sizes) @ (of_points + of_changes)
        return d + step
