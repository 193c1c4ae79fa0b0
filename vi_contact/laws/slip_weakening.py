"""Let friction fall with the way slipped: linear slip weakening.

    mu(S) = static - (static - kinetic) min(S/dc, 1)

S is the length of the way that a point has slipped, dc the distance. Over a step the coefficient is
the mean over the way, so that the work of friction is the area under the law whatever dt is.

A rupture may be *forced*: a point weakens at a time T of its own, within a duration t0, whether it
slips or not,

    mu = static - (static - kinetic) max(min(S/dc, 1), min(max((t - T)/t0, 0), 1))

so that a rupture starts from equilibrium. Times are counted from where the law starts. Sources:
D. J. Andrews, J. Geophys. Res. 81 (1976) 5679-5687; the forced one: R. A. Harris and others, Seism.
Res. Lett. 80 (2009) 119-126.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.joint_laws import Committed, Slope, Strength
from ..core.quantities import RATIO, Unit
from .joint_values import (
    NotNegativeByPoint,
    OfPoints,
    PositiveByPoint,
    Prestress,
    compare_fields,
    measure_length,
    take_mean_of_line,
)

SHORT = 1e-6  # of the distance: over a shorter way the slope of the mean is half that of the law


@dataclass(frozen=True)
class SlipWeakening(OfPoints):
    """Rub by the equation of the module; every number may be one per point, or f(points).

    Attributes:
        static: mu of a point that has not slipped.
        kinetic: mu after the distance; at most ``static``.
        distance: dc [m].
        cohesion: [Pa], which stays.
        forced: T [s], when a point is forced to weaken; a time after the run for never. None:
            never.
        ramp: t0 [s], within which it is.
        prestress: stresses before anything moves; None for none.
        implicit: False takes the coefficient that is there before each step.
    """

    static: Annotated[NotNegativeByPoint, RATIO, "the static coefficient"]
    kinetic: Annotated[NotNegativeByPoint, RATIO, "the kinetic coefficient"]
    distance: Annotated[PositiveByPoint, Unit("m"), "the distance"]
    cohesion: Annotated[NotNegativeByPoint, Unit("Pa"), "the cohesion"] = 0.0
    forced: Annotated[NotNegativeByPoint | None, Unit("s"), "the time of forced weakening"] = None
    ramp: Annotated[PositiveByPoint, Unit("s"), "the ramp of forced weakening"] = 0.1
    prestress: Prestress | None = None
    implicit: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refuse_where(
            compare_fields(lambda kinetic, static: kinetic > static, self.kinetic, self.static),
            "kinetic is larger than static, and friction that grows with slip does not weaken: "
            "give kinetic <= static",
        )

    def start(self, count: int) -> Committed:
        """Return "way" (count,) [m], and "clock" [s] of a rupture that is forced, zero.

        Args:
            count: number of points.
        """
        start = {"way": np.zeros(count)}
        if self.forced is not None:
            start["clock"] = np.zeros(count)
        return start

    def _force(self, committed: Committed, dt: float) -> Array:
        """Return the mean over a step of what is left when a point is forced to weaken, (m,).

        Args:
            committed: before the step.
            dt: its length [s]; 0 for the moment itself.
        """
        clock = committed["clock"]
        ramp = self.spread("ramp", len(clock))
        first = (clock - self.spread("forced", len(clock))) / ramp
        last = first + dt / ramp

        # The mean of 1 - x, x cut off below 0 and above 1: by the integral of its lost part.
        def area(x: Array) -> Array:
            """Return the integral of the cut x."""
            inside = np.minimum(np.maximum(x, 0.0), 1.0)
            return 0.5 * inside**2 + np.maximum(x - 1.0, 0.0)

        cut = np.minimum(np.maximum(first, 0.0), 1.0)
        way = last - first
        lost = np.divide(area(last) - area(first), way, out=cut, where=way > 0.0)
        return np.asarray(1.0 - np.minimum(lost, 1.0))

    def _read(self, count: int) -> tuple[Array, Array, Array]:
        """Return kinetic mu, the drop to it and the distance, each (count,)."""
        kinetic = self.spread("kinetic", count)
        return kinetic, self.spread("static", count) - kinetic, self.spread("distance", count)

    def strength(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Strength:
        """Return the mean coefficient over the way of a step, and the cohesion [Pa].

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning; not read.
            g1: openings at its end; not read.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s], which a forced rupture reads.
        """
        count = len(s1)
        kinetic, drop, distance = self._read(count)
        left = take_mean_of_line(committed["way"], measure_length(s1 - s0), distance)
        if self.forced is not None:
            left = np.minimum(left, self._force(committed, dt))
        none = np.zeros(count)
        return Strength(none, self.spread("cohesion", count), kinetic + drop * left, none)

    def slope(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Slope:
        """Return how the mean coefficient changes with the way, (mu(S1) - mean)/way.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        count = len(s1)
        kinetic, drop, distance = self._read(count)
        way = measure_length(s1 - s0)
        last = committed["way"] + way
        there = kinetic + drop * (1.0 - np.minimum(last / distance, 1.0))
        mean = self.strength(committed, g0, g1, s0, s1, dt).mu
        is_long = way > SHORT * distance
        at_once = np.where(last < distance, -0.5 * drop / distance, 0.0)
        of_mean = np.divide(there - mean, way, out=at_once, where=is_long)
        if self.forced is not None:  # where time decides, slip does not
            by_time = kinetic + drop * self._force(committed, dt)
            of_mean = np.where(mean < by_time, of_mean, 0.0)
        return Slope(np.zeros(count), of_mean)

    def commit(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Committed:
        """Return the length of the way (m,) [m] after a step.

        Args:
            committed: before it.
            g0: openings (m,) [m] at its beginning; not read.
            g1: openings at its end; not read.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        after = {"way": committed["way"] + measure_length(s1 - s0)}
        if self.forced is not None:
            after["clock"] = committed["clock"] + dt
        return after

    def softening_of(self, pressure: Array) -> Slope:
        """Return the steepest loss of mu [1/m], as a positive number.

        Args:
            pressure: (m,) [Pa]; only its count is read.
        """
        _, drop, distance = self._read(len(pressure))
        return Slope(np.zeros(len(pressure)), drop / distance)
