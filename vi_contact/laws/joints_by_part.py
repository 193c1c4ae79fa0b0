"""Give each part of a contact surface a joint of its own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError
from ..core.joint_laws import Committed, JointLaw, Slope, Strength
from ..core.surfaces import ContactSurface
from .joint_values import OfPoints, Prestress


@dataclass(frozen=True, eq=False)
class JointsByPart:
    """Hold the law of each part, and the part of each point.

    Committed arrays of laws of the same names are one array: each point reads its own law's.

    Attributes:
        laws: by the names of the parts.
        part: number of the part (total,) of each point of all ranks, in the order of ``laws``.
    """

    laws: Mapping[str, JointLaw]
    part: Indices = field(repr=False)
    _bound: tuple[tuple[Any, Indices], ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if any(hasattr(law, "at_speed") for law in self.laws.values()):
            raise InputError(
                "a law of slip rates is solved on all points together: give all parts the same "
                "RateAndState"
            )
        if len({getattr(law, "implicit", True) for law in self.laws.values()}) > 1:
            raise InputError(
                "some parts have implicit joints and some explicit ones: give all the same"
            )

    def on_surface(self, surface: ContactSurface) -> "JointsByPart":
        """Return the laws with the values of this rank's points, in ``_bound``.

        Args:
            surface: whose points they are.
        """
        own = self.part[surface.slots]
        bound = []
        for number, law in enumerate(self.laws.values()):
            places = np.flatnonzero(own == number)
            slots_of_part = np.flatnonzero(self.part == number)
            rows = np.searchsorted(slots_of_part, surface.slots[places])
            at_points = getattr(law, "at_points", None)
            taken: Any = law if at_points is None else at_points(surface.points[places])
            bound.append((_take_rows(taken, rows, len(slots_of_part)), places))
        return replace(self, _bound=tuple(bound))

    def list_values(self, surface: ContactSurface) -> list[Array]:
        """Return the numbers of each point, arrays (m,) in the same order on all ranks.

        They are the part, and each value of each law, zero at points of other parts. Of a law of a
        user's own only the part is known.

        Args:
            surface: whose points they are.
        """
        columns = [self.part[surface.slots].astype(float)]
        for law, places in self._bound:
            for owner, name in _list_numbers_of(law):
                column = np.zeros(surface.count)
                column[places] = owner.spread(name, len(places))
                columns.append(column)
        return columns

    @property
    def rubs(self) -> bool:
        """Say whether some part has any tangential strength."""
        return any(getattr(law, "rubs", True) for law in self.laws.values())

    @property
    def implicit(self) -> bool:
        """Say whether the strength of a step is that of its answer."""
        return all(getattr(law, "implicit", True) for law in self.laws.values())

    @cached_property
    def prestress(self) -> Prestress | None:
        """Return the prestress of all parts, zero where a part has none."""
        parts = [(getattr(law, "prestress", None), places) for law, places in self._bound]
        if all(before is None for before, _ in parts):
            return None
        count = sum(len(places) for _, places in parts)
        normal = np.zeros(count)
        shear = np.zeros(count)
        for before, places in parts:
            if before is not None:
                normal[places] = before.spread("normal", len(places))
                shear[places] = before.spread("shear", len(places))
        nucleate = any(before is not None and before.nucleate for before, _ in parts)
        return Prestress(normal, shear, nucleate=nucleate)

    def start(self, count: int) -> Committed:
        """Return the arrays of all laws, zero at points of other parts.

        Args:
            count: number of points of this rank.
        """
        return self._scatter(count, lambda law, places: law.start(len(places)))

    def strength(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Strength:
        """Return the strength of each point by the law of its part.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        found = self._scatter(
            len(g1),
            lambda law, places: law.strength(
                *_pick(places, committed, g0, g1, s0, s1), dt
            )._asdict(),
        )
        return Strength(**found)

    def slope(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Slope:
        """Return the slopes of each point by the law of its part; arguments of ``strength``.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        found = self._scatter(
            len(g1),
            lambda law, places: law.slope(*_pick(places, committed, g0, g1, s0, s1), dt)._asdict(),
        )
        return Slope(**found)

    def commit(
        self, committed: Committed, g0: Array, g1: Array, s0: Array, s1: Array, dt: float
    ) -> Committed:
        """Return the committed arrays after a step; arguments of ``strength``.

        Args:
            committed: before the step.
            g0: openings (m,) [m] at its beginning.
            g1: openings at its end.
            s0: slips (m, d - 1) [m] at its beginning.
            s1: slips at its end.
            dt: its length [s].
        """
        return self._scatter(
            len(g1),
            lambda law, places: law.commit(*_pick(places, committed, g0, g1, s0, s1), dt),
        )

    def stored(self, committed: Committed, g: Array) -> Array:
        """Return the energy [J/m²] (m,) that comes back when the points close.

        Args:
            committed: what they have gone through.
            g: openings (m,) [m].
        """
        return self._scatter_one(
            len(g),
            "stored",
            lambda law, places: law.stored(_pick_committed(places, committed), g[places]),
        )

    def dilation(self, committed: Committed) -> Array:
        """Return how far slip has lifted the points (m,) [m].

        Args:
            committed: what they have gone through.
        """
        return self._scatter_one(
            len(next(iter(committed.values()))),
            "dilation",
            lambda law, places: law.dilation(_pick_committed(places, committed)),
        )

    def softening_of(self, pressure: Array) -> Slope:
        """Return the steepest losses of strength, as positive numbers.

        Args:
            pressure: (m,) [Pa].
        """
        found = self._scatter(
            len(pressure),
            lambda law, places: (
                law.softening_of(pressure[places])._asdict() if hasattr(law, "softening_of") else {}
            ),
        )
        none = np.zeros(len(pressure))
        return Slope(found.get("tension", none), found.get("mu", none))

    def _scatter(
        self, count: int, ask: Callable[[Any, Indices], Mapping[str, Array]]
    ) -> dict[str, Array]:
        """Return arrays by name (count, …), of what each law says of its points.

        Args:
            count: number of points.
            ask: takes a law and its points.
        """
        whole: dict[str, Array] = {}
        for law, places in self._bound:
            for name, values in ask(law, places).items():
                rows = np.asarray(values, dtype=float)
                if name not in whole:
                    whole[name] = np.zeros((count, *rows.shape[1:]))
                whole[name][places] = rows
        return whole

    def _scatter_one(self, count: int, name: str, ask: Callable[[Any, Indices], Array]) -> Array:
        """Return one array (count,), zero at points of laws without a member of this name."""
        found = self._scatter(
            count, lambda law, places: {name: ask(law, places)} if hasattr(law, name) else {}
        )
        return found.get(name, np.zeros(count))


def _pick_committed(places: Indices, committed: Committed) -> Committed:
    """Return the rows of committed arrays at some points."""
    return {name: values[places] for name, values in committed.items()}


def _pick(places: Indices, committed: Committed, *arrays: Array) -> tuple[Any, ...]:
    """Return the rows of committed and other arrays at some points."""
    return (_pick_committed(places, committed), *(array[places] for array in arrays))


def _list_numbers_of(law: Any) -> list[tuple[OfPoints, str]]:
    """Return the values by point of a law, and of what it holds, each as its owner and name."""
    found: list[tuple[OfPoints, str]] = []
    for name, value in vars(law).items() if isinstance(law, OfPoints) else ():
        if isinstance(value, OfPoints):
            found += _list_numbers_of(value)
        elif isinstance(value, int | float | tuple) and not isinstance(value, bool):
            found.append((law, name))
    return found


def _take_rows(law: Any, rows: Indices, count: int) -> Any:
    """Return a law with those of its tables' values that are of this rank.

    Args:
        law: of a part.
        rows: of the points of this rank among those of the part on all ranks.
        count: number of all these.
    """
    if not isinstance(law, OfPoints):
        return law
    changes: dict[str, Any] = {}
    for name, value in vars(law).items():
        if isinstance(value, OfPoints):
            changes[name] = _take_rows(value, rows, count)
        elif isinstance(value, tuple) and len(value) == count and len(rows) != count:
            changes[name] = tuple(value[row] for row in rows)
    return replace(law, **changes) if changes else law  # type: ignore[type-var]
