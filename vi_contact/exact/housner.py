"""Solve the rocking of a rigid block on a rigid base (Housner, Bull. Seism. Soc. Am. 53, 1963).

Uniform block of width 2b and height 2h, no sliding, no bouncing. With R = sqrt(b² + h²), alpha =
atan(b/h), p² = 3g/(4R) and phi = theta/alpha, rocking about the edge on the side to which the block
leans obeys

    theta'' = -p² sin(alpha - theta)   for theta > 0, mirrored for theta < 0
    slender: phi'' = p² (phi - 1).

When theta passes zero, angular momentum about the new edge is conserved: |theta'| is multiplied by
e = 1 - (3/2) sin²(alpha). Angles [rad], times [s], accelerations [m/s²].
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.errors import InputError
from ..core.quantities import Positive, Unit

REST = 1e-30  # phi below which the rest of the motion lasts less than round-off of what has passed


@dataclass(frozen=True)
class HousnerBlock:
    """Describe a block of width 2b and height 2h (the full lengths) under gravity.

    "Slender" is said of what uses the linearised equation; theta0 is the angle of release at rest,
    in (0, alpha).

    Attributes:
        width: 2b.
        height: 2h.
        gravity: g.

    Raises:
        InputError: a block that does not rock on after an impact (e <= 0).
    """

    width: Annotated[float, Positive, Unit("m")]
    height: Annotated[float, Positive, Unit("m")]
    gravity: Annotated[float, Positive, Unit("m/s²")] = 9.81

    def __post_init__(self) -> None:
        check_fields(self)
        if self.restitution <= 0.0:
            raise InputError(
                f"HousnerBlock: width {self.width} is too large for height {self.height}, the "
                "first impact stops the block; give a width below sqrt(2) times the height"
            )

    @property
    def radius(self) -> float:
        """Return R [m], from a base corner to the centre of mass."""
        return 0.5 * math.hypot(self.width, self.height)

    @property
    def alpha(self) -> float:
        """Return atan(b/h) [rad]: beyond it the block overturns."""
        return math.atan(self.width / self.height)

    @property
    def p(self) -> float:
        """Return sqrt(3g/(4R)) [1/s]."""
        return math.sqrt(0.75 * self.gravity / self.radius)

    @property
    def restitution(self) -> float:
        """Return e = 1 - (3/2) sin²(alpha), ratio of angular velocities over an impact."""
        return 1.0 - 1.5 * math.sin(self.alpha) ** 2

    @property
    def energy_ratio(self) -> float:
        """Return r = e²."""
        return self.restitution**2

    @property
    def onset_acceleration(self) -> float:
        """Return g tan(alpha) = g b/h [m/s²].

        A horizontal base acceleration above it starts rocking.
        """
        return self.gravity * self.width / self.height

    def period(self, theta0: float) -> float:
        """Return (4/p) arcosh(1/(1 - phi0)), free rocking without loss, slender [s]."""
        return float(_period(self._phi(theta0))) / self.p

    def amplitudes(self, theta0: float, impacts: int) -> Array:
        """Return the largest |theta| after 0, 1, ... impacts, slender, shape (impacts + 1,) [rad].

        phi_n = 1 - sqrt(1 - r^n (1 - (1 - phi0)²)).
        """
        return self.alpha * self._amplitudes(theta0, impacts)

    def impact_times(self, theta0: float, impacts: int) -> Array:
        """Return times of the first impacts (impacts,), slender [s].

        They are a quarter period, then half ones of phi_1, and so on.
        """
        halves = 0.5 * _period(self._amplitudes(theta0, impacts)[:-1]) / self.p
        return np.cumsum(halves) - 0.5 * halves[:1]

    def free_rocking(self, theta0: float, t: ArrayLike) -> Array:
        """Return theta(t) [rad] after release at t = 0, slender, with impacts; shape of t [s] >= 0.

        phi = ±(1 - (1 - phi_n) cosh(p (t - t_n))), t_n the time of the n-th amplitude; 0 after the
        rest time.
        """
        t = np.asarray(t, dtype=float)

        # After so many impacts phi is below REST, from any angle. The amplitudes are half way
        # between impacts.
        impacts = math.ceil(math.log(REST) / math.log(self.energy_ratio))
        phi = self._amplitudes(theta0, impacts)
        ends = self.impact_times(theta0, len(phi) - 1)
        peaks = np.append(0.0, 0.5 * (ends[1:] + ends[:-1]))

        # The lean between the impacts around t, to the side of theta0 and to the other by turns;
        # cosh - 1 = 2 sinh² of the half.
        n = np.searchsorted(ends, t, side="right")
        last = np.minimum(n, len(peaks) - 1)
        half = np.sinh(0.5 * self.p * np.where(n < len(peaks), t - peaks[last], 0.0))
        lean = phi[last] - 2.0 * (1.0 - phi[last]) * half**2
        return self.alpha * np.where(n < len(peaks), np.where(n % 2, -lean, lean), 0.0)

    def overturning_time(self, acceleration: float) -> float:
        """Return the length of the shortest rectangular pulse that overturns, slender [s].

        It is ln(A/(A - 1))/p, A = acceleration/(g alpha), for a pulse of the base acceleration
        [m/s²].

        Raises:
            InputError: A is not above 1; below that nothing moves.
        """
        excess = acceleration / (self.gravity * self.alpha)
        if not excess > 1.0:
            raise InputError(
                f"HousnerBlock: an acceleration of {acceleration!r} does not lift the block; give "
                f"more than {self.gravity * self.alpha:.6g}"
            )
        return -math.log1p(-1.0 / excess) / self.p

    def _phi(self, theta0: float) -> float:
        """Return theta0/alpha, or raise InputError for a theta0 outside (0, alpha)."""
        if not 0.0 < theta0 < self.alpha:
            raise InputError(
                f"HousnerBlock: theta0 is {theta0!r}; give one between 0 and alpha = "
                f"{self.alpha:.6g}"
            )
        return theta0 / self.alpha

    def _amplitudes(self, theta0: float, impacts: int) -> Array:
        """Return phi_0, ..., shape (impacts + 1,)."""
        phi0 = self._phi(theta0)
        lost = self.energy_ratio ** np.arange(impacts + 1.0) * phi0 * (2.0 - phi0)
        return lost / (1.0 + np.sqrt(1.0 - lost))  # 1 - sqrt(1 - lost) without cancellation


def _period(phi: ArrayLike) -> Array:
    """Return 4 arcosh(1/(1 - phi)), without cancellation for small phi."""
    phi = np.asarray(phi, dtype=float)
    return 8.0 * np.arcsinh(np.sqrt(0.5 * phi / (1.0 - phi)))
