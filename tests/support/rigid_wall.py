"""Solve an elastic soil layer on rigid rock, held by a rigid smooth wall and accelerated
horizontally.

The one-dimensional theory of Veletsos and Younan (1994) for the layer of Wood (1973): vertical
stresses are neglected and the horizontal displacements of all modes sin((2n-1) pi y/2H) decay from
the wall into the layer:

    p(y) = kappa rho a H sum_n 8/((2n-1)² pi²) sin((2n-1) pi y/2H),   kappa = psi_s²/psi_e
    Q = ∫ p dy = kappa rho a H² 14 zeta(3)/pi³
    M = ∫ p y dy = kappa rho a H³ 32/pi⁴ sum_n (-1)ⁿ⁻¹/(2n-1)⁴

with psi_s² = 2/(1-nu) and psi_e² = (2-nu)/(1-nu), or psi_e = psi_s in the simpler form. y [m] is
the height above the rock, p [Pa] the pressure of the layer on the wall for a body force rho a
towards it, Q [N/m], M [N] per metre of wall. The two-dimensional theory of elasticity gives thrusts
2 to 6 % off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import zeta

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import NotNegative, Positive, Unit

CATALAN = 0.915965594177219
TERMS = 4000  # of the series of p: its tail is below 3e-5 of p
THRUST = 14.0 * float(zeta(3)) / math.pi**3  # 0.54276
MOMENT = 32.0 / math.pi**4 * (float(zeta(4, 0.25)) - float(zeta(4, 0.75))) / 256.0  # 0.32488
TURNED = 8.0 * CATALAN / math.pi**2  # 0.74245


@dataclass(frozen=True)
class RigidWall:
    """Hold height H [m], density rho [kg/m³], Poisson's ratio nu in [0, 1/2); ``simple``: psi_e =
    psi_s.

    ``flexibility`` d = G H²/R for a rotational spring R [N m/m] at the foot; 0: no turning.
    InputError out of range.
    """

    height: Annotated[float, Positive, Unit("m")]
    rho: Annotated[float, Positive, Unit("kg/m³")]
    nu: Annotated[float, NotNegative]
    simple: bool = False
    flexibility: Annotated[float, NotNegative] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.nu >= 0.5:
            raise InputError(
                f"RigidWall: nu is {self.nu!r}; give a Poisson's ratio from 0 to below 0.5"
            )

    @property
    def kappa(self) -> float:
        """Return psi_s²/psi_e."""
        psi_s = 2.0 / (1.0 - self.nu)
        psi_e = psi_s if self.simple else (2.0 - self.nu) / (1.0 - self.nu)
        return psi_s / math.sqrt(psi_e)

    def _unit(self, acceleration: float) -> float:
        return self.kappa * self.rho * acceleration * self.height

    def pressure(self, y: ArrayLike, acceleration: float) -> Array:
        """Return p [Pa] at heights y [m] (any shape) on a wall that cannot turn."""
        odd = 2.0 * np.arange(1, TERMS + 1) - 1.0
        angle = np.multiply.outer(np.asarray(y, dtype=float) / self.height, 0.5 * math.pi * odd)
        return np.asarray(self._unit(acceleration) * (np.sin(angle) @ (8.0 / (odd * math.pi) ** 2)))

    def thrust(self, acceleration: float) -> float:
        """Return Q [N/m] under a body force rho a to the wall; turning takes 8 G/pi² M_1 kappa d/(1
        + Q_1 kappa d)."""
        flexibility = self.kappa * self.flexibility
        yielding = flexibility / (1.0 + THRUST * flexibility)
        return self._unit(acceleration) * self.height * (THRUST - TURNED * MOMENT * yielding)

    def moment(self, acceleration: float) -> float:
        """Return M [N] about the foot of the wall; M/Q is the height of the thrust, 0.5986 H if it
        cannot turn."""
        return (
            self._unit(acceleration)
            * self.height**2
            * MOMENT
            / (1.0 + THRUST * self.kappa * self.flexibility)
        )
