"""Expect how far the ground shears a buried box.

The box is a thin frame that neither slips nor opens (Wang 1993).
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ....core.quantities import Positive, Unit
from .comparison import Check, Formula, History, Length, Numbers, Poisson

# ends of Wang's curves: F, and depth of the centre over the height of the box
LARGEST, SHALLOWEST = (10.0, 1.5)


def flexibility(
    shear_modulus: float, width: float, height: float, wall: float, roof: float, invert: float
) -> float:
    """Return F = G W/(S H) [-] of a box.

    It is 0 if the box is rigid. S is the force at its roof for a unit racking; E I is in [N m²/m].
    """
    a1, a2 = roof / invert, roof * height / (wall * width)
    psi = (3.0 * a2**2 + 2.0 * (1.0 + a1) * a2 + a1) / (1.0 + a1 + 6.0 * a2)
    return shear_modulus * height * width**2 / (12.0 * roof) * psi


def racking_ratio(flexible: float, nu: float) -> float:
    """Return R for F and the ground's nu: 0 (rigid) to 4 (1 - nu) (a hole)."""
    return 4.0 * (1.0 - nu) * flexible / (3.0 - 4.0 * nu + flexible)


Stiffness = Annotated[float, Positive, Unit("N m²/m")]


@dataclass(frozen=True, kw_only=True)
class RackingRatio(Check):
    """Expect the racking of a box over that of the free field, both recorded by ``Racking``.

    width, height: of the frame's centre lines; wall, roof, invert: bending stiffness per metre
    E I, E/(1 - nu²) for E in plane strain; shear_modulus, nu: of the ground; depth:
    of the box's centre; box, free: labels of the box and of four points of the ground far away,
    at the same depths. It applies up to F = 10, from 1.5 H down.
    """

    formula: ClassVar[Formula] = Formula(
        text="R = 4 (1-ν) F/(3-4ν+F), F = G H W²/(12 EI_roof) ψ(EI, H/W)",
        source="Wang 1993; Penzien 2000",
        range="F up to 10; centre at 1.5 heights or deeper; neither slip nor opening",
        fields=("width", "height", "wall", "roof", "invert", "shear_modulus", "nu", "depth"),
        reads=("racking_{box}", "racking_{free}"),
        answers={"": "-"},
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
        shear = [history[f"racking_{one}"] for one in (self.box, self.free)]
        box, free = (float(np.abs(one - one[0]).max()) for one in shear)
        ratio = flexibility(
            self.shear_modulus, self.width, self.height, self.wall, self.roof, self.invert
        )
        why = (
            f"F is {ratio:.4g}, beyond {LARGEST:g}, where the curves end" if ratio > LARGEST else ""
        )
        if self.depth < SHALLOWEST * self.height:
            why = (
                f"the box lies {self.depth / self.height:.3g} of its heights deep, less than "
                f"{SHALLOWEST:g}"
            )
        why = why if free else "the free field does not shear"
        return (
            racking_ratio(ratio, self.nu),
            box / free if free else float("nan"),
            why,
            {"F": (ratio, "-")},
        )
