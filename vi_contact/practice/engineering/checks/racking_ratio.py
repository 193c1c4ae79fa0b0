"""Expect how far the ground shears a buried box.

The box is a thin frame that neither slips nor opens (Wang 1993).
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ....core.algebra import Array
from ....core.quantities import Positive, Unit
from .comparison import NO_JUDGEMENT, Check, Formula, History, Length, Numbers, Poisson

# ends of Wang's curves
LARGEST = 10.0  # F
SHALLOWEST = 1.5  # depth of the centre over the height of the box


def flexibility(
    shear_modulus: float, width: float, height: float, wall: float, roof: float, invert: float
) -> float:
    """Return F = G W/(S H) [-] of a box, which is 0 if the box is rigid.

    S is the force at its roof for a unit racking, that of a frame of beams (Wang 1993).

    Args:
        shear_modulus: G of the ground [Pa].
        width: W, of the frame's centre lines [m].
        height: H, likewise [m].
        wall: E I of a wall per metre [N m²/m].
        roof: E I of the roof per metre [N m²/m].
        invert: E I of the invert per metre [N m²/m].
    """
    # Stiffness of the roof beside the invert, and beside the walls.
    a1 = roof / invert
    a2 = roof * height / (wall * width)
    psi = (3.0 * a2**2 + 2.0 * (1.0 + a1) * a2 + a1) / (1.0 + a1 + 6.0 * a2)
    return shear_modulus * height * width**2 / (12.0 * roof) * psi


def racking_ratio(flexible: float, nu: float) -> float:
    """Return R for F and the ground's nu: 0 (rigid) to 4 (1 - nu) (a hole)."""
    return 4.0 * (1.0 - nu) * flexible / (3.0 - 4.0 * nu + flexible)


Stiffness = Annotated[float, Positive, Unit("N m²/m")]


@dataclass(frozen=True, kw_only=True)
class RackingRatio(Check):
    """Expect the racking of a box over that of the free field, both recorded by ``Racking``.

    It applies up to F = 10, and where the centre of the box is 1.5 of its heights deep or deeper.

    Attributes:
        width: of the frame's centre lines.
        height: likewise.
        wall: bending stiffness E I per metre of a wall, with E/(1 - nu²) for E in plane strain.
        roof: that of the roof.
        invert: that of the invert.
        shear_modulus: of the ground.
        nu: Poisson's ratio of the ground.
        depth: of the box's centre.
        box: label of the box.
        free: label of four points of the ground far away, at the same depths.
    """

    formula: ClassVar[Formula] = Formula(
        text="R = 4 (1-ν) F/(3-4ν+F), F = G H W²/(12 EI_roof) ψ(EI, H/W)",
        source="Wang 1993; Penzien 2000",
        range="F up to 10; centre at 1.5 heights or deeper; neither slip nor opening",
        fields=("width", "height", "wall", "roof", "invert", "shear_modulus", "nu", "depth"),
        reads=("racking_{box}", "racking_{free}"),
        answers={"": "-"},
        reading=(
            f"{NO_JUDGEMENT}: above 1 the box of the run racks more than the formula says, which "
            "is unsafe for a design by the formula"
        ),
    )

    width: Length
    height: Length
    wall: Stiffness
    roof: Stiffness
    invert: Stiffness
    shear_modulus: Annotated[float, Positive, Unit("Pa")]
    nu: Poisson
    depth: Length
    box: str = "box"
    free: str = "free_field"

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, and why they cannot be compared."""
        box = _largest_change(history[f"racking_{self.box}"])
        free = _largest_change(history[f"racking_{self.free}"])
        ratio = flexibility(
            self.shear_modulus, self.width, self.height, self.wall, self.roof, self.invert
        )
        why = ""
        if ratio > LARGEST:
            why = f"F is {ratio:.4g}, beyond {LARGEST:g}, where the curves end"
        if self.depth < SHALLOWEST * self.height:
            why = (
                f"the box lies {self.depth / self.height:.3g} of its heights deep, less than "
                f"{SHALLOWEST:g}"
            )
        if not free:
            why = "the free field does not shear"
        found = box / free if free else float("nan")
        return Numbers(racking_ratio(ratio, self.nu), found, why, {"F": (ratio, "-")})


def _largest_change(values: Array) -> float:
    """Return the largest distance of values from the first one."""
    return float(np.abs(values - values[0]).max())
