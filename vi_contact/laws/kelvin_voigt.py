"""Damp a body by viscous stresses beside the elastic ones: the solid of Kelvin and Voigt."""

from dataclasses import dataclass

from ..core.checks import attributes
from .materials import LinearElastic


@dataclass(frozen=True)
class KelvinVoigt:
    """Damp by sigma_v = bulk tr(eps') I + 2 shear dev(eps'), with the viscosities shear, bulk [Pa s] >= 0.

        C = ∫ sigma_v(v):eps(w) = ∫ (bulk - 2/3 shear) tr(eps(v)) tr(eps(w)) + 2 shear eps(v):eps(w)

    Rigid motions feel nothing of it, and materials are not asked. A wave or a mode of one kind of strain has the
    damping ratio ½ w tau at w [rad/s], with tau = shear / G in shear, and (bulk + 4/3 shear) / (lambda + 2 mu) in a bar
    without lateral strain. Not for PlaneStress, where the strain across the panel would have a motion of its own
    (``assemble`` refuses it). With viscosities beta times the shear and bulk moduli, mu and lambda + 2/3 mu, it is
    Rayleigh(0, beta), the solid of one retardation time, which goes with PlaneStress too.
    Raises InputError for a viscosity that is negative or not finite.
    """

    shear: float
    bulk: float = 0.0

    def __post_init__(self) -> None:
        attributes(self, not_negative=("shear", "bulk"))

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (0, 0): nothing is proportional to the mass or the stiffness of a material."""
        return 0.0, 0.0

    @property
    def viscosities(self) -> tuple[float, float]:
        """Return (lambda_v, mu_v) [Pa s] of sigma_v = lambda_v tr(eps') I + 2 mu_v eps'."""
        return self.bulk - 2.0 / 3.0 * self.shear, self.shear
