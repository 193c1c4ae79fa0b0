"""Solve a flat rigid punch without friction on an elastic half-space (Johnson 1985, ch. 2 and 3).

Pressures are positive in compression and infinite at the edge, where they grow with the power -1/2 of the distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.checks import attributes


@dataclass(frozen=True)
class StripPunch:
    """Describe a long punch of width 2a under `force` P per unit of length: p = P/(pi sqrt(a² - x²)).

    half_width a [m], force [N/m]. Raises InputError unless both are finite and positive.
    """

    half_width: float
    force: float

    def __post_init__(self) -> None:
        attributes(self, positive=("half_width", "force"))

    def pressure(self, x: ArrayLike) -> Array:
        """Return p(x) [Pa] at the distance x from the centre line, 0 beside the punch, infinite at its edge."""
        return self.force / math.pi * _inverse_root(self.half_width, x)


@dataclass(frozen=True)
class RoundPunch:
    """Describe a round punch of radius a under `force` F: p = F/(2 pi a sqrt(a² - r²)), depth = F/(2 E* a).

    radius a [m], force [N], modulus E* = E/(1 - nu²) [Pa]. Raises InputError unless all are finite and positive.
    """

    radius: float
    force: float
    modulus: float

    def __post_init__(self) -> None:
        attributes(self, positive=("radius", "force", "modulus"))

    @property
    def depth(self) -> float:
        """Return the depth to which it sinks [m]."""
        return self.force / (2.0 * self.modulus * self.radius)

    def pressure(self, r: ArrayLike) -> Array:
        """Return p(r) [Pa] at the distance r from the axis, 0 beside the punch, infinite at its edge."""
        return self.force / (2.0 * math.pi * self.radius) * _inverse_root(self.radius, r)


def _inverse_root(a: float, x: ArrayLike) -> Array:
    """Return 1/sqrt(a² - x²), 0 for |x| > a."""
    square = a**2 - np.asarray(x, dtype=float) ** 2
    with np.errstate(divide="ignore"):
        return np.where(square < 0.0, 0.0, 1.0 / np.sqrt(np.maximum(square, 0.0)))
