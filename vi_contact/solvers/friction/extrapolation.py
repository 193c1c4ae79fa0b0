"""Extrapolate fixed-point iterations: find the next x from points tried and their images g(x).

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
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_fields
from ...core.checks import provides
from ...core.quantities import NotNegative, Positive

Next = Callable[[Array, Array], Array]  # x (n,) and its image g(x) -> the point to try after x
DEPENDENT = 1e-10  # of the largest singular value: differences that others nearly combine to


class Trial(NamedTuple):
    """Hold what is known of a point x that was tried."""

    f: Array  # g(x) - x
    image: Array  # g(x)


class Extrapolation(Protocol):
    """Choose the next point: Plain or Anderson."""

    def start(self) -> Next:
        """Return what chooses the points of one iteration, which it remembers."""


def check_extrapolation(owner: str, value: Any) -> None:
    """Raise InputError unless the value is an extrapolation."""
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
    """Extrapolate from the last steps.

    Attributes:
        depth: how many differences are combined, at most.
        after: number of plain steps before.
    """

    depth: Annotated[int, Positive] = 5
    after: Annotated[int, NotNegative] = 0

    def __post_init__(self) -> None:
        check_fields(self)

    def start(self) -> Next:
        """Return the choice of the next point, which remembers the points of one iteration."""
        count = 0
        points: list[Trial] = []

        def choose_next(x: Array, image: Array) -> Array:
            """Return the point (n,) to try after x, which has this image g(x)."""
            nonlocal count, points
            count += 1
            f = image - x

            # After a plain step that let f grow along itself all that was tried is forgotten.
            points = points[-self.depth :]
            if points and np.array_equal(x, points[-1].image):
                f_old = points[-1].f
                if float(f @ f_old) >= float(f_old @ f_old):
                    points = []
            points.append(Trial(f, image.copy()))
            if count <= self.after or len(points) < 2:
                return image

            # Least squares for f by differences of f; the same combination of those of g.
            of_f = np.diff(np.column_stack([point.f for point in points]))
            of_g = np.diff(np.column_stack([point.image for point in points]))
            gamma, *_ = np.linalg.lstsq(of_f, f, rcond=DEPENDENT)
            return np.asarray(image - of_g @ gamma)

        return choose_next
