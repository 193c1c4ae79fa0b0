"""Say where a rigid obstacle lies: by contact directions and initial gaps, which are checked."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from .algebra import Array, Indices, Mask
from .checks import array, describe_point, function
from .errors import InputError
from .quantities import Unit

RIGHT_ANGLE = 1e-9  # its cosine, to round-off
BESIDE = 0.01  # cosine of the angle (89.4°) from which on a direction is along a boundary
SAME_TURN = 1e-9  # relative; turns of normals that differ by less are one
PRESS_FIT = (
    "make a press fit of bodies that touch without stress, by quasi_static on "
    "surface.moving(towards=…) or by fem.InitialStrain"
)
OVERLAP = 1e-12  # of the size of the body: gaps below zero that are round-off
REMEDY = (
    "give unit vectors from the body to the obstacle (the normal of a HalfSpace points towards the "
    "body: turn its sign)"
)


class Obstacle(Protocol):
    """Say where a rigid support lies: contact direction and initial gap of points of a boundary."""

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the unit contact directions (k, d), from the body to the obstacle.

        It is asked before ``gap``, with the same arrays.

        Args:
            points: (k, d) positions of contact nodes [m], each rank its own.
            normals: (k, d) unit outward normals of the body there.

        Raises:
            InputError: body and support do not fit.
        """

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the initial gaps (k,) [m] along these directions, >= 0 but for round-off.

        gap - u·direction is what is left when the point moves by u.

        Args:
            points: (k, d) positions of contact nodes [m], as in ``directions``.
            normals: (k, d) unit outward normals of the body there.
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
    """Describe a rigid half-space behind a plane.

    The condition is exact for any boundary shape: (X + u - point)·normal >= 0, so the contact
    direction is -normal.

    Attributes:
        point: a point (d,) [m] of the plane.
        normal: its normal (d,), which points towards the body; of any length but zero.
    """

    point: Annotated[tuple[float, ...], Unit("m")]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        point = array("HalfSpace", "point", self.point, (None,))
        normal = array("HalfSpace", "normal", self.normal, (None,))
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
    """Give the gap g0(x) as a function of the points, along the body's outward normal.

    The function is asked for the points of each rank by themselves: let no gap depend on other
    points, such as their mean or the lowest of them.

    Attributes:
        function: takes points (k, d) [m] and returns gaps (k,) [m].
    """

    function: Annotated[Callable[[Array], Array], Unit("m")]

    def __post_init__(self) -> None:
        remedy = "give a function of points (k, d) that returns gaps (k,)"
        function("AnalyticGap", "function", self.function, remedy)

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the outward normals of the body."""
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the values (k,) [m] of the function at the points."""
        return self.function(points)


def number_places(points: Array) -> Indices:
    """Return a number (k,) for every point (k, d), equal where points coincide."""
    _, numbers = np.unique(points, axis=0, return_inverse=True)
    return np.asarray(numbers, dtype=np.int64).ravel()


def locate_obstacle(
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
    ``angle`` at once. Other such points are of a face that the obstacle never reaches.

    Args:
        obstacle: the obstacle that is asked.
        points: (m, d) positions of the contact nodes [m].
        normals: (m, d) outward unit normals of the body there.
        name: of the boundary, for the sentence.
        angle: how much normals may turn at once [rad].
        alone: whether these are all its points. If not, points on a far side are refused too, as
            other points might decide.

    Raises:
        InputError: other shapes, what are no real numbers, directions of no length, along the
            boundary or into the body.
    """
    owner = type(obstacle).__name__
    m = len(points)
    answer = obstacle.directions(points, normals)
    directions = array(owner, "what directions returns", answer, points.shape)
    length = np.linalg.norm(directions, axis=1)
    if not length.all():
        place = describe_point(points[np.argmin(length)])
        raise InputError(f"{owner}: the contact direction at {place} has no length; {REMEDY}")
    _refuse_beside(owner, name, directions / length[:, None], normals)
    gap = np.asarray(obstacle.gap(points, normals))
    if gap.shape != (m,) or gap.dtype.kind not in "iuf":
        raise InputError(
            f"{owner}: gap returned {gap.dtype} of shape {gap.shape} for {m} points; return one "
            "real gap per point"
        )

    # A place looks away from the obstacle when all normals there do: a node at an edge has one for
    # each of its faces.
    cosines = np.sum(directions * normals, axis=1) / length
    places = number_places(points)
    towards = cosines >= -RIGHT_ANGLE
    away = ~np.isin(places, places[towards])

    # It may do so on the far side of a round face alone: beyond all points that look towards the
    # obstacle, and without a sharp edge on the way.
    beyond = np.zeros(m, dtype=bool)
    if alone:
        beyond = gap > np.max(gap[cosines > BESIDE], initial=-np.inf)
    wrong = np.flatnonzero(away & ~(beyond & _turn_smoothly(cosines, angle)))
    if len(wrong):
        turn = np.degrees(np.arccos(np.clip(cosines[wrong], -1.0, 1.0)).mean())
        place = describe_point(points[wrong[0]])
        raise InputError(
            f"{owner}: the contact direction at {place}{_of_boundary(name)} points into the "
            f"body at {turn:.4g} degrees to the outward normal, in the mean of {len(wrong)} "
            f"points; leave the face there out of the boundary, or {REMEDY}"
        )
    return directions, gap.astype(float)


def _refuse_beside(owner: str, name: str, directions: Array, normals: Array) -> None:
    """Raise InputError, once for a whole boundary, for directions along it or into the body.

    Args:
        owner: class of the obstacle.
        name: of the boundary.
        directions: (m, d) unit contact directions.
        normals: (m, d) unit outward normals.
    """
    cosines = np.sum(directions * normals, axis=1)
    if not len(cosines) or cosines.max() > BESIDE:
        return

    # The sentence is about the part that the obstacle can reach, or about all of it where that is
    # none.
    reached = cosines >= -RIGHT_ANGLE
    if not np.any(reached):
        reached = np.ones(len(cosines), dtype=bool)
    direction = _normalise(directions[reached].mean(axis=0))
    normal = _normalise(normals[reached].mean(axis=0))
    angle = np.degrees(np.arccos(np.clip(direction @ normal, -1.0, 1.0)))
    defect = "points into the body" if cosines.max() < -BESIDE else "is along the boundary"
    raise InputError(
        f"{owner}: the contact direction {describe_point(direction.round(6))}{_of_boundary(name)} "
        f"{defect} at {angle:.4g} degrees to its mean outward normal "
        f"{describe_point(normal.round(6))}; choose the boundary that looks towards the obstacle, "
        f"or {REMEDY}"
    )


def _of_boundary(name: str) -> str:
    """Return the name of a boundary in a sentence."""
    return f" of '{name}'" if name else ""


def _turn_smoothly(cosines: Array, angle: float) -> Mask:
    """Return which normals are reached, by small turns, from that which looks most at the obstacle.

    Args:
        cosines: (m,) those of normals and contact directions.
        angle: the largest turn [rad] from one normal to the next.
    """
    turns = np.arccos(np.clip(cosines, -1.0, 1.0))
    steps = np.unique(turns)
    wide = np.flatnonzero(np.diff(steps) > angle * (1.0 + SAME_TURN))
    last = steps[wide[0]] if len(wide) else np.inf
    return np.asarray(turns <= last)


def _normalise(vector: Array) -> Array:
    """Return the vector with length one, zero as it is, without negative zeros."""
    length = np.linalg.norm(vector) or 1.0
    return np.asarray(vector / length + 0.0)


def check_gap(gap: Array, points: Array, size: float) -> Array:
    """Return the initial gap (m,) [m] without round-off below zero.

    Args:
        gap: (m,) what the obstacle gives [m].
        points: (m, d) positions [m], for the sentence.
        size: of the body [m], which round-off is measured by.

    Raises:
        InputError: the body penetrates the obstacle, or a gap is no finite number.
    """
    if not np.all(np.isfinite(gap)):
        raise InputError(
            "the initial gap contains NaN or infinite values: check the obstacle's gap function"
        )
    if len(gap) and gap.min() < -OVERLAP * size:
        worst = int(np.argmin(gap))
        place = describe_point(points[worst])
        raise InputError(
            f"the body penetrates its obstacle by {-gap[worst]:.3g} m at {place} "
            "before the first step: move the obstacle or the mesh so that every initial gap is >= "
            f"0, or {PRESS_FIT}"
        )
    return np.maximum(gap, 0.0)
