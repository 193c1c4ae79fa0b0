"""Solve the bouncing of an elastic bar on a rigid wall under gravity, by characteristics.

    rho u_tt = E u_xx - rho g,   u_x(length, t) = 0,   u = u_t = 0 at t = 0,
    y = height + u(0, t) >= 0,   p = -E u_x(0, t) >= 0,   y p = 0

u(x, t) [m] is positive upwards. With c = sqrt(E/rho), T = length/c and F(s) = 0 for s <= 0 every
solution is

    u(x, t) = -g t²/2 + F(t - x/c) + F(t - 2T + x/c),   p(t) = rho c (F'(t) - F'(t - 2T)).

Let a(t) = -g t + 2 F'(t - 2T), the velocity of a free foot, known 2T ahead. Where the foot touches
and a < 0 it stays (y' = 0, p = -rho c a), else it is free (p = 0, y' = a): F is quadratic between
events, and these are roots of quadratics, so that the solution is exact to round-off. A periodic
motion costs a few pieces per bounce; in others their number multiplies with every bounce, a
thousand or so after five.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.errors import InputError
from ..core.quantities import Positive, Unit
from .bar import UprightBar

# events and piece ends closer than this, relative to the problem's own scales, are the same
COINCIDENT = 1e-12


@dataclass(frozen=True)
class BouncingBar(UprightBar):
    """Describe a bar released at rest `height` above the wall.

    The defaults are those of Doyen, Ern, Piperno (2011), second test.

    The fall takes t_f = sqrt(2 height/g). For integer t_f/T >= 3 the motion is periodic, 4T + 4t_f,
    and the first contact, of length 2T, has p = rho c g (t_f + r), r the time since touch-down; the
    second has it in reverse. Methods take t >= 0; where velocity and pressure jump they return the
    later value.
    """

    gravity: Annotated[float, Positive, Unit("m/s²")] = 10.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def fall_time(self) -> float:
        """Return t_f = sqrt(2 height/g) [s], when the first contact starts."""
        return math.sqrt(2.0 * self.height / self.gravity)

    @property
    def period(self) -> float:
        """Return 4T + 4t_f [s].

        Raises InputError unless t_f/T is an integer >= 3: no other period is known.
        """
        ratio = self.fall_time / self.crossing
        if abs(ratio - round(ratio)) > 1e-9 * ratio or round(ratio) < 3:
            raise InputError(
                f"BouncingBar: fall time over crossing time is {ratio:.6g}, which gives no known "
                "period; choose a height for which it is an integer of at least 3"
            )
        return 4.0 * (self.crossing + self.fall_time)

    @property
    def energy(self) -> float:
        """Return rho length g height [J/m²] at any time.

        It is zero for the undeformed bar at rest on the wall.
        """
        return self.rho * self.length * self.gravity * self.height

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u(x, t) [m]."""
        t, up, down = self._waves(x, t)
        return up[0] + down[0] - 0.5 * self.gravity * t**2

    def velocity(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_t(x, t) [m/s]."""
        t, up, down = self._waves(x, t)
        return up[1] + down[1] - self.gravity * t

    def strain(self, x: ArrayLike, t: ArrayLike) -> Array:
        """Return u_x(x, t)."""
        _, up, down = self._waves(x, t)
        return (down[1] - up[1]) / self.wave_speed

    def force(self, t: ArrayLike) -> Array:
        """Return the contact pressure p(t) [Pa] >= 0."""
        _, now, before = self._waves(0.0, t)
        return np.where(now[2], self.rho * self.wave_speed * (now[1] - before[1]), 0.0)

    def foot(self, t: ArrayLike) -> Array:
        """Return the height y(t) of the foot above the wall [m], >= 0 to round-off."""
        return self.height + self.displacement(0.0, t)

    def contacts(self, until: float) -> Array:
        """Return start and end of the contacts before `until` [s].

        They have one row each and are clipped there; the shape is (m, 2).
        """
        start, _, closed = self._history(until)
        change = np.flatnonzero(np.diff(closed, append=0.0))
        times = np.append(start, math.inf)[change + 1].reshape(-1, 2)
        return np.minimum(times[times[:, 0] < until], until)

    def _waves(self, x: ArrayLike, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return t, and (F, F', in contact) at t - x/c, upwards, and at t - 2T + x/c, downwards."""
        delay = np.asarray(x, dtype=float) / self.wave_speed
        t = np.asarray(t, dtype=float)
        start, wave, closed = self._history(float(np.max(t, initial=0.0)))

        def evaluate(s: Array) -> Array:
            """Return F, F' and 1.0 in contact at arguments s [s], of the pieces they lie in."""
            piece = np.maximum(np.searchsorted(start, s, side="right") - 1, 0)
            value, slope, curvature = np.moveaxis(wave[piece], -1, 0)
            after = s - start[piece]
            F = value + (slope + 0.5 * curvature * after) * after
            return np.stack([F, slope + curvature * after, closed[piece]])

        up = evaluate(np.asarray(t - delay))
        down = evaluate(np.asarray(t - 2.0 * self.crossing + delay))
        return t, up, down

    def _history(self, until: float) -> tuple[Array, Array, Array]:
        """Return the pieces of F up to a time [s].

        They are their starts (m,) [s]; value, slope and curvature there (m, 3); and 1.0 for those
        in contact (m,).
        """
        return _pieces(self, 1 + math.ceil(until / (2.0 * self.crossing)))


@lru_cache(maxsize=8)
def _pieces(bar: BouncingBar, round_trips: int) -> tuple[Array, Array, Array]:
    """Return the pieces of F from -2T to at least `round_trips` · 2T.

    They are as BouncingBar._history returns them.
    """
    trip = 2.0 * bar.crossing
    g = bar.gravity
    near = COINCIDENT * (bar.height + g * trip**2)
    slow = COINCIDENT * g * (bar.fall_time + trip)

    # From event to event, a piece each. Before t = 0 there is one without motion.
    start = [-trip]
    wave = [(0.0, 0.0, 0.0)]
    closed = [False]
    t = 0.0
    y = bar.height
    delayed = 0  # the piece that holds t - 2T
    while t < round_trips * trip:
        # The piece that comes back from the top now, its value and slope at t - 2T, and its end.
        while delayed + 1 < len(start) and start[delayed + 1] + trip <= t + COINCIDENT * trip:
            delayed += 1
        end = (start[delayed + 1] if delayed + 1 < len(start) else t) + trip
        value, slope, curvature = wave[delayed]
        after = t - trip - start[delayed]
        value = value + (slope + 0.5 * curvature * after) * after
        slope = slope + curvature * after

        # Velocity and acceleration of a free foot; what is round-off is zero.
        a = 2.0 * slope - g * t
        a1 = 2.0 * curvature - g
        y = 0.0 if y <= near else y
        a = 0.0 if abs(a) <= slow else a
        touching = y == 0.0 and (a < 0.0 or (a == 0.0 and a1 < 0.0))

        # F of the new piece, by y' = 0 of a foot that touches or p = 0 of a free one, and the event
        # that ends it: release or touch-down.
        fall = bar.height - 0.5 * g * t**2  # where the foot would be without F
        start.append(t)
        closed.append(touching)
        if touching:
            wave.append((-fall - value, g * t - slope, g - curvature))
            event = t - a / a1 if a1 > 0.0 else math.inf  # a grows to zero
        else:
            wave.append((y - fall - value, slope, curvature))
            event = t + find_first_root(y, a, a1)

        # Go on to it, or to the end of the piece that comes back.
        step = (event if event < end - COINCIDENT * trip else end) - t
        t += step
        y = 0.0 if touching or t == event else y + (a + 0.5 * a1 * step) * step
    return np.array(start), np.array(wave), np.array(closed, dtype=float)


def find_first_root(y: float, a: float, a1: float) -> float:
    """Return the first s > 0 at which y + a s + a1 s²/2 is zero, or infinity if there is none.

    Args:
        y: value at s = 0, zero or more.
        a: slope at s = 0.
        a1: curvature.
    """
    disc = a * a - 2.0 * a1 * y
    if disc < 0.0 or (a1 >= 0.0 and a >= 0.0):
        return math.inf
    root = math.sqrt(disc)
    return (-a - root) / a1 if a > 0.0 else 2.0 * y / (root - a)
