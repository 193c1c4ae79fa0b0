"""Give the solution of a membrane over a ball, the obstacle problem on a square.

-Δu >= 0, u >= psi and one of them an equality, on (-2, 2)²; psi is the upper half of the unit ball,
continued outside of r = 0.9 by its tangent cone so that it has a value everywhere. With the
boundary values of

    u = psi for r <= a,    u = -A log(r / 2) for r >= a,    A = a² / sqrt(1 - a²)

the membrane leaves the ball smoothly at the radius a where u is continuous: a² (1 - log(a / 2)) =
1. The force between ball and membrane is 2 pi A. (E. Bueler, PETSc for Partial Differential
Equations, SIAM 2020, section 12.1.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

HALF = 2.0  # of the side of the square
CONE = 0.9


@dataclass(frozen=True)
class Membrane:
    """Hold the solution with all heights times ``unit`` [m]; places are in metres too."""

    unit: float = 1.0

    @property
    def radius(self) -> float:
        """Return the contact radius a, 0.69797 [m]."""
        return float(brentq(lambda a: a**2 * (1.0 - np.log(a / 2.0)) - 1.0, 0.1, 0.9, xtol=1e-15))

    @property
    def factor(self) -> float:
        """Return A, times the unit [m]."""
        return self.unit * self.radius**2 / float(np.sqrt(1.0 - self.radius**2))

    @property
    def force(self) -> float:
        """Return what the ball pushes, 2 pi A, over the tension of the membrane [m]."""
        return 2.0 * np.pi * self.factor

    def obstacle(self, x: Any) -> Any:
        """Return psi [m] at points (3, n) [m], shape (n,)."""
        r = np.hypot(x[0], x[1])
        edge = np.sqrt(1.0 - CONE**2)
        ball = np.sqrt(np.maximum(1.0 - r**2, 0.0))
        return self.unit * np.where(r < CONE, ball, edge - (r - CONE) * CONE / edge)

    def height(self, x: Any) -> Any:
        """Return u [m] at points (3, n) [m], shape (n,)."""
        r = np.hypot(x[0], x[1])
        off = -self.factor * np.log(np.maximum(r, self.radius) / HALF)
        return np.where(r < self.radius, self.obstacle(x), off)
