"""Expect the pressure of resting soil on a wall.

It is that of soil at rest, and of yielding soil after Rankine and Coulomb.

N is the force along the normal of a metre of wall. phi: friction angle of the soil; delta: between
soil and wall; slope: of the ground, rising from the wall; batter: of its back from the vertical,
positive where soil rests on it. An elastic soil does not yield: its pressure is that at rest, and
active and passive ones are bounds beside it.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from ....core.algebra import Array
from ....core.quantities import NotNegative, Unit
from ....core.units import STANDARD_GRAVITY
from .comparison import (
    NO_JUDGEMENT,
    Check,
    Comparison,
    Density,
    Formula,
    Friction,
    Gravity,
    History,
    Incline,
    Length,
    Numbers,
    Poisson,
)
from .model_facts import SLACK, ModelFacts, tell_contradiction


def wedge(
    phi: float,
    delta: float,
    slope: float,
    batter: float,
    *,
    psi: float = 0.0,
    passive: bool = False,
) -> float:
    """Return K of the worst plane wedge, nan where none is at rest.

    K = cos²(phi -+ batter - psi) / (cos psi cos² batter cos(delta +- batter + psi) (1 +- root)²),
    root² = sin(phi + delta) sin(phi -+ slope - psi) / (cos(delta +- batter + psi) cos(slope -
    batter)); upper signs active, lower ones passive. Coulomb 1776; psi: Okabe 1924, Mononobe and
    Matsuo 1929.

    Args:
        phi: friction angle of the soil [rad].
        delta: friction angle between soil and wall [rad].
        slope: of the ground, rising from the wall [rad].
        batter: of the wall's back from the vertical, positive where soil rests on it [rad].
        psi: angle by which gravity is turned [rad].
        passive: whether the wall is pushed into the soil.
    """
    sign = -1.0 if passive else 1.0
    lean = math.cos(delta + sign * batter + psi)
    spare = phi - sign * slope - psi  # angle by which the ground could still be steeper
    if spare < 0.0 or lean <= 0.0 or math.cos(slope - batter) <= 0.0:
        return math.nan
    root = 1.0 + sign * math.sqrt(
        math.sin(phi + delta) * math.sin(spare) / (lean * math.cos(slope - batter))
    )
    if not root > 0.0:
        return math.nan
    top = math.cos(phi - sign * batter - psi) ** 2
    return top / (math.cos(psi) * math.cos(batter) ** 2 * lean * root**2)


WALL_FIELDS = ("height", "rho", "surcharge", "gravity", "width")
WALL_COLUMNS = ("N_{part}", "height_{part}")
WALL_ANSWERS = {"thrust": "N/m", "moment": "N m/m", "height": "m"}
YIELDED = (
    f"{NO_JUDGEMENT}: below 1 the run presses less than yielding soil, which is unsafe; above 1 it "
    "presses more, as elastic soil does"
)
PUSHED_UP = (
    f"{NO_JUDGEMENT}: above 1 the run presses more than soil bears before it is pushed up, which "
    "is unsafe"
)


@dataclass(frozen=True, kw_only=True)
class EarthPressure(Check):
    """Hold what all theories of a wall need.

    Attributes:
        height: of the wall.
        rho: density of the soil.
        part: of the contact, whose ``Resultants`` with their centre at the foot of the wall record
            N_<part>, height_<part>, uplift_<part>.
        of: "thrust", N [N/m] per metre of wall; "moment", N times its height above the foot
            [N m/m]; or "height", of its line of action above the foot [m].
        surcharge: q, on a horizontal metre of ground.
        gravity: g.
        width: of the model across its plane, of a slice its thickness.
    """

    # Whether the largest thrust of the run is compared, or that of the first row, the one of rest.
    largest: ClassVar[bool] = False

    height: Length
    rho: Density
    part: str = "wall"
    of: str = "thrust"
    surcharge: Annotated[float, NotNegative, Unit("Pa")] = 0.0
    gravity: Gravity = STANDARD_GRAVITY
    width: Length = 1.0

    def coefficient(self) -> tuple[float, str]:
        """Return the K of N, and why it does not apply, or ""."""
        raise NotImplementedError

    def settle(self, history: History, facts: ModelFacts) -> tuple[Self, list[str]]:
        """Return the check, and a sentence for a density that no body of the run has."""
        densities = facts.densities.values()
        if not densities or any(
            not tell_contradiction("rho", self.rho, density, "", "") for density in densities
        ):
            return self, []
        texts = ", ".join(f"{name} {density:.4g}" for name, density in facts.densities.items())
        return self, [f"you gave rho = {self.rho:.4g} kg/m³, the bodies of the run have {texts}"]

    def compare_all(
        self, history: History, facts: ModelFacts | None = None
    ) -> tuple[Comparison, ...]:
        """Return the comparison of the thrust and that of its moment; of one, if one is asked for.

        What both would say is said with the thrust; where the formula does not apply it is all.
        """
        first = self.compare(history, facts)
        if self.of != "thrust" or first.applies:
            return (first,)
        second = replace(self, of="moment").compare(history, facts)
        return first, replace(
            second, notes=tuple(note for note in second.notes if note not in first.notes)
        )

    @property
    def reading(self) -> str:
        """Return what the ratio means: of passive pressure the other side is unsafe."""
        return PUSHED_UP if getattr(self, "passive", False) else self.formula.reading

    @property
    def laden(self) -> float:
        """Return by what q counts on the ground of a wedge, longer or shorter than its height."""
        slope = getattr(self, "slope", 0.0)
        batter = getattr(self, "batter", 0.0)
        return math.cos(batter) * math.cos(slope) / math.cos(slope - batter)

    def expect(self) -> tuple[float, float, str]:
        """Return N [N/m], its height above the foot [m], and why the theory does not apply, or "".

        The height is that of rho g H²/2 at H/3 and of q H, times ``laden``, at H/2.
        """
        factor, why = self.coefficient()
        weight = 0.5 * self.rho * self.gravity * self.height**2
        load = self.laden * self.surcharge * self.height
        arm = self.height * (weight / 3.0 + load / 2.0) / (weight + load)
        return factor * (weight + load), arm, why

    def find_pressure(self, heights: Array) -> Array:
        """Return the normal pressure K (rho g z + q laden) [Pa], z the depth, at heights (n,) [m].

        Heights count from the foot of the wall; above its top there is no pressure.
        """
        depth = self.height - heights
        pressure = self.coefficient()[0] * (
            self.rho * self.gravity * depth + self.laden * self.surcharge
        )
        return np.where(depth >= 0.0, pressure, 0.0)

    def numbers(self, history: History) -> Numbers:
        """Compare N, its moment about the foot, or its height."""
        expected, arm, why = self.expect()

        # What the run has: the row of the largest value, or that of rest.
        thrust = history[f"N_{self.part}"] / self.width
        height = history[f"height_{self.part}"]
        values = thrust * np.nan_to_num(height) if self.of == "moment" else thrust
        row = int(np.argmax(values)) if self.largest else 0
        if self.of == "height":
            return Numbers(arm, float(height[row]), why)
        expected *= arm if self.of == "moment" else 1.0
        found = float(values[row])
        peak = values if self.largest and found > 0.0 else None
        notes = () if why else self.judge(found / expected)
        return Numbers(expected, found, why, peak=peak, notes=notes)

    def judge(self, ratio: float) -> tuple[str, ...]:
        """Return what a ratio of found to expected says beyond the reading; nothing as a rule."""
        return ()


def judge_active(of: str, ratio: float) -> tuple[str, ...]:
    """Return a sentence where the run at rest presses less than yielding soil.

    Args:
        of: "thrust" or "moment".
        ratio: found over expected.
    """
    if ratio >= 1.0 - SLACK:
        return ()
    return (
        f"at rest the {of} of the run is {ratio:.2f} of the active one, so a design by the run is "
        "unsafe: fill that is one elastic body, placed in one lift, presses too little",
    )


@dataclass(frozen=True, kw_only=True)
class AtRest(EarthPressure):
    """Give the thrust of an elastic layer that cannot give way sideways.

    An elastic soil is compared with it.

    nu: Poisson's ratio. The wall is smooth and does not move; for sand, nu of K0 = 1 - sin(phi) is
    K0/(1 + K0).
    """

    formula: ClassVar[Formula] = Formula(
        text="N = K0 (ρ g H²/2 + q H), K0 = ν/(1-ν)",
        source="plane strain without lateral strain",
        range="an elastic layer on a smooth wall that does not move",
        fields=(*WALL_FIELDS, "nu"),
        reads=WALL_COLUMNS,
        answers=WALL_ANSWERS,
        reading=(
            f"{NO_JUDGEMENT}: below 1 the run presses less than soil at rest, which is unsafe for "
            "a wall that does not give way"
        ),
    )

    nu: Poisson

    def coefficient(self) -> tuple[float, str]:
        """Return K = K0, which always applies."""
        return self.nu / (1.0 - self.nu), ""


@dataclass(frozen=True, kw_only=True)
class Rankine(EarthPressure):
    """Expect the thrust of soil in active, or passive, failure throughout.

    It acts on a vertical wall, parallel to the ground.

    phi, slope [rad]. It applies up to slope = phi: steeper ground does not stand.
    """

    formula: ClassVar[Formula] = Formula(
        text="N = K (ρ g H²/2 + q H), K = cos²β (cos β ∓ s)/(cos β ± s), s² = cos²β - cos²φ",
        source="Rankine 1857",
        range="β up to φ; soil that yields",
        fields=(*WALL_FIELDS, "phi", "slope"),
        reads=WALL_COLUMNS,
        answers=WALL_ANSWERS,
        reading=YIELDED,
    )

    phi: Friction
    slope: Incline = 0.0
    passive: bool = False

    def coefficient(self) -> tuple[float, str]:
        """Return K, and why it does not apply, or ""."""
        # Rankine's thrust is that of Coulomb's wedge on a wall whose friction is along the ground.
        # In passive failure the soil slides up: the same lines, friction turned round.
        delta = -self.slope if self.passive else self.slope
        K = wedge(self.phi, delta, self.slope, 0.0, passive=self.passive) * math.cos(self.slope)
        why = ""
        if abs(self.slope) > self.phi:
            why = "the ground is steeper than the friction angle"
        return K, why

    def judge(self, ratio: float) -> tuple[str, ...]:
        """Tell of a run that presses less than the active pressure."""
        return () if self.passive else judge_active(self.of, ratio)


@dataclass(frozen=True, kw_only=True)
class CoulombWedge(EarthPressure):
    """Expect the thrust of a plane wedge of soil.

    The wedge slides on the wall and on the ground below it.

    phi, delta, slope, batter [rad]; N = P cos(delta). A delta of None is that of the run: atan(mu)
    of the part, no more than the wedge takes, and 0 where the run does not tell mu. The check
    applies for delta <= phi, passive: delta <= phi/2 (beyond it surfaces that are curved slide at
    less), ground up to phi, and phi -+ slope - psi >= 0.
    """

    formula: ClassVar[Formula] = Formula(
        text=(
            "N = K cos δ (ρ g H²/2 + q H cos ι cos β/cos(β-ι)), K(φ, δ, slope β, batter ι) "
            "of the worst plane wedge"
        ),
        source="Coulomb 1776",
        range="δ up to φ, passive up to φ/2; ground up to φ; soil that yields",
        fields=(*WALL_FIELDS, "phi", "delta", "slope", "batter"),
        reads=WALL_COLUMNS,
        answers=WALL_ANSWERS,
        reading=YIELDED,
    )

    phi: Friction
    delta: Friction | None = None
    slope: Incline = 0.0
    batter: Incline = 0.0
    passive: bool = False

    @property
    def largest_delta(self) -> float:
        """Return the largest delta [rad] for which a plane wedge is the worst."""
        return 0.5 * self.phi if self.passive else self.phi

    def settle(self, history: History, facts: ModelFacts) -> tuple[Self, list[str]]:
        """Return the check with the friction of the wall, and sentences about it."""
        _, notes = super().settle(history, facts)
        mu = facts.find_mu(self.part)
        angle = 0.0 if mu is None else math.atan(mu)
        if self.delta is not None:
            if mu is not None:
                source = f"atan(mu) of '{self.part}', mu = {mu:.4g}"
                notes = notes + tell_contradiction("delta", self.delta, angle, " rad", source)
            return self, notes
        delta = min(angle, self.largest_delta)
        if mu:
            most = f", at most {delta:.4g}" if delta < angle else ""
            notes = [*notes, f"delta is that of the run: atan(mu) of '{self.part}'{most}"]
        return replace(self, delta=delta), notes

    def coefficient(self, psi: float = 0.0) -> tuple[float, str]:
        """Return K under gravity turned by psi [rad], and why it does not apply, or ""."""
        delta = self.delta or 0.0
        largest_delta = self.largest_delta
        sign = "+" if self.passive else "-"
        K = wedge(self.phi, delta, self.slope, self.batter, psi=psi, passive=self.passive)
        why = ""
        if abs(self.slope) > self.phi:
            why = "the ground is steeper than phi"
        if math.isnan(K):
            why = f"phi {sign} slope - psi is below zero, psi = {psi:.4g}: no wedge is at rest"
        if delta > largest_delta:
            why = f"delta is above {largest_delta:.4g}: no plane wedge is the worst"
        return K * math.cos(delta), why

    def judge(self, ratio: float) -> tuple[str, ...]:
        """Tell of a run at rest that presses less than the active pressure."""
        return () if self.passive or self.largest else judge_active(self.of, ratio)
