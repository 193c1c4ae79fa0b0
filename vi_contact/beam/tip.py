"""Solve friction at the tip.

There is one scalar equation per step for the slip s = u_m^{k+1} - u_m^k (Ahn 2012, section 7).

Condensed to the tip, the step says  c s - g + R = 0  with the friction R that the wall takes from
the beam [N]: c > 0 [N/m] is the stiffness of the step, g [N] the force that would hold the tip.
With limit = mu |r_N| >= 0:

    exact           |R| <= limit,   R = limit sgn(s) where s is not zero        (2.8), (2.9)
    regularised     R = limit s / sqrt(s² + eps²)                               (7.1), J' of (3.5)

eps [m] is a slip per *step*, not a speed: the rate that is rounded off is eps/dt.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Protocol

from ..core.arguments import check_fields
from ..core.errors import StepFailure
from ..core.quantities import Positive, Unit


@dataclass(frozen=True)
class Slip:
    """Hold what friction makes of a step.

    Args:
        s: the slip of the tip [m], positive upwards.
        force: R [N], which the wall takes from the beam, positive with s.
        updates: of Newton's method.
    """

    s: float
    force: float
    updates: int


class TipFriction(Protocol):
    """Solve the scalar equation: what every friction at the tip offers."""

    def solve(self, c: float, g: float, limit: float) -> Slip:
        """Return the slip of a step, the root of c s - g + R(s) = 0.

        Args:
            c: stiffness of the step at the tip, positive [N/m].
            g: the force that would hold the tip [N].
            limit: mu |r_N| >= 0 [N].
        """


@dataclass(frozen=True)
class ExactFriction:
    """Solve the inequality itself: the tip sticks while |g| <= limit, else R = ± limit.

    Closed form, no iteration.
    """

    def solve(self, c: float, g: float, limit: float) -> Slip:
        """Return s = (g - R)/c [m] with R [N] the point of [-limit, limit] nearest to g.

        Args:
            c: stiffness of the step at the tip, positive [N/m].
            g: the force that would hold the tip [N].
            limit: mu |r_N| >= 0 [N].
        """
        force = min(max(g, -limit), limit)
        return Slip((g - force) / c, force, 0)


@dataclass(frozen=True)
class RegularisedFriction:
    """Solve (7.9) by Newton's method from s = 0.

    The equation is multiplied by the root:

        F(s) = sqrt(s² + eps²) (c s - g) + limit s = 0

    F has one zero, between 0 and the frictionless slip g/c, but is not monotonic where the slip is
    large beside eps; Newton's method may then run away.

    Args:
        eps: slip of a step at which the friction is 0.7 of its limit [m].
        tolerance: of |F| over c eps² [-], plus the round-off of F.
        absolute: of |F| [N m], in place of ``tolerance``; 1e-10 in the source.
        max_iterations: of Newton updates.
        safeguard: bisect when an iterate leaves the bracket of the zero; off, the method is that of
            the source.

    Raises:
        InputError: a number is outside its range.

    Source: J. Ahn (2012), equations (7.8) and (7.9).
    """

    eps: Annotated[float, Positive, Unit("m")]
    tolerance: Annotated[float, Positive] = 1e-12
    absolute: Annotated[float | None, Positive, Unit("N m")] = None
    max_iterations: Annotated[int, Positive] = 60
    safeguard: bool = True

    def __post_init__(self) -> None:
        check_fields(self)

    def solve(self, c: float, g: float, limit: float) -> Slip:
        """Return the zero of F.

        Args:
            c: stiffness of the step at the tip, positive [N/m].
            g: the force that would hold the tip [N].
            limit: mu |r_N| >= 0 [N].

        Raises:
            StepFailure: max_iterations updates do not reach the tolerance.
        """
        # The bracket of the zero is a little wider than 0 to g/c, as the zero may be its end.
        low, high = sorted((0.0, g / c * (1.0 + 1e-9)))
        s = 0.0
        for updates in range(self.max_iterations + 1):
            root = math.hypot(s, self.eps)
            F = root * (c * s - g) + limit * s
            if self.absolute is None:
                round_off = 1e-15 * (abs(c * s) + abs(g) + limit) * root
                negligible = self.tolerance * c * self.eps**2 + round_off
            else:
                negligible = self.absolute
            if abs(F) <= negligible:
                return Slip(s, limit * s / root, updates)

            # F rises through its zero: its sign says on which side of it s is.
            if self.safeguard and F < 0.0:
                low = s
            elif self.safeguard:
                high = s

            # Newton's update, or the middle of the bracket where it leaves that.
            slope = s / root * (c * s - g) + root * c + limit
            s = s - F / slope if slope else math.inf
            if self.safeguard and not low <= s <= high:
                s = 0.5 * (low + high)
            if not math.isfinite(s):
                break
        raise StepFailure(
            f"Newton's method for the slip of the tip did not converge in {updates} updates (|F| = "
            f"{abs(F):.1e} N m): take a smaller time step, a larger eps, safeguard=True or "
            "ExactFriction()"
        )
