"""Solve a circular lining in an elastic full space sheared far away, with and without friction at
its outside.

``ThickLining`` is the plane-strain solution of two rings of Michell's second harmonic; theta is
measured from the direction in which the ground is stretched, at 45° to the shear gamma:

    phi = (A r² + B r⁴ + C/r² + D) cos 2 theta
    sigma_r = -(2 A + 6 C/r⁴ + 4 D/r²) cos 2 theta
    sigma_theta = (2 A + 12 B r² + 6 C/r⁴) cos 2 theta
    tau = (2 A + 6 B r² - 6 C/r⁴ - 2 D/r²) sin 2 theta
    2 G u_r = (-2 A r - 4 nu B r³ + 2 C/r³ + 4 (1 - nu) D/r) cos 2 theta
    2 G u_theta = (2 A r + 2 (3 - 2 nu) B r³ + 2 C/r³ - 2 (1 - 2 nu) D/r) sin 2 theta

with A = -G gamma/2, B = 0 in the soil. It tends to the usual formulas for thin shells (Wang 1993,
Hashash et al. 2001) and supposes that soil and lining do not part: with full slip that needs a
pressure beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit
from vi_contact.laws.materials import LinearElastic


@dataclass(frozen=True)
class ThickLining:
    """Hold inner and outer radius [m]; ``slip``: no friction at the outside, else nothing slides
    there."""

    inner: Annotated[float, Positive, Unit("m")]
    outer: Annotated[float, Positive, Unit("m")]
    lining: LinearElastic
    soil: LinearElastic
    slip: bool = True

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.inner < self.outer:
            raise InputError(
                f"ThickLining: inner radius {self.inner!r} m, outer {self.outer!r} m; give inner < "
                "outer"
            )

    @cached_property
    def _constants(self) -> Array:
        """Return A, B, C, D of the lining; C, D of the soil, for gamma = 1, lengths in units of the
        outer radius."""
        G = self.soil.shear_modulus
        inside, interface = _rows(self.lining, self.inner / self.outer), _rows(self.lining, 1.0)
        outside = _rows(self.soil, 1.0)
        far = np.array([-0.5 * G, 0.0, 0.0, 0.0])
        matrix, right = np.zeros((6, 6)), np.zeros(6)
        matrix[0, :4], matrix[1, :4] = inside["sigma_r"], inside["tau"]
        jumps = ["u_r", "sigma_r"] + ([] if self.slip else ["u_theta", "tau"])
        for row, name in enumerate(jumps, 2):
            matrix[row, :4], matrix[row, 4:] = interface[name], -outside[name][2:]
            right[row] = outside[name] @ far
        if self.slip:
            matrix[4, :4] = interface["tau"]
            matrix[5, 4:], right[5] = outside["tau"][2:], -outside["tau"] @ far
        scale = np.abs(matrix).max(axis=1)
        return np.asarray(np.linalg.solve(matrix / scale[:, None], right / scale))

    def field(self, name: str, r: float, gamma: float) -> float:
        """Return the amplitude of "sigma_r", "sigma_theta", "tau" [Pa], "u_r", "u_theta" [m] in the
        lining at r [m]."""
        size = self.outer if name.startswith("u_") else 1.0
        return float(
            gamma * size * (_rows(self.lining, r / self.outer)[name] @ self._constants[:4])
        )

    def diameter_change(self, gamma: float) -> float:
        """Return 2 u_r [m] at the outside, of the diameter that is stretched most."""
        return 2.0 * self.field("u_r", self.outer, gamma)

    def pressure(self, gamma: float) -> float:
        """Return the amplitude of sigma_r [Pa] at the outside: contact lasts if the pressure
        beforehand exceeds it."""
        return self.field("sigma_r", self.outer, gamma)

    def thrust(self, gamma: float) -> float:
        """Return the amplitude of the hoop force N = ∫ sigma_theta dr [N/m]."""
        return self._integral(gamma)[0]

    def moment(self, gamma: float) -> float:
        """Return the amplitude of the bending moment ∫ sigma_theta (r - R) dr [N m/m] about the
        mean radius R."""
        return self._integral(gamma)[1]

    def _integral(self, gamma: float) -> tuple[float, float]:
        """Integrate across the thickness by Gauss quadrature."""
        x, w = np.polynomial.legendre.leggauss(12)
        half, mean = 0.5 * (self.outer - self.inner), 0.5 * (self.outer + self.inner)
        hoop = np.array([self.field("sigma_theta", mean + half * s, gamma) for s in x])
        return float(half * (w @ hoop)), float(half * (w @ (hoop * half * x)))


def _rows(material: LinearElastic, r: float) -> dict[str, Array]:
    """Return the amplitudes of the fields at r as products with (A, B, C, D)."""
    nu, G2 = material.nu, 2.0 * material.shear_modulus
    return {
        "sigma_r": -np.array([2.0, 0.0, 6.0 / r**4, 4.0 / r**2]),
        "sigma_theta": np.array([2.0, 12.0 * r**2, 6.0 / r**4, 0.0]),
        "tau": np.array([2.0, 6.0 * r**2, -6.0 / r**4, -2.0 / r**2]),
        "u_r": np.array([-2.0 * r, -4.0 * nu * r**3, 2.0 / r**3, 4.0 * (1.0 - nu) / r]) / G2,
        "u_theta": np.array([2 * r, 2 * (3 - 2 * nu) * r**3, 2 / r**3, -2 * (1 - 2 * nu) / r]) / G2,
    }
