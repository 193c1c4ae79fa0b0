"""Expect how far a rigid block slides on a plane that is shaken and rocks on rigid ground.

Sliding is after Newmark, Géotechnique 15, 1965; rocking is after Housner, Bull. Seism. Soc. Am. 53,
1963.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from ....core.algebra import Array
from ....core.quantities import RATIO, Between, Positive, Unit
from ....core.units import STANDARD_GRAVITY
from .comparison import NO_JUDGEMENT, Check, Formula, Gravity, History, Incline, Length, Numbers
from .model_facts import ModelFacts, tell_contradiction
from .rigid_slip import slide

# CHOSEN: share of alpha below which the first tilt is round-off of a block that stands.
ROUNDED = 1e-9
# CHOSEN: longest step of the rigid block, over 1/p. Its angles are those of shorter steps to 0.1 %.
FINE = 2e-4
MOST_PARTS = 400  # of a step of the run, for a block of any size


@dataclass(frozen=True, kw_only=True)
class NewmarkBlock(Check):
    """Expect the displacement that is left after a motion.

    It applies while the block stays on the plane, and where it stands without motion.

    Attributes:
        mu: friction, or in its place the yield acceleration over g of a level plane; None: that of
            the run, see ``settle``.
        slope: angle by which the plane falls towards +x.
        one_sided: whether the block slides to one side only, as a wall before its fill does.
        towards: whose sign is this side along x; 0: down the plane, +x if it is level.
        gravity: g.
        slip: column of the displacement on the plane, signed.
        acceleration: column of the ground's acceleration along x.
        vertical: column of the ground's acceleration upwards.
        part: of the contact, on which the block slides; "": that of the column sliding_<part>.
        weight: of what slides; None: that of ``body``, or else the normal force of the first row.
        body: name of what slides, among the bodies of the model.
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
        reading=(
            f"{NO_JUDGEMENT}: below 1 the run slides less than the rigid block, and the formula is "
            "the safer one; above 1 the formula is unsafe"
        ),
    )

    mu: Annotated[float, Positive, RATIO] | None = None
    slope: Incline = 0.0
    one_sided: bool = False
    towards: Annotated[float, Between(-1.0, 1.0), RATIO] = 0.0
    gravity: Gravity = STANDARD_GRAVITY
    slip: str = "sliding_base"
    acceleration: str = "a_g_x"
    vertical: str = "a_g_y"
    part: str = ""
    weight: Annotated[float, Positive, Unit("N")] | None = None
    body: str = ""

    def settle(self, history: History, facts: ModelFacts) -> tuple[Self, list[str]]:
        """Return the check with mu of the run, and sentences about mu and the weight.

        A block that slides to both sides has the friction mu of its part. One that slides to one
        side, on level ground, is a wall before its fill, which pushes it with T, the tangential
        force of the first row. It yields under

            k_y = (mu N - |T|)/W,    N the normal force of the first row, W the weight

        which is mu of a block that nothing pushes.
        """
        part = self.part or self.slip.removeprefix("sliding_")
        mu = facts.find_mu(part)
        weight, notes = self._find_weight(history, facts, part)
        name = "mu"
        source = f"the friction of '{part}'"
        has_forces = f"N_{part}" in history and f"T_{part}" in history
        if self.one_sided and self.slope == 0.0 and mu is not None and weight and has_forces:
            normal = float(history[f"N_{part}"][0])
            push = abs(float(history[f"T_{part}"][0]))
            name = "mu (the yield coefficient)"
            source = (
                f"(mu N - |T|)/W of the first row, mu = {mu:.4g}, N = {1e-3 * normal:.5g} kN, "
                f"T = {1e-3 * push:.5g} kN, W = {1e-3 * weight:.5g} kN"
            )
            mu = (mu * normal - push) / weight
        if self.mu is not None:
            told = tell_contradiction(name, self.mu, mu, "", source) if mu is not None else []
            return self, notes + told
        if mu is None or mu <= 0.0:
            return self, notes
        return replace(self, mu=mu), [*notes, f"{name} is that of the run: {source}"]

    def _find_weight(
        self, history: History, facts: ModelFacts, part: str
    ) -> tuple[float | None, list[str]]:
        """Return the weight of what slides [N], None if it is not known, and sentences about it.

        Args:
            history: of the run.
            facts: of its model.
            part: of the contact.
        """
        of_run = None
        source = f"N_{part} of the first row"
        if f"N_{part}" in history:
            of_run = float(history[f"N_{part}"][0])
        if self.body:
            if self.body not in facts.masses:
                names = ", ".join(facts.masses) or "none"
                return self.weight, [f"the model has no body '{self.body}', it has {names}"]
            of_run = facts.masses[self.body] * self.gravity
            source = f"mass of '{self.body}' times g"
        if self.weight is None:
            return of_run, []
        if of_run is None:
            return self.weight, []
        return self.weight, tell_contradiction("weight", self.weight, of_run, " N", source)

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, and why they cannot be compared."""
        along = history[self.acceleration]
        up = history[self.vertical] + self.gravity
        slip = history[self.slip]
        found = float(abs(slip[-1] - slip[0]))

        # Accelerations normal to the plane, and down it.
        sine = math.sin(self.slope)
        cosine = math.cos(self.slope)
        normal = up * cosine + along * sine
        drive = up * sine - along * cosine

        why = ""
        if self.mu is None:
            why = "the run does not tell a friction above zero that is left: give mu"
            return Numbers(math.nan, found, why)
        if not along.any():
            why = f"the column {self.acceleration} is zero: name acceleration= that of the ground"
        if normal.min() < 0.0:
            why = "the ground falls away below the block"
        if abs(sine) > self.mu * cosine:
            why = "the block slides under its weight: |slope| is above atan(mu)"
        side = math.copysign(1.0, self.towards or self.slope or 1.0)
        resist = self.mu * np.maximum(normal, 0.0)
        displacement = slide(history["t"], side * drive, resist, one_sided=self.one_sided)
        peak = float(np.abs(along).max())
        return Numbers(abs(float(displacement[-1])), found, why, {"a": (peak, "m/s²")})


@dataclass(frozen=True, kw_only=True)
class Housner(Check):
    """Expect the largest angle of a uniform block, or the time of its first impact.

    It applies to blocks that rock and do not overturn, slide or bounce. One history in a long
    motion is chaotic: compare many, or the first impacts.

    Attributes:
        width: of the block.
        height: of the block.
        of: "angle" [rad] or "impact" [s] after the first row.
        gravity: g.
        theta: column of the angle, anticlockwise positive, whose first row is the start, at rest.
        acceleration: column of the ground's acceleration along x.
        vertical: column of the ground's acceleration upwards.
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
        reading=(
            f"{NO_JUDGEMENT}: an angle above 1 is one that the rigid block does not reach, so that "
            "the formula is unsafe there"
        ),
    )

    width: Length
    height: Length
    of: str = "angle"
    gravity: Gravity = STANDARD_GRAVITY
    theta: str = "theta_base"
    acceleration: str = "a_g_x"
    vertical: str = "a_g_y"

    def rock(self, t: Array, ground: Array, theta: float) -> Array:
        """Return the angle [rad] of the rigid block at all times; beyond alpha it stays.

        Args:
            t: (n,), rising [s].
            ground: (2, n), a_x and g + a_y, linear between the times [m/s²].
            theta: angle of the start, from rest [rad].
        """
        alpha = math.atan(self.width / self.height)
        angles = np.full(len(t), theta)
        rate = 0.0
        inertia = 1.5 / math.hypot(self.width, self.height)  # p²/g of the formula
        restitution = 1.0 - 1.5 * math.sin(alpha) ** 2
        for row, length in enumerate(np.diff(t)):
            # A block that needs more parts than MOST_PARTS is of a size that none has.
            parts = min(math.ceil(length * math.sqrt(inertia * self.gravity) / FINE), MOST_PARTS)
            share = (np.arange(parts) + 0.5) / parts
            middles = ground[:, row, None] + np.diff(ground[:, row : row + 2]) * share
            for push, pull in middles.T.tolist():
                # About which foot it leans, and the angle from there to overturning.
                lean = math.copysign(1.0, theta or rate or push)
                reserve = alpha - abs(theta)
                acceleration = inertia * (
                    push * math.cos(reserve) - lean * pull * math.sin(reserve)
                )
                stands = theta == rate == 0.0 and acceleration * lean <= 0.0
                if stands or reserve < 0.0:
                    continue

                # Symplectic Euler; an impact within the part takes its share of angle and rate.
                rate += length / parts * acceleration
                new_theta = theta + length / parts * rate
                if new_theta * theta < 0.0:
                    theta = restitution * new_theta
                    rate = restitution * rate
                else:
                    theta = new_theta
            angles[row + 1] = theta
        return angles

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, why they cannot be compared, alpha and the angle of the start."""
        t = history["t"]
        angle = history[self.theta]
        alpha = math.atan(self.width / self.height)
        ground = np.array([history[self.acceleration], self.gravity + history[self.vertical]])
        start = float(angle[0]) if abs(angle[0]) > ROUNDED * alpha else 0.0
        rigid = self.rock(t, ground, start)
        if self.of == "angle":
            expected = float(np.abs(rigid).max())
            found = float(np.abs(angle).max())
        else:
            expected = find_impact(t, rigid)
            found = find_impact(t, angle)

        why = ""
        if not self.width < math.sqrt(2.0) * self.height:
            why = "the first impact stops a block as wide as this"
        elif not ground[1].min() > 0.0:
            why = "the ground falls away below the block"
        elif not rigid.any():
            why = f"{self.acceleration} stays below (g + a_y) b/h: the block does not rock"
        elif not np.abs(rigid).max() < alpha:
            why = "the rigid block overturns"
        elif math.isnan(expected):
            why = "the rigid block does not land in this time"
        return Numbers(expected, found, why, {"alpha": (alpha, "rad"), "theta0": (start, "rad")})


def find_impact(t: Array, theta: Array) -> float:
    """Return the time [s] from the first row until the angle is zero, or nan if it never is.

    Angles before it first exceeds 1e-3 of its largest do not count.
    """
    start = int(np.argmax(np.abs(theta) > 1e-3 * np.abs(theta).max()))
    row = start + int(np.argmax(theta[start:] * theta[start] <= 0.0))
    share = theta[row] / (theta[row] - theta[row - 1]) if row > start else math.nan
    return float(t[row] - share * (t[row] - t[row - 1]) - t[0])
