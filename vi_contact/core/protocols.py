"""Describe what a problem asks of its laws and of what shakes it: protocols for users' classes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol

import numpy as np

from .algebra import Array, Mask
from .arguments import check_fields
from .checks import number, several
from .errors import InputError
from .quantities import RATIO, Finite
from .surfaces import ContactSurface
from .system import SemiDiscreteSystem

EXCITATION = ("acceleration", "direction", "duration")  # what is asked of one
Direction = Annotated[tuple[float, ...], Finite, RATIO]


class Excitation(Protocol):
    """Shake the ground in one direction, or give any motion its history."""

    @property
    def direction(self) -> tuple[float, ...]:
        """Return the direction (d,), not all zero; its length is a factor of the acceleration."""

    @property
    def duration(self) -> float:
        """Return the time [s] after which it stays zero or negligible, or infinity."""

    def acceleration(self, t: float) -> float:
        """Return the acceleration [m/s²] at time ``t`` [s], positive along the direction.

        It is asked for at any time >= 0, also twice and between the steps. It is a finite number,
        the same on every rank.
        """

    def __call__(self, t: float) -> Array:
        """Return the vector acceleration(t) · direction [m/s²] at time ``t`` [s], shape (d,)."""


def vector(self: Excitation, t: float) -> Array:
    """Return the vector acceleration(t) · direction [m/s²], shape (d,)."""
    return self.acceleration(t) * np.array(self.direction)


def check_excitation(excitation: Excitation) -> None:
    """Raise InputError for a bad field or direction; turn the direction into a tuple of floats."""
    owner = type(excitation).__name__
    direction = finite_tuple(owner, "direction", excitation.direction)
    if not 1 <= len(direction) <= 3 or not any(direction):
        raise InputError(
            f"{owner}: direction is {direction!r}; give one to three components, not all zero"
        )
    object.__setattr__(excitation, "direction", direction)
    check_fields(excitation)


def finite_tuple(owner: str, name: str, values: Sequence[float]) -> tuple[float, ...]:
    """Return numbers as a tuple of floats.

    Args:
        owner: class that asks, the first word of the sentence.
        name: the argument.
        values: what the user gave.

    Raises:
        InputError: names the first entry that is not a finite number.
    """
    entries = several(owner, name, values, "give a sequence of numbers")
    return tuple(number(owner, f"{name}[{k}]", value) for k, value in enumerate(entries))


class FrictionLaw(Protocol):
    """Bound the tangential reaction by the normal one: what a solver asks of a friction law.

    |r_t| <= limit(r_n) = cohesion + slope max(r_n, 0); r_t = limit along the slip where there is
    one.
    """

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return the largest tangential reactions (m,) >= 0, in the unit of ``r_n``.

        Args:
            r_n: normal reactions (m,), ``scale`` times newtons; of either sign, tension counts as
                zero.
            weights: tributary lengths times thickness, or areas (m,) [m²]: what turns stresses into
                forces.
            scale: that of the step, 1 for forces, dt [s] for impulses. A limit that ignores r_n is
                multiplied by it.
        """

    def slope(self, weights: Array) -> Array:
        """Return d limit / d r_n >= 0 (m,) under pressure; the weights are as in ``limit``."""

    def at(self, speed: Array) -> "FrictionLaw":
        """Return the law at slip rates |v_t| (m,) [m/s] >= 0, with its own limit and slope.

        ``limit`` and ``slope`` of the law itself are those at rest. A law without rates returns
        itself; then nothing is iterated.
        """


@dataclass(frozen=True)
class Frictionless:
    """Let everything slide freely: limit = 0."""

    never_negative: ClassVar[bool] = True

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return zeros (m,): no reaction, however large the pressure.

        Args:
            r_n: normal reactions (m,), ``scale`` times newtons; only their number is read.
            weights: areas (m,) [m²]; not read.
            scale: how many times newtons the reactions of the step are; not read.
        """
        return np.zeros_like(r_n, dtype=float)

    def slope(self, weights: Array) -> Array:
        """Return zeros, shape (m,)."""
        return np.zeros(len(weights))

    def at(self, speed: Array) -> "Frictionless":
        """Return itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class Impact:
    """Tell an impact law of the m conditions.

    Springs do not collide, so their conditions are never active here.

    Attributes:
        before: (m,) normal velocities before the step [m/s], > 0 towards the obstacle.
        v_n: (m,) normal velocities that the step left [m/s].
        active: (m,) True for closed conditions.
        closing: (m,) True for those that have just closed.
    """

    before: Array
    v_n: Array
    active: Mask
    closing: Mask


class ImpactLaw(Protocol):
    """Change velocities after a step in which conditions are closed.

    It is a law of ``laws.impact``, or your own. A law that says ``by_rows = True`` also gets
    velocities of several runs, (k, m) and (k, n), and returns such.
    """

    def target(self, impact: Impact) -> Array:
        """Return the normal velocities (m,) [m/s] after an impact, NaN where they stay as they are.

        > 0 is towards the obstacle, so a rebound is negative. The loop calls it only when some
        condition is active.
        """

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
    ) -> Array:
        """Return the velocity vector (n,) [m/s] with the wanted normal velocities. Collective.

        Args:
            system: the equations that are marched, whose M says what an impulse does.
            surface: its contact conditions; ``surface.normal_values(v)`` are the velocities to
                change.
            v: the velocity (n,) [m/s] that the step left; not to be written to.
            target: wanted normal velocities (m,) [m/s], NaN where they stay as they are.
        """


class MassLaw(Protocol):
    """Choose the mass matrix that contact is marched with."""

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem:
        """Return ``system.changed(M=…, massless=…)`` with the wanted mass, or ``system`` as it is.

        Total mass and centre of mass should stay as they are; C and the load follow when inertia is
        moved. Collective.

        Args:
            system: in the rotated basis of ``surface``, every body in its own unknowns, before the
                excitations.
            surface: the conditions, whose nodes may lose their inertia (``massless``: True for
                unknowns without).
            tangential: whether there is friction: then tangential contact unknowns matter as normal
                ones do.
        """
