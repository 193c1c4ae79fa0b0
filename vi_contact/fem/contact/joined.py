"""Join several contact surfaces of one system.

So there can be more than one pair of bodies, pairs and obstacles, corners.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.corners import tangent_vectors
from ...core.errors import InputError
from ...core.surfaces import ContactSurface
from .frames import FemSurface, NodalFrames, gather_frame_data, surface_of

Motion = Callable[[float], Array]


def joined_surfaces(*surfaces: ContactSurface) -> ContactSurface:
    """Return one surface with the conditions of all, in the order given.

    A node that is on several of them, at the edge of a channel, has a condition for each, at any
    angle between them. Beside friction such nodes are refused unless they may slide freely
    (``with_frictionless_corners``); in space they rub along the edge then, with the normal force of
    the first of them: name the surface that carries the body first. A node of side 2 of a pair may
    touch an obstacle, but not be on side 1 of another pair.

    Raises:
        InputError: surfaces of different systems; directions of a node that are parallel (a
            boundary or a pair listed twice) or depend on one another; a node on side 1 of one pair
            and side 2 of another.
    """
    made = [surface for surface in surfaces if isinstance(surface, FemSurface)]
    if (
        not made
        or len(made) < len(surfaces)
        or any(surface.space is not made[0].space for surface in made)
    ):
        raise InputError(
            "joined_surfaces: give surfaces of fem.contact_surface and contact_pair of one system"
        )
    names = ("gap0", "weights", "bilateral", "compliance")
    data: dict[str, Any] = {
        name: np.concatenate([getattr(surface, name) for surface in made]) for name in names
    }
    if any(surface.uncovered is not None for surface in made):
        data["uncovered"] = np.concatenate(
            [
                np.zeros(surface.count, dtype=bool)
                if surface.uncovered is None
                else surface.uncovered
                for surface in made
            ]
        )
    parts = [part for surface in made for part in surface.parts]
    joined = surface_of(
        made[0].space,
        parts,
        motion=_join_motions([(surface.motion, (surface.count,)) for surface in made]),
        companions=tuple(one for surface in made for one in surface.companions),
        watched=tuple(one for surface in made for one in surface.watched),
        censuses=tuple(one for surface in made for one in surface.censuses),
        **data,
    )
    joined = replace(joined, slide=_join_slides(made))
    return (
        joined.with_frictionless_corners()
        if all(one.frictionless_corners for one in made)
        else joined
    )


def _join_motions(motions: Sequence[tuple[Motion | None, tuple[int, ...]]]) -> Motion | None:
    """Return the motions of all conditions from those of the surfaces."""
    if all(motion is None for motion, _ in motions):
        return None
    return lambda t: np.concatenate(
        [np.zeros(shape) if motion is None else motion(t) for motion, shape in motions]
    )


def _join_slides(made: Sequence[FemSurface]) -> Motion | None:
    """Return the slides of all conditions.

    Those of nodes with several are along the vectors that are left to them.
    """
    joined = _join_motions(
        [(surface.slide, (surface.count, surface.tangents.shape[1])) for surface in made]
    )
    frames = NodalFrames(*gather_frame_data([part for surface in made for part in surface.parts]))
    corners = np.flatnonzero(frames.double[frames.place])
    if joined is None or not len(corners):
        return joined
    before = np.concatenate([tangent_vectors(surface.normals, surface.nodes) for surface in made])[
        corners
    ]
    after = (
        tangent_vectors(frames.directions, frames.place)[corners] * frames.rubs[corners, None, :]
    )
    turn = np.einsum("kic,kie->kce", after, before)

    def slide(t: float) -> Array:
        values = joined(t)
        values[corners] = np.einsum("kce,ke->kc", turn, values[corners])
        return values

    return slide
