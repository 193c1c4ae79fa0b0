"""Bind two faces by a tensile strength and a cohesion that are lost as the joint opens and slips.

With the largest opening kappa and the critical one dc,

    f(kappa) = f_t D(kappa),    D = 1 - kappa/dc (linear),  1 below dc (constant),  0 (brittle)

is the traction of a joint that opens, and G_f = f_t dc/2 [J/m²] what its loss takes (linear; f_t dc
constant, 0 brittle). Below its largest opening it goes to the origin, f(kappa) g/kappa, and gives
that energy back. The cohesion c D is lost with it: in mixed mode kappa is the largest
sqrt(g² + (beta s)²) with beta = c/f_t, so that both modes take G_f. Friction mu r_n stays.

Over a step the strength is the mean of the law, its work over the change of opening: the sum of the
works is then the area under the law whatever dt is. Sources: A. Hillerborg, M. Modéer and
P.-E. Petersson, Cem. Concr. Res. 6 (1976) 773-782 (linear); D. S. Dugdale, J. Mech. Phys. Solids 8
(1960) 100-104 (constant).
"""

import math
from copy import copy
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError
from ..core.joint_laws import Committed, Slope, Strength
from ..core.quantities import RATIO, Unit
from ..core.surfaces import ContactSurface
from .joint_values import (
    NotNegativeByPoint,
    OfPoints,
    PositiveByPoint,
    Prestress,
    compare_fields,
    measure_length,
    take_mean_of_line,
)
from .joint_water import JointWater, PlacedWater

SHORT = 1e-6  # of dc: over a shorter way the slope of the mean is half that of the law
ROUNDING = 1e-9  # relative: a cohesion that is mu times the tensile strength but for rounding


class _Walk(NamedTuple):
    """Hold what is left of a strength along the way of a step, each (m,).

    Attributes:
        dc: at which nothing is left [m].
        last: kappa at the end [m].
        secant: D over the largest opening before [1/m], of the way below it.
        on_law: the mean of D beyond it.
        whole: the mean of D between both ends.
    """

    dc: Array
    last: Array
    secant: Array
    on_law: Array
    whole: Array


@dataclass(frozen=True)
class Joint(OfPoints):
    """Bind by the equations of the module; every number may be one per point, or f(points).

    Attributes:
        mu: coefficient of friction.
        cohesion: c [Pa]; at least mu times the tension.
        tension: tensile strength f_t [Pa].
        energy: G_f [N/m], joules a square metre; give it or the opening.
        opening: dc [m], at which nothing is left; of a joint without tension, the slip.
        softening: "linear", "brittle" or "constant".
        dilatancy: tan(psi), by how much slip lifts the joint.
        water: pressure of the water in the joint [Pa], given and kept, or ``JointWater``. It
            presses both faces, and friction does not feel it: reactions are total ones, effective
            ones less by it.
        prestress: stresses before anything moves; None for none.
        implicit: False takes the strength that is there before each step.
    """

    mu: Annotated[NotNegativeByPoint, RATIO, "the friction coefficient mu"] = 0.0
    cohesion: Annotated[NotNegativeByPoint, Unit("Pa"), "the cohesion"] = 0.0
    tension: Annotated[NotNegativeByPoint, Unit("Pa"), "the tension"] = 0.0
    energy: Annotated[PositiveByPoint | None, Unit("N/m"), "the fracture energy"] = None
    opening: Annotated[PositiveByPoint | None, Unit("m"), "the opening"] = None
    softening: Literal["linear", "brittle", "constant"] = "linear"
    dilatancy: Annotated[NotNegativeByPoint, RATIO, "the dilatancy tan(psi)"] = 0.0
    water: Annotated[NotNegativeByPoint | JointWater, Unit("Pa"), "the water pressure"] = 0.0
    prestress: Prestress | None = None
    implicit: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refuse_word("softening", ("linear", "brittle", "constant"))
        self._refuse_softening()
        if isinstance(self.water, JointWater) and self.water.follows and not self.implicit:
            raise InputError(
                "Joint: water that follows the opening needs the strength of the answer: leave "
                "implicit=False out, or give JointWater(follows=False)"
            )
        self.refuse_where(
            compare_fields(
                lambda mu, tension, cohesion: cohesion < mu * tension * (1.0 - ROUNDING),
                self.mu,
                self.tension,
                self.cohesion,
            ),
            "cohesion is less than mu times tension, so that a pulled point would have a negative "
            "limit of friction: give cohesion >= mu tension",
        )

    def _refuse_softening(self) -> None:
        """Raise InputError unless energy and opening say how the strength is lost."""
        given = [name for name in ("energy", "opening") if getattr(self, name) is not None]
        if self.softening == "brittle":
            if given:
                raise InputError(
                    f"Joint: {given[0]} is given beside softening='brittle', which loses all when "
                    "it opens: leave one of the two out"
                )
            return
        strengths: tuple[Any, ...] = (self.tension, self.cohesion)
        if any(callable(value) or bool(np.any(value)) for value in strengths) and len(given) != 1:
            raise InputError(
                "Joint: give either energy or opening, over which tension and cohesion are lost, "
                "or softening='brittle'"
            )

    @property
    def rubs(self) -> bool:
        """Say whether there is any tangential strength, the same on all ranks."""
        return not (_is_zero(self.mu) and _is_zero(self.cohesion))

    def lay(self, surface: ContactSurface, places: Indices) -> "Joint":
        """Return the joint with its water at conditions of this rank. Collective.

        Args:
            surface: whose conditions they are.
            places: their rows.
        """
        if not isinstance(self.water, JointWater):
            return self  # numbers by point have been laid already
        return replace(self, water=self.water.place(surface, places))

    @property
    def water_follows(self) -> bool:
        """Say whether static stages let water into what opens."""
        return isinstance(self.water, PlacedWater) and self.water.follows

    def at_time(self, t: float) -> "Joint":
        """Return the joint with the water of a time [s]."""
        if not isinstance(self.water, PlacedWater) or self.water.history is None:
            return self
        other = copy(self)
        object.__setattr__(other, "water", self.water.at_time(t))
        return other

    def find_crack(self, g: Array) -> float:
        """Return how long the crack from the heel is [m], 0 without ``JointWater``. Collective.

        Args:
            g: openings (m,) [m].
        """
        if isinstance(self.water, PlacedWater):
            return self.water.find_tip(g)[0] * self.water.length
        return 0.0

    def _find_reach(self, count: int) -> Array:
        """Return dc (count,) [m]; 0 for a brittle joint."""
        return self.make_once("dc", count, lambda: self._make_reach(count))

    def _make_reach(self, count: int) -> Array:
        """Return dc (count,) [m], out of the energy where it is given."""
        if self.softening == "brittle":
            return np.zeros(count)
        if self.opening is not None:
            return self.spread("opening", count).copy()
        if self.energy is None:
            return np.ones(count)  # of a joint without strength: nothing is lost
        tension = self.spread("tension", count)
        strength = np.where(tension > 0.0, tension, self.spread("cohesion", count))
        area = 0.5 if self.softening == "linear" else 1.0
        energy = self.spread("energy", count)
        reach = np.ones(count)
        return np.divide(energy, area * strength, out=reach, where=strength > 0.0)

    def _find_beta(self, count: int) -> Array:
        """Return c/f_t (count,), by which slip counts as opening; 1 without tension."""
        return self.make_once("beta", count, lambda: self._make_beta(count))

    def _make_beta(self, count: int) -> Array:
        """Return c/f_t (count,)."""
        tension = self.spread("tension", count)
        cohesion = self.spread("cohesion", count)
        return np.divide(cohesion, tension, out=np.ones(count), where=tension > 0.0)

    def start(self, count: int) -> Committed:
        """Return "kappa" and "opened" (count,) [m], and "way" [m], all zero; and the water's.

        Args:
            count: number of points.
        """
        zero = np.zeros(count)
        start = {"kappa": zero, "opened": zero, "way": zero}
        return start | self.water.start() if isinstance(self.water, PlacedWater) else start

    def _left(self, kappa: Array, dc: Array) -> Array:
        """Return D (m,)."""
        if self.softening == "brittle":
            return np.where(kappa > 0.0, 0.0, 1.0)
        if self.softening == "constant":
            return np.where(kappa < dc, 1.0, 0.0)
        return 1.0 - np.minimum(kappa / dc, 1.0)

    def _mean_left(self, first: Array, last: Array, dc: Array) -> Array:
        """Return the mean of D between two kappa (m,) [m], first <= last."""
        if self.softening == "brittle":
            return self._left(last, dc)
        way = last - first
        if not way.any():
            return self._left(first, dc)
        if self.softening == "linear":
            return take_mean_of_line(first, way, dc)
        # Of constant strength the mean is the part of the way that lies below dc.
        below = np.minimum(last, dc) - np.minimum(first, dc)
        return np.divide(below, way, out=self._left(first, dc), where=way > 0.0)

    def _reach(self, committed: Committed, g1: Array, s1: Array) -> tuple[Array, Array]:
        """Return kappa (m,) [m] where a step comes back to the largest opening, and at its end.

        Args:
            committed: before the step.
            g1: openings (m,) [m] at its end.
            s1: slips (m, d - 1) [m] at its end.
        """
        turn = np.minimum(g1, committed["opened"])
        last = g1
        if s1.shape[1]:
            slip = self._find_beta(len(g1)) * measure_length(s1)
            turn = np.hypot(turn, slip)
            last = np.hypot(last, slip)
        turn = np.maximum(committed["kappa"], turn)
        return turn, np.maximum(turn, last)

    def _walk(self, committed: Committed, g1: Array, s1: Array) -> _Walk:
        """Return how much of the strength is left along the way of a step.

        Args:
            committed: before the step.
            g1: openings (m,) [m] at its end.
            s1: slips (m, d - 1) [m] at its end.
        """
        count = len(g1)
        dc = self._find_reach(count)
        kappa = committed["kappa"]
        opened = committed["opened"]
        turn, last = self._reach(committed, g1, s1)
        on_law = self._mean_left(turn, last, dc)
        if np.array_equal(turn, kappa):  # nothing is lost on the way back: the usual case
            before, whole = self._left(kappa, dc), on_law
        else:
            before = self._mean_left(kappa, turn, dc)
            whole = self._mean_left(kappa, last, dc)
        if self.softening == "constant":
            # Slip may take kappa past dc, where the tension would jump within a step, which then
            # has no answer: it is lost in the mean of the step, as the cohesion is.
            on_law = whole
        secant = np.divide(before, opened, out=np.zeros(count), where=opened > 0.0)
        return _Walk(dc, last, secant, on_law, whole)

    def _find_mean(self, committed: Committed, g0: Array, g1: Array, walk: _Walk) -> Array:
        """Return the mean of the tension over a step (m,), of the tensile strength.

        Along the secant up to the largest opening before, then along the law.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            walk: between them.
        """
        opened = committed["opened"]
        secant = walk.secant
        way = g1 - g0
        beyond = g1 > opened
        back = 0.5 * secant * (opened - g0) * (opened + g0)
        work = back + walk.on_law * (g1 - opened)
        mean = np.divide(work, way, out=walk.on_law.copy(), where=beyond & (way > 0.0))
        mean = np.where(beyond & (g0 == opened), walk.on_law, mean)
        return np.where(beyond | (opened == 0.0), mean, 0.5 * secant * (g0 + g1))

    def strength(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Strength:
        """Return the mean strength [Pa] of a step, work over the change of opening.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s]; read by water alone.
        """
        count = len(g1)
        walk = self._walk(committed, g1, s1)
        tension = self.spread("tension", count) * self._find_mean(committed, g0, g1, walk)
        cohesion = self.spread("cohesion", count)
        if not _is_zero(self.cohesion):
            cohesion = cohesion * walk.whole
        if isinstance(self.water, PlacedWater):
            water = self.water.find_in_step(committed, g0, dt)
        else:
            water = self.spread("water", count)
        return Strength(tension, cohesion, self.spread("mu", count), water)

    def slope(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Slope:
        """Return how the mean tension changes with the end of the step.

        On the secant half of its slope; on the law (f(g1) - mean)/(g1 - g0).

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        count = len(g1)
        walk = self._walk(committed, g1, s1)
        dc, last = walk.dc, walk.last
        tension = self.spread("tension", count)
        mean = tension * self._find_mean(committed, g0, g1, walk)
        way = g1 - g0
        is_long = way > SHORT * dc
        change = tension * self._left(last, dc) - mean
        of_mean = np.divide(change, way, out=np.zeros(count), where=is_long)
        if self.softening == "linear":
            at_once = np.where(last < dc, -0.5 * tension / dc, 0.0)
            of_mean = np.where(is_long, of_mean, at_once)
        opened = committed["opened"]
        on_secant = (g1 < opened) | ((g1 == opened) & (g0 < opened))
        return Slope(np.where(on_secant, 0.5 * tension * walk.secant, of_mean), np.zeros(count))

    def commit(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Committed:
        """Return the largest kappa and opening, and the length of the slip's way, after a step.

        Args:
            committed: before it.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s]; read by water alone.
        """
        last = self._reach(committed, g1, s1)[1]
        after = {
            "kappa": last,
            "opened": np.maximum(committed["opened"], g1),
            "way": committed["way"] + measure_length(s1 - s0),
        }
        if isinstance(self.water, PlacedWater):
            after |= self.water.commit(committed, g0, g1, dt)
        return after

    def stored(self, committed: Committed, g: Array) -> Array:
        """Return the energy [J/m²] that comes back when the joint closes, ½ f(kappa) g²/opened.

        Args:
            committed: what the points have gone through.
            g: openings (m,) [m].
        """
        count = len(g)
        opened = committed["opened"]
        left = self._left(committed["kappa"], self._find_reach(count))
        part = np.divide(g, opened, out=np.zeros(count), where=opened > 0.0)
        return 0.5 * self.spread("tension", count) * left * part * g

    def dilation(self, committed: Committed) -> Array:
        """Return tan(psi) times the length of the slip's way, (m,) [m]."""
        way = committed["way"]
        return self.spread("dilatancy", len(way)) * way

    def softening_of(self, pressure: Array) -> Slope:
        """Return the steepest losses of strength, as positive numbers; infinite of sudden ones.

        Args:
            pressure: (m,) [Pa]; not read, as friction stays.
        """
        count = len(pressure)
        tension = self.spread("tension", count)
        nothing = np.zeros(count)
        if self.softening != "linear":
            return Slope(np.where(tension > 0.0, math.inf, 0.0), nothing)
        return Slope(tension / self._find_reach(count), nothing)


def _is_zero(value: object) -> bool:
    """Say whether a value is the number zero, and no table or function."""
    return isinstance(value, int | float) and value == 0
