"""Describe what a body is made of.

It is isotropic elasticity, the section it is cut to, and the damping of its motion.

Everything here is a frozen value checked when it is built; SI units throughout; no finite element
is needed.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Protocol

from ..core.arguments import check_fields, checked
from ..core.errors import InputError
from ..core.quantities import RATIO, Between, NotNegative, Positive, Unit

EXTREME = 1e100  # beyond it, and below its inverse, squares are no numbers any more
BELOW_ONE = Between(0.0, 1.0, "[)", "give ratios from 0 to less than 1, not per cent")
DampedBy = Annotated[float, BELOW_ONE, RATIO, "the damping ratio xi"]
Density = Annotated[float, Positive, Unit("kg/m³"), "the mass density rho"]
Thickness = Annotated[float, Positive, Unit("m"), "the thickness"]


@dataclass(frozen=True)
class LinearElastic:
    """Describe isotropic elasticity, sigma = lame_lambda tr(eps) I + 2 shear_modulus eps.

    xi is that at the frequency of ``DampingRatio``, the one law that reads it.
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
    rho: Density
    xi: DampedBy = 0.0

    def __post_init__(self) -> None:
        if any(
            callable(one) or hasattr(one, "ufl_shape")
            for one in (self.E, self.nu, self.rho, self.xi)
        ):
            raise InputError(
                "LinearElastic: E, nu, rho and xi are numbers; give fem.Heterogeneous(E, nu, rho, "
                "xi) where they change from place to place"
            )
        check_fields(self)
        if not (EXTREME**-1 <= self.E <= EXTREME and EXTREME**-1 <= self.rho <= EXTREME):
            raise InputError(
                f"LinearElastic: no material has E = {self.E:g} Pa and rho = {self.rho:g} kg/m³; "
                f"give numbers between {1.0 / EXTREME:g} and {EXTREME:g}"
            )

    @classmethod
    @checked
    def from_wave_speeds(
        cls,
        c_p: Annotated[float, Positive, Unit("m/s"), "c_p"],
        c_s: Annotated[float, Positive, Unit("m/s"), "c_s"],
        rho: Annotated[float, Positive, Unit("kg/m³"), "rho"],
        xi: DampedBy = 0.0,
    ) -> "LinearElastic":
        """Return the material whose pressure and shear waves travel at c_p and c_s.

        Its damping ratio is xi.

        nu = (c_p² - 2 c_s²) / (2 (c_p² - c_s²)), shear_modulus = rho c_s², E = 2 shear_modulus (1 +
        nu). Raises InputError unless c_p > sqrt(4/3) c_s > 0, which is nu > -1.
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

        It is never called mu here: mu is friction.
        """
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def c_p(self) -> float:
        """Return the pressure wave speed [m/s], which is also that in plane strain.

        It is sqrt((lame_lambda + 2 shear_modulus) / rho).
        """
        return math.sqrt((self.lame_lambda + 2.0 * self.shear_modulus) / self.rho)

    @property
    def c_s(self) -> float:
        """Return the shear wave speed sqrt(shear_modulus / rho) [m/s]."""
        return math.sqrt(self.shear_modulus / self.rho)


@dataclass(frozen=True)
class ElasticValues:
    """Hold E [Pa], nu, rho [kg/m³] and the damping ratio xi at points.

    Each is (k,) or one for all; sections and damping take them alike.
    """

    E: Any
    nu: Any
    rho: Any
    xi: Any = 0.0
    lame_lambda = LinearElastic.lame_lambda
    shear_modulus = LinearElastic.shear_modulus


class Section(Protocol):
    """Say how the body is cut out of space.

    Integrals over the mesh are multiplied by `thickness` [m] (solids: 1).
    """

    @property
    def thickness(self) -> float:
        """Return the thickness [m] that integrals over the mesh are multiplied by."""

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lambda_eff, shear_modulus) [Pa] of the stress in the plane.

        It is sigma = lambda_eff tr(eps) I + 2 shear_modulus eps.
        """


@dataclass(frozen=True)
class PlaneStress:
    """Cut a panel of this thickness, free of stress across it.

    lambda_eff = 2 lambda mu / (lambda + 2 mu).
    """

    thickness: Thickness = 1.0

    def __post_init__(self) -> None:
        check_fields(self)

    def elastic_constants(self, material: LinearElastic) -> tuple[float, float]:
        """Return (lambda_eff, shear_modulus) [Pa].

        They equal (E nu / (1 - nu²), E / (2 (1 + nu))).
        """
        lame, shear = material.lame_lambda, material.shear_modulus
        return 2.0 * lame * shear / (lame + 2.0 * shear), shear


@dataclass(frozen=True)
class PlaneStrain:
    """Cut a slice of the given thickness of a long body that cannot strain along its axis.

    lambda_eff = lambda.
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
        """Return (alpha [1/s], beta [s]) of C = alpha M + beta K.

        They are those on the part of the body made of `material`.
        """


@dataclass(frozen=True)
class NoDamping:
    """Leave damping out: C = 0."""

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (0, 0)."""
        return 0.0, 0.0


@dataclass(frozen=True)
class MassProportional:
    """Damp by a force c u' per unit volume.

    rho u'' + c u' = div sigma + f.
    """

    c: Annotated[float, NotNegative, Unit("kg/m³/s"), "the damping coefficient c"]

    def __post_init__(self) -> None:
        check_fields(self)

    def coefficients(self, material: LinearElastic) -> tuple[float, float]:
        """Return (c / rho, 0).

        Integrating c against the shape functions is c / rho times the consistent mass.
        """
        return self.c / material.rho, 0.0


@dataclass(frozen=True)
class Rayleigh:
    """Damp by C = alpha M + beta K.

    K is the stiffness without any contact term.

    Once a body lifts off, alpha M also resists its rigid rocking, which nothing physical does: with
    uplift prefer alpha = 0.
    """

    alpha: Annotated[float, NotNegative, Unit("1/s"), "the mass coefficient alpha"]
    beta: Annotated[float, NotNegative, Unit("s"), "the stiffness coefficient beta"]

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    @checked
    def from_frequencies(
        cls,
        f1: Annotated[float, Positive, Unit("Hz"), "the frequency f1"],
        f2: Annotated[float, Positive, Unit("Hz"), "the frequency f2"],
        *,
        xi1: Annotated[float, NotNegative, RATIO, "the damping ratio xi1"],
        xi2: Annotated[float, NotNegative, RATIO, "the damping ratio xi2"],
    ) -> "Rayleigh":
        """Make the damping of ratio xi1 at f1, xi2 at f2.

        alpha / (2 w_i) + beta w_i / 2 = xi_i, w_i = 2 pi f_i.

        alpha = 2 w1 w2 (w2 xi1 - w1 xi2) / (w2² - w1²), beta = 2 (w2 xi2 - w1 xi1) / (w2² - w1²);
        for equal ratios xi alpha = 2 xi w1 w2 / (w1 + w2) and beta = 2 xi / (w1 + w2). 5 % at 1 and
        10 Hz: 0.5712 1/s and 1.4469e-3 s. Raises InputError when f1 = f2 or when the solution needs
        a negative coefficient.
        """
        if f1 == f2:
            raise InputError(
                f"Rayleigh.from_frequencies: f1 and f2 are both {f1!r} Hz; give two frequencies"
            )
        w1, w2 = 2.0 * math.pi * min(f1, f2), 2.0 * math.pi * max(f1, f2)
        low, high = (xi1, xi2) if f1 < f2 else (xi2, xi1)
        mass, stiffness = w2 * low - w1 * high, w2 * high - w1 * low
        round_off = 1e-12 * (w1 + w2) * (low + high)
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

    @checked
    def ratio(self, f: Annotated[float, Positive, Unit("Hz"), "the frequency f"]) -> float:
        """Return the damping ratio of a mode of frequency f = w / 2 pi.

        It is alpha / (2 w) + beta w / 2.

        Smallest at w = sqrt(alpha / beta), where it is sqrt(alpha beta).
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

    ``second`` is f2, or zero for damping of the stiffness alone: xi f/f1 at f. With two frequencies
    the ratio is less than xi between them and more outside, and alpha M also resists rigid rocking
    (see ``Rayleigh``).
    """

    frequency: Annotated[float, Positive, Unit("Hz"), "frequency"]
    second: Annotated[float, NotNegative, Unit("Hz"), "second"] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def coefficients(self, material: LinearElastic) -> tuple[Any, Any]:
        """Return (alpha [1/s], beta [s]), of values at points where xi is."""
        w1, w2 = 2.0 * math.pi * self.frequency, 2.0 * math.pi * self.second
        beta = 2.0 / (w1 + w2) * material.xi
        return w1 * w2 * beta, beta


@dataclass(frozen=True)
class KelvinVoigt:
    """Damp by sigma_v = bulk tr(eps') I + 2 shear dev(eps').

    The viscosities are shear and bulk.

        C = ∫ sigma_v(v):eps(w) = ∫ (bulk - 2/3 shear) tr(eps(v)) tr(eps(w)) + 2 shear eps(v):eps(w)

    Rigid motions feel nothing of it, and materials are not asked. A wave or a mode of one kind of
    strain has the damping ratio ½ w tau at w [rad/s], with tau = shear / G in shear, and (bulk +
    4/3 shear) / (lambda + 2 mu) in a bar without lateral strain. Not for PlaneStress, where the
    strain across the panel would have a motion of its own (``assemble`` refuses it). With
    viscosities beta times the shear and bulk moduli, mu and lambda + 2/3 mu, it is Rayleigh(0,
    beta), the solid of one retardation time, which goes with PlaneStress too.
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
