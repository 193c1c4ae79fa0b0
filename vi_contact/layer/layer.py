"""Describe the layer before an obstacle.

It has its width, cut-off and force (b-geometry, ENOC 2017, equation 25).

    f̂_1 = [k̂/x - ĉ ẋ/x²] delta(x; a, b),    k̂ = k b²,    ĉ = c b²/V
    x = rho(q) > 0 the distance function
    delta = 1 - s(z),  z = (x - a)/(b - a),  s = f(z)/(f(z) + f(1 - z))
    f(z) = exp(-1/z) for z > 0, else 0

x > 0 is admissible, x = 0 is the obstacle; a positive f̂_1 pushes away from it. The layer reaches
from 0 to b; the force is complete up to a and fades out smoothly between a and b.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import expit

from ..core.algebra import Array
from ..core.checks import number, optional
from ..core.errors import InputError

# Products of squares of these are finite.
LARGEST = 1e60  # of lengths, speeds and masses
LARGEST_FORCE = 1e150  # of k and c


@dataclass(frozen=True)
class Layer:
    """Describe the law f̂_1 of (25) by its parameters.

    The distance x is in metres here (k, c have other units for other rho); the force is positive
    away from the obstacle.

    Args:
        width: b [m], where the layer begins.
        k: [N/m] >= 0, spring-like: k x is what is left of it in the normal equation divided by
            (b/x)².
        c: [N] >= 0, damper-like.
        speed: V [m/s] of ĉ = c b²/V; None: the speed at which the layer is entered, as in the
            source.
        start: a [m], 0 < a <= b, where the force is complete; None: a = b, no transition.

    Raises:
        InputError: a parameter is outside its range, or k and c are both zero.

    Source: ENOC 2017, A solution of the general single contact frictionless problem using tools of
    b-geometry.
    """

    width: float
    k: float
    c: float = 0.0
    speed: float | None = None
    start: float | None = None

    def __post_init__(self) -> None:
        check_size("Layer", "the layer width b", self.width, "m")
        for name, unit in (("k", "N/m"), ("c", "N")):
            meaning = f"the layer parameter {name}"
            value = getattr(self, name)
            if number("Layer", meaning, value, not_negative=True, unit=unit):
                check_size("Layer", meaning, value, unit, most=LARGEST_FORCE)
        if self.k == 0.0 and self.c == 0.0:
            raise InputError(
                "layer parameters k and c are both zero: nothing would push the body back, give k "
                "> 0"
            )
        optional(check_size, "Layer", "the layer speed V", self.speed, "m/s")
        if self.start is not None:
            start = check_size("Layer", "the layer start a", self.start, "m")
            if start > self.width:
                raise InputError(
                    f"Layer: the layer start a is {self.start}; give a length up to the width "
                    f"{self.width} m"
                )

    @property
    def a(self) -> float:
        """Return the distance at which the force is complete [m]."""
        return self.width if self.start is None else self.start

    @property
    def v(self) -> float:
        """Return V [m/s].

        Raises:
            InputError: it is not known.
        """
        if self.speed is None:
            raise InputError(
                "the layer's speed V is not given: give speed, or enter the layer first"
            )
        return self.speed

    def at(self, speed: float) -> "Layer":
        """Return the layer as a body that enters with this speed [m/s] meets it."""
        return self if self.speed is not None else replace(self, speed=speed)

    def cut_off(self, x: Array | float) -> Array:
        """Return delta(x; a, b) [-] at distances x [m], of the shape of x.

        It is 1 up to a, 0 from b on, and infinitely smooth between.
        """
        x = np.asarray(x, dtype=float)
        a = self.a
        b = self.width
        between = (x > a) & (x < b)
        length = b - a if b > a else 1.0
        z = np.where(between, (x - a) / length, 0.5)
        z = np.clip(z, 1e-3, 1.0 - 1e-3)  # beyond that exp(-1000) and 1 - exp(-1000)
        return np.where(between, expit(1.0 / z - 1.0 / (1.0 - z)), np.where(x <= a, 1.0, 0.0))

    def force(self, x: Array | float, rate: Array | float) -> Array:
        """Return f̂_1 of (25) [N], positive away from the obstacle, of the shape of x.

        It is the force at distances x > 0 [m] and rates ẋ [m/s], which are negative on the way in.
        """
        x = np.asarray(x, dtype=float)
        return np.asarray(
            self.width**2 * (self.k - self.c / self.v * rate / x) / x * self.cut_off(x)
        )


def check_size(owner: str, meaning: str, value: Any, unit: str, *, most: float = LARGEST) -> float:
    """Return a positive number whose powers are finite.

    Args:
        owner: who asks, for messages.
        meaning: of the number, in words.
        value: to be checked.
        unit: of the number, for messages.
        most: largest number; the smallest is one over it.

    Raises:
        InputError: another number, or none.
    """
    size = number(owner, meaning, value, positive=True, unit=unit)
    if not 1.0 / most <= size <= most:
        raise InputError(
            f"{owner}: {meaning} is {size:g}; give a number from {1.0 / most:g} to {most:g} in "
            f"{unit}"
        )
    return size
