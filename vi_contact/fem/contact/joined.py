"""Join several contact surfaces of one system: pairs of bodies, pairs and obstacles, corners.

The conditions of all come one after the other, and what a surface holds of them is concatenated.
What is new is at a node of several surfaces: it has one frame with all its directions (``frames``),
so that tangents, and slides along them, are no longer those of its surfaces.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.corners import make_tangent_vectors
from ...core.errors import InputError
from ...core.surfaces import ContactSurface
from .frames import FemSurface, NodalFrames, gather_frame_data, surface_of

Motion = Callable[[float], Array]


def joined_surfaces(*surfaces: ContactSurface) -> ContactSurface:
    """Return one surface with the conditions of all, in the order given.

    A node that is on several of them, at the edge of a channel, has a condition for each, at any
    angle between them. Beside friction it rubs on all its faces, unless it may slide freely
    (``with_frictionless_corners``); in space it rubs along the edge then, with the normal force of
    the first of them: name the surface that carries the body first. A node may also be in several
    pairs, on side 1 of one and on side 2 of another, or face several bodies along one direction:
    its conditions are traces then (``core.traces``), not for ``Volume``.

    Raises:
        InputError: surfaces of different systems; a boundary or a pair that is listed twice, or a
            pair both ways; directions of a node that depend on one another though it faces one
            body.
    """
    ours = [surface for surface in surfaces if isinstance(surface, FemSurface)]
    if (
        not ours
        or len(ours) < len(surfaces)
        or any(surface.space is not ours[0].space for surface in ours)
    ):
        raise InputError(
            "joined_surfaces: give surfaces of fem.contact_surface and contact_pair of one system"
        )

    # a row for each condition, in the order of the surfaces
    data: dict[str, Any] = {}
    for name in ("gap0", "weights", "bilateral", "compliance"):
        data[name] = np.concatenate([getattr(surface, name) for surface in ours])
    if any(surface.uncovered is not None for surface in ours):
        rows = [
            np.zeros(surface.count, dtype=bool) if surface.uncovered is None else surface.uncovered
            for surface in ours
        ]
        data["uncovered"] = np.concatenate(rows)
    joined = surface_of(
        ours[0].space,
        list(chain(*(surface.parts for surface in ours))),
        motion=_join_motions([(surface.motion, (surface.count,)) for surface in ours]),
        companions=tuple(chain(*(surface.companions for surface in ours))),
        watched=tuple(chain(*(surface.watched for surface in ours))),
        censuses=tuple(chain(*(surface.censuses for surface in ours))),
        **data,
    )
    alone = _join_own_slides(ours)
    slide = alone if joined.traces is not None else _join_slides(ours)
    joined = replace(joined, slide=slide, own_slide=alone)
    if all(surface.frictionless_corners for surface in ours):
        return joined.with_frictionless_corners()
    return joined


def _join_motions(motions: Sequence[tuple[Motion | None, tuple[int, ...]]]) -> Motion | None:
    """Return the motion of all conditions, t [s] -> rows, from those of the surfaces.

    Args:
        motions: of each surface its motion, and the shape (m, …) of its values, which are zero
            where it has none.

    Returns:
        a function of the time, or None where no surface moves.
    """
    if all(motion is None for motion, _ in motions):
        return None
    return lambda t: np.concatenate(
        [np.zeros(shape) if motion is None else motion(t) for motion, shape in motions]
    )


def _join_own_slides(surfaces: Sequence[FemSurface]) -> Motion | None:
    """Return how far obstacles slide along the tangents of conditions as traces. Collective.

    It is None where no obstacle slides, and where that is not known of the corners of some surface.
    """
    slides = [surface.find_own_slide() for surface in surfaces]
    for surface, slide in zip(surfaces, slides, strict=True):
        if surface.slide is not None and slide is None:
            return None
    shapes = [(surface.count, surface.tangents.shape[1]) for surface in surfaces]
    return _join_motions(list(zip(slides, shapes, strict=True)))


def _join_slides(surfaces: Sequence[FemSurface]) -> Motion | None:
    """Return how far obstacles slide along the tangents (m, d - 1) of all conditions, t [s] -> [m].

    The slide is s = t·x for each tangent t of a condition and the motion x of its obstacle. A node
    with several conditions has other tangents t' than on each of its surfaces. They lie in the
    plane of the t, so that t'·x is t' times the sum of s t.

    Args:
        surfaces: those that are joined.
    """
    joined = _join_motions(
        [(surface.slide, (surface.count, surface.tangents.shape[1])) for surface in surfaces]
    )
    parts = list(chain(*(surface.parts for surface in surfaces)))
    frames = NodalFrames(*gather_frame_data(parts))
    corners = np.flatnonzero(frames.double[frames.place])
    if joined is None or not len(corners):
        return joined

    # tangents (corners, d, d - 1) as columns, those that do not rub as zeros
    before = np.concatenate(
        [make_tangent_vectors(surface.normals, surface.nodes) for surface in surfaces]
    )[corners]
    after = make_tangent_vectors(frames.directions, frames.place)[corners]
    after = after * frames.rubs[corners, None, :]
    turn = np.einsum("kic,kie->kce", after, before)

    def slide(t: float) -> Array:
        values = joined(t)
        values[corners] = np.einsum("kce,ke->kc", turn, values[corners])
        return values

    return slide
