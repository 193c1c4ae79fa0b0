"""Let bodies that turn land on flat rigid supports, with any node of their boundary.

A half-space does not turn with the body: the gap of a node is gap0 - u·n in any position, with the
direction n of the support, exactly linear in u. Every node of the boundary has such a condition.
The outside of a half-space is convex, so that edges and faces between nodes outside are outside
too: nothing passes through the support, by steps of any length.

Weights are those of the undeformed boundary, of all facets around a node: at an edge of the body
r_n / weight is less than the pressure on the one face that lies on the support.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError
from ...core.internal import turns
from ...core.obstacles import HalfSpace, Obstacle, check_gap
from ..body.space import space_of
from ..mesh.tagged_mesh import Facets
from .frames import snap_to_axes


def choose_boundary(
    system: Any, facets: Facets | None, obstacle: Obstacle | None
) -> tuple[Facets, bool]:
    """Return the part of the boundary that may land, and whether the body turns. Collective.

    Args:
        system: that of the body.
        facets: the part that was given; None for all of the boundary of a body that turns.
        obstacle: what it faces.

    Raises:
        InputError: an obstacle that is not flat before a body that turns; no part of a body that
            does not, where the far side cannot be meant.
    """
    body_turns = turns(getattr(system, "internal", None))
    if body_turns and not isinstance(obstacle, HalfSpace):
        kind = "Touching" if obstacle is None else type(obstacle).__name__
        raise InputError(
            f"contact_surface: {kind} says gaps along the normals of the undeformed body, and this "
            "body turns: give obstacle=HalfSpace(point, normal), and several by joined_surfaces"
        )
    if facets is not None:
        return facets, body_turns
    space = space_of("contact_surface", system)
    if not body_turns:
        raise InputError(
            "contact_surface: facets are not given, and only a body that turns lands with all of "
            "its boundary: give facets, the part that looks towards the obstacle"
        )

    def mark_all(points: Array) -> Array:
        return np.ones(points.shape[1], dtype=bool)

    return Facets.where("boundary", space.mesh, mark_all), True


def make_flat_question(
    obstacle: Obstacle | None, size: float
) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Return a function that asks a flat support: points, normals -> directions, gaps [m].

    Which way the boundary looks does not matter.

    Args:
        obstacle: the HalfSpace.
        size: that of the mesh [m].
    """
    assert obstacle is not None  # refuse_curved was asked before

    def ask(points: Array, normals: Array) -> tuple[Array, Array]:
        directions = obstacle.directions(points, normals)
        return snap_to_axes(directions), check_gap(obstacle.gap(points, normals), points, size)

    return ask
