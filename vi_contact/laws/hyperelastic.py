"""Describe elastic materials of bodies that turn: stored energies W(C) of the strain C = FᵀF.

F = 1 + grad u is the gradient of the deformation. A rotation R of the whole body leaves C alone,
(R F)ᵀ(R F) = C, so that turning costs no energy. Stresses are S = 2 dW/dC (second Piola-Kirchhoff).
In plane strain C has the third row (0, 0, 1). At small strain both materials are ``LinearElastic``.

Here are the constants alone; ``fem.Hyperelastic`` has the energies, and takes one of your own.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from ..core.arguments import check_fields
from ..core.quantities import RATIO, Between, Positive, Unit
from .materials import Density, LinearElastic

Stiffness = Annotated[float, Positive, Unit("Pa"), "Young's modulus E at small strain"]
Ratio = Annotated[
    float,
    Between(-1.0, 0.5, "()", "give a number between -1 and 0.5, both excluded"),
    RATIO,
    "Poisson's ratio nu at small strain",
]


@dataclass(frozen=True)
class TurningLaw:
    """Hold the constants at small strain, where the law is that of ``LinearElastic``.

    Attributes:
        E: Young's modulus [Pa] at small strain.
        nu: Poisson's ratio at small strain.
        rho: mass density [kg/m³] of the undeformed body.
        xi: damping ratio, of which such bodies have none.
    """

    E: Stiffness
    nu: Ratio
    rho: Density
    xi: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def at_rest(self) -> LinearElastic:
        """Return the material at small strain."""
        return LinearElastic(self.E, self.nu, self.rho)

    @property
    def lame_lambda(self) -> float:
        """Return the first Lamé constant [Pa]."""
        return self.at_rest.lame_lambda

    @property
    def shear_modulus(self) -> float:
        """Return the second Lamé constant [Pa]."""
        return self.at_rest.shear_modulus

    @property
    def c_p(self) -> float:
        """Return the pressure wave speed [m/s] of the body at rest."""
        return self.at_rest.c_p

    @property
    def c_s(self) -> float:
        """Return the shear wave speed [m/s] of the body at rest."""
        return self.at_rest.c_s


@dataclass(frozen=True)
class SaintVenantKirchhoff(TurningLaw):
    """Describe Hooke's law between S and E = ½ (C - 1): small strain in large rotation.

        S = lame_lambda tr(E) 1 + 2 shear_modulus E
        W = ½ lame_lambda tr(E)² + shear_modulus E:E

    It is not for strong compression: a bar softens there, and gives way at a stretch of 0.58. The
    attributes are those of ``TurningLaw``.
    """


@dataclass(frozen=True)
class NeoHookean(TurningLaw):
    """Describe rubber: large strain, with an energy that is infinite where volume vanishes.

        W = ½ shear_modulus (tr C - 3 - 2 ln J) + ½ lame_lambda (ln J)²,   J = sqrt(det C)

    The attributes are those of ``TurningLaw``. Source: Bonet and Wood, Nonlinear Continuum
    Mechanics for Finite Element Analysis, 2nd ed. 2008, eq. 6.27.
    """
