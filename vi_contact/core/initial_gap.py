"""Where an obstacle lies: the contact directions and initial gaps that it gives, checked."""

from __future__ import annotations

import numpy as np

from .algebra import Array
from .checks import array
from .errors import InputError
from .surfaces import Obstacle, alike


def facing(obstacle: Obstacle, points: Array, normals: Array) -> tuple[Array, Array]:
    """(contact directions (m, d), gaps (m,)) of an obstacle; InputError for other shapes, what are no real numbers, and
    directions that point into the body: away from the outward normals of all faces of a point (at right angles it may
    touch with an edge)."""
    owner, m = type(obstacle).__name__, len(points)
    directions = array(owner, "what directions returns", obstacle.directions(points, normals), points.shape)
    length = np.linalg.norm(directions, axis=1)
    towards, places = np.sum(directions * normals, axis=1) >= -1e-9 * length, alike(points)
    wrong = np.flatnonzero(~np.isin(places, places[towards]) | (length == 0.0))
    if len(wrong):
        where = ", ".join(f"{x:g}" for x in points[wrong[0]])
        raise InputError(f"{owner}: the contact direction at ({where}) points into the body or has no length; give "
                         "unit vectors from the body to the obstacle")
    gap = np.asarray(obstacle.gap(points, normals))
    if gap.shape != (m,) or gap.dtype.kind not in "iuf":
        raise InputError(f"{owner}: gap returned {gap.dtype} of shape {gap.shape} for {m} points; return one real gap "
                         "per point")
    return directions, gap.astype(float)


def admissible_gap(gap: Array, points: Array, size: float) -> Array:
    """The initial gap with round-off (1e-12 of the body's size) removed; InputError where the body penetrates."""
    if not np.all(np.isfinite(gap)):
        raise InputError("the initial gap contains NaN or infinite values: check the obstacle's gap function")
    if len(gap) and gap.min() < -1e-12 * size:
        worst = int(np.argmin(gap))
        where = ", ".join(f"{x:g}" for x in points[worst])
        raise InputError(
            f"the body penetrates its obstacle by {-gap[worst]:.3g} m at ({where}) before the first step: "
            "move the obstacle or the mesh so that every initial gap is >= 0"
        )
    return np.maximum(gap, 0.0)
