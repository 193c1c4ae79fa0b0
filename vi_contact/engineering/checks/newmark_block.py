"""Expect how far a rigid block slides on a plane that is shaken (Newmark, Géotechnique 15, 1965)."""

import math
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.units import STANDARD_GRAVITY
from .comparison import Check, History, Numbers

PARTS = 32  # CHOSEN: of a step of the run; a slide ends within one, which costs less than r h²/8 of slip, h = dt/32


def sliding(t: Array, drive: Array, resist: Array, *, one_sided: bool = False) -> Array:
    """Return the displacement [m] at times t (n,) of u'' = w - r sgn(u') from rest, sticking while |w| <= r.

    drive w, resist r >= 0 [m/s²], (n,), linear between the times; one_sided: it never slides back, u' >= 0.
    """
    u, slip, speed, share = np.zeros(len(t)), 0.0, 0.0, (np.arange(PARTS) + 0.5) / PARTS
    for row, length in enumerate(np.diff(t) / PARTS):
        push, hold = (length * (x[row] + share * (x[row + 1] - x[row])) for x in (drive, resist))
        for gain, most in zip(push.tolist(), hold.tolist(), strict=True):
            free = speed + gain
            new = max(free - most, 0.0) - (0.0 if one_sided else max(-free - most, 0.0))
            slip, speed = slip + 0.5 * length * (speed + new), new
        u[row + 1] = slip
    return u


@dataclass(frozen=True, kw_only=True)
class NewmarkBlock(Check):
    """Expect the displacement that is left after a motion, on a plane that falls by ``slope`` [rad] towards +x.

    mu: friction, or in its place the yield acceleration over g of a level plane; one_sided: it slides to one side only,
    as a wall before its fill does: to that of the sign of ``towards`` along x; 0: down the plane, +x if it is level;
    slip, acceleration, vertical: columns of the displacement on the plane, signed, and of the ground's accelerations.
    It applies while the block stays on the plane, and where it stands without motion.
    """

    mu: float
    slope: float = 0.0
    one_sided: bool = False
    towards: float = 0.0
    gravity: float = STANDARD_GRAVITY
    slip: str = "sliding_base"
    acceleration: str = "a_g_x"
    vertical: str = "a_g_y"

    def numbers(self, history: History) -> Numbers:
        along, up = history[self.acceleration], history[self.vertical] + self.gravity
        sine, cosine = math.sin(self.slope), math.cos(self.slope)
        normal, drive = up * cosine + along * sine, up * sine - along * cosine
        found = float(abs(history[self.slip][-1] - history[self.slip][0]))
        side = math.copysign(1.0, self.towards or self.slope or 1.0)
        why = "" if along.any() else f"the column {self.acceleration} is zero: name acceleration= that of the ground"
        why = "the ground falls away below the block" if normal.min() < 0.0 else why
        why = "the block slides under its weight: |slope| is above atan(mu)" if abs(sine) > self.mu * cosine else why
        moved = sliding(history["t"], side * drive, self.mu * np.maximum(normal, 0.0), one_sided=self.one_sided)
        return abs(float(moved[-1])), found, why, {"a": (float(np.abs(along).max()), "m/s²")}
