"""Make nothing twice: several parts of a step ask for products with the same vectors, and for one load.

Remembered are vectors that nobody can write to any more (``frozen``), such as those of a state; each is known as the
object it is. What is handed out is shared, and read-only too.
"""

from __future__ import annotations

from collections import deque
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
        self._function = function
        self._kept: deque[tuple[Any, Array | Callable[[], Array]]] = deque(maxlen=kept)

    def __call__(self, x: Any) -> Array:
        """Return the value at x."""
        for known, value in self._kept:
            if known is x or type(x) is float and x == known:
                return value() if callable(value) else value
        value = self._function(x)
        if type(x) is float or not x.flags.writeable:
            self._kept.append((x, frozen(value)))
        return value

    def know(self, x: Array, value: Callable[[], Array]) -> Array:
        """Return x, frozen; ``value`` tells the value there when somebody asks for it."""
        self._kept.append((frozen(x), value))
        return x
