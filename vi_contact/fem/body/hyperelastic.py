"""Give the stored energies W(C) of materials of bodies that turn, as UFL expressions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import ufl

from ...core.checks import function
from ...core.quantities import Unit
from ...laws.hyperelastic import NeoHookean, SaintVenantKirchhoff, TurningLaw
from .. import compat


@dataclass(frozen=True, kw_only=True)
class Hyperelastic(TurningLaw):
    """Describe a material of a body that turns by a stored energy of your own.

    Attributes:
        energy: C -> W [J/m³], UFL expressions: C is a (3, 3) tensor, in plane strain too. At C = 1
            the stress 2 dW/dC is zero.
        E: Young's modulus [Pa] at small strain, which must be that of the energy.
        nu: Poisson's ratio at small strain.
        rho: mass density [kg/m³] of the undeformed body.
    """

    energy: Annotated[Callable[[Any], Any], Unit("J/m³")]

    def __post_init__(self) -> None:
        function("Hyperelastic", "energy", self.energy, "give a function of C that returns W")
        super().__post_init__()


TurningMaterial = SaintVenantKirchhoff | NeoHookean | Hyperelastic
TURNING = (SaintVenantKirchhoff, NeoHookean, Hyperelastic)


def find_energy(material: TurningMaterial, mesh: Any) -> Callable[[Any], Any]:
    """Return C (3, 3) -> W [J/m³] of a material, UFL expressions.

    Args:
        material: the material.
        mesh: that of its constants, by which one compiled form serves all of its kind.
    """
    if isinstance(material, Hyperelastic):
        return material.energy
    lame = compat.constant(mesh, material.lame_lambda)
    shear = compat.constant(mesh, material.shear_modulus)

    def saint_venant(C: Any) -> Any:
        E = 0.5 * (C - ufl.Identity(3))
        return 0.5 * lame * ufl.tr(E) ** 2 + shear * ufl.inner(E, E)

    def neo_hooke(C: Any) -> Any:
        log_J = 0.5 * ufl.ln(ufl.det(C))
        return 0.5 * shear * (ufl.tr(C) - 3.0 - 2.0 * log_J) + 0.5 * lame * log_J**2

    return saint_venant if isinstance(material, SaintVenantKirchhoff) else neo_hooke
