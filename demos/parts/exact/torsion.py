"""Give closed forms for the elastic-plastic torsion of bars: the disk and the square.

The stress function u of a bar of shear modulus G, yield stress k and twist theta per length
minimises (H. Brezis, M. Sibony, 1971)

    ½ ∫ |∇u|² - 2 G theta ∫ u    under |∇u| <= k, which is |u| <= k dist(x, boundary)

and the torque is 2 ∫ u. Lengths are in units of a (radius, half side), stresses in units of k; w =
G theta a / k. Disk: plastic for r > 1/w, torque (2 pi/3) (1 - 1/(4 w³)) for w >= 1, pi w / 2
before. Square: elastic torque 2.24923 w and largest stress 1.35063 w (S. Timoshenko, J. Goodier,
Theory of Elasticity, section 109), limit torque 8/3 (sand).
"""

from __future__ import annotations

from typing import Any

import numpy as np

DISK_LIMIT = 2.0 * np.pi / 3.0
SQUARE_LIMIT = 8.0 / 3.0


def disk_torque(w: Any) -> Any:
    """Return the torque of the disk at the twists w, in units of k a³."""
    w = np.asarray(w, dtype=float)
    return np.where(w <= 1.0, 0.5 * np.pi * w, DISK_LIMIT * (1.0 - 0.25 / np.maximum(w, 1.0) ** 3))


def disk_function(w: float, r: Any) -> Any:
    """Return the stress function of the disk at radii r, in units of k a."""
    edge = min(1.0, 1.0 / w)
    core = 1.0 - edge + 0.5 * w * (edge**2 - np.minimum(r, edge) ** 2)
    return np.where(r <= edge, core, 1.0 - np.asarray(r))


def square_elastic() -> tuple[float, float]:
    """Return torque and largest stress of the elastic square at w = 1, by their series."""
    n = np.arange(1, 200, 2)
    stress = 2.0 - 16.0 / np.pi**2 * np.sum(1.0 / (n**2 * np.cosh(0.5 * n * np.pi)))
    torque = 16.0 / 3.0 * (1.0 - 192.0 / np.pi**5 * np.sum(np.tanh(0.5 * n * np.pi) / n**5))
    return float(torque), float(stress)
