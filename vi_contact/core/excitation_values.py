"""Check values that shake a body, and turn their scalar accelerations into vectors."""

from collections.abc import Sequence

import numpy as np

from .algebra import Array
from .checks import attributes, number, several
from .errors import InputError
from .protocols import Excitation


def vector(self: Excitation, t: float) -> Array:
    """Return the vector acceleration(t) · direction [m/s²], shape (d,)."""
    return self.acceleration(t) * np.array(self.direction)


def check_excitation(excitation: Excitation, *, finite: tuple[str, ...] = (), positive: tuple[str, ...] = ()) -> None:
    """Raise InputError for a bad number or direction; turn the direction into a tuple of floats."""
    attributes(excitation, finite=finite, positive=positive)
    owner = type(excitation).__name__
    direction = finite_tuple(owner, "direction", excitation.direction)
    if not 1 <= len(direction) <= 3 or not any(direction):
        raise InputError(f"{owner}: direction is {direction!r}; give one to three components, not all zero")
    object.__setattr__(excitation, "direction", direction)


def finite_tuple(owner: str, name: str, values: Sequence[float]) -> tuple[float, ...]:
    """Return `values` as a tuple of floats; InputError naming the first entry that is not a finite number."""
    entries = several(owner, name, values, "give a sequence of numbers")
    return tuple(number(owner, f"{name}[{k}]", value) for k, value in enumerate(entries))
