"""Solve a rigid block on a moving base with Coulomb friction (Newmark, Géotechnique 15, 1965).

    u'' = -a(t) - mu g sgn(u')   while it slides,   u' = 0 stays while |a| <= mu g

u [m] is the displacement of the block relative to the base, a [m/s²] the horizontal acceleration of
the base.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import array
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.exact.bouncing_bar import find_first_root


@dataclass(frozen=True)
class SlidingBlock:
    """Hold mu >= 0 of a level base, and gravity g [m/s²]. Raises InputError for values out of
    range."""

    mu: Annotated[float, NotNegative]
    gravity: Annotated[float, Positive, Unit("m/s²")] = 9.81

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def onset_acceleration(self) -> float:
        """Return mu g [m/s²]."""
        return self.mu * self.gravity

    def slip(self, acceleration: float, duration: float) -> float:
        """Return the final |u| [m] of a rectangular pulse a for t1: ½ a t1² (a/(mu g) - 1), 0 if
        |a| <= mu g.

        acceleration a [m/s²], duration t1 [s]. Infinite without friction.
        """
        a = abs(acceleration)
        if a <= self.onset_acceleration:
            return 0.0
        return 0.5 * a * duration**2 * (a / self.onset_acceleration - 1.0) if self.mu else math.inf

    def history(self, times: ArrayLike, acceleration: ArrayLike) -> tuple[Array, Array]:
        """Return (u, u') at `times`, from rest, for an acceleration that is linear between them;
        exact to round-off.

        times [s], not decreasing, a time given twice is a jump; acceleration [m/s²]; all of shape
        (n,). Raises InputError when the shapes differ, a number is not finite or the times
        decrease.
        """
        t = array("SlidingBlock", "times", times, (None,), unit="s")
        a = array("SlidingBlock", "acceleration", acceleration, t.shape, unit="m/s²")
        if np.any(np.diff(t) < 0.0):
            raise InputError("SlidingBlock: times decrease; give them in order")
        u, v = np.zeros_like(t), np.zeros_like(t)
        for n in range(len(t) - 1):
            u[n + 1], v[n + 1] = self._interval(u[n], v[n], a[n], a[n + 1], t[n + 1] - t[n])
        return u, v

    def _interval(
        self, u: float, v: float, a: float, a_end: float, length: float
    ) -> tuple[float, float]:
        """Return (u, u') after an interval [s] in which the acceleration goes linearly from a to
        a_end."""
        slope = (a_end - a) / length if length > 0.0 else 0.0
        while length > 0.0:
            sign = math.copysign(1.0, v) if v else self._onset(a, slope)
            if sign == 0.0:  # sticks until |a| reaches mu g, if it does
                wait = (
                    (math.copysign(self.onset_acceleration, slope) - a) / slope
                    if slope
                    else math.inf
                )
                if wait >= length:
                    break
                a, length = math.copysign(self.onset_acceleration, slope), length - wait
                continue
            push = -a - sign * self.onset_acceleration
            step = min(length, find_first_root(sign * v, sign * push, -sign * slope))
            u += step * (v + step * (0.5 * push - slope * step / 6.0))
            v = 0.0 if step < length else v + step * (push - 0.5 * slope * step)
            a, length = a + slope * step, length - step
        return u, v

    def _onset(self, a: float, slope: float) -> float:
        """Return the direction in which a block at rest starts to slide: 1, -1, or 0 if it
        sticks."""
        side = math.copysign(1.0, a)  # of ±0 too, for a block without friction
        slides = abs(a) > self.onset_acceleration or (
            abs(a) == self.onset_acceleration and side * slope > 0.0
        )
        return -side if slides else 0.0
