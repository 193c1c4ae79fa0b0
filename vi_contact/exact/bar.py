"""Solve the impact of upright elastic bars, foot x = 0, on a rigid wall without friction.

    rho u_tt = E u_xx - rho g,   u_x(length, t) = 0 or u(length, t) = 0,
    y = height + u(0, t) >= 0,   p = -E u_x(0, t) >= 0,   y p = 0

u(x, t) [m] is positive upwards and counted from the stress-free bar whose foot is `height` above
the wall; y is the height of the foot, p the pressure of the wall on it. c = sqrt(E/rho); crossing T
= length / c. All arguments are SI, forces and energies per unit of section. Methods take arrays x
in [0, length] and t >= 0 whose shapes broadcast; where a velocity, strain or pressure jumps they
return one of the two values.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.quantities import NotNegative, Positive, Unit

# (c0, c1, c2) of PeriodicBar, u = c0 + c1 x + c2 s, in [phase][zone]
_PERIOD_THREE = 0.5 * np.array(
    [
        [(1, -1, 0), (1, 0, -1), (1, -1, 0), (1, 0, -1)],  # released
        [(0, 0, -1), (0, -1, 0), (-1, 1, 0), (-1, 0, 1)],  # in contact
        [(0, 0, 1), (0, 0, 1), (1, -1, 0), (1, -1, 0)],  # expanding
    ]
)


@dataclass(frozen=True)
class UprightBar:
    """Hold what upright bars have in common.

    Attributes:
        length: of the bar without stress.
        E: Young's modulus.
        rho: mass density.
        height: of its foot above the wall at the start.
    """

    length: Annotated[float, Positive, Unit("m")] = 10.0
    E: Annotated[float, Positive, Unit("Pa")] = 900.0
    rho: Annotated[float, Positive, Unit("kg/m³")] = 1.0
    height: Annotated[float, NotNegative, Unit("m")] = 5.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def wave_speed(self) -> float:
        """Return c = sqrt(E/rho) [m/s]."""
        return math.sqrt(self.E / self.rho)

    @property
    def crossing(self) -> float:
        """Return T = length/c [s]."""
        return self.length / self.wave_speed


@dataclass(frozen=True)
class ThrownBar(UprightBar):
    """Describe a bar thrown at the wall with `speed` v0, no gravity.

    The defaults are those of Doyen, Ern, Piperno (2011), first test.

        u = -height - v0 min(x/c, T - |s - T|),   s = t - height/v0,   p = rho c v0 for 0 < s < 2T,

    which contains the rigid motions with -v0 before the contact and +v0 after it.
    """

    speed: Annotated[float, Positive, Unit("m/s")] = 10.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def contact_start(self) -> float:
        """Return height/v0 [s]."""
        return self.height / self.speed

    @property
    def contact_end(self) -> float:
        """Return height/v0 + 2T [s]."""
        return self.contact_start + 2.0 * self.crossing

    @property
    def pressure(self) -> float:
        """Return rho c v0 [Pa], constant during the contact."""
        return self.rho * self.wave_speed * self.speed

    @property
    def energy(self) -> float:
        """Return ½ rho length v0² [J/m²], kinetic and strain energy at any time."""
        return 0.5 * self.rho * self.length * self.speed**2

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u(x, t) [m]."""
        delay, s = self._times(x, t)
        front = self.crossing - np.abs(s - self.crossing)
        return -self.height - self.speed * np.minimum(delay, front)

    def velocity(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_t(x, t) [m/s]: -v0 ahead of the wave, 0 behind it, v0 behind its reflection."""
        delay, s = self._times(x, t)
        behind_wave = np.where(s > delay, 1.0, 0.0)
        behind_reflection = np.where(s > 2.0 * self.crossing - delay, 1.0, 0.0)
        return self.speed * (behind_wave + behind_reflection - 1.0)

    def strain(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_x(x, t): -v0/c behind the wave and ahead of its reflection, else 0."""
        delay, s = self._times(x, t)
        between = (s > delay) & (s < 2.0 * self.crossing - delay)
        return -np.where(between, self.speed / self.wave_speed, 0.0)

    def force(self, t: ArrayLike) -> Array:
        """Return the contact pressure p(t) [Pa] >= 0."""
        t = np.asarray(t, dtype=float)
        touches = (t > self.contact_start) & (t < self.contact_end)
        return self.pressure * np.where(touches, 1.0, 0.0)

    def contacts(self, until: float) -> Array:
        """Return start and end of the contacts before `until` [s].

        They have one row each and are clipped there; the shape is (1, 2) or (0, 2).
        """
        times = np.array([[self.contact_start, self.contact_end]])
        return np.minimum(times[times[:, 0] < until], until)

    def _times(self, x: ArrayLike, t: ArrayLike) -> tuple[Array, Array]:
        """Return x/c and the time since touch-down [s]."""
        delay = np.asarray(x, dtype=float) / self.wave_speed
        return delay, np.asarray(t, dtype=float) - self.contact_start


@dataclass(frozen=True)
class PeriodicBar:
    """Describe a bar of length = E = rho = 1, top clamped.

    Its foot is released at the wall from u = (1 - x)/2; there is no gravity.

    Period 3: released, in contact (p = 1/2), expanding, one unit of time each. With s = t mod 1, u
    is linear in x and s in the four zones between s = x and s = 1 - x (Dabaghi, Petrov, Pousin,
    Renard; Chouly, Hild, Renard).
    """

    length: ClassVar[float] = 1.0
    E: ClassVar[float] = 1.0
    rho: ClassVar[float] = 1.0
    period: ClassVar[float] = 3.0  # [s]
    energy: ClassVar[float] = 0.125  # [J/m²], kinetic and strain energy at any time

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u(x, t) [m]."""
        x, s, coefficients = self._zones(x, t)
        return coefficients[..., 0] + coefficients[..., 1] * x + coefficients[..., 2] * s

    def velocity(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_t(x, t) [m/s]: -1/2, 0 or 1/2."""
        _, _, coefficients = self._zones(x, t)
        return coefficients[..., 2]

    def strain(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_x(x, t): -1/2, 0 or 1/2."""
        _, _, coefficients = self._zones(x, t)
        return coefficients[..., 1]

    def force(self, t: ArrayLike) -> Array:
        """Return the contact pressure p(t) [Pa]: 1/2 in the second third of a period, else 0."""
        phase = np.floor(np.mod(np.asarray(t, dtype=float), 3.0))
        return 0.5 * np.where(phase == 1.0, 1.0, 0.0)

    def contacts(self, until: float) -> Array:
        """Return start and end of the contacts before `until` [s].

        They have one row each and are clipped there; the shape is (m, 2).
        """
        starts = np.arange(1.0, until, 3.0)
        return np.minimum(np.stack([starts, starts + 1.0], axis=1), until)

    @staticmethod
    def _zones(x: ArrayLike, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return x, s and the row of the table for every pair, shapes (...), (...), (..., 3)."""
        x, t = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(t, dtype=float))
        phase = np.floor(np.mod(t, 3.0)).astype(int)
        s = np.mod(t, 1.0)

        # Zones 0 to 3: whether s is above x, and twice whether it is above 1 - x.
        zone = np.where(s > 1.0 - x, 2, 0) + np.where(s > x, 1, 0)
        return x, s, _PERIOD_THREE[phase, zone]
