"""Say where a rigid obstacle lies.

It does so by contact directions and initial gaps; the module also checks what is asked of them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from .algebra import Array, Indices, Mask
from .checks import array, at, function
from .errors import InputError
from .quantities import Unit

ROUND_OFF = 1e-9  # cosine of a right angle
BESIDE = 0.01  # cosine of the angle (89.4°) from which on a direction is along a boundary
REMEDY = (
    "give unit vectors from the body to the obstacle (the normal of a HalfSpace points towards the "
    "body: turn its sign)"
)


class Obstacle(Protocol):
    """Say where a rigid support lies.

    It gives the contact direction of each point of a boundary, and its initial gap.
    """

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the unit contact directions (k, d), from the body to the obstacle.

        ``points``: (k, d) positions of contact nodes [m], each rank its own; ``normals``: (k, d)
        unit outward normals of the body there. Asked before ``gap``, with the same arrays;
        InputError when body and support do not fit.
        """

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the initial gaps (k,) [m] along these directions, >= 0 but for round-off.

        ``points`` and ``normals`` as in ``directions``. gap - u·direction is what is left when the
        point moves by u.
        """


@dataclass(frozen=True)
class Touching:
    """Fit the boundary exactly: zero initial gap, contact along the body's outward normal."""

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the outward normals of the body."""
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        """Return zero gaps (k,) [m]."""
        return np.zeros(len(points))


@dataclass(frozen=True)
class HalfSpace:
    """Describe a rigid half-space behind the plane through ``point``.

    Its ``normal`` points towards the body.

    The condition is exact for any boundary shape: (X + u - point)·normal >= 0, so the contact
    direction is -normal.
    """

    point: Annotated[tuple[float, ...], Unit("m")]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        point, normal = (
            array("HalfSpace", name, getattr(self, name), (None,)) for name in ("point", "normal")
        )
        if not normal.any() or not np.isfinite(np.linalg.norm(normal)) or len(point) != len(normal):
            raise InputError(
                f"HalfSpace(point={self.point}, normal={self.normal}): give a point and a nonzero "
                "normal with the same number of components"
            )

    @property
    def unit_normal(self) -> Array:
        """Return the normal with length one."""
        normal = np.asarray(self.normal, dtype=float)
        return np.asarray(normal / np.linalg.norm(normal))

    def directions(self, points: Array, normals: Array) -> Array:
        """Return -normal at every point, (k, d)."""
        return np.tile(-self.unit_normal, (len(points), 1))

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the distances (k,) [m] of the points from the plane."""
        return np.asarray((points - np.asarray(self.point, dtype=float)) @ self.unit_normal)


@dataclass(frozen=True)
class AnalyticGap:
    """Give the gap g0(x) as a function of points (k, d) -> (k,) [m].

    It is measured along the body's outward normal. It is asked for the points of each rank by
    themselves: let no gap depend on other points, as on their mean or lowest.
    """

    function: Annotated[Callable[[Array], Array], Unit("m")]

    def __post_init__(self) -> None:
        function(
            "AnalyticGap",
            "function",
            self.function,
            "give a function of points (k, d) that returns gaps (k,)",
        )

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the outward normals of the body."""
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the values (k,) [m] of the function at the points."""
        return self.function(points)


def alike(points: Array) -> Indices:
    """Return a number (k,) for every point, equal where points coincide."""
    return np.asarray(np.unique(points, axis=0, return_inverse=True)[1], dtype=np.int64).ravel()


def facing(
    obstacle: Obstacle,
    points: Array,
    normals: Array,
    *,
    name: str = "",
    angle: float = 0.0,
    alone: bool = True,
) -> tuple[Array, Array]:
    """Return the contact directions (m, d) and gaps (m,) [m] of an obstacle, checked.

    The obstacle can reach facets whose outward normals do not look away from it. Of the whole
    boundary, the mean direction must be within a right angle of the mean normal of those: else
    nothing of it can touch. A point whose normals all look away from the direction, on the far side
    of a round face, cannot touch either, and is let be: its gap is larger than that of every point
    which looks towards the obstacle, and the normals turn from theirs to its own by no more than
    ``angle`` [rad] at once. Other such points are of a face that the obstacle never reaches.

    Args:
        obstacle: what is asked.
        points: (m, d) positions of the contact nodes [m].
        normals: (m, d) outward unit normals of the body there.
        name: of the boundary, for the sentence.
        angle: how much normals may turn at once [rad].
        alone: whether these are all its points; some of them only are refused where others might
            decide.

    Raises:
        InputError: other shapes, what are no real numbers, directions of no length, along the
            boundary or into the body.
    """
    owner, m = type(obstacle).__name__, len(points)
    directions = array(
        owner, "what directions returns", obstacle.directions(points, normals), points.shape
    )
    length = np.linalg.norm(directions, axis=1)
    if not length.all():
        raise InputError(
            f"{owner}: the contact direction at {at(points[np.argmin(length)])} has no length; "
            f"{REMEDY}"
        )
    _refuse_beside(owner, name, directions / length[:, None], normals)
    gap = np.asarray(obstacle.gap(points, normals))
    if gap.shape != (m,) or gap.dtype.kind not in "iuf":
        raise InputError(
            f"{owner}: gap returned {gap.dtype} of shape {gap.shape} for {m} points; return one "
            "real gap per point"
        )
    cosines, places = np.sum(directions * normals, axis=1) / length, alike(points)
    towards = cosines >= -ROUND_OFF
    beyond = (
        gap > np.max(gap[cosines > BESIDE], initial=-np.inf) if alone else np.zeros(m, dtype=bool)
    )
    away = ~np.isin(places, places[towards])
    wrong = np.flatnonzero(away & ~(beyond & _turned_smoothly(cosines, angle)))
    if len(wrong):
        turn = np.degrees(np.arccos(np.clip(cosines[wrong], -1.0, 1.0)).mean())
        raise InputError(
            f"{owner}: the contact direction at {at(points[wrong[0]])}{_of(name)} points into the "
            f"body at {turn:.4g} degrees to the outward normal, in the mean of {len(wrong)} "
            f"points; leave the face there out of the boundary, or {REMEDY}"
        )
    return directions, gap.astype(float)


def _refuse_beside(owner: str, name: str, directions: Array, normals: Array) -> None:
    """Raise InputError for unit directions along the boundary or into the body.

    It is raised once for a whole boundary.
    """
    cosines = np.sum(directions * normals, axis=1)
    if not len(cosines) or cosines.max() > BESIDE:
        return
    reached = (
        cosines >= -ROUND_OFF
        if np.any(cosines >= -ROUND_OFF)
        else np.ones(len(cosines), dtype=bool)
    )
    way, normal = (_unit(one[reached].mean(axis=0)) for one in (directions, normals))
    angle = np.degrees(np.arccos(np.clip(way @ normal, -1.0, 1.0)))
    what = "points into the body" if cosines.max() < -BESIDE else "is along the boundary"
    raise InputError(
        f"{owner}: the contact direction {at(way.round(6))}{_of(name)} {what} at {angle:.4g} "
        f"degrees to its mean outward normal {at(normal.round(6))}; choose the boundary that looks "
        f"towards the obstacle, or {REMEDY}"
    )


def _of(name: str) -> str:
    """Return the name of a boundary in a sentence."""
    return f" of '{name}'" if name else ""


def _turned_smoothly(cosines: Array, angle: float) -> Mask:
    """Return which normals (m,) are reached from the one that looks most in the direction.

    They are judged by their cosines with the direction, and reached by turns of no more than
    ``angle`` from one normal to the next.
    """
    turns = np.arccos(np.clip(cosines, -1.0, 1.0))
    steps = np.unique(turns)
    wide = np.flatnonzero(np.diff(steps) > angle * (1.0 + 1e-9))
    return np.asarray(turns <= (steps[wide[0]] if len(wide) else np.inf))


def _unit(vector: Array) -> Array:
    """Return the vector with length one, zero as it is, without negative zeros."""
    return np.asarray(vector / (np.linalg.norm(vector) or 1.0) + 0.0)


def admissible_gap(gap: Array, points: Array, size: float) -> Array:
    """Return the initial gap without round-off (1e-12 of the body's size).

    Raises:
        InputError: the body penetrates the obstacle.
    """
    if not np.all(np.isfinite(gap)):
        raise InputError(
            "the initial gap contains NaN or infinite values: check the obstacle's gap function"
        )
    if len(gap) and gap.min() < -1e-12 * size:
        worst = int(np.argmin(gap))
        raise InputError(
            f"the body penetrates its obstacle by {-gap[worst]:.3g} m at {at(points[worst])} "
            "before the first step: move the obstacle or the mesh so that every initial gap is >= 0"
        )
    return np.maximum(gap, 0.0)
