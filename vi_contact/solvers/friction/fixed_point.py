"""Solve Coulomb's law as a sequence of Tresca problems: the fixed point of s <- limit(r_n(s)).

Every problem with the threshold s given is convex and has one solution; the map is a contraction
for small friction (Nečas, Jarušek and Haslinger, Boll. Unione Mat. Ital. 17-B, 1980; Haslinger,
Hlaváček and Nečas, Handbook of Numerical Analysis IV, 1996). ``extrapolation`` may shorten the
sequence.
"""

from dataclasses import dataclass, field

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from .extrapolation import Extrapolation, Plain, check_extrapolation
from .newton import FrictionNewton
from .problem import (
    FrictionMethod,
    FrictionResult,
    LastIterate,
    ScaledDelassus,
    Settings,
    check_inner_method,
)

LOOSE = 100.0  # times the tolerance: residual that an answer may have


@dataclass(frozen=True)
class FixedPoint(Settings):
    """Hold the settings of the sequence of Tresca problems.

    In the result ``iterations`` counts Tresca problems and ``history`` the relative change of the
    thresholds in each. What the thresholds still change by shifts points that stick, and fine
    meshes amplify that: on 2e5 unknowns the equilibrium of a step is off by 1e-9 at 1e-10.

    Attributes:
        tolerance: change of the thresholds relative to the largest, or rounding where that is more.
        max_iterations: number of Tresca problems, at most.
        tresca: the method for each problem.
        extrapolation: how the next thresholds follow: Plain() or Anderson().
    """

    max_iterations: int = 200
    tresca: FrictionMethod = field(default_factory=FrictionNewton)
    extrapolation: Extrapolation = field(default_factory=Plain)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_inner_method("FixedPoint", "tresca", self.tresca)
        check_extrapolation("FixedPoint", self.extrapolation)

    def prepare(self, G: Array, bilateral: Mask) -> "PreparedFixedPoint":
        """Check and scale G (m d, m d); ``bilateral`` (m,) says which rows are bilateral."""
        return PreparedFixedPoint(self, G, bilateral)


class PreparedFixedPoint:
    """Solve for one G and many right-hand sides."""

    def __init__(self, method: FixedPoint, G: Array, bilateral: Mask) -> None:
        """Check and scale G: see ``FixedPoint.prepare``."""
        self.method = method
        self.delassus = ScaledDelassus(G, bilateral)
        self._tresca = method.tresca.prepare(G, bilateral)

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Solve the small problem.

        Args:
            q: (m, d) gap, and minus the slip, without reactions.
            cohesion: (m,) [as r].
            slope: (m,).
            guess: (m,) predicted contact set, or reactions (m, d).

        Raises:
            StepFailure: the tolerance is not reached.
        """
        method = self.method
        scale = self.delassus.scale
        unit = scale[:, -1]  # of thresholds
        step = self.delassus.problem(q, cohesion, slope)

        # Thresholds of the guess, and the Tresca problem with them.
        start = step.start(guess) * scale
        constant = np.zeros_like(slope)
        limit = cohesion + slope * np.maximum(start[:, 0], 0.0)
        choose_next = method.extrapolation.start()
        history: list[float] = []
        answer = self._tresca.solve(q, limit, constant, start)

        # s <- limit(r_n(s)) until s stays, in scaled numbers.
        while len(history) < method.max_iterations:
            new = cohesion + slope * np.maximum(answer.r[:, 0], 0.0)
            change = max_abs((new - limit) / unit)
            size = max(max_abs(new / unit), max_abs(limit / unit))
            if change <= max(method.tolerance * size, step.rounding(answer.r / scale)):
                break
            history.append(change / size)
            limit = np.maximum(unit * choose_next(limit / unit, new / unit), 0.0)
            answer = self._tresca.solve(q, limit, constant, answer.r)
        last = LastIterate(answer.r / scale, len(history) + 1, history)
        return step.result(method, LOOSE * method.tolerance, last)
