"""Find the part of a way where the energy is nearly flat, from its slopes along the way alone.

M. A. Crisfield, Non-linear Finite Element Analysis of Solids and Structures 1, 1991, section 9.2.
"""

from collections.abc import Callable
from math import isfinite
from typing import TypeVar

PARTS = 12  # of a way that are tried, at most
FLAT = 0.5  # of the slope at the start: one that is small
INSIDE = 0.1  # of a bracket: how near to its ends the next part may be

T = TypeVar("T")


def find_flat(ask: Callable[[float], tuple[T, float]], first: float, last: float) -> T | None:
    """Return a place on a way where the slope is small; else the last one where it is negative.

    The place lies between a part with a negative slope and one with a positive slope or none. The
    next part is that of the secant and the middle in turn.

    Args:
        ask: part of the way from 0 to 1 -> the place there, and the slope; infinite for none.
        first: the negative slope at the start.
        last: the slope at the end.

    Returns:
        The place; None where no slope that was asked for is small or negative.
    """
    lowest: T | None = None
    low = 0.0
    low_slope = first
    high = 1.0
    high_slope = last
    for turn in range(PARTS):
        share = 0.5
        if turn % 2 == 0 and isfinite(high_slope):
            share = low_slope / (low_slope - high_slope)
            share = min(max(share, INSIDE), 1.0 - INSIDE)
        part = low + share * (high - low)
        place, slope = ask(part)
        if abs(slope) <= FLAT * abs(first):
            return place
        if slope < 0.0:
            low = part
            low_slope = slope
            lowest = place
        else:
            high = part
            high_slope = slope
    return lowest


def find_finite(ask: Callable[[float], tuple[T, float]]) -> T | None:
    """Return the first place with a slope, of a half of the way, a quarter and so on.

    Args:
        ask: as of ``find_flat``.
    """
    for turn in range(1, PARTS + 1):
        place, slope = ask(0.5**turn)
        if isfinite(slope):
            return place
    return None
