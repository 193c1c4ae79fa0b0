"""Tell how far the ground shears a buried frame: flexibility and racking ratio (Wang 1993, Penzien 2000).

    F = G W/(S H),     R = gamma_frame/gamma_soil = 4 (1-nu) F/(3 - 4 nu + F)

G [Pa] and nu are those of the soil, W [m] the width and H [m] the height of the frame, S [N/m per m] the force at its
roof for a unit racking displacement. Frames are of thin members with bending stiffness E I [N m²/m], in plane strain
E/(1-nu²) for E. R is of a frame in the full space without slip at its faces; finite elements are up to 15 % off.
"""

from __future__ import annotations

from dataclasses import dataclass

from vi_contact.core.checks import attributes
from vi_contact.core.errors import InputError


@dataclass(frozen=True)
class BoxFrame:
    """Describe a closed box of one cell. width, height [m]; E I of walls, roof and invert [N m²/m]; all positive."""

    width: float
    height: float
    wall: float
    roof: float
    invert: float

    def __post_init__(self) -> None:
        attributes(self, positive=("width", "height", "wall", "roof", "invert"))

    def flexibility(self, shear_modulus: float) -> float:
        """Return F = G H W²/(12 E I_roof) psi, psi = [3 a2² + 2 (1 + a1) a2 + a1]/(1 + a1 + 6 a2);
        a1 = I_roof/I_invert, a2 = I_roof H/(I_wall W)."""
        a1, a2 = self.roof / self.invert, self.roof * self.height / (self.wall * self.width)
        psi = (3.0 * a2**2 + 2.0 * (1.0 + a1) * a2 + a1) / (1.0 + a1 + 6.0 * a2)
        return shear_modulus * self.height * self.width**2 / (12.0 * self.roof) * psi


def racking_ratio(flexibility: float, nu: float) -> float:
    """Return R of a box in soil of Poisson's ratio nu, 0 (rigid) to 4 (1 - nu) (a hole).

    InputError for a negative flexibility or nu outside [0, 1/2].
    """
    if not flexibility >= 0.0 or not 0.0 <= nu <= 0.5:
        raise InputError(f"racking_ratio: flexibility {flexibility!r} and nu {nu!r}; give F >= 0 and nu from 0 to 0.5")
    return 4.0 * (1.0 - nu) * flexibility / (3.0 - 4.0 * nu + flexibility)
