"""Solve Rayleigh waves in closed form."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from vi_contact.core.algebra import Array
from vi_contact.laws.materials import LinearElastic


def rayleigh_speed(material: LinearElastic) -> float:
    """Return c_R [m/s]: (2 - x²)² = 4 sqrt(1 - x²) sqrt(1 - x² c_S²/c_P²), x = c_R/c_S, the root in
    (0, 1)."""
    ratio = (material.c_s / material.c_p) ** 2

    def equation(y: float) -> float:  # y = x², divided by y: the trivial root is gone
        return ((2.0 - y) ** 2 - 4.0 * math.sqrt((1.0 - y) * (1.0 - ratio * y))) / y

    return material.c_s * math.sqrt(brentq(equation, 1e-3, 1.0, xtol=1e-15))


def rayleigh_motion(
    material: LinearElastic, depth: Array, wavelength: float
) -> tuple[Array, Array]:
    """Return (U, V) at depths >= 0 [m]: u_x = U cos k(x - c t), u_y = V sin k(x - c t), y upwards;
    U(0) = 1.

    With q, s = k sqrt(1 - c²/c_P²), k sqrt(1 - c²/c_S²): U ~ exp(-q z) - (1 + s²/k²)/2 exp(-s z)
    and V ~ (q/k) (exp(-q z) - 2/(1 + s²/k²) exp(-s z)); y = -z.
    """
    k, c = 2.0 * np.pi / wavelength, rayleigh_speed(material)
    q, s = (k * math.sqrt(1.0 - (c / speed) ** 2) for speed in (material.c_p, material.c_s))
    b = 1.0 + (s / k) ** 2
    scale = 1.0 / (1.0 - 0.5 * b)
    first, second = np.exp(-q * depth), np.exp(-s * depth)
    return scale * (first - 0.5 * b * second), scale * (q / k) * (first - 2.0 / b * second)
