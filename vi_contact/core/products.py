"""Remember products, so that none is made twice.

Several parts of a step ask for products with the same vectors, and for one load. Those with
read-only vectors (``freeze``) are remembered, each by the identity of its vector; what is handed
out is read-only too.
"""

from collections.abc import Callable
from typing import Any

from .algebra import Array


def freeze(x: Array) -> Array:
    """Return the vector, which nobody can write to from now on."""
    x.flags.writeable = False
    return x


class Remembered:
    """Hold the last few values of a function of a vector, or of a number."""

    def __init__(self, function: Callable[[Any], Array], size: int) -> None:
        """Begin with no value.

        Args:
            function: of a vector, or of a float.
            size: how many values are remembered.
        """
        self._function = function
        self._size = size
        # Each entry keeps its vector alive, so that no other object gets the same id.
        self._known: dict[Any, tuple[Any, Array | Callable[[], Array]]] = {}

    def __call__(self, x: Any) -> Array:
        """Return the value at x, a vector or a float.

        It is remembered for numbers and for vectors that nobody can write to: of others the
        identity says nothing of the content.
        """
        is_number = type(x) is float
        known = self._known.get(x if is_number else id(x))
        if known is not None:
            value = known[1]
            return value() if callable(value) else value
        value = self._function(x)
        if is_number or not x.flags.writeable:
            self._remember(x if is_number else id(x), x, freeze(value))
        return value

    def _remember(self, key: Any, x: Any, value: Array | Callable[[], Array]) -> None:
        """Add a value, and forget the oldest one where there are too many.

        Args:
            key: the number x, or the id of the vector x.
            x: the number or vector, which is kept alive.
            value: the value at x, or what makes it.
        """
        if len(self._known) == self._size:
            oldest = next(iter(self._known))
            del self._known[oldest]
        self._known[key] = (x, value)

    def know(self, x: Any, value: Callable[[], Array]) -> Any:
        """Return x, made read-only; ``value`` makes the value there when somebody asks for it."""
        self._remember(x if type(x) is float else id(freeze(x)), x, value)
        return x

    def numbers(self) -> list[float]:
        """Return the numbers at which the values are known."""
        return [x for x in self._known if type(x) is float]
