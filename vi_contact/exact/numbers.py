"""Checks of the numbers an exact solution is built from."""

from __future__ import annotations

import math
from numbers import Real

from ..errors import InputError


def check(owner: object, *, positive: tuple[str, ...] = (), not_negative: tuple[str, ...] = ()) -> None:
    """InputError naming the first attribute of `owner` that is not a finite number > 0, or >= 0."""
    for name in positive + not_negative:
        value = getattr(owner, name)
        if not isinstance(value, Real) or not math.isfinite(value) or value < 0 or (name in positive and value == 0):
            wanted = "a finite number above zero" if name in positive else "zero or a positive finite number"
            raise InputError(f"{type(owner).__name__}: {name} is {value!r}; give {wanted}")
