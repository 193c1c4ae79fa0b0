"""Make no product twice.

Several parts of a step ask for products with the same vectors, and for one load.

Remembered are read-only vectors (``frozen``), each known as the object it is; what is handed out is
read-only too.
"""

from collections.abc import Callable
from typing import Any

from .algebra import Array


def frozen(x: Array) -> Array:
    """Return the vector, which nobody can write to from now on."""
    x.flags.writeable = False
    return x


class Remembered:
    """Hold the last few values of a function of a vector, or of a number."""

    def __init__(self, function: Callable[[Any], Array], kept: int) -> None:
        self._function, self._kept = function, kept
        # with the vectors, so that ids are theirs
        self._known: dict[Any, tuple[Any, Array | Callable[[], Array]]] = {}

    def __call__(self, x: Any) -> Array:
        """Return the value at x."""
        is_number = type(x) is float
        known = self._known.get(x if is_number else id(x))
        if known is not None:
            value = known[1]
            return value() if callable(value) else value
        value = self._function(x)
        if is_number or not x.flags.writeable:
            self._keep(x if is_number else id(x), x, frozen(value))
        return value

    def _keep(self, key: Any, x: Any, value: Array | Callable[[], Array]) -> None:
        if len(self._known) == self._kept:
            del self._known[next(iter(self._known))]
        self._known[key] = x, value

    def know(self, x: Any, value: Callable[[], Array]) -> Any:
        """Return x, frozen; ``value`` tells the value there when somebody asks for it."""
        self._keep(x if type(x) is float else id(frozen(x)), x, value)
        return x

    def numbers(self) -> list[float]:
        """Return the numbers at which the values are known."""
        return [x for x in self._known if type(x) is float]
