"""Fill a joint with water: linear between its ends, with drains, and following what opens.

With xi from 0 at the heel, where the joint meets the water, to 1 at the toe, the head h (height of
the water level in a standpipe [m]) is linear between

    level at the heel,   tail + (1 - efficiency) (level - tail) at the drain,   tail at the toe

and the pressure is p = gamma max(h - y, 0) at a point of height y. Water that follows has the full
head in the crack, which is what has opened from the heel on without a gap, and is linear from its
tip on: to the drain and the toe, or straight to the toe where the tip has passed the drain.

Two rules say where the tip is, and neither lets pressures jump when a point opens. Water that
enters at once (``opening`` 0) goes to where the line through the last two openings is zero, between
the last open point and the next one. Water that needs an opening g_min fills a point to the share
s = min(max(g/g_min - 1, 0), 1), and to no more than the points before it. The length of the crack
is then the sum of s times weight, and s of the full pressure is the least that a point has.

Sources: U.S. Army Corps of Engineers, Gravity dam design, EM 1110-2-2200 (1995), section 3-3
(drains, cracks, no change of uplift in an earthquake); U.S. Bureau of Reclamation, Design of
gravity dams (1976), chapter III (no uplift in what opens in an earthquake).
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, fields
from typing import Annotated

import numpy as np

from ..core.algebra import Array, Indices, largest
from ..core.arguments import check_fields
from ..core.checks import quote
from ..core.collective import keep_error
from ..core.errors import InputError
from ..core.joint_laws import Committed
from ..core.quantities import RATIO, Between, Finite, NotNegative, Positive, Unit
from ..core.surfaces import ContactSurface
from ..core.system import evaluate_history
from ..core.units import WATER_WEIGHT

QUAKES = ("kept", "follows", "none")
FAR = 0.5  # of the way from heel to toe: the joint ends nearer to them than that
Share = Annotated[float, Between(0.0, 1.0), RATIO]


@dataclass(frozen=True)
class JointWater:
    """Fill a joint with water by the equations of the module.

    Args:
        heel: where the joint meets the water (d,) [m], the upstream end.
        toe: its other end (d,) [m].
        level: height of the water level [m], on the last axis of the mesh.
        tail: that of the tail water [m]; None: none, the pressure at the toe is zero.
        drain: distance of the drains from the heel [m], along the joint; None: no drains.
        efficiency: share of the head that the drains take away; with 0 they do nothing and with 1
            the head of the tail water begins at the drains.
        follows: whether static stages let water into what opens.
        quake: what steps in time do: "kept" leaves the pressures as they were at rest, "follows"
            takes those of the openings at the beginning of each step, and "none" lets no water into
            what opens newly.
        opening: g_min [m], from which on water enters; all of it is there at twice as much.
        gamma: weight of the water [N/m³].
        history: a factor f(t) of all pressures; None: 1.
    """

    heel: Annotated[tuple[float, ...], Unit("m")]
    toe: Annotated[tuple[float, ...], Unit("m")]
    level: Annotated[float, Finite, Unit("m"), "the level"]
    tail: Annotated[float | None, Finite, Unit("m"), "the tail water"] = None
    drain: Annotated[float | None, Positive, Unit("m"), "the drain"] = None
    efficiency: Share = 2.0 / 3.0
    follows: bool = True
    quake: str = "kept"
    opening: Annotated[float, NotNegative, Unit("m"), "the opening"] = 0.0
    gamma: Annotated[float, Positive, Unit("N/m³"), "gamma"] = WATER_WEIGHT
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.quake not in QUAKES:
            raise InputError(
                f"JointWater: quake is {quote(self.quake)}; give {' or '.join(map(quote, QUAKES))}"
            )
        object.__setattr__(self, "heel", tuple(map(float, self.heel)))
        object.__setattr__(self, "toe", tuple(map(float, self.toe)))
        if len(self.heel) != len(self.toe) or not self.length > 0.0:
            raise InputError(
                f"JointWater: heel {self.heel} and toe {self.toe} are no two ends of a joint; give "
                "two different points with as many coordinates as the mesh"
            )
        if self.level < self.heel[-1]:
            raise InputError(
                f"JointWater: the level {self.level:g} m is below the heel at {self.heel[-1]:g} m: "
                "give a higher level, or leave the water out"
            )
        if self.tail_head > self.level:
            raise InputError(
                f"JointWater: the tail water at {self.tail_head:g} m is above the level "
                f"{self.level:g} m: exchange heel and toe, so that the heel has the higher water"
            )
        if self.drain is not None and self.drain >= self.length:
            raise InputError(
                f"JointWater: the drain is {self.drain:g} m from the heel, and the joint is "
                f"{self.length:g} m long: give a place between heel and toe"
            )

    @property
    def length(self) -> float:
        """Return the distance of heel and toe [m]."""
        return float(np.linalg.norm(np.subtract(self.toe, self.heel)))

    @property
    def tail_head(self) -> float:
        """Return the head at the toe [m]: the tail water, or the toe itself without any."""
        return max(self.toe[-1], self.toe[-1] if self.tail is None else self.tail)

    def find_head(self, xi: Array, tip: float) -> Array:
        """Return the head (m,) [m] beyond a crack, and the full one in it.

        Args:
            xi: places of the points (m,), 0 at the heel and 1 at the toe.
            tip: place of the tip of the crack.
        """
        places = [tip]
        heads = [self.level]
        drain = None if self.drain is None else self.drain / self.length
        if drain is not None and tip < drain:
            places.append(drain)
            heads.append(self.tail_head + (1.0 - self.efficiency) * (self.level - self.tail_head))
        if tip < 1.0:
            places.append(1.0)
            heads.append(self.tail_head)
        return np.asarray(np.interp(xi, places, heads))

    def place(self, surface: ContactSurface, places: Indices) -> "PlacedWater":
        """Return the water at some conditions of this rank. Collective.

        Args:
            surface: whose conditions they are.
            places: their rows.

        Raises:
            InputError: points in other dimensions; water that follows in space.
        """
        points = surface.points[places]
        d = surface.points.shape[1]
        if d != len(self.heel):
            raise InputError(
                f"JointWater: heel {self.heel} has {len(self.heel)} coordinates and the points of "
                f"the joint have {d}: give as many"
            )
        if d == 3 and (self.follows or self.quake != "kept"):
            raise InputError(
                "JointWater: in space the tip of a crack is a curve, which is not followed: give "
                "follows=False and quake='kept'"
            )
        way = np.subtract(self.toe, self.heel)
        xi = (points - self.heel) @ way / self.length**2
        self._refuse_elsewhere(surface, xi)
        words = {name: getattr(self, name) for name in WORDS}
        return PlacedWater(
            **words, surface=surface, places=places, xi=xi, height=points[:, -1].copy()
        )

    def _refuse_elsewhere(self, surface: ContactSurface, xi: Array) -> None:
        """Raise InputError for a heel and a toe that are not near its ends. Collective.

        Args:
            surface: whose ranks ask.
            xi: places of this rank's points (m,), 0 at the heel and 1 at the toe.
        """
        first = -largest(surface.comm, np.max(-xi, initial=-np.inf))
        last = largest(surface.comm, np.max(xi, initial=-np.inf))
        if first > last:  # a joint without points
            return
        if not (abs(first) <= FAR and abs(last - 1.0) <= FAR):
            raise InputError(
                f"JointWater: heel {self.heel} and toe {self.toe} are not the ends of the joint, "
                f"whose points lie from {first * self.length:.4g} m to {last * self.length:.4g} m "
                "on the way from heel to toe: give the places where it begins and ends"
            )


WORDS = tuple(word.name for word in fields(JointWater))


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacedWater(JointWater):
    """Hold the water of a joint at conditions of this rank, at a time.

    Attributes:
        surface: the contact conditions of all parts.
        places: rows of those of this joint.
        xi: their places (m,) between heel and toe.
        height: their heights (m,) [m].
        time: of the pressures [s].
    """

    surface: ContactSurface = field(repr=False)
    places: Indices = field(repr=False)
    xi: Array = field(repr=False)
    height: Array = field(repr=False)
    time: float = 0.0

    def at_time(self, t: float) -> "PlacedWater":
        """Return the water at a time [s]."""
        if self.history is None:
            return self
        other = copy(self)
        object.__setattr__(other, "time", t)
        return other

    def start(self) -> dict[str, Array]:
        """Return the arrays of a closed joint: "water" [Pa], "tip", "wet". Collective.

        "tip" is the place of the tip at the last static stage, the same at all points, and "wet"
        is the share to which a point was filled then.
        """
        return self._stand(np.zeros(len(self.xi)))

    def find_tip(self, g: Array) -> tuple[float, Array]:
        """Return the tip of the crack, and the shares (m,) to which points are filled. Collective.

        Args:
            g: openings (m,) [m].

        Returns:
            the place of the tip, 0 closed and 1 open to the toe, and the shares.
        """
        # The crack is a property of the whole row of points, from the heel to the toe.
        surface = self.surface
        table = np.full((surface.count, 3), np.nan)
        table[self.places] = np.column_stack([self.xi, g, surface.weights[self.places]])
        whole = np.asarray(surface.everywhere(table))
        of_joint = np.flatnonzero(~np.isnan(whole[:, 0]))
        order = of_joint[np.argsort(whole[of_joint, 0], kind="stable")]
        xi, opened, weights = whole[order].T
        share = np.minimum.accumulate(self._fill(opened))
        if self.opening > 0.0:
            tip = float(weights @ share / weights.sum())
        else:
            tip = _find_zero(xi, opened)
        filled = np.zeros(len(whole))
        filled[order] = share
        return tip, np.asarray(surface.mine(filled)[self.places])

    def _fill(self, g: Array) -> Array:
        """Return the shares to which openings [m] would be filled if water came to them."""
        least = self.opening
        return np.clip(g / least - 1.0, 0.0, 1.0) if least > 0.0 else np.where(g > 0.0, 1.0, 0.0)

    def press(self, tip: float, share: Array) -> Array:
        """Return the pressures (m,) [Pa] at the time.

        Args:
            tip: place of the tip of the crack.
            share: to which points are filled (m,).
        """
        factor = self._find_factor()
        linear = np.maximum(self.find_head(self.xi, tip) - self.height, 0.0)
        full = np.maximum(self.level - self.height, 0.0)
        return np.asarray(factor * self.gamma * np.maximum(linear, share * full))

    def _find_factor(self) -> float:
        """Return the factor of all pressures at the time.

        Raises:
            InputError: it is negative, NaN or infinite; in a frame of several ranks at its end.
        """
        if self.history is None:
            return 1.0
        factor = evaluate_history(self.history, self.time)
        if 0.0 <= factor < np.inf:
            return factor
        what = f"JointWater: history is {factor:g} at t = {self.time:g} s"
        return keep_error(what, InputError(f"{what}: return a factor of 0 or more"), 0.0)

    def _stand(self, g: Array) -> dict[str, Array]:
        """Return the committed arrays of a static stage with openings (m,) [m]. Collective."""
        tip, share = self.find_tip(g if self.follows else np.zeros(len(g)))
        return {"water": self.press(tip, share), "tip": np.full(len(g), tip), "wet": share}

    def commit(self, committed: Committed, g0: Array, g1: Array, dt: float) -> dict[str, Array]:
        """Return the committed arrays after a step. Collective.

        Args:
            committed: before it.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            dt: its length [s], 0 of a static stage.
        """
        if dt == 0.0:
            return self._stand(g1)
        pressure = self.find_in_step(committed, g0, dt)
        return {"water": pressure, "tip": committed["tip"], "wet": committed["wet"]}

    def find_in_step(self, committed: Committed, g0: Array, dt: float) -> Array:
        """Return the pressures (m,) [Pa] that a step has, of its beginning. Collective.

        Args:
            committed: before it.
            g0: openings (m,) [m] at its beginning.
            dt: its length [s]; with 0 the pressures are those that were committed.
        """
        if dt == 0.0:
            return committed["water"]
        if self.quake == "follows":
            return self.press(*self.find_tip(g0))
        tip = committed["tip"]
        share = committed["wet"]
        before = self.press(float(tip[0]), share) if len(tip) else np.zeros(0)
        if self.quake == "kept":
            return before
        return before * (1.0 - np.maximum(self._fill(g0) - share, 0.0))


def _find_zero(xi: Array, opened: Array) -> float:
    """Return where a crack ends: the zero of the line through its last two openings.

    Args:
        xi: places (k,), ascending, from the heel on.
        opened: openings (k,) [m], 0 of closed points.
    """
    closed = np.flatnonzero(opened <= 0.0)
    if len(closed) == 0:
        return 1.0
    last = int(closed[0]) - 1  # the last open point
    if last < 0:
        return 0.0
    most = float(xi[last + 1])
    if last == 0 or opened[last - 1] <= opened[last]:
        return 0.5 * float(xi[last] + most)
    slope = (opened[last - 1] - opened[last]) / (xi[last] - xi[last - 1])
    return min(float(xi[last] + opened[last] / slope), most)
