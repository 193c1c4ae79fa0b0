"""Solve the impact of a particle on a wall in closed form.

See b-geometry, ENOC 2017, equations 35 to 38.

With y = ln x the normal equation (35) is linear, m y'' = k - (c/V) y', and b cancels. From x = a, ẋ
= -V:

    x(t) = a exp(beta),   beta = kappa [(1 + s) T² phi(s T) - T]                (36)
    ẋ = (V/a) x [(1 + s) T psi(s T) - 1]
    s = c/(a k),  kappa = m V²/(k a²),  T = a k t/(m V)
    phi(z) = (exp(-z) - 1 + z)/z²,  psi(z) = (1 - exp(-z))/z

(this form of (36) has no difference of large numbers as c -> 0). Consequences, with h(z) = (z -
ln(1 + z))/z²:

    compression ends at t_c = m V/(a k) ln(1 + s)/s,    x_min = a exp(-kappa h(s))
    e = V'/V is the root of e² h(-s e) = h(s), that is e = tau/s - 1
    tau = 1 + s + W0(-(1 + s) exp(-(1 + s)))
    contact ends at t_f = (1 + e) m V/(a k)

e depends on s alone: e = 1 - 2/3 s + ... for small s, and tends to 1/s for large s. A speed V of
the law that is not the particle's own U changes s to c U/(a k V).
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import exprel, lambertw

from ..core.algebra import Array
from ..core.checks import instance, number
from ..core.errors import InputError
from .layer import Layer, check_size

LEAST = 1e-9  # least restitution that is asked for


@dataclass(frozen=True)
class ParticleImpact:
    """Solve the impact of a particle that reaches x = a of the layer, in closed form.

    The equations are those at the head of this file; x is the distance from the obstacle.

    Args:
        layer: the law; k must be positive, as without it no particle leaves the layer.
        mass: m [kg].
        speed: V [m/s], of the particle at x = a, positive towards the obstacle.

    Raises:
        InputError: a value is outside its range.

    Source: ENOC 2017, equations 35 to 38.
    """

    layer: Layer
    mass: float
    speed: float

    def __post_init__(self) -> None:
        instance("ParticleImpact", "layer", self.layer, Layer, "give a Layer")
        check_size("ParticleImpact", "the particle's mass", self.mass, "kg")
        check_size("ParticleImpact", "the particle's speed", self.speed, "m/s")
        if self.layer.k == 0.0:
            raise InputError(
                "layer parameter k is zero: the particle would stay in the layer, give k > 0"
            )

    @property
    def damping_ratio(self) -> float:
        """Return s = c/(a k) [-], times the particle's speed over the law's."""
        layer = self.layer.at(self.speed)
        return layer.c / (layer.a * layer.k) * (self.speed / layer.v)

    @property
    def _time(self) -> float:
        """Return m V/(a k), the unit of T [s]."""
        return self.mass * self.speed / (self.layer.a * self.layer.k)

    @property
    def _kappa(self) -> float:
        """Return kappa of (36) [-]."""
        return self.mass * self.speed**2 / (self.layer.k * self.layer.a**2)

    @property
    def restitution(self) -> float:
        """Return e_v = V'/V [-], Newton's coefficient (37)."""
        return restitution(self.damping_ratio)

    @property
    def compression_time(self) -> float:
        """Return t_c [s], when the velocity is zero."""
        return self._time / float(exprel(np.log1p(self.damping_ratio)))

    @property
    def duration(self) -> float:
        """Return t_f [s], when the particle is back at x = a."""
        return self._time * (1.0 + self.restitution)

    @property
    def deepest(self) -> float:
        """Return x_min [m], the least distance."""
        return float(self.layer.a * np.exp(-self._kappa * _h(self.damping_ratio)))

    def position(self, t: Array | float) -> Array:
        """Return x [m] at times 0 <= t <= t_f [s], of the shape of t."""
        T = np.asarray(t, dtype=float) / self._time
        s = self.damping_ratio
        return np.asarray(self.layer.a * np.exp(self._kappa * ((1.0 + s) * T**2 * _phi(s * T) - T)))

    def velocity(self, t: Array | float) -> Array:
        """Return ẋ [m/s] at times 0 <= t <= t_f [s], of the shape of t, negative on the way in."""
        T = np.asarray(t, dtype=float) / self._time
        s = self.damping_ratio
        return np.asarray(
            self.speed / self.layer.a * self.position(t) * ((1.0 + s) * T * exprel(-s * T) - 1.0)
        )

    def boundary_force(self, t: Array | float) -> Array:
        """Return f̂_1 of (25) [N] at times t [s], without cut-off: x does not exceed a."""
        x = self.position(t)
        layer = self.layer.at(self.speed)
        return np.asarray(layer.width**2 * (layer.k - layer.c / layer.v * self.velocity(t) / x) / x)

    @property
    def poisson(self) -> float:
        """Return e_p = p_r/p_c [-] of (37), (38) with f = m dv/dt, the force on the particle.

        It is equal to Newton's e_v.
        """
        return float(self.velocity(self.duration) / self.speed)

    @property
    def poisson_covector(self) -> float:
        """Return e_p [-] with f = f̂_1 in (38).

        That is the force in the covector space of the boundary; e_p is a little above e_v.
        """
        t_c = self.compression_time
        t_f = self.duration

        # Impulses of compression p_c and of restitution p_r.
        p_c, *_ = quad(self.boundary_force, 0.0, t_c, epsabs=0.0, epsrel=1e-12)
        p_r, *_ = quad(self.boundary_force, t_c, t_f, epsabs=1e-12 * abs(p_c), epsrel=1e-12)
        return float(p_r / p_c)


def restitution(s: float) -> float:
    """Return the restitution e [-] of a damping ratio s = c/(a k) >= 0 [-]: e² h(-s e) = h(s).

    Raises:
        InputError: s is negative or no number.
    """
    number("restitution", "the damping ratio s = c/(a k)", s, not_negative=True)
    if s > 1.0:
        return (1.0 + float(lambertw(-(1.0 + s) * np.exp(-(1.0 + s))).real)) / s

    # Newton's method from the series for small s; e² h(-s e) has the derivative e/(1 - s e).
    e = 1.0 - 2.0 / 3.0 * s + 4.0 / 9.0 * s**2
    if s < 0.3:
        e = e - 44.0 / 135.0 * s**3
    for _ in range(8):
        e -= (e**2 * _h(-s * e) - _h(s)) * (1.0 - s * e) / e
    return e


def damping_ratio(e: float) -> float:
    """Return s = c/(a k) [-] that gives the restitution 0 < e <= 1: inverse of ``restitution``.

    Raises:
        InputError: e is not between 1e-9 and 1.
    """
    if not LEAST <= number("damping_ratio", "the restitution coefficient e", e) <= 1.0:
        raise InputError(
            f"damping_ratio: the restitution coefficient e is {e}; give a number from {LEAST:g} to "
            "1"
        )
    if e == 1.0:
        return 0.0
    most = (1.0 + 1e-9) / e  # e(s) < 1/s
    return float(brentq(lambda s: restitution(s) - e, 0.0, most, xtol=1e-300, rtol=1e-15))


def layer_for(
    e: float,
    *,
    mass: float,
    speed: float,
    width: float,
    start: float | None = None,
    deepest: float = 0.5,
) -> Layer:
    """Find the layer from which a particle returns with a wanted restitution.

    This holds for the dominant terms, ``Metric.DOMINANT``: s = c/(a k) follows from e, and k from
    x_min = a exp(-kappa h(s)) with kappa = m V²/(k a²).

    Args:
        e: V'/V, 0 < e <= 1 [-].
        mass: m [kg].
        speed: V [m/s].
        width: b [m].
        start: a [m], where the force is complete; None: a = b.
        deepest: x_min/a [-], what is left of the distance a at the greatest compression, below 1.

    Returns:
        The layer, with its speed V.

    Raises:
        InputError: a value is outside its range.

    Source: ENOC 2017, equations 36 and 37, solved for k and c.
    """
    if not 0.0 < number("layer_for", "deepest", deepest) < 1.0:
        raise InputError(
            f"layer_for: deepest is {deepest}; give the part of the layer that is left, between 0 "
            "and 1"
        )
    check_size("layer_for", "the mass", mass, "kg")
    check_size("layer_for", "the speed", speed, "m/s")
    check_size("layer_for", "the layer width b", width, "m")
    s = damping_ratio(e)
    a = width if start is None else check_size("layer_for", "start", start, "m")
    k = mass * speed**2 / a**2 * _h(s) / -np.log(deepest)
    return Layer(width, k=float(k), c=float(s * a * k), speed=speed, start=start)


def _h(z: float) -> float:
    """Return (z - ln(1 + z))/z², ½ at z = 0, by its series where digits would be lost."""
    if abs(z) > 0.05:
        return float((z - np.log1p(z)) / z**2)
    return sum((-z) ** n / (n + 2.0) for n in range(14))


def _phi(z: Array) -> Array:
    """Return (exp(-z) - 1 + z)/z², ½ at z = 0, by its series where digits would be lost."""
    small = np.abs(z) < 0.05
    large = np.where(small, 1.0, z)
    series = np.zeros_like(z)
    term = np.full_like(z, 0.5)
    for n in range(10):
        series = series + term
        term = -term * z / (n + 3.0)
    return np.where(small, series, (np.expm1(-large) + large) / large**2)
