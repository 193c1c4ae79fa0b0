"""Solve Coulomb's law as a sequence of Tresca problems.

It is s <- limit(r_n(s)), the classical fixed point.

Every problem with the threshold s given is convex and has one solution; the map is a contraction
for small friction (Nečas, Jarušek and Haslinger, Boll. Unione Mat. Ital. 17-B, 1980; Haslinger,
Hlaváček and Nečas, Handbook of Numerical Analysis IV, 1996). ``extrapolation`` may shorten the
sequence.
"""

from dataclasses import dataclass, field

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from .extrapolation import Extrapolation, Plain, accelerated
from .newton import FrictionNewton
from .problem import FrictionMethod, FrictionResult, ScaledDelassus, Settings, inner_method


@dataclass(frozen=True)
class FixedPoint(Settings):
    """Hold the settings.

    ``tolerance``: change of the thresholds relative to the largest, or rounding where that is more;
    ``tresca``: method for each problem; ``extrapolation``: Plain() or Anderson(), how the next
    thresholds follow. What the thresholds still change by shifts points that stick, and fine meshes
    amplify that: on 2e5 unknowns the equilibrium of a step is off by 1e-9 at 1e-10.

    In the result ``iterations`` counts Tresca problems and ``history`` the relative change of the
    thresholds in each.
    """

    max_iterations: int = 200
    tresca: FrictionMethod = field(default_factory=FrictionNewton)
    extrapolation: Extrapolation = field(default_factory=Plain)

    def __post_init__(self) -> None:
        super().__post_init__()
        inner_method("FixedPoint", "tresca", self.tresca)
        accelerated("FixedPoint", self.extrapolation)

    def prepare(self, G: Array, bilateral: Mask) -> "PreparedFixedPoint":
        """Check and scale G (m d, m d)."""
        return PreparedFixedPoint(self, G, bilateral)


class PreparedFixedPoint:
    """Solve for one G and many right-hand sides."""

    def __init__(self, method: FixedPoint, G: Array, bilateral: Mask) -> None:
        self.method, self.delassus = method, ScaledDelassus(G, bilateral)
        self._tresca = method.tresca.prepare(G, bilateral)

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Solve the small problem; see PreparedFriction."""
        step = self.delassus.problem(q, cohesion, slope)
        constant = np.zeros_like(slope)
        start = step.start(guess) * self.delassus.scale
        limit, unit = cohesion + slope * np.maximum(start[:, 0], 0.0), self.delassus.scale[:, -1]
        following = self.method.extrapolation.start()
        history: list[float] = []
        found = self._tresca.solve(q, limit, constant, start)
        while len(history) < self.method.max_iterations:
            new = cohesion + slope * np.maximum(found.r[:, 0], 0.0)
            change, size = (
                max_abs((new - limit) / unit),
                max(max_abs(new / unit), max_abs(limit / unit)),
            )
            if change <= max(
                self.method.tolerance * size, step.rounding(found.r / self.delassus.scale)
            ):
                break
            history.append(change / size)
            limit = np.maximum(unit * following(limit / unit, new / unit), 0.0)
            found = self._tresca.solve(q, limit, constant, found.r)
        tolerance = 100.0 * self.method.tolerance
        return step.result(
            self.method, tolerance, (found.r / self.delassus.scale, len(history) + 1, history)
        )
