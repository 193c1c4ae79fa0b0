"""Place names in a picture in the plane, so that they cover neither each other nor lines."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.algebra import Array

LETTER = 0.6  # width of a letter over its size, about
POINT = 1.0 / 72.0  # inches
NEAR = 6.0  # of a name from its place [points]
# How far a name is moved, over its size, where nearer places are taken.
STEPS = (0.0, 1.3, 2.8, 4.4)
HALO = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8}


class Labels:
    """Write names where there is room for them.

    Args:
        axis: matplotlib's, with its limits and one scale along both directions.
        inches: of the picture a metre.
    """

    def __init__(self, axis: Any, inches: float) -> None:
        self.axis = axis
        self.inches = inches
        self.taken: list[Array] = []

    def reserve(self, points: Array) -> None:
        """Keep names off the box round points (k, 2) [m], which is a line or a small thing."""
        low = points.min(axis=0) * self.inches
        high = points.max(axis=0) * self.inches
        self.taken.append(np.array([low, high]))

    def write(
        self, text: str, place: Array, away: Array, *, size: float = 7.0, **look: Any
    ) -> None:
        """Write a name beside its place.

        Args:
            text: the name.
            place: (2,) that it is about [m].
            away: (2,) the direction in which it stands; where there is no room it stands on the
                other side, across, or farther away, with a line to its place.
            size: of the letters [points].
            **look: arguments of matplotlib's ``annotate``.
        """
        wide = (LETTER * len(text) * size + 2.0) * POINT
        high = 1.4 * size * POINT
        half = 0.5 * np.array([wide, high])
        centre, moved = self._find_room(place * self.inches, half, away)
        self.taken.append(np.array([centre - half, centre + half]))
        offset = (centre - place * self.inches) / POINT
        if moved:
            look |= {"arrowprops": {"arrowstyle": "-", "lw": 0.6, "color": "0.3", "shrinkA": 0}}
        look = {"ha": "center", "va": "center", "bbox": HALO, "zorder": 6, **look}
        self.axis.annotate(
            text, place, xytext=tuple(offset), textcoords="offset points", fontsize=size, **look
        )

    def _find_room(self, place: Array, half: Array, away: Array) -> tuple[Array, bool]:
        """Return where the middle of a name stands [inches], and whether that is farther away.

        Args:
            place: (2,) that it is about [inches].
            half: (2,) half of its size [inches].
            away: (2,) the direction in which it stands.
        """
        across = np.array([-away[1], away[0]])
        directions: Sequence[Array] = (away, -away, across, -across, away + across, away - across)
        best = place
        for step in STEPS:
            for direction in directions:
                unit = direction / np.linalg.norm(direction)
                reach = NEAR * POINT + step * 2.0 * half[1]
                best = place + unit * (half + reach)
                if self._is_free(best - half, best + half):
                    return best, step > 0.0
        return place + away / np.linalg.norm(away) * (half + NEAR * POINT), False

    def _is_free(self, low: Array, high: Array) -> bool:
        """Return whether a box [inches] touches none that is taken."""
        return not any(np.all(low < box[1]) and np.all(high > box[0]) for box in self.taken)
