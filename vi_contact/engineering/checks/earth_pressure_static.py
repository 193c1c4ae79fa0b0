"""Expect the pressure of resting soil on a wall: at rest, and of yielding soil after Rankine and Coulomb.

With the coefficient K of each theory the soil presses by P = K (rho g H²/2 + q H) on a metre of a wall of height H, and
N is the part of P along the normal of the wall. phi: friction angle of the soil; delta: between soil and wall; slope:
of the ground, rising from the wall; batter: of the back of the wall from the vertical, positive where soil rests on it.
An elastic soil does not yield: its pressure is that at rest, and active and passive ones are bounds beside it.
"""

import math
from dataclasses import dataclass

from ...core.algebra import Array
from ...core.checks import attributes, between, check_word, column_name, flag
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from .comparison import Check, History, Inputs, Numbers

SOIL = {"height": "m", "rho": "kg/m³", "surcharge": "Pa", "gravity": "m/s²"}


def wedge(phi: float, delta: float, slope: float, batter: float, *, psi: float = 0.0, passive: bool = False) -> float:
    """Return K of the worst plane wedge, active or passive, under gravity turned by psi; nan where none is at rest.

    K = cos²(phi -+ batter - psi) / (cos psi cos² batter cos(delta +- batter + psi) (1 +- root)²),
    root² = sin(phi + delta) sin(phi -+ slope - psi) / (cos(delta +- batter + psi) cos(slope - batter));
    upper signs active, lower ones passive. Coulomb 1776; psi: Okabe 1924, Mononobe and Matsuo 1929. Angles [rad].
    """
    sign = -1.0 if passive else 1.0
    lean, open_ = math.cos(delta + sign * batter + psi), phi - sign * slope - psi
    if open_ < 0.0 or lean <= 0.0 or math.cos(slope - batter) <= 0.0:
        return math.nan
    root = 1.0 + sign * math.sqrt(math.sin(phi + delta) * math.sin(open_) / (lean * math.cos(slope - batter)))
    top = math.cos(phi - sign * batter - psi) ** 2
    return top / (math.cos(psi) * math.cos(batter) ** 2 * lean * root**2) if root > 0.0 else math.nan


@dataclass(frozen=True, kw_only=True)
class EarthPressure(Check):
    """Hold what all theories of a wall need: its height [m], the soil's density [kg/m³], and what is compared.

    part: of the contact, whose ``Resultants`` with their centre at the foot of the wall record N_<part>, height_<part>,
    uplift_<part>; of: "thrust", N [N/m], or "height", of its line of action above the foot [m]; surcharge: q [Pa];
    width: of the model across its plane [m]. InputError out of range, for angles beyond a right one.
    """

    height: float
    rho: float
    part: str = "wall"
    of: str = "thrust"
    surcharge: float = 0.0
    gravity: float = STANDARD_GRAVITY
    width: float = 1.0

    def __post_init__(self) -> None:
        name = type(self).__name__
        attributes(self, positive=("height", "rho", "gravity", "width"), not_negative=("surcharge",))
        column_name(f"{name}: part", self.part)
        check_word(f"{name}: of", self.of, ("thrust", "height"))
        if hasattr(self, "passive"):
            flag(name, "passive", self.passive)
        for angle in [one for one in ("phi", "delta", "slope", "batter") if getattr(self, one, None) is not None]:
            between(f"{name}: {angle}", getattr(self, angle), 0.0 if angle in ("phi", "delta") else -0.5 * math.pi,
                    0.5 * math.pi, "give an angle in radians below a right one, 30 degrees are 0.5236")

    @property
    def unit(self) -> str:  # type: ignore[override]
        return "N/m" if self.of == "thrust" else "m"

    @property
    def columns(self) -> tuple[str, ...]:  # type: ignore[override]
        return (f"N_{self.part}", f"height_{self.part}")[: 1 if self.of == "thrust" else 2]

    def coefficient(self, history: History) -> tuple[float, str, Inputs]:
        """Return the K of N, why there is none, and the inputs taken from the run."""
        raise NotImplementedError

    def row(self, thrust: Array) -> int:
        """Return the row to compare with: the first, the state of rest before any motion."""
        return 0

    def numbers(self, history: History) -> Numbers:
        """Compare N, or its height: that of rho g H²/2 at H/3 and of q H at H/2."""
        factor, why, inputs = self.coefficient(history)
        own, extra = 0.5 * self.rho * self.gravity * self.height**2, self.surcharge * self.height
        thrust, row = history[self.columns[0]], self.row(history[self.columns[0]])
        if self.of == "thrust":
            return Numbers(factor * (own + extra), float(thrust[row]) / self.width, why, inputs)
        arm = self.height * (own / 3.0 + extra / 2.0) / (own + extra)
        return Numbers(arm, float(history[self.columns[1]][row]), why, inputs)


@dataclass(frozen=True, kw_only=True)
class AtRest(EarthPressure):
    """Expect the thrust of soil that cannot give way sideways: K0 of an elastic layer, or Jaky's of sand.

    nu: Poisson's ratio of the elastic soil; phi: in its place, the friction angle of a sand; InputError for both or
    neither. It is the theory to compare an elastic soil with, on a smooth wall that does not move.
    """

    formula = "N = K0 (ρ g H²/2 + q H), K0 = ν/(1-ν) elastic, or 1 - sin φ"
    source = "plane strain without lateral strain; Jaky 1944"
    units = SOIL | {"nu": "-", "phi": "rad"}
    nu: float | None = None
    phi: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.nu is None) == (self.phi is None):
            raise InputError("AtRest: give nu, of an elastic soil, or phi, of a sand, and not both")
        between("AtRest: nu", self.nu or 0.0, 0.0, 0.5, "give a Poisson's ratio from 0 to 0.5")

    def coefficient(self, history: History) -> tuple[float, str, Inputs]:
        return self.nu / (1.0 - self.nu) if self.nu is not None else 1.0 - math.sin(self.phi or 0.0), "", {}


@dataclass(frozen=True, kw_only=True)
class Rankine(EarthPressure):
    """Expect the thrust of soil in active, or passive, failure throughout, on a vertical wall.

    phi, slope [rad]: P is parallel to the ground, N = P cos(slope). It applies up to slope = phi.
    """

    formula = "N = K (ρ g H²/2 + q H), K = cos²β (cos β ∓ s)/(cos β ± s), s² = cos²β - cos²φ"
    source = "Rankine 1857"
    units = SOIL | {"phi": "rad", "slope": "rad"}
    phi: float
    slope: float = 0.0
    passive: bool = False

    def coefficient(self, history: History) -> tuple[float, str, Inputs]:
        if abs(self.slope) > self.phi:
            return math.nan, "the ground is steeper than the friction angle of the soil", {}
        ground = math.cos(self.slope)
        root = math.sqrt(max(ground**2 - math.cos(self.phi) ** 2, 0.0)) * (-1.0 if self.passive else 1.0)
        return ground**2 * (ground - root) / (ground + root), "", {}


@dataclass(frozen=True, kw_only=True)
class Coulomb(EarthPressure):
    """Expect the thrust of a plane wedge of soil that slides on the wall and on the ground below it: ``wedge``.

    phi, delta, slope, batter [rad]; N = P cos(delta). It applies for delta <= phi, passive: delta <= phi/2 (beyond it
    surfaces that are curved slide at less).
    """

    formula = "N = K cos δ (ρ g H²/2 + q H), K(φ, δ, slope, batter) of the worst plane wedge"
    source = "Coulomb 1776"
    units = SOIL | {"phi": "rad", "delta": "rad", "slope": "rad", "batter": "rad"}
    phi: float
    delta: float = 0.0
    slope: float = 0.0
    batter: float = 0.0
    passive: bool = False

    def coefficient(self, history: History) -> tuple[float, str, Inputs]:
        most = 0.5 * self.phi if self.passive else self.phi
        found = wedge(self.phi, self.delta, self.slope, self.batter, passive=self.passive) * math.cos(self.delta)
        why = "no wedge is at rest at these angles: the ground is too steep" if math.isnan(found) else ""
        return found, f"delta is above {most:.4g}: no plane wedge is the worst" if self.delta > most else why, {}
