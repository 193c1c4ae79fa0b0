"""Solve the impact of two coaxial elastic bars. All arguments are SI, forces and impulses per unit
of section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit


@dataclass(frozen=True)
class TwoBars:
    """Describe a bar 1 that hits bar 2, at rest, with `speed` v0 at t = 0; both stress-free, their
    far ends free.

    With impedances z = rho c and crossing times T = length/c, continuity of velocity gives, until a
    wave returns,

        p = v0 z1 z2 / (z1 + z2)

    The bar of the smaller T sends relief after 2T; if its impedance is not above the other's, this
    ends the contact for good, after the impulse 2T p, which leaves that bar free of stress. Equal
    bars but for length: the striker stops, restitution e = min(T1, T2)/max(T1, T2). length1,
    length2 [m]; z1, z2 [kg/(m² s)]; c1, c2, speed [m/s], velocities positive from bar 1 to bar 2;
    pressures and impulses per unit of section. Raises InputError unless all are finite and
    positive, and for bars that part later than after the first reflection.
    """

    length1: Annotated[float, Positive, Unit("m")] = 1.0
    length2: Annotated[float, Positive, Unit("m")] = 2.0
    z1: Annotated[float, Positive] = 1.0
    z2: Annotated[float, Positive] = 1.0
    c1: Annotated[float, Positive, Unit("m/s")] = 1.0
    c2: Annotated[float, Positive, Unit("m/s")] = 1.0
    speed: Annotated[float, Positive, Unit("m/s")] = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        first, second = (self.length1 / self.c1, self.z1), (self.length2 / self.c2, self.z2)
        if min(first, second)[1] > max(first, second)[1]:
            raise InputError(
                "TwoBars: the bar crossed first has the larger impedance, so that contact outlives "
                "the first reflection; give it an impedance (z1 or z2) that is not above the "
                "other's"
            )

    @property
    def pressure(self) -> float:
        """Return p = v0 z1 z2/(z1 + z2) [Pa], constant during the contact."""
        return self.speed * self.z1 * self.z2 / (self.z1 + self.z2)

    @property
    def duration(self) -> float:
        """Return 2 min(T1, T2) [s]."""
        return 2.0 * min(self.length1 / self.c1, self.length2 / self.c2)

    @property
    def impulse(self) -> float:
        """Return pressure · duration [Pa s]."""
        return self.pressure * self.duration

    @property
    def velocity1(self) -> float:
        """Return the mean velocity of bar 1 after the contact [m/s]: v0 - impulse/mass."""
        return self.speed - self.impulse / (self.z1 * self.length1 / self.c1)

    @property
    def velocity2(self) -> float:
        """Return the mean velocity of bar 2 after the contact [m/s]: impulse/mass."""
        return self.impulse / (self.z2 * self.length2 / self.c2)

    @property
    def restitution(self) -> float:
        """Return (velocity2 - velocity1)/v0."""
        return (self.velocity2 - self.velocity1) / self.speed

    def force(self, t: ArrayLike) -> Array:
        """Return the contact pressure p(t) [Pa] >= 0 at times t [s] after the first touch."""
        t = np.asarray(t, dtype=float)
        return self.pressure * ((t > 0.0) & (t < self.duration))
