"""Describe what a problem asks of the law of a joint: protocol and values of users' own laws.

``core.joints`` says what a step makes of them.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from .algebra import Array
from .checks import describe_point, refuse
from .surfaces import ContactSurface

Committed = Mapping[str, Array]


class Strength(NamedTuple):
    """Hold what a joint bears, a number for each of m points.

    A law gives stresses [Pa]; a step has forces [N], which are stresses times weights.

    Attributes:
        tension: the tensile strength (m,).
        cohesion: the tangential strength without pressure (m,).
        mu: the slope of the tangential strength (m,), a pure number.
        water: the pressure of the water in the joint (m,); friction does not feel it.
    """

    tension: Array
    cohesion: Array
    mu: Array
    water: Array


class Slope(NamedTuple):
    """Hold how the strength changes with the end of a step, for Newton's method.

    Attributes:
        tension: d tension / d opening (m,) [Pa/m].
        mu: d mu / d |s1 - s0| (m,) [1/m].
    """

    tension: Array
    mu: Array


class JointLaw(Protocol):
    """Say what the points of a joint bear: three functions, and where they start.

    A law is a value without state. In all functions g0, g1 (m,) [m] are openings and s0, s1
    (m, d - 1) [m] slips at the beginning and at the end of a step of dt [s]; dt is 0 in a static
    stage. Arrays that come in are not written to. Optional members, which a frame without them
    takes as said:

    - ``never_negative``: True for a law that has checked its values, whose answers are not looked
      at. Else False.
    - ``rubs``: False for a joint without any tangential strength. Else True.
    - ``implicit``: False takes the strength that is there before the step. Else True.
    - ``stored(committed, g)``: energy [J/m²] (m,) that the point gives back when it closes. Else 0.
    - ``dilation(committed)``: how far slip has lifted the point (m,) [m]. Else not at all.
    - ``prestress``: with ``normal`` and ``shear`` [Pa]. Else None.
    - ``softening_of(pressure)``: the steepest losses, a positive ``Slope``; pressure (m,) [Pa].
    - ``lay(surface, rows)``: itself at conditions of this rank, for water that must know them all.
    - ``at_time(t)``: itself with the water of a time [s].
    - ``water_follows``: True where static stages let water into what opens. Else False.
    - ``find_crack(g)``: how long the crack from the wet end is [m]. Else 0.
    - ``at_speed(committed, speed, dt)``: (mu, d mu / d ln speed) (m,) of slip rates [m/s] > 0, for
      laws whose steps are solved for the rate (``RateAndState``).
    """

    def start(self, count: int) -> Committed:
        """Return the committed arrays (count, …) of points that nothing has happened to."""

    def strength(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Strength:
        """Return the mean strength [Pa] over the way from (g0, s0) to (g1, s1).

        Without a way, g1 = g0 and s1 = s0, it is the strength there.
        """

    def slope(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Slope:
        """Return how this mean changes with g1 and with |s1 - s0|."""

    def commit(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Committed:
        """Return the committed arrays after the step, when it is accepted."""


def refuse_overstressed(law: Any, surface: ContactSurface) -> None:
    """Raise InputError, on all ranks, for points whose prestress is beyond their strength.

    Collective.

    Args:
        law: of the joint.
        surface: the contact conditions.
    """
    before = getattr(law, "prestress", None)
    if before is None or before.nucleate or hasattr(law, "at_speed"):
        return
    still = np.zeros(surface.count)
    slip = np.zeros(surface.tangents.shape)
    strength = law.strength(law.start(surface.count), still, still, slip, slip, 0.0)
    shear = np.abs(before.spread("shear", surface.count))
    normal = before.spread("normal", surface.count)
    beyond = np.flatnonzero(shear > strength.cohesion + strength.mu * normal)
    sentences = [
        f"{type(law).__name__}: the shear prestress {shear[point]:g} Pa at "
        f"{describe_point(surface.points[point])} is beyond the strength there: give less, or "
        "Prestress(nucleate=True) if a rupture shall start so"
        for point in beyond[:1]
    ]
    refuse(sentences, surface.comm)
