"""Let friction depend on the slip rate and on the state of the contact: rate and state.

    mu = a arsinh(V/(2 V0) exp((mu0 + b ln(V0 theta/dc))/a))
    aging: theta' = 1 - V theta/dc,    slip: theta' = -(V theta/dc) ln(V theta/dc)

The rate V is constant over a step, so theta has a closed form there: with x = V t/dc,

    aging: theta e^-x + (1 - e^-x) dc/V,    slip: V theta/dc -> (V theta/dc)^(e^-x)

mu of a step has theta at its middle. At fixed theta mu grows with V, so a step that is short beside
dc/V has one answer; it is found in ln V (``solvers.joint_rates``), as d mu/d V = a/V is steep at
rest. Sources: A. Ruina, J. Geophys. Res. 88 (1983) 10359-10370 (both laws); N. Lapusta, J. R. Rice,
Y. Ben-Zion and G. Zheng, J. Geophys. Res. 105 (2000) 23765-23789 (regularised at V = 0).
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from ..core.algebra import Array
from ..core.joint_laws import Committed, Slope, Strength
from ..core.quantities import RATIO, Unit
from .joint_values import (
    NotNegativeByPoint,
    OfPoints,
    PositiveByPoint,
    Prestress,
    measure_length,
)

FAR = 20.0  # arsinh(e^z) is z + ln 2 to the last digit above


@dataclass(frozen=True)
class RateAndState(OfPoints):
    """Rub by the equations of the module; every number may be one per point, or f(points).

    Attributes:
        a: of the direct effect.
        b: of the state; more than a weakens with the rate.
        mu0: coefficient of steady slip at V0.
        V0: the rate of reference [m/s].
        dc: the slip over which the state changes [m].
        law: "aging" or "slip".
        theta: state at the start [s]; None: that of steady slip at V0.
        speed: slip rate at the start [m/s], from which the first step looks; None: V0.
        prestress: stresses before anything moves; None for none.
    """

    a: Annotated[PositiveByPoint, RATIO, "a"]
    b: Annotated[NotNegativeByPoint, RATIO, "b"]
    mu0: Annotated[NotNegativeByPoint, RATIO, "mu0"]
    V0: Annotated[PositiveByPoint, Unit("m/s"), "the rate V0"]
    dc: Annotated[PositiveByPoint, Unit("m"), "the distance dc"]
    law: Literal["aging", "slip"] = "aging"
    theta: Annotated[PositiveByPoint | None, Unit("s"), "the state theta"] = None
    speed: Annotated[PositiveByPoint | None, Unit("m/s"), "the slip rate at the start"] = None
    prestress: Prestress | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refuse_word("law", ("aging", "slip"))

    def start(self, count: int) -> Committed:
        """Return "theta" (count,) [s] and "speed" [m/s] at the start.

        Args:
            count: number of points.
        """
        V0 = self.spread("V0", count)
        theta = self.spread("dc", count) / V0
        if self.theta is not None:
            theta = self.spread("theta", count)
        speed = V0 if self.speed is None else self.spread("speed", count)
        return {"theta": np.array(theta), "speed": np.array(speed)}

    def _age(self, theta: Array, speed: Array, dt: float) -> tuple[Array, Array]:
        """Return theta after a time at constant rates, and d ln theta / d ln V.

        Args:
            theta: state (m,) [s].
            speed: slip rates (m,) [m/s] > 0.
            dt: the time [s].
        """
        dc = self.spread("dc", len(theta))
        x = speed * dt / dc
        fade = np.exp(-x)
        if self.law == "slip":
            ratio = np.log(speed * theta / dc)
            aged = dc / speed * np.exp(fade * ratio)
            return aged, fade - 1.0 - x * fade * ratio
        # (1 - e^-x)/x, which is 1 at rest
        filling = np.divide(-np.expm1(-x), x, out=np.ones(len(x)), where=x > 0.0)
        aged = theta * fade + filling * dt
        change = -x * fade * theta + dt * (fade - filling)
        return aged, change / aged

    def at_speed(self, committed: Committed, speed: Array, dt: float) -> tuple[Array, Array]:
        """Return mu and d mu / d ln V (m,) of a step at constant slip rates.

        Args:
            committed: before the step.
            speed: the rates (m,) [m/s] > 0.
            dt: length of the step [s].
        """
        count = len(speed)
        a = self.spread("a", count)
        b = self.spread("b", count)
        V0 = self.spread("V0", count)
        dc = self.spread("dc", count)
        theta, rise = self._age(committed["theta"], speed, 0.5 * dt)
        z = np.log(speed / (2.0 * V0))
        z = z + (self.spread("mu0", count) + b * np.log(V0 * theta / dc)) / a
        near = np.arcsinh(np.exp(np.minimum(z, FAR)))
        mu = a * np.where(z > FAR, z + np.log(2.0), near)
        slope = a / np.sqrt(1.0 + np.exp(np.minimum(-2.0 * z, 600.0)))
        return mu, slope * (1.0 + b / a * rise)

    def strength(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Strength:
        """Return mu of a step at its slip rate |s1 - s0|/dt; zero at rest.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning; not read.
            g1: openings at its end; not read.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        speed = measure_length(s1 - s0) / dt
        none = np.zeros(len(speed))
        moves = speed > 0.0
        mu, _ = self.at_speed(committed, np.where(moves, speed, 1.0), dt)
        return Strength(none, none, np.where(moves, mu, 0.0), none)

    def slope(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Slope:
        """Return d mu / d |s1 - s0| (m,) [1/m]; zero at rest, where it is not finite.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning; not read.
            g1: openings at its end; not read.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        way = measure_length(s1 - s0)
        moves = way > 0.0
        _, rise = self.at_speed(committed, np.where(moves, way / dt, 1.0), dt)
        return Slope(np.zeros(len(way)), np.divide(rise, way, out=0.0 * way, where=moves))

    def commit(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Committed:
        """Return the state and the slip rate after a step at a constant rate.

        Args:
            committed: before it.
            g0: openings (m,) [m] at its beginning; not read.
            g1: openings at its end; not read.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        speed = measure_length(s1 - s0) / dt
        rests = speed <= 0.0
        theta, _ = self._age(committed["theta"], np.where(rests, 1.0, speed), dt)
        return {"theta": np.where(rests, committed["theta"] + dt, theta), "speed": speed}
