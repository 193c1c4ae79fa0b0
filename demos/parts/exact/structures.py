"""Give closed forms for beams and plates that touch a rigid stop or the rigid ground.

A body that a load presses on a stop at the distance g carries there P = (w0 - g)/f, where w0 is the
deflection of that point under the load alone and f the deflection under a unit force at it.
Deflections of plates: S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells (1959),
sections 16, 19, 30 and 34. The beam on the ground and the disk on the ground solve EI w'''' = -q
and D ∇⁴ w = q where they do not touch; where they begin to touch deflection, slope and moment are
those of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from vi_contact.core.algebra import Array


def stop_force(w0: float, gap: float, flexibility: float) -> float:
    """Return the force of a stop [N].

    There are w0 [m] under the load alone, gap [m] and flexibility [m/N]; it is 0 where w0 < gap.
    """
    return max(w0 - gap, 0.0) / flexibility


def arm_flexibility(height: float, arm: float, *, EA: float, EI: float) -> Array:
    """Return F (2, 2) [m/N] of the end of an arm [m] on a clamped column.

    The column has this height [m]; u = F p, along and up.
    """
    xx = height**3 / (3.0 * EI) + arm / EA
    xy = -(height**2) * arm / (2.0 * EI)
    yy = (arm**3 / 3.0 + arm**2 * height) / EI + height / EA
    return np.array([[xx, xy], [xy, yy]])


@dataclass(frozen=True)
class LiftedBeam:
    """Describe a heavy beam on the rigid ground whose end is pulled up.

    There are EI [N m²], weight q [N/m], force P [N].

    Over the length a = 2 P/q from the end it is off the ground, as w = w' = w'' = 0 where it begins
    to touch.
    """

    EI: float
    q: float
    P: float

    @property
    def length(self) -> float:
        """Return the length a [m] that is off the ground."""
        return 2.0 * self.P / self.q

    @property
    def height(self) -> float:
        """Return how high the end is, q a⁴/(24 EI) [m]."""
        return self.q * self.length**4 / (24.0 * self.EI)

    def shape(self, x: Array) -> Array:
        """Return the heights [m] at distances x [m] from the lifted end."""
        s = np.maximum(self.length - np.asarray(x, dtype=float), 0.0)
        return np.asarray(self.q * s**3 * (2.0 * self.length - s) / (24.0 * self.EI))


def square_plate() -> tuple[float, float]:
    """Return the deflection of the middle of a simply supported square plate under a uniform load.

    It is in units of q a⁴/D; with it comes that under a unit force there, in units of a²/D; a is
    the side.
    """
    m = np.arange(1, 60, 2)
    b = 0.5 * np.pi * m
    load = (
        4.0
        / np.pi**5
        * np.sum((-1.0) ** (m // 2) / m**5 * (1.0 - (b * np.tanh(b) + 2.0) / (2.0 * np.cosh(b))))
    )
    m = np.arange(1, 2001, 2)  # the terms fall like 1/m³
    b = np.minimum(0.5 * np.pi * m, 300.0)
    force = np.sum((np.tanh(b) - b / np.cosh(b) ** 2) / m**3) / (2.0 * np.pi**3)
    return float(load), float(force)


def clamped_disk() -> tuple[float, float]:
    """Return the same of a clamped disk of radius a: 1/64 and 1/(16 pi)."""
    return 1.0 / 64.0, 1.0 / (16.0 * np.pi)


@dataclass(frozen=True)
class DiskOnGround:
    """Hold a clamped disk (radius a = 1, D = 1, q = 1) on flat ground.

    The load presses it on ground at a distance g below.

    It lies on the ground for r <= b; elsewhere w = r⁴/64 + c1 + c2 r² + c3 ln r + c4 r² ln r, with
    w = w' = 0 at r = 1 and w = g, w' = w'' = 0 at r = b. The ground carries q inside and a line
    load on the circle r = b.
    """

    gap: float
    b: float
    c: tuple[float, ...]

    @property
    def force(self) -> float:
        """Return what the ground carries, in units of q a²: the load less the shear at the rim."""
        return -8.0 * np.pi * self.c[3]

    def deflection(self, r: Array) -> Array:
        """Return w at radii r in [0, 1], in units of q a⁴/D."""
        s = np.maximum(np.asarray(r, dtype=float), self.b)
        c1, c2, c3, c4 = self.c
        return np.asarray(s**4 / 64.0 + c1 + c2 * s**2 + (c3 + c4 * s**2) * np.log(s))


def disk_on_ground(gap: float) -> DiskOnGround:
    """Return the disk above ground at this distance, in units of q a⁴/D, 0 < gap < 1/70."""
    b = float(brentq(lambda b: _gap(b)[0] - gap, 1e-6, 1.0 - 1e-3, xtol=1e-15))
    return DiskOnGround(gap, b, tuple(map(float, _gap(b)[1:])))


def _gap(b: float) -> Array:
    """(g, c1, c2, c3, c4) of the disk that lies on the ground for r <= b."""
    log = np.log(b)
    rows = [
        [0.0, 1.0, 1.0, 0.0, 0.0],  # w(1) = 0
        [0.0, 0.0, 2.0, 1.0, 1.0],  # w'(1) = 0
        [-1.0, 1.0, b**2, log, b**2 * log],  # w(b) = g
        [0.0, 0.0, 2.0 * b, 1.0 / b, b * (2.0 * log + 1.0)],  # w'(b) = 0
        [0.0, 0.0, 2.0, -1.0 / b**2, 2.0 * log + 3.0],  # w''(b) = 0
    ]
    load = [-1.0 / 64.0, -1.0 / 16.0, -(b**4) / 64.0, -(b**3) / 16.0, -3.0 * b**2 / 16.0]
    return np.asarray(np.linalg.solve(rows, load))
