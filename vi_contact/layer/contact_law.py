"""Give the boundary layer as a contact law of finite elements.

It gives the reaction of a node over one time step.

Per unit area of the contact boundary, rho = gap > 0, y = ln rho (b-geometry with the blended
metric, see ``Metric``):

    p = delta(rho)/rho · b² [k - (c/V) ẏ - gamma ÿ],        ÿ = ρ̈/rho - ρ̇²/rho²

gamma [kg/m²] is g_11 per area: -gamma b² ÿ/rho is the reaction of the metric, -ĝ_11 (ρ̈ - ρ̇²/rho).
At rest p = k b²/rho: the law is a logarithmic barrier, and tends to the exact inequality 0 <= p ⊥
rho >= 0 as b -> 0. The mean over a step from rho_0 to rho_1 is that of the midpoint rule in y:

    p̄ = (Y_1 - Y_0)/(rho_1 - rho_0) · b² [k - (c/V)(y_1 - y_0)/dt - gamma (w_1 - w_0)/dt]
    Y' = delta/rho,    Y(b) = 0
    (w_0 + w_1)/2 = (y_1 - y_0)/dt
    w_0 = ẏ = ρ̇/rho where the step begins outside the layer, carried on inside it

Order 2. Energy: the part with k does exactly the work of a potential -k b² Y; the part with gamma,
where delta = 1, that of a kinetic energy ½ gamma b² w²; the part with c never gives any. Where the
metric is cut off the part with gamma gives ½ gamma (ẋ_in² - ẋ_out²) to a body that returns more
slowly than it came: nothing to a stiff body without loss, O(b) with gamma = O(b). However large the
step, p̄ is unbounded as rho_1 -> 0: the gap stays open. w is carried because ρ̇/rho from the
velocities of the body would leave order 1.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from ..core.algebra import Array
from ..core.checks import instance, number, quote
from ..core.errors import InputError
from ..core.quantities import RATIO, Unit
from ..core.surfaces import ContactSurface
from .layer import Layer, check_size
from .metric import Metric
from .particle import damping_ratio
from .trajectory import cross_layer

LEAST_RESTITUTION = 1e-3  # below it the search takes minutes
DOUBLINGS = 60  # of the damping ratio in search of a rebound
# |rho_1 - rho_0| over rho below which the quotient is the derivative in the middle.
SHORT_STEP = 1e-5


@dataclass(frozen=True)
class ContactLayer:
    """Describe the law of a contact boundary: pressure as a function of the gap and its rate.

    The equations are those at the head of this file; pressures push the body away from the
    obstacle.

    Args:
        layer: width b, start a < b [m]; k [N/m per m²], c [N per m²]; its speed V [m/s] must be
            given.
        mass: gamma >= 0 [kg/m²] of the metric's terms: for a stiff body its mass over its contact
            area; 0: without them, a potential and a damper, which never give energy.

    Raises:
        InputError: a value is outside its range, or the layer has no V or no transition from a to
            b.
    """

    layer: Layer
    mass: float = 0.0

    def __post_init__(self) -> None:
        instance("ContactLayer", "layer", self.layer, Layer, "give a Layer")
        owner = "ContactLayer"
        meaning = "the law's mass per area"
        if number(owner, meaning, self.mass, not_negative=True, unit="kg/m²"):
            check_size(owner, meaning, self.mass, "kg/m²")
        if self.layer.speed is None:
            raise InputError(
                "a contact law needs the layer's speed V: give Layer(speed=...), the speed of "
                "approach"
            )
        if self.layer.a >= self.layer.width:
            raise InputError(
                "a contact law needs a force that fades out: give the layer a start a below its "
                "width b"
            )

    @cached_property
    def _fading(self) -> CubicHermiteSpline:
        """Return Y on [a, b] as a function of ln rho, to ten digits; its derivative is delta."""
        y = np.linspace(np.log(self.layer.a), np.log(self.layer.width), 801)
        delta = self.layer.cut_off(np.exp(y))
        middle = self.layer.cut_off(np.exp(0.5 * (y[1:] + y[:-1])))

        # Simpson's rule, a third of the trapezia and two of the values in the middle.
        trapezia = cumulative_trapezoid(delta, y, initial=0.0)
        Y = np.append(0.0, np.cumsum(4.0 * middle)) * (y[1] - y[0]) / 6.0 + trapezia / 3.0
        return CubicHermiteSpline(y, Y - Y[-1], delta)

    def set_back(self, surface: ContactSurface) -> ContactSurface:
        """Return the surface with its obstacle moved back by b.

        A body that touched it now touches the layer's edge.
        """
        instance(
            "ContactLayer.set_back", "surface", surface, ContactSurface, "give a contact surface"
        )
        return replace(surface, gap0=surface.gap0 + self.layer.width)

    def potential(self, rho: Array) -> Array:
        """Return Y <= 0: -k b² Y is the energy stored per area when nothing moves [J/m²]."""
        a = np.log(self.layer.a)
        b = np.log(self.layer.width)
        y = np.log(rho)

        # Below a the slope over ln rho is 1, beyond b it is 0.
        fading = np.where(y < b, self._fading(np.clip(y, a, b)), 0.0)
        return np.where(y < a, self._fading(a) + y - a, fading)

    def mean_pressure(self, rho: Array, old: Array, rate: Array, dt: float) -> tuple[Array, Array]:
        """Return the mean pressure p̄ (m,) [Pa] of a step and its derivative d p̄/d rho_1 [Pa/m].

        Args:
            rho: gaps at the end of the step (m,) [m], positive.
            old: gaps at its beginning (m,) [m], positive.
            rate: w_0 = d ln(rho)/dt at its beginning (m,) [1/s].
            dt: time step [s].
        """
        layer = self.layer
        gamma = self.mass

        # bracket: b² [k - …] of the law; damper: its factor of ln rho_1, without b².
        squared = layer.width**2
        damper = layer.c / layer.v / dt + 2.0 * gamma / dt**2
        bracket = squared * (layer.k - damper * np.log(rho / old) + 2.0 * gamma / dt * rate)

        # quotient: (Y_1 - Y_0)/(rho_1 - rho_0), of short steps Y' in the middle.
        step = rho - old
        middle = 0.5 * (rho + old)
        cut = layer.cut_off
        near = np.abs(step) < SHORT_STEP * middle
        step = np.where(near, middle, step)
        difference = (self.potential(rho) - self.potential(old)) / step
        quotient = np.where(near, cut(middle) / middle, difference)

        # slope: its derivative by rho_1, of short steps half of Y'' by a central difference.
        h = 1e-4 * middle
        bend = 0.5 * (cut(middle + h) / (middle + h) - cut(middle - h) / (middle - h)) / (2.0 * h)
        slope = np.where(near, bend, (cut(rho) / rho - quotient) / step)
        return quotient * bracket, slope * bracket - quotient * squared * damper / rho

    def rebound(self, mass: float, speed: float) -> float:
        """Return the restitution e [-] of a rigid body that enters, by one equation in time.

        Args:
            mass: of the body [kg/m²].
            speed: with which it enters [m/s].

        Raises:
            InputError: a value is outside its range, or a law with metric, which knows its own mass
                alone, is asked for another.
        """
        check_size("ContactLayer.rebound", "mass", mass, "kg/m²")
        check_size("ContactLayer.rebound", "speed", speed, "m/s")
        if self.mass not in (0.0, mass):
            raise InputError(
                f"the law's metric is that of {self.mass} kg/m²: ask for the rebound of that mass"
            )
        return _rebound(self.layer, mass, speed, Metric.BLENDED if self.mass else Metric.FLAT)


def contact_layer(
    e: Annotated[float, RATIO],
    *,
    mass: Annotated[float, Unit("kg/m²")],
    speed: Annotated[float, Unit("m/s")],
    width: Annotated[float, Unit("m")],
    start: Annotated[float | None, Unit("m")] = None,
    strength: Annotated[float, RATIO] = 1.0,
    metric: Metric = Metric.BLENDED,
) -> ContactLayer:
    """Find the law of a contact boundary that returns a rigid body with a wanted restitution.

    k follows from the strength, and c by a search, in which the impact is integrated in time.

    Args:
        e: speed after over speed before the impact [-], from 0.001 to 1.
        mass: of the body over its contact area [kg/m²].
        speed: V, with which the body enters the layer [m/s].
        width: b, of the layer [m].
        start: a, where the force is complete [m]; None: half the width.
        strength: k b²/(mass V²) [-], how soon the body is turned back.
        metric: BLENDED, gamma = mass, or FLAT, gamma = 0.

    Returns:
        The law, for ``BoundaryLayer``.

    Raises:
        InputError: a value is outside its range, the metric is another, or no layer returns so
            little of the speed.
    """
    for name, value, unit in (
        ("mass per area", mass, "kg/m²"),
        ("speed", speed, "m/s"),
        ("layer width", width, "m"),
        ("strength k b²/(mass V²)", strength, "units of one"),
    ):
        check_size("contact_layer", f"the {name}", value, unit)
    if not LEAST_RESTITUTION <= number("contact_layer", "the restitution coefficient e", e) <= 1.0:
        raise InputError(
            f"contact_layer: the restitution coefficient e is {e}; give a number from "
            f"{LEAST_RESTITUTION:g} to 1"
        )
    if not (metric is Metric.BLENDED or metric is Metric.FLAT):
        raise InputError(
            f"contact_layer: a law cannot have {quote(metric)}; give Metric.BLENDED or Metric.FLAT"
        )
    a = 0.5 * width if start is None else check_size("contact_layer", "start", start, "m")
    k = strength * mass * speed**2 / width**2

    def layer(s: float) -> Layer:
        """Return the layer with the damping ratio s [-]."""
        return Layer(width, k=k, c=s * width * k, speed=speed, start=a)

    def excess(s: float) -> float:
        """Return by how much the restitution with s is above e."""
        return _rebound(layer(s), mass, speed, metric) - e

    # Restitution falls with s: double s from that of the dominant terms until it is too low, then
    # find the root between.
    s = damping_ratio(e)
    low = 0.0
    if s > 0.0:
        for _ in range(DOUBLINGS):
            if excess(s) <= 0.0:
                break
            low = s
            s = 2.0 * s
        else:
            raise InputError(f"contact_layer: no layer returns {e:g} of the speed; give a larger e")
        s = float(brentq(excess, low, s, xtol=1e-14, rtol=1e-8))
    return ContactLayer(layer(s), mass if metric is Metric.BLENDED else 0.0)


def _rebound(layer: Layer, mass: float, speed: float, metric: Metric) -> float:
    """Return e of a rigid body.

    Args:
        layer: the law.
        mass: of the body [kg/m²].
        speed: with which it enters [m/s].
        metric: the reading of the law.
    """
    return cross_layer(layer, mass, speed, metric, rtol=1e-8).contacts[0].restitution
