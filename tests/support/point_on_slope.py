"""A point that slides on an inclined plane with friction, thrown across the slope: path and times
in closed form.

    v' = g sin(a) e - mu g cos(a) v/|v|

With e down the slope, s = g sin(a), k = mu/tan(a) and v turned by phi from e, tau = tan(phi/2), the
speed and the angle obey |v|' = s cos(phi) - k s, phi' = -s sin(phi)/|v|, so that along the path |v|
= ½ C tau^(k-1) (1 + tau²) with a constant C, the initial speed when tau starts at 1 (right across).
Time and place are integrals of powers of tau. The point comes to rest, down the slope in the end,
if k > 1; else its speed grows for ever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from vi_contact.core.algebra import Array


@dataclass(frozen=True)
class PointOnSlope:
    """mu, the tangent of the slope, neither equal to it nor to half of it, and the speed of the
    throw [m/s]."""

    mu: float
    slope: float
    speed: float
    gravity: float = 9.81

    @property
    def k(self) -> float:
        return self.mu / self.slope

    @property
    def pull(self) -> float:
        """s [m/s²]"""
        return float(self.gravity * np.sin(np.arctan(self.slope)))

    def _between(self, power: float, tau: float) -> float:
        """The integral of tau^(power - 1) from tau to 1."""
        return (1.0 - tau**power) / power

    def time(self, tau: float) -> float:
        """When the velocity has turned to tau [s]."""
        k = self.k
        return (
            self.speed
            / (2.0 * self.pull)
            * (self._between(k - 1.0, tau) + self._between(k + 1.0, tau))
        )

    @property
    def rest_time(self) -> float:
        """When it comes to rest [s], k > 1."""
        return self.time(0.0) if self.k > 1.0 else np.inf

    def at(self, t: float) -> tuple[Array, Array]:
        """(place, velocity) down the slope and across [m, m/s]."""
        tau = 0.0
        if t < self.rest_time:
            low = 0.5
            while self.time(low) < t:
                low *= 0.5
            tau = float(brentq(lambda tau: self.time(tau) - t, low, 1.0, xtol=1e-15, rtol=1e-14))
        k, scale = self.k, self.speed**2 / (2.0 * self.pull)
        down = 0.5 * (self._between(2.0 * k - 2.0, tau) - self._between(2.0 * k + 2.0, tau))
        across = self._between(2.0 * k - 1.0, tau) + self._between(2.0 * k + 1.0, tau)
        fast = 0.5 * self.speed * tau ** (k - 1.0)
        return scale * np.array([down, across]), fast * np.array([1.0 - tau**2, 2.0 * tau])
