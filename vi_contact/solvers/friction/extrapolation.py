"""Extrapolate fixed-point iterations.

The next point x is found from the points tried so far and their images g(x).

    plain       x <- g(x)
    Anderson    x <- g(x) - sum_j gamma_j (g_j+1 - g_j)
                g(x) - x = f = sum_j gamma_j (f_j+1 - f_j) at best

Both need one image a step and nothing else. Anderson combines the last ``depth`` differences (J.
ACM 12, 1965; Walker and Ni, SIAM J. Numer. Anal. 49, 2011), is the secant method for one unknown,
and on linear problems is equivalent to GMRES. Where a plain step lets f grow along itself, f·f_old
>= |f_old|², g expands and both would turn back: the next step is plain again, and what was tried
before is forgotten.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_fields
from ...core.checks import provides
from ...core.quantities import NotNegative, Positive

Next = Callable[[Array, Array], Array]  # x (n,) and its image g(x) -> the point to try after x


class Extrapolation(Protocol):
    """Choose the next point: Plain or Anderson."""

    def start(self) -> Next:
        """Return what chooses the points of one iteration, which it remembers."""


def accelerated(owner: str, value: Any) -> None:
    """Raise InputError unless it is an extrapolation."""
    provides(
        owner, "extrapolation", value, ("start",), "give Plain() or Anderson()", lacks=("step",)
    )


@dataclass(frozen=True)
class Plain:
    """Take the image itself: a plain iteration without extrapolation."""

    def start(self) -> Next:
        """Return the choice of the next point, which remembers nothing."""
        return lambda x, image: image


@dataclass(frozen=True)
class Anderson:
    """Extrapolate from the last ``depth`` steps, after ``after`` plain ones."""

    depth: Annotated[int, Positive] = 5
    after: Annotated[int, NotNegative] = 0

    def __post_init__(self) -> None:
        check_fields(self)

    def start(self) -> Next:
        """Return the choice of the next point."""
        count = 0
        points: list[tuple[Array, Array]] = []  # (f, g)

        def following(x: Array, image: Array) -> Array:
            nonlocal count, points
            count += 1
            new, kept = image - x, points[-self.depth :]
            if (
                kept
                and np.array_equal(x, kept[-1][1])
                and float(new @ kept[-1][0]) >= float(kept[-1][0] @ kept[-1][0])
            ):
                kept = []
            points = [*kept, (new, image.copy())]
            if count <= self.after or len(points) < 2:
                return image
            f, g = (np.column_stack(part) for part in zip(*points, strict=True))
            gamma, *_ = np.linalg.lstsq(np.diff(f), f[:, -1], rcond=1e-10)
            return np.asarray(image - np.diff(g) @ gamma)

        return following
