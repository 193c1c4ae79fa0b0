"""Describe what a problem asks of its laws and of what shakes it: the protocols that users' own classes satisfy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .algebra import Array, Mask
from .surfaces import ContactSurface
from .system import SemiDiscreteSystem


class Excitation(Protocol):
    """The contract of every excitation."""

    @property
    def direction(self) -> tuple[float, ...]:
        """Components of the direction, one per space dimension, not all zero."""
        ...

    @property
    def duration(self) -> float:
        """Time [s] after which the acceleration stays zero or negligible; infinite if it never does."""
        ...

    def acceleration(self, t: float) -> float:
        """Acceleration [m/s²] at time t [s], positive along the direction."""
        ...

    def __call__(self, t: float) -> Array:
        """The vector acceleration(t) · direction [m/s²], shape (d,)."""
        ...


class FrictionLaw(Protocol):
    """What a solver asks of a friction law."""

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Largest tangential reaction of each node, shape (n,), in the unit of r_n.

        r_n: normal reactions, shape (n,) [N or N s]; weights: tributary lengths or areas, shape (n,) [m or m²];
        scale: 1 for forces, dt [s] for impulses.
        """
        ...

    def slope(self, weights: Array) -> Array:
        """d limit / d r_n of each node under pressure, shape (n,); limit does not grow with tension."""
        ...

    def at(self, speed: Array) -> FrictionLaw:
        """The law at slip rates |v| [m/s], shape (n,), with a slope of its own.

        ``limit`` and ``slope`` of a law itself are those at rest. A law that does not know rates returns itself.
        """
        ...


@dataclass(frozen=True)
class Frictionless:
    """No tangential reaction: limit = 0."""

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Zeros, shape (n,)."""
        return np.zeros_like(r_n, dtype=float)

    def slope(self, weights: Array) -> Array:
        """Zeros, shape (n,)."""
        return np.zeros(len(weights))

    def at(self, speed: Array) -> Frictionless:
        """Itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class Impact:
    """What an impact law is told of the m conditions.

    Attributes:
        before: normal velocities before the step [m/s], > 0 towards the obstacle.
        v_n: normal velocities that the step left [m/s].
        active: which are closed. closing: which have just closed.
    """

    before: Array
    v_n: Array
    active: Mask
    closing: Mask


class ImpactLaw(Protocol):
    """Post-impact velocity law: one of this file, or the user's own object with these two methods."""

    def target(self, impact: Impact) -> Array:
        """Normal velocities (m,) after the impact; NaN where the law leaves the velocity alone."""
        ...

    def apply(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        """The velocity vector that has these normal velocities."""
        ...


class MassLaw(Protocol):
    """Turns the system, in the rotated basis, into one with the wanted mass matrix."""

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem: ...
