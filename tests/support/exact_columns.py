"""Solve columns (or layers of any extent) on a rigid base with friction: u(y, t) are exact plane
waves.

y in [0, height], base at y = 0, free top. Pressure waves (u_n, upwards) travel with c_P, shear
waves (u_t) with c_S and ignore each other but for the friction of the base. Tractions, impulses and
energies are per unit of base area. Methods take arrays y and t >= 0 whose shapes broadcast.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.laws.materials import LinearElastic

History = Callable[[Array], Array]


def reflected(history: History, delay: Array, t: Array, *, crossing: float) -> Array:
    """Return the waves that a load at the foot of a uniform bar or layer sends to its free top and
    back:

        sum over k >= 0 of P(t - 2kT - x/c) + P(t - 2(k+1)T + x/c)
        P(t) = integral of p from 0 to t.

    With z the impedance rho c, T = length / c and p(t) the traction on the foot x = 0 (zero for t <
    0), the motion is that of the rigid free body plus q(x, t) / z, where q is this sum (d'Alembert;
    every k is one more reflection):

        q_tt = c² q_xx,   q_x(length, t) = 0,   c q_x(0, t) = -p(t).

    With p instead of P the sum is q_t. history: P [Pa s] or p [Pa], must vanish for negative times;
    delay = x/c [s]; t [s], of shapes that broadcast; crossing T [s]. Returns the unit of history,
    in the broadcast shape.
    """
    total = np.zeros(np.broadcast(delay, t).shape)
    for k in range(int(np.max(t, initial=0.0) / (2.0 * crossing)) + 1):
        total += history(t - 2 * k * crossing - delay) + history(t - 2 * (k + 1) * crossing + delay)
    return total


@dataclass(frozen=True)
class ObliqueImpact:
    """Describe a column that strikes the base at t = 0 with u_n' = -speed_n, u_t' = speed_t,
    Coulomb friction mu.

    It stays for 2 height/c_P under p = rho c_P speed_n. If mu c_P speed_n < c_S speed_t the base
    slips throughout with v_b = speed_t - mu (c_P/c_S) speed_n under the traction mu p, else it
    sticks under rho c_S speed_t: the shear wave returns only after the contact, as c_S < c_P.
    height [m]; speeds [m/s]; mu >= 0. InputError for other values.
    """

    height: Annotated[float, Positive, Unit("m")]
    material: LinearElastic
    speed_n: Annotated[float, Positive, Unit("m/s")]
    speed_t: Annotated[float, NotNegative, Unit("m/s")]
    mu: Annotated[float, NotNegative]

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def duration(self) -> float:
        """Return 2 height/c_P [s]."""
        return 2.0 * self.height / self.material.c_p

    @property
    def pressure(self) -> float:
        """Return rho c_P speed_n [Pa], constant during the contact."""
        return self.material.rho * self.material.c_p * self.speed_n

    @property
    def traction(self) -> float:
        """Return the friction on the base [Pa], against speed_t: min(mu p, rho c_S speed_t)."""
        return min(self.mu * self.pressure, self.material.rho * self.material.c_s * self.speed_t)

    @property
    def slip_speed(self) -> float:
        """Return v_b [m/s] >= 0, 0 when the base sticks."""
        return max(
            0.0, self.speed_t - self.mu * self.material.c_p / self.material.c_s * self.speed_n
        )

    @property
    def impulses(self) -> tuple[float, float]:
        """Return the normal (upwards) and tangential (along speed_t) impulse of the base on the
        column [Pa s]."""
        return self.pressure * self.duration, -self.traction * self.duration

    @property
    def friction_work(self) -> float:
        """Return the energy lost to friction [J/m²]: traction · v_b · duration."""
        return self.traction * self.slip_speed * self.duration

    @property
    def energy(self) -> float:
        """Return the kinetic and strain energy after the contact [J/m²]."""
        kinetic = 0.5 * self.material.rho * self.height * (self.speed_n**2 + self.speed_t**2)
        return kinetic - self.friction_work

    def displacement(self, y: ArrayLike, t: ArrayLike) -> Array:
        """Return (u_n, u_t) [m], shape (..., 2)."""
        return self._motion(y, t, lambda s: s, lambda s: np.clip(s, 0.0, self.duration))

    def velocity(self, y: ArrayLike, t: ArrayLike) -> Array:
        """Return the time derivative of `displacement` [m/s]; on a front one of its two values."""
        return self._motion(y, t, np.ones_like, lambda s: 1.0 * ((s >= 0.0) & (s < self.duration)))

    def _motion(self, y: ArrayLike, t: ArrayLike, rigid: History, pulse: History) -> Array:
        y, t = np.asarray(y, dtype=float), np.asarray(t, dtype=float)
        c_p, c_s, rho = self.material.c_p, self.material.c_s, self.material.rho
        normal = self.speed_n * reflected(pulse, y / c_p, t, crossing=self.height / c_p)
        tangential = (
            self.traction / (rho * c_s) * reflected(pulse, y / c_s, t, crossing=self.height / c_s)
        )
        return np.stack(
            [normal - self.speed_n * rigid(t), self.speed_t * rigid(t) - tangential], axis=-1
        )


@dataclass(frozen=True)
class ShearColumn:
    """Describe a column that slides on its base from u_t' = speed until it sticks, threshold tau_y
    (Tresca).

    With c = c_S, T = height/c and delta = tau_y/(rho c), in the n-th round trip, 2nT < t < 2(n+1)T,
    the base slips with speed - (2n+1) delta under the traction tau_y as long as this is positive.
    Then it sticks for good: the traction is then rho c (speed - 2n delta) in absolute value and
    changes sign with every round trip. height [m], speed [m/s], tau_y [Pa]. Raises InputError
    unless all are finite and positive.
    """

    height: Annotated[float, Positive, Unit("m")]
    material: LinearElastic
    speed: Annotated[float, Positive, Unit("m/s")]
    tau_y: Annotated[float, Positive, Unit("Pa")]

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def crossing(self) -> float:
        """Return T = height/c [s]."""
        return self.height / self.material.c_s

    @property
    def impedance(self) -> float:
        """Return rho c [kg/(m² s)]."""
        return self.material.rho * self.material.c_s

    @property
    def delta(self) -> float:
        """Return tau_y/(rho c) [m/s]."""
        return self.tau_y / self.impedance

    @property
    def slip_speeds(self) -> Array:
        """Return the slip speed [m/s] in every round trip until the base sticks, shape (m,)."""
        trips = max(0, math.ceil(0.5 * (self.speed / self.delta - 1.0)))
        return self.speed - (2.0 * np.arange(trips) + 1.0) * self.delta

    @property
    def stick_time(self) -> float:
        """Return the time at which the base comes to rest [s]."""
        return 2.0 * self.crossing * len(self.slip_speeds)

    @property
    def slip(self) -> float:
        """Return the total slip [m]."""
        return 2.0 * self.crossing * float(self.slip_speeds.sum())

    @property
    def friction_work(self) -> float:
        """Return the energy lost to friction [J/m²]."""
        return self.tau_y * self.slip

    @property
    def energy(self) -> float:
        """Return the kinetic and strain energy left once the base sticks [J/m²]: ½ rho height
        (speed - 2n delta)²."""
        left = self.speed - 2.0 * len(self.slip_speeds) * self.delta
        return 0.5 * self.material.rho * self.height * left**2

    def traction(self, t: ArrayLike) -> Array:
        """Return the friction on the base [Pa], positive against the speed; 0 before t = 0."""
        t = np.asarray(t, dtype=float)
        trip = np.floor(t / (2.0 * self.crossing)).astype(int)
        slips = len(self.slip_speeds)
        held = (
            self.impedance
            * (self.speed - 2.0 * slips * self.delta)
            * np.where((trip - slips) % 2, -1.0, 1.0)
        )
        return np.where(t < 0.0, 0.0, np.where(trip < slips, self.tau_y, held))

    def displacement(self, y: ArrayLike, t: ArrayLike) -> Array:
        """Return u_t(y, t) [m]."""
        t = np.asarray(t, dtype=float)
        return self.speed * t - self._waves(self._impulse, y, t)

    def velocity(self, y: ArrayLike, t: ArrayLike) -> Array:
        """Return the time derivative of `displacement` [m/s]; on a front one of its two values."""
        return self.speed - self._waves(self.traction, y, np.asarray(t, dtype=float))

    def _waves(self, history: History, y: ArrayLike, t: Array) -> Array:
        delay = np.asarray(y, dtype=float) / self.material.c_s
        return reflected(history, delay, t, crossing=self.crossing) / self.impedance

    def _impulse(self, t: Array) -> Array:
        """Return the integral of the traction from 0 to t [Pa s], 0 for t < 0."""
        after = np.maximum(t - self.stick_time, 0.0)
        trip = 2.0 * self.crossing
        held = self.traction(np.asarray(self.stick_time + 0.5 * trip)) * (
            trip - np.abs(after % (2.0 * trip) - trip)
        )
        return self.tau_y * np.clip(t, 0.0, self.stick_time) + held
