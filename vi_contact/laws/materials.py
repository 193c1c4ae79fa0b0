"""Describe what a body is made of: isotropic elasticity, its section, and its damping.

Everything here is a frozen value that is checked when it is built, in SI units. No finite element
is needed.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Protocol

from ..core.arguments import check_arguments, check_fields
from ..core.errors import InputError
from ..core.quantities import RATIO, Between, NotNegative, Positive, Unit

EXTREME = 1e100  # beyond it, and below its inverse, squares are no numbers any more
ROUND_OFF = 1e-12  # relative; coefficients of damping that are zero, but for it
BELOW_ONE = Between(0.0, 1.0, "[)", "give ratios from 0 to less than 1, not per cent")
DampedBy = Annotated[float, BELOW_ONE, RATIO, "the damping ratio xi"]
Density = Annotated[float, Positive, Unit("kg/m³"), "the mass density rho"]
Thickness = Annotated[float, Positive, Unit("m"), "the thickness"]


@dataclass(frozen=True)
class LinearElastic:
    """Describe isotropic elasticity, sigma = lame_lambda tr(eps) I + 2 shear_modulus eps.

    Attributes:
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: mass density [kg/m³]; 0 for a body without mass, such as a massless foundation
            (docs/guide/dams.md).
        xi: damping ratio at the frequency of ``DampingRatio``, the one law that reads it.
    """

    E: Annotated[float, Positive, Unit("Pa"), "Young's modulus E"]
    nu: Annotated[
        float,
        Between(
            -1.0,
            0.5,
            "()",
            "give a number between -1 and 0.5, both excluded (nearly incompressible materials need "
            "a mixed method)",
        ),
        RATIO,
        "Poisson's ratio nu",
    ]
    rho: Annotated[float, NotNegative, Unit("kg/m³"), "the mass density rho"]
    xi: DampedBy = 0.0

    def __post_init__(self) -> None:
        values = (self.E, self.nu, self.rho, self.xi)
        if any(callable(value) or hasattr(value, "ufl_shape") for value in values):
            raise InputError(
                "LinearElastic: E, nu, rho and xi are numbers; give fem.Heterogeneous(E, nu, rho, "
                "xi) where they change from place to place"
            )
        check_fields(self)
        rho = self.rho or 1.0  # zero is a body without mass
        if not (EXTREME**-1 <= self.E <= EXTREME and EXTREME**-1 <= rho <= EXTREME):
            raise InputError(
                f"LinearElastic: no material has E = {self.E:g} Pa and rho = {self.rho:g} kg/m³; "
                f"give numbers between {1.0 / EXTREME:g} and {EXTREME:g}"
            )

    @classmethod
    @check_arguments
    def from_wave_speeds(
        cls,
        c_p: Annotated[float, Positive, Unit("m/s"), "c_p"],
        c_s: Annotated[float, Positive, Unit("m/s"), "c_s"],
        rho: Annotated[float, Positive, Unit("kg/m³"), "rho"],
        xi: DampedBy = 0.0,
    ) -> "LinearElastic":
        """Return the material whose pressure and shear waves travel at given speeds.

        nu = (c_p² - 2 c_s²) / (2 (c_p² - c_s²)), shear_modulus = rho c_s², E = 2 shear_modulus (1 +
        nu).

        Args:
            c_p: speed of pressure waves [m/s].
            c_s: speed of shear waves [m/s].
            rho: mass density [kg/m³].
            xi: damping ratio, as in the class.

        Raises:
            InputError: unless c_p > sqrt(4/3) c_s > 0, which is nu > -1.
        """
        if 3.0 * c_p**2 <= 4.0 * c_s**2:
            raise InputError(
                f"LinearElastic.from_wave_speeds: c_p = {c_p!r} is too slow for c_s = {c_s!r}; "
                "give c_p > sqrt(4/3) c_s, as an elastic solid has"
            )
        nu = (c_p**2 - 2.0 * c_s**2) / (2.0 * (c_p**2 - c_s**2))
        return cls(E=2.0 * rho * c_s**2 * (1.0 + nu), nu=nu, rho=rho, xi=xi)

    @property
    def lame_lambda(self) -> float:
        """Return the first Lamé constant E nu / ((1 + nu)(1 - 2 nu)) [Pa]."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    @property
    def shear_modulus(self) -> float:
        """Return the second Lamé constant E / (2 (1 + nu)) [Pa].

        It is not called mu here, for mu is friction.
        """
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def c_p(self) -> float:
        """Return the pressure wave speed sqrt((lame_lambda + 2 shear_modulus) / rho) [m/s].

        It is also that in plane strain, and infinite without mass.
        """
        if self.rho == 0.0:
            return math.inf
        return math.sqrt((self.lame_lambda + 2.0 * self.shear_modulus) / self.rho)

    @property
    def c_s(self) -> float:
        """Return the shear wave speed sqrt(shear_modulus / rho) [m/s], infinite without mass."""
        if self.rho == 0.0:
            return math.inf
        return math.sqrt(self.shear_modulus / self.rho)


def require_mass(owner: str, name: str, material: LinearElastic) -> None:
    """Raise InputError for a material without mass, where waves are computed.

    Args:
        owner: the function, in its own words.
        name: of the material, in words.
        material: the material.
    """
    if material.rho == 0.0:
        raise InputError(
            f"{owner}: {name} has rho = 0, and no wave runs without mass: give a density above zero"
        )


@dataclass(frozen=True)
class ElasticValues:
    """Hold elastic constants at points, which sections and damping take as they take a material.

    Attributes:
        E: Young's moduli (k,) [Pa], or one for all points.
        nu: Poisson's ratios (k,), or one.
        rho: mass densities (k,) [kg/m³], or one.
        xi: damping ratios (k,), or one.
    """

    E: Any
    nu: Any
    rho: Any
    xi: Any = 0.0
    lame_lambda = LinearElastic.lame_lambda
    shear_modulus = LinearElastic.shear_modulus


class Section(Protocol):
    """Say how the body is cut out of space."""

    @property
    def thickness(self) -> float:
        """Return the thickness [m] that integrals over the mesh are multiplied by, 1 of solids."""

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lambda_eff, shear_modulus) [Pa] of sigma = lambda_eff tr(eps) I + 2 shear eps."""


@dataclass(frozen=True)
class PlaneStress:
    """Cut a panel of this thickness, free of stress across it.

    lambda_eff = 2 lambda mu / (lambda + 2 mu).

    Attributes:
        thickness: of the panel [m].
    """

    thickness: Thickness = 1.0

    def __post_init__(self) -> None:
        check_fields(self)

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lambda_eff, shear_modulus) [Pa], (E nu / (1 - nu²), E / (2 (1 + nu)))."""
        lame = material.lame_lambda
        shear = material.shear_modulus
        return 2.0 * lame * shear / (lame + 2.0 * shear), shear


@dataclass(frozen=True)
class PlaneStrain:
    """Cut a slice out of a long body that cannot strain along its axis: lambda_eff = lambda.

    Attributes:
        thickness: of the slice [m].
    """

    thickness: Thickness = 1.0

    def __post_init__(self) -> None:
        check_fields(self)

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lame_lambda, shear_modulus) [Pa]."""
        return material.lame_lambda, material.shear_modulus


@dataclass(frozen=True)
class Solid:
    """Take a three-dimensional body: lambda_eff = lambda, nothing to multiply integrals by."""

    thickness: ClassVar[float] = 1.0

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lame_lambda, shear_modulus) [Pa]."""
        return material.lame_lambda, material.shear_modulus


class Damping(Protocol):
    """Build viscous damping from the mass and stiffness of one material: C = alpha M + beta K."""

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (alpha [1/s], beta [s]) on the part of the body that is made of a material."""


@dataclass(frozen=True)
class NoDamping:
    """Leave damping out: C = 0."""

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (0, 0)."""
        return 0.0, 0.0


@dataclass(frozen=True)
class MassProportional:
    """Damp by a force c u' per unit volume: rho u'' + c u' = div sigma + f.

    Attributes:
        c: damping coefficient [kg/m³/s].
    """

    c: Annotated[float, NotNegative, Unit("kg/m³/s"), "the damping coefficient c"]

    def __post_init__(self) -> None:
        check_fields(self)

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (c / rho, 0), for the integral of c is c / rho times the consistent mass.

        Raises:
            InputError: a material without mass, of which no multiple damps.
        """
        if isinstance(material.rho, int | float) and material.rho == 0.0:
            raise InputError(
                "MassProportional damps by the mass, and a material has rho = 0: give "
                "Rayleigh(0.0, beta), or give it a density above zero"
            )
        return self.c / material.rho, 0.0


@dataclass(frozen=True)
class Rayleigh:
    """Damp by C = alpha M + beta K, with the stiffness K of the body, without contact.

    Once a body lifts off, alpha M also resists its rigid rocking, which nothing physical does: with
    uplift prefer alpha = 0.

    Attributes:
        alpha: factor of the mass [1/s].
        beta: factor of the stiffness [s].
    """

    alpha: Annotated[float, NotNegative, Unit("1/s"), "the mass coefficient alpha"]
    beta: Annotated[float, NotNegative, Unit("s"), "the stiffness coefficient beta"]

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    @check_arguments
    def from_frequencies(
        cls,
        f1: Annotated[float, Positive, Unit("Hz"), "the frequency f1"],
        f2: Annotated[float, Positive, Unit("Hz"), "the frequency f2"],
        *,
        xi1: Annotated[float, NotNegative, RATIO, "the damping ratio xi1"],
        xi2: Annotated[float, NotNegative, RATIO, "the damping ratio xi2"],
    ) -> "Rayleigh":
        """Return the damping that has given ratios at two frequencies.

        alpha / (2 w_i) + beta w_i / 2 = xi_i, w_i = 2 pi f_i, so that

            alpha = 2 w1 w2 (w2 xi1 - w1 xi2) / (w2² - w1²)
            beta = 2 (w2 xi2 - w1 xi1) / (w2² - w1²)

        For equal ratios xi they are 2 xi w1 w2 / (w1 + w2) and 2 xi / (w1 + w2). 5 % at 1 and 10 Hz
        gives 0.5712 1/s and 1.4469e-3 s.

        Args:
            f1: one frequency [Hz].
            f2: the other [Hz].
            xi1: damping ratio at f1.
            xi2: damping ratio at f2.

        Raises:
            InputError: f1 = f2, or ratios that need a negative coefficient.
        """
        if f1 == f2:
            raise InputError(
                f"Rayleigh.from_frequencies: f1 and f2 are both {f1!r} Hz; give two frequencies"
            )
        (f_low, xi_low), (f_high, xi_high) = sorted([(f1, xi1), (f2, xi2)])
        w1 = 2.0 * math.pi * f_low
        w2 = 2.0 * math.pi * f_high
        mass = w2 * xi_low - w1 * xi_high
        stiffness = w2 * xi_high - w1 * xi_low
        round_off = ROUND_OFF * (w1 + w2) * (xi_low + xi_high)
        if min(mass, stiffness) < -round_off:
            raise InputError(
                f"Rayleigh.from_frequencies: ratios {xi1!r} at {f1!r} Hz and {xi2!r} at {f2!r} Hz "
                "would need a negative coefficient; keep xi2/xi1 between f1/f2 and f2/f1"
            )
        factor = 2.0 / (w2**2 - w1**2)
        return cls(alpha=factor * w1 * w2 * max(mass, 0.0), beta=factor * max(stiffness, 0.0))

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (alpha, beta), whatever the material."""
        return self.alpha, self.beta

    @check_arguments
    def ratio(self, f: Annotated[float, Positive, Unit("Hz"), "the frequency f"]) -> float:
        """Return the damping ratio alpha / (2 w) + beta w / 2 of a mode of frequency f = w / 2 pi.

        It is smallest at w = sqrt(alpha / beta), where it is sqrt(alpha beta).
        """
        w = 2.0 * math.pi * f
        return 0.5 * (self.alpha / w + self.beta * w)


@dataclass(frozen=True)
class DampingRatio:
    """Damp by the ratio xi of each material at one frequency f1, or at two.

    Every material has a xi, zero by default; that of ``fem.Heterogeneous`` may change from cell to
    cell. ``assemble`` refuses the law where no material has one, and a ratio of a material without
    this law.

        C = alpha M + beta K,    w = 2 pi f
        alpha = 2 xi w1 w2 / (w1 + w2),    beta = 2 xi / (w1 + w2)

    With two frequencies the ratio is less than xi between them and more outside, and alpha M also
    resists rigid rocking (see ``Rayleigh``).

    Attributes:
        frequency: f1 [Hz].
        second: f2 [Hz], or zero for damping of the stiffness alone, xi f/f1 at f.
    """

    frequency: Annotated[float, Positive, Unit("Hz"), "frequency"]
    second: Annotated[float, NotNegative, Unit("Hz"), "second"] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def coefficients(self, material: LinearElastic) -> tuple[Any, Any]:
        """Return (alpha [1/s], beta [s]); values at points where xi has such."""
        w1 = 2.0 * math.pi * self.frequency
        w2 = 2.0 * math.pi * self.second
        beta = 2.0 / (w1 + w2) * material.xi
        return w1 * w2 * beta, beta


@dataclass(frozen=True)
class KelvinVoigt:
    """Damp by the viscous stress sigma_v = bulk tr(eps') I + 2 shear dev(eps').

        C = ∫ sigma_v(v):eps(w) = ∫ (bulk - 2/3 shear) tr(eps(v)) tr(eps(w)) + 2 shear eps(v):eps(w)

    Rigid motions feel nothing of it, and materials are not asked. A wave or a mode of one kind of
    strain has the damping ratio ½ w tau at w [rad/s], with tau = shear / G in shear, and (bulk +
    4/3 shear) / (lambda + 2 mu) in a bar without lateral strain. Not for PlaneStress, where the
    strain across the panel would have a motion of its own (``assemble`` refuses it). With
    viscosities beta times the shear and bulk moduli, mu and lambda + 2/3 mu, it is Rayleigh(0,
    beta), the solid of one retardation time, which goes with PlaneStress too.

    Attributes:
        shear: shear viscosity [Pa s].
        bulk: bulk viscosity [Pa s].
    """

    shear: Annotated[float, NotNegative, Unit("Pa·s")]
    bulk: Annotated[float, NotNegative, Unit("Pa·s")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (0, 0): nothing is proportional to the mass or the stiffness of a material."""
        return 0.0, 0.0

    @property
    def viscosities(self) -> tuple[float, float]:
        """Return (lambda_v, mu_v) [Pa s] of sigma_v = lambda_v tr(eps') I + 2 mu_v eps'."""
        return self.bulk - 2.0 / 3.0 * self.shear, self.shear


BLIND_TO_RATIOS = (NoDamping, MassProportional, Rayleigh, KelvinVoigt)
"""Damping laws that do not read the ratio xi of a material."""
