"""Expect how far a rigid block slides on a plane that is shaken and rocks on rigid ground.

Sliding is after Newmark, Géotechnique 15, 1965; rocking is after Housner, Bull. Seism. Soc. Am. 53,
1963.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ....core.algebra import Array
from ....core.quantities import RATIO, Between, Positive
from ....core.units import STANDARD_GRAVITY
from .comparison import Check, Formula, Gravity, History, Incline, Length, Numbers
from .rigid_slip import sliding

ROUNDED = (
    1e-9  # CHOSEN: share of alpha below which the first tilt is round-off of a block that stands
)
# CHOSEN: longest step of the rigid block, over 1/p: its angles are those of shorter steps to 0.1 %
FINE = 2e-4


@dataclass(frozen=True, kw_only=True)
class NewmarkBlock(Check):
    """Expect the displacement that is left after a motion.

    The plane falls by ``slope`` [rad] towards +x.

    mu: friction, or in its place the yield acceleration over g of a level plane; one_sided: it
    slides to one side only, as a wall before its fill does: to that of the sign of ``towards``
    along x; 0: down the plane, +x if it is level; slip, acceleration, vertical: columns of the
    displacement on the plane, signed, and of the ground's accelerations. It applies while the block
    stays on the plane, and where it stands without motion.
    """

    formula: ClassVar[Formula] = Formula(
        text=(
            "u'' = w - r sgn u', w = g sin β - a_x cos β + a_y sin β, r = μ (g cos β + a_x "
            "sin β + a_y cos β)"
        ),
        source="Newmark 1965",
        range="one rigid block that stays on its plane, and stands when nothing moves",
        fields=("mu", "slope", "towards", "gravity"),
        reads=("t", "{slip}", "{acceleration}", "{vertical}"),
        answers={"": "m"},
    )

    mu: Annotated[float, Positive, RATIO]
    slope: Incline = 0.0
    one_sided: bool = False
    towards: Annotated[float, Between(-1.0, 1.0), RATIO] = 0.0
    gravity: Gravity = STANDARD_GRAVITY
    slip: str = "sliding_base"
    acceleration: str = "a_g_x"
    vertical: str = "a_g_y"

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, and why they cannot be compared."""
        along, up = history[self.acceleration], history[self.vertical] + self.gravity
        sine, cosine = math.sin(self.slope), math.cos(self.slope)
        normal, drive = up * cosine + along * sine, up * sine - along * cosine
        found = float(abs(history[self.slip][-1] - history[self.slip][0]))
        side = math.copysign(1.0, self.towards or self.slope or 1.0)
        why = (
            ""
            if along.any()
            else f"the column {self.acceleration} is zero: name acceleration= that of the ground"
        )
        why = "the ground falls away below the block" if normal.min() < 0.0 else why
        why = (
            "the block slides under its weight: |slope| is above atan(mu)"
            if abs(sine) > self.mu * cosine
            else why
        )
        moved = sliding(
            history["t"], side * drive, self.mu * np.maximum(normal, 0.0), one_sided=self.one_sided
        )
        return abs(float(moved[-1])), found, why, {"a": (float(np.abs(along).max()), "m/s²")}


@dataclass(frozen=True, kw_only=True)
class Housner(Check):
    """Expect the largest angle of a uniform block, or the time of its first impact.

    The block has this width and height [m].

    of: "angle" [rad] or "impact" [s] after the first row; theta: column of the angle, anticlockwise
    positive, whose first row is the start, at rest; acceleration, vertical: of the ground. It
    applies to blocks that rock and do not overturn, slide or bounce. One history in a long motion
    is chaotic: compare many, or the first impacts.
    """

    formula: ClassVar[Formula] = Formula(
        text=(
            "θ'' = -p² (± (1 + a_y/g) sin(α - |θ|) - a_x/g cos(α - |θ|)), p² = 3g/4R, θ' "
            "times 1 - 1.5 sin²α where θ = 0"
        ),
        source="Housner 1963",
        range=(
            "width below √2 height; a rigid block that rocks, and does not overturn, slide "
            "or bounce"
        ),
        fields=("width", "height", "gravity"),
        reads=("t", "{theta}", "{acceleration}", "{vertical}"),
        answers={"angle": "rad", "impact": "s"},
    )

    width: Length
    height: Length
    of: str = "angle"
    gravity: Gravity = STANDARD_GRAVITY
    theta: str = "theta_base"
    acceleration: str = "a_g_x"
    vertical: str = "a_g_y"

    def rocking(self, t: Array, ground: Array, theta: float) -> Array:
        """Return the angle [rad] at times t (n,) from rest under a_x, g + a_y (2, n).

        Beyond alpha it stays.
        """
        alpha, angles, rate = math.atan(self.width / self.height), np.full(len(t), theta), 0.0
        inertia, kept = 1.5 / math.hypot(self.width, self.height), 1.0 - 1.5 * math.sin(alpha) ** 2
        for row, length in enumerate(np.diff(t)):
            # of sizes none has, fewer
            parts = min(math.ceil(length * math.sqrt(inertia * self.gravity) / FINE), 400)
            share = (np.arange(parts) + 0.5) / parts
            for push, pull in (
                ground[:, row, None] + np.diff(ground[:, row : row + 2]) * share
            ).T.tolist():
                lean, left = math.copysign(1.0, theta or rate or push), alpha - abs(theta)
                falls = inertia * (push * math.cos(left) - lean * pull * math.sin(left))
                if theta == rate == 0.0 and falls * lean <= 0.0 or left < 0.0:
                    continue
                rate += length / parts * falls
                new = theta + length / parts * rate
                theta, rate = (kept * new, kept * rate) if new * theta < 0.0 else (new, rate)
            angles[row + 1] = theta
        return angles

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, and why they cannot be compared."""
        t, angle, alpha = history["t"], history[self.theta], math.atan(self.width / self.height)
        ground = np.array([history[self.acceleration], self.gravity + history[self.vertical]])
        start = float(angle[0]) if abs(angle[0]) > ROUNDED * alpha else 0.0
        rigid = self.rocking(t, ground, start)
        both = (
            float(np.abs(one).max()) if self.of == "angle" else landing(t, one)
            for one in (rigid, angle)
        )
        expected, found = both
        why = (
            ""
            if self.width < math.sqrt(2.0) * self.height
            else "the first impact stops a block as wide as this"
        )
        why = why or ("" if ground[1].min() > 0.0 else "the ground falls away below the block")
        why = why or (
            ""
            if rigid.any()
            else f"{self.acceleration} stays below (g + a_y) b/h: the block does not rock"
        )
        why = why or ("" if np.abs(rigid).max() < alpha else "the rigid block overturns")
        why = why or ("the rigid block does not land in this time" if math.isnan(expected) else "")
        return expected, found, why, {"alpha": (alpha, "rad"), "theta0": (start, "rad")}


def landing(t: Array, theta: Array) -> float:
    """Return the time [s] from the first row until the angle is zero.

    That holds once it was above 1e-3 of its largest; the time is nan if it never is.
    """
    start = int(np.argmax(np.abs(theta) > 1e-3 * np.abs(theta).max()))
    row = start + int(np.argmax(theta[start:] * theta[start] <= 0.0))
    share = theta[row] / (theta[row] - theta[row - 1]) if row > start else math.nan
    return float(t[row] - share * (t[row] - t[row - 1]) - t[0])
