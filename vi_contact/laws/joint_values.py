"""Hold values of joints by points: numbers, tables, or functions of the place."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from ..core.algebra import Array, freeze
from ..core.arguments import check_fields
from ..core.checks import quote
from ..core.errors import InputError
from ..core.quantities import Between, Finite, Unit
from .friction import keep_as_tuple, spread_values

OF_POINTS = "give zero or a positive finite number, one per point, or a function of the points"
ABOVE_ZERO = "give a positive finite number, one per point, or a function of the points"
ByPoint = float | Array | tuple[float, ...] | Callable[[Array], Any]
NotNegativeByPoint = Annotated[ByPoint, Between(0.0, math.inf, remedy=OF_POINTS)]
PositiveByPoint = Annotated[ByPoint, Between(0.0, math.inf, "(]", ABOVE_ZERO)]


class OfPoints:
    """Share what laws of joints do with values by point."""

    never_negative: ClassVar[bool] = True  # the values have been checked

    def __post_init__(self) -> None:
        check_fields(self)
        owner = type(self).__name__
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, tuple | list | np.ndarray):
                object.__setattr__(self, field.name, keep_as_tuple(owner, value))

    def at_points(self, points: Array) -> Any:
        """Return the law with its functions taken at points (m, d) [m].

        Raises:
            InputError: a function that does not return one real number, or one for each point.
        """
        changes: dict[str, Any] = {}
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if is_dataclass(value) and isinstance(value, OfPoints):
                changes[field.name] = value.at_points(points)
            elif callable(value):
                changes[field.name] = self._take(field.name, value, points)
        return replace(self, **changes) if changes else self  # type: ignore[type-var]

    def _take(self, name: str, function: Callable[[Array], Any], points: Array) -> Any:
        """Return the values of a function at points, as a tuple."""
        found = np.asarray(function(points))
        if found.dtype.kind not in "iuf" or found.shape not in ((), (len(points),)):
            raise InputError(
                f"{type(self).__name__}: {name} returns {quote(found)} for {len(points)} points; "
                "return one real number, or one for each row of points"
            )
        return tuple(np.broadcast_to(found.astype(float), len(points)).tolist())

    def spread(self, name: str, count: int) -> Array:
        """Return a value as an array (count,).

        Args:
            name: the field.
            count: number of points.
        """

        def read() -> Array:
            value = spread_values(type(self).__name__, name, getattr(self, name), count)
            return np.full(count, value)

        return self.make_once(name, count, read)

    def make_once(self, name: str, count: int, make: Callable[[], Array]) -> Array:
        """Return an array that depends on the values alone, made when it is first asked for.

        Args:
            name: of the array.
            count: number of points.
            make: makes it.
        """
        known: dict[tuple[str, int], Array] = self.__dict__.setdefault("_arrays", {})
        if (name, count) not in known:
            known[name, count] = freeze(make())
        return known[name, count]

    def refuse_word(self, name: str, words: tuple[str, ...]) -> None:
        """Raise InputError unless a field is one of some words."""
        value = getattr(self, name)
        if value not in words:
            raise InputError(
                f"{type(self).__name__}: {name} is {quote(value)}; give "
                f"{' or '.join(map(quote, words))}"
            )

    def refuse_where(self, wrong: Any, sentence: str) -> None:
        """Raise InputError where a comparison of two fields holds at some point."""
        if np.any(wrong):
            raise InputError(f"{type(self).__name__}: {sentence}")


def measure_length(s: Array) -> Array:
    """Return the lengths (m,) of tangential vectors (m, d - 1)."""
    return np.asarray(np.abs(s[:, 0]) if s.shape[1] == 1 else np.linalg.norm(s, axis=1))


def take_mean_of_line(first: Array, way: Array, reach: Array) -> Array:
    """Return the mean (m,) of 1 - min(S/reach, 1) while S grows by a way.

    The line is integrated up to the reach; beyond it nothing is left. Without a way it is the
    value itself.

    Args:
        first: S (m,) [m] at the beginning.
        way: by how much it grows (m,) [m], >= 0.
        reach: where nothing is left any more (m,) [m].
    """
    begin = np.minimum(first, reach)
    end = np.minimum(first + way, reach)
    below = np.divide(end - begin, way, out=np.ones(len(way)), where=way > 0.0)
    return np.asarray((1.0 - 0.5 * (begin + end) / reach) * np.minimum(below, 1.0))


def compare_fields(check: Callable[..., Any], *values: Any) -> Any:
    """Return what a check of values says, False where functions or unlike counts forbid it.

    Args:
        check: takes them as arrays.
        values: numbers, tuples or functions.
    """
    if any(callable(value) for value in values):
        return False
    arrays = [np.asarray(value, dtype=float) for value in values]
    counts = {len(array) for array in arrays if array.ndim}
    return check(*arrays) if len(counts) < 2 else False


@dataclass(frozen=True)
class Prestress(OfPoints):
    """Hold the stresses that a fault has before anything moves: u = 0 is the prestressed state.

    The forces normal · weight and shear · weight along the first tangent are loads of the bodies,
    and the reactions of the problem are the total ones.

    Attributes:
        normal: sigma0 [Pa], pressing > 0.
        shear: tau0 [Pa] along the first tangent, of either sign: with it the body tends to move
            along the tangent.
        nucleate: whether points may start beyond their strength, as those of a nucleus do.
    """

    normal: Annotated[NotNegativeByPoint, Unit("Pa"), "the normal prestress"] = 0.0
    shear: Annotated[ByPoint, Finite, Unit("Pa"), "the shear prestress"] = 0.0
    nucleate: bool = False
