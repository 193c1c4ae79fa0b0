"""Expect the pressure of resting soil on a wall.

It is that of soil at rest, and of yielding soil after Rankine and Coulomb.

N is the force along the normal of a metre of wall. phi: friction angle of the soil; delta: between
soil and wall; slope: of the ground, rising from the wall; batter: of its back from the vertical,
positive where soil rests on it. An elastic soil does not yield: its pressure is that at rest, and
active and passive ones are bounds beside it.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ....core.quantities import NotNegative, Unit
from ....core.units import STANDARD_GRAVITY
from .comparison import (
    Check,
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
WALL_ANSWERS = {"thrust": "N/m", "height": "m"}


@dataclass(frozen=True, kw_only=True)
class EarthPressure(Check):
    """Hold what all theories of a wall need.

    Attributes:
        height: of the wall.
        rho: density of the soil.
        part: of the contact, whose ``Resultants`` with their centre at the foot of the wall record
            N_<part>, height_<part>, uplift_<part>.
        of: "thrust", N [N/m] per metre of wall, or "height", of its line of action above the foot
            [m].
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

    def numbers(self, history: History) -> Numbers:
        """Compare N, or its height.

        The height is that of rho g H²/2 at H/3 and of q H, times ``laden``, at H/2.
        """
        factor, why = self.coefficient()
        slope = getattr(self, "slope", 0.0)
        batter = getattr(self, "batter", 0.0)

        # The load on the ground of a wedge, which is longer or shorter than its height.
        laden = math.cos(batter) * math.cos(slope) / math.cos(slope - batter)
        weight = 0.5 * self.rho * self.gravity * self.height**2
        load = laden * self.surcharge * self.height
        thrust = history[f"N_{self.part}"]
        height = history[f"height_{self.part}"]
        row = int(np.argmax(thrust)) if self.largest else 0
        if self.of == "height":
            expected = self.height * (weight / 3.0 + load / 2.0) / (weight + load)
            return expected, float(height[row]), why, {}
        return factor * (weight + load), float(thrust[row]) / self.width, why, {}


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


@dataclass(frozen=True, kw_only=True)
class CoulombWedge(EarthPressure):
    """Expect the thrust of a plane wedge of soil.

    The wedge slides on the wall and on the ground below it.

    phi, delta, slope, batter [rad]; N = P cos(delta). It applies for delta <= phi, passive: delta
    <= phi/2 (beyond it surfaces that are curved slide at less), ground up to phi, and phi -+ slope
    - psi >= 0.
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
    )

    phi: Friction
    delta: Friction = 0.0
    slope: Incline = 0.0
    batter: Incline = 0.0
    passive: bool = False

    def coefficient(self, psi: float = 0.0) -> tuple[float, str]:
        """Return K under gravity turned by psi [rad], and why it does not apply, or ""."""
        largest_delta = 0.5 * self.phi if self.passive else self.phi
        sign = "+" if self.passive else "-"
        K = wedge(self.phi, self.delta, self.slope, self.batter, psi=psi, passive=self.passive)
        why = ""
        if abs(self.slope) > self.phi:
            why = "the ground is steeper than phi"
        if math.isnan(K):
            why = f"phi {sign} slope - psi is below zero, psi = {psi:.4g}: no wedge is at rest"
        if self.delta > largest_delta:
            why = f"delta is above {largest_delta:.4g}: no plane wedge is the worst"
        return K * math.cos(self.delta), why
