"""Solve Hertz contact of spheres and the quasi-static impact of one.

There is no friction (Johnson 1985, ch. 4 and 11).

Bodies of moduli E_i, nu_i and radii R_i touch without friction, with E* and R from

    1/E* = sum over i of (1 - nu_i²)/E_i,   1/R = sum over i of 1/R_i.

Pressures are positive in compression. Lengths [m], pressures and moduli [Pa], forces [N], or any
consistent units.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.arguments import check_arguments, check_fields
from ..core.errors import InputError
from ..core.quantities import Positive, Unit


def contact_modulus(*bodies: tuple[float, float]) -> float:
    """Return E* [Pa] of one or two bodies (E [Pa], nu); leave out a rigid body.

    Raises InputError for no body, E <= 0 or nu outside (-1, 1/2].
    """
    for E, nu in bodies:
        if not (E > 0.0 and math.isfinite(E) and -1.0 < nu <= 0.5):
            raise InputError(
                f"contact_modulus: E = {E!r}, nu = {nu!r}; give E > 0 and -1 < nu <= 1/2"
            )
    if not bodies:
        raise InputError("contact_modulus: no elastic body; give the (E, nu) of one or two")
    return 1.0 / sum((1.0 - nu**2) / E for E, nu in bodies)


def contact_radius(*radii: float) -> float:
    """Return R [m] of one or two bodies; leave out a plane, give a hollow one a negative radius.

    Raises InputError unless the sum of 1/radius is finite and positive.
    """
    pointed = any(radius == 0.0 for radius in radii)
    if pointed or not 0.0 < sum(1.0 / radius for radius in radii) < math.inf:
        raise InputError(
            f"contact_radius: {radii} leave no gap that grows away from the contact; "
            "give radii whose sum of 1/radius is positive"
        )
    return 1.0 / sum(1.0 / radius for radius in radii)


@dataclass(frozen=True)
class HertzPoint:
    """Describe spheres pressed with `force` F.

    The contact has

        a = (3 F R/(4 E*))^(1/3),   p0 = 3 F/(2 pi a²),   p = p0 sqrt(1 - r²/a²),
        approach = a²/R,   F = (4/3) E* sqrt(R) approach^(3/2)

    Attributes:
        force: F, which presses where positive.
        modulus: E*.
        radius: R.
    """

    force: Annotated[float, Positive, Unit("N")]
    modulus: Annotated[float, Positive, Unit("Pa")]
    radius: Annotated[float, Positive, Unit("m")]

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    @check_arguments
    def from_approach(
        cls,
        approach: Annotated[float, Positive, Unit("m")],
        *,
        modulus: Annotated[float, Positive, Unit("Pa")],
        radius: Annotated[float, Positive, Unit("m")],
    ) -> "HertzPoint":
        """Return the contact of spheres whose distant points have come nearer by an approach.

        Args:
            approach: of distant points [m].
            modulus: E* [Pa].
            radius: R [m].

        Returns:
            The contact, with the force that the approach needs.

        Raises:
            InputError: a number is not positive.
        """
        force = 4.0 / 3.0 * modulus * math.sqrt(radius) * approach**1.5
        return cls(force, modulus, radius)

    @property
    def contact_radius(self) -> float:
        """Return a [m]: contact on r < a."""
        return math.cbrt(0.75 * self.force * self.radius / self.modulus)

    @property
    def peak(self) -> float:
        """Return p0 [Pa]."""
        return 1.5 * self.force / (math.pi * self.contact_radius**2)

    @property
    def approach(self) -> float:
        """Return the approach of distant points [m]."""
        return self.contact_radius**2 / self.radius

    def pressure(self, r: ArrayLike) -> Array:
        """Return p(r) [Pa] at the distance r from the axis, 0 outside the contact."""
        share = np.asarray(r, dtype=float) / self.contact_radius
        return self.peak * np.sqrt(np.maximum(1.0 - share**2, 0.0))


@dataclass(frozen=True)
class HertzImpact:
    """Describe a mass m that strikes with v on a Hertz spring.

    It is quasi-static, with m d'' = -(4/3) E* sqrt(R) d^(3/2):

        d_max = (15 m v²/(16 E* sqrt(R)))^(2/5)
        duration = 4 sqrt(pi) Gamma(2/5)/(5 Gamma(9/10)) d_max/v

    (factor 2.9433). It rebounds with v: waves in the bodies are left out.

    Attributes:
        mass: m.
        speed: v.
        modulus: E*.
        radius: R.
    """

    mass: Annotated[float, Positive, Unit("kg")]
    speed: Annotated[float, Positive, Unit("m/s")]
    modulus: Annotated[float, Positive, Unit("Pa")]
    radius: Annotated[float, Positive, Unit("m")]

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def approach(self) -> float:
        """Return d_max [m]."""
        stiffness = 16.0 * self.modulus * math.sqrt(self.radius)
        return (15.0 * self.mass * self.speed**2 / stiffness) ** 0.4

    @property
    def duration(self) -> float:
        """Return the length of the contact [s]."""
        factor = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
        return factor * self.approach / self.speed

    @property
    def deepest(self) -> HertzPoint:
        """Return the contact at d_max: its force is F_max, its contact_radius a_max."""
        return HertzPoint.from_approach(self.approach, modulus=self.modulus, radius=self.radius)
