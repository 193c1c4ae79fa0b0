"""The usual formulas of a thin circular lining in sheared ground (Wang 1993; Hashash et al.
2001)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from vi_contact.core.arguments import check_fields
from vi_contact.core.quantities import Positive, Unit
from vi_contact.laws.materials import LinearElastic


@dataclass(frozen=True)
class ThinLining:
    """Hold radius R [m], thickness t [m]; lining and soil of two materials, plane strain."""

    radius: Annotated[float, Positive, Unit("m")]
    thickness: Annotated[float, Positive, Unit("m")]
    lining: LinearElastic
    soil: LinearElastic

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def compressibility(self) -> float:
        """Return C = E_m (1 - nu_l²) R/(E_l t (1 + nu)(1 - 2 nu))."""
        nu = self.soil.nu
        hoop = self.lining.E * self.thickness * (1.0 + nu) * (1.0 - 2.0 * nu)
        return self.soil.E * (1.0 - self.lining.nu**2) * self.radius / hoop

    @property
    def flexibility(self) -> float:
        """Return F = E_m (1 - nu_l²) R³/(6 E_l I (1 + nu)), I = t³/12."""
        bending = 6.0 * self.lining.E * self.thickness**3 / 12.0 * (1.0 + self.soil.nu)
        return self.soil.E * (1.0 - self.lining.nu**2) * self.radius**3 / bending

    @property
    def full_slip(self) -> float:
        """Return K1 = 12 (1 - nu)/(2 F + 5 - 6 nu)."""
        nu = self.soil.nu
        return 12.0 * (1.0 - nu) / (2.0 * self.flexibility + 5.0 - 6.0 * nu)

    def diameter_change(self, gamma: float) -> float:
        """Return K1 F gamma D/3 [m] at full slip, of the diameter that is stretched most."""
        return self.full_slip * self.flexibility * gamma / 3.0 * 2.0 * self.radius

    def thrust(self, gamma: float, *, slip: bool) -> float:
        """Return the largest hoop force [N/m]: full slip K1 E_m R gamma/(6 (1 + nu)), no slip K2 G
        R gamma."""
        nu, F, C = self.soil.nu, self.flexibility, self.compressibility
        if slip:
            return self.full_slip * self.soil.E * self.radius * gamma / (6.0 * (1.0 + nu))
        a = 1.0 - 2.0 * nu
        above = F * (a - a * C) - 0.5 * a**2 + 2.0
        below = F * ((3.0 - 2.0 * nu) + a * C) + C * (2.5 - 8.0 * nu + 6.0 * nu**2) + 6.0 - 8.0 * nu
        return (1.0 + above / below) * self.soil.shear_modulus * gamma * self.radius

    def moment(self, gamma: float) -> float:
        """Return the largest bending moment at full slip [N m/m], thrust times R."""
        return self.thrust(gamma, slip=True) * self.radius
