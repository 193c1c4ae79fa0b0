"""The part of a way where the energy is flat, on slopes whose zero is known."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from vi_contact.solvers.line_search import FLAT, find_finite, find_flat

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("zero", [0.002, 0.1, 0.5, 0.97])
@pytest.mark.parametrize("last", [1.0, 1e6, math.inf])
def test_a_flat_part_is_found(zero: float, last: float) -> None:
    """Wherever it is, however steep the way is at its end, and where it has no slope there."""

    def slope(part: float) -> float:
        if part < zero:
            return part / zero - 1.0
        return last * (part - zero) / (1.0 - zero) if math.isfinite(last) or part > zero else 0.0

    found = find_flat(lambda part: (part, slope(part)), -1.0, last)
    assert found is not None
    assert abs(slope(found)) <= FLAT or 0.0 < found < zero


def test_no_part_is_flat() -> None:
    """Where the energy grows from the very start, and where there is no energy at all."""
    up: Callable[[float], tuple[float, float]] = lambda part: (part, 10.0)  # noqa: E731
    none: Callable[[float], tuple[float, float]] = lambda part: (part, math.inf)  # noqa: E731
    assert find_flat(up, -1.0, 10.0) is None
    assert find_finite(none) is None
    assert find_finite(lambda part: (part, 1.0 if part < 0.2 else math.inf)) == 0.125
