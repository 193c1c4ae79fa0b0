"""Several contact surfaces of one system as one: more than one pair of bodies, pairs and obstacles, corners."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..algebra import Array, Mask
from ..errors import InputError
from ..surfaces import ContactSurface
from .frames import FemSurface, Frames, surface_of

Motion = Callable[[float], Array]


def together(*surfaces: ContactSurface) -> ContactSurface:
    """One surface with the conditions of all, in the order given.

    A node that is on several of them, at the edge of a channel, has a condition for each. Their directions must be at
    right angles: each is one vector of the node's frame. Such a node rubs on none of them (its tangents are -1).
    A node of side 2 of a pair may touch an obstacle, but not be on side 1 of another pair.

    Raises:
        InputError: surfaces of different systems; directions of a node that are parallel (a boundary or a pair listed
            twice) or oblique; a node on side 1 of one pair and side 2 of another.
    """
    made = [surface for surface in surfaces if isinstance(surface, FemSurface)]
    if not made or len(made) < len(surfaces) or any(surface.space is not made[0].space for surface in made):
        raise InputError("together needs surfaces of fem.contact_surface and fem.contact_pair, all of the same system")
    names = ("gap0", "weights", "bilateral", "compliance")
    data: dict[str, Any] = {name: np.concatenate([getattr(surface, name) for surface in made]) for name in names}
    parts = [part for surface in made for part in surface.parts]
    frames = Frames(parts)
    single = ~frames.double[frames.place]
    return surface_of(
        made[0].space,
        parts,
        motion=_joined([(surface.motion, (surface.count,)) for surface in made]),
        slide=_joined([(surface.slide, (surface.count, surface.tangents.shape[1])) for surface in made], single),
        **data,
    )


def _joined(motions: Sequence[tuple[Motion | None, tuple[int, ...]]], kept: Mask | None = None) -> Motion | None:
    """The motions of all conditions from those of the surfaces; zero where not kept."""
    if all(motion is None for motion, _ in motions):
        return None

    def moved(t: float) -> Array:
        values = np.concatenate([np.zeros(shape) if motion is None else motion(t) for motion, shape in motions])
        return values if kept is None else values * kept[:, None]

    return moved
