"""Say where a rigid obstacle lies: contact directions and initial gaps, and what is asked of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .algebra import Array, Indices
from .checks import array, at, function
from .errors import InputError


class Obstacle(Protocol):
    """Say where a rigid support lies: the contact direction of each point of a boundary, and its initial gap."""

    def directions(self, points: Array, normals: Array) -> Array:
        """Return the unit contact directions (k, d), from the body to the obstacle.

        ``points``: (k, d) positions of contact nodes [m], each rank its own; ``normals``: (k, d) unit outward normals
        of the body there. Asked before ``gap``, with the same arrays; InputError when body and support do not fit."""

    def gap(self, points: Array, normals: Array) -> Array:
        """Return the initial gaps (k,) [m] along these directions, >= 0 but for round-off.

        ``points`` and ``normals`` as in ``directions``. gap - u·direction is what is left when the point moves by u."""


@dataclass(frozen=True)
class Touching:
    """Fit the boundary exactly: zero initial gap, contact along the body's outward normal."""

    def directions(self, points: Array, normals: Array) -> Array:
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        return np.zeros(len(points))


@dataclass(frozen=True)
class HalfSpace:
    """Describe a rigid half-space behind the plane through ``point``, whose ``normal`` points towards the body.

    The condition is exact for any boundary shape: (X + u - point)·normal >= 0, so the contact direction is -normal."""

    point: tuple[float, ...]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        point, normal = (array("HalfSpace", name, getattr(self, name), (None,)) for name in ("point", "normal"))
        if not normal.any() or not np.isfinite(np.linalg.norm(normal)) or len(point) != len(normal):
            raise InputError(f"HalfSpace(point={self.point}, normal={self.normal}): give a point and a nonzero normal "
                             "with the same number of components")

    @property
    def unit_normal(self) -> Array:
        """Return the normal with length one."""
        normal = np.asarray(self.normal, dtype=float)
        return np.asarray(normal / np.linalg.norm(normal))

    def directions(self, points: Array, normals: Array) -> Array:
        return np.tile(-self.unit_normal, (len(points), 1))

    def gap(self, points: Array, normals: Array) -> Array:
        return np.asarray((points - np.asarray(self.point, dtype=float)) @ self.unit_normal)


@dataclass(frozen=True)
class AnalyticGap:
    """Give the gap g0(x) as a function of points (k, d) -> (k,) [m], measured along the body's outward normal. It is
    asked for the points of each rank by themselves: let no gap depend on other points, as on their mean or lowest."""

    function: Callable[[Array], Array]

    def __post_init__(self) -> None:
        function("AnalyticGap", "function", self.function, "give a function of points (k, d) that returns gaps (k,)")

    def directions(self, points: Array, normals: Array) -> Array:
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        return self.function(points)


def alike(points: Array) -> Indices:
    """Return a number (k,) for every point, equal where points coincide."""
    return np.asarray(np.unique(points, axis=0, return_inverse=True)[1], dtype=np.int64).ravel()


def facing(obstacle: Obstacle, points: Array, normals: Array) -> tuple[Array, Array]:
    """Return the contact directions (m, d) and gaps (m,) [m] of an obstacle, checked.

    InputError for other shapes, what are no real numbers, and directions that point into the body: away from the
    outward normals of all faces of a point (at right angles it may touch with an edge)."""
    owner, m = type(obstacle).__name__, len(points)
    directions = array(owner, "what directions returns", obstacle.directions(points, normals), points.shape)
    length = np.linalg.norm(directions, axis=1)
    towards, places = np.sum(directions * normals, axis=1) >= -1e-9 * length, alike(points)
    wrong = np.flatnonzero(~np.isin(places, places[towards]) | (length == 0.0))
    if len(wrong):
        raise InputError(f"{owner}: the contact direction at {at(points[wrong[0]])} points into the body or has no "
                         "length; give unit vectors from the body to the obstacle (the normal of a HalfSpace points "
                         "towards the body: turn its sign)")
    gap = np.asarray(obstacle.gap(points, normals))
    if gap.shape != (m,) or gap.dtype.kind not in "iuf":
        raise InputError(f"{owner}: gap returned {gap.dtype} of shape {gap.shape} for {m} points; return one real gap "
                         "per point")
    return directions, gap.astype(float)


def admissible_gap(gap: Array, points: Array, size: float) -> Array:
    """Return the initial gap without round-off (1e-12 of the body's size); InputError where the body penetrates."""
    if not np.all(np.isfinite(gap)):
        raise InputError("the initial gap contains NaN or infinite values: check the obstacle's gap function")
    if len(gap) and gap.min() < -1e-12 * size:
        worst = int(np.argmin(gap))
        raise InputError(f"the body penetrates its obstacle by {-gap[worst]:.3g} m at {at(points[worst])} before the "
                         "first step: move the obstacle or the mesh so that every initial gap is >= 0")
    return np.maximum(gap, 0.0)
