"""Let friction fall with the way slipped: linear slip weakening.

    mu(S) = static - (static - kinetic) min(S/dc, 1)

S is the length of the way that a point has slipped, dc the distance. Over a step the coefficient is
the mean over the way, so that the work of friction is the area under the law whatever dt is.
Source: D. J. Andrews, J. Geophys. Res. 81 (1976) 5679-5687.
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
        prestress: stresses before anything moves; None for none.
        implicit: False takes the coefficient that is there before each step.
    """

    static: Annotated[NotNegativeByPoint, RATIO, "the static coefficient"]
    kinetic: Annotated[NotNegativeByPoint, RATIO, "the kinetic coefficient"]
    distance: Annotated[PositiveByPoint, Unit("m"), "the distance"]
    cohesion: Annotated[NotNegativeByPoint, Unit("Pa"), "the cohesion"] = 0.0
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
        """Return "way" (count,) [m], zero.

        Args:
            count: number of points.
        """
        return {"way": np.zeros(count)}

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
            dt: its length [s]; not read.
        """
        count = len(s1)
        kinetic, drop, distance = self._read(count)
        left = take_mean_of_line(committed["way"], measure_length(s1 - s0), distance)
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
            dt: its length [s]; not read.
        """
        return {"way": committed["way"] + measure_length(s1 - s0)}

    def softening_of(self, pressure: Array) -> Slope:
        """Return the steepest loss of mu [1/m], as a positive number.

        Args:
            pressure: (m,) [Pa]; only its count is read.
        """
        _, drop, distance = self._read(len(pressure))
        return Slope(np.zeros(len(pressure)), drop / distance)
