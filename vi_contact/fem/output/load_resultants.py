"""Sum up a load: its resultant, its moment, and the point in which it may be drawn."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.system import SemiDiscreteSystem
from ..body.assembly import make_nodal_force
from ..body.space import FemSpace, space_of
from .nodal_work import rigid_motions
from .sizes import measure_cells, measure_facets

NOTHING = 1e-9  # of the sum of the sizes of all nodal forces: a resultant that is none
FLAT = 1e-6  # of the extent of facets: so far they may stand off the plane through them


@dataclass(frozen=True)
class Resultant:
    """Hold what a load amounts to.

    Attributes:
        force: (d,) [N]; in plane strain that on the thickness of the slice.
        moment: (q,) about the origin [N m]: one number in the plane, three in space, none on a
            line.
        centroid: (d,) of the facets or cells on which it acts [m]; None where these are unknown.
        point: (d,) on the line of action [m]; None for a couple, which has no line.
    """

    force: Array
    moment: Array
    centroid: Array | None
    point: Array | None


def sum_up_load(system: SemiDiscreteSystem, load: Any, t: float) -> Resultant:
    """Return the resultant of a load at time t, less its history. Collective.

    The forces on held nodes count, which no unknown feels.

    Args:
        system: of the body.
        load: a ``Traction``, ``BodyForce`` or ``LinearForm``.
        t: the time [s].
    """
    space = space_of("sum_up_load", system)
    nodal = make_nodal_force(space, space.forms.section, load)(t)

    # The work on unit translations and on unit rotations about the origin.
    d = space.dimension
    motions = rigid_motions(space.points, np.zeros(d))
    works = motions.reshape(len(motions), -1) @ nodal
    size = np.sum(np.linalg.norm(nodal.reshape(-1, d), axis=1))
    sums = space.comm.sum(np.array([*works, size]))
    force = sums[:d]
    moment = sums[d:-1]

    centroid, normal = _find_place(space, load)
    if np.linalg.norm(force) <= NOTHING * sums[-1]:
        return Resultant(force, moment, centroid, None)
    near = np.zeros(d) if centroid is None else centroid
    return Resultant(force, moment, centroid, find_point(force, moment, near=near, normal=normal))


def find_point(
    force: Array, moment: Array, *, near: Array, normal: Array | None = None
) -> Array | None:
    """Return the point of the line of action that lies in a plane, or is nearest to a point.

    In space it is the line about which the moment has a part along the force alone.

    Args:
        force: (d,) the resultant [N], not zero.
        moment: (q,) about the origin [N m].
        near: (d,) a point [m], one of the plane.
        normal: (d,) of the plane; None: the nearest point is asked for.

    Returns:
        (d,) [m]; None on a line, where nothing tells it.
    """
    d = len(force)
    if d == 1:
        return None
    F = np.zeros(3)
    F[:d] = force
    M = np.zeros(3)
    M[-len(moment) :] = moment
    c = np.zeros(3)
    c[:d] = near

    # About the point c the moment is M - c × F, and the line of action passes F × M / |F|² off c.
    arm = np.cross(F, M - np.cross(c, F)) / (F @ F)
    if normal is None:
        return np.asarray((c + arm)[:d])

    # Along F into the plane, unless F runs within it: then the point nearest to c remains.
    n = np.zeros(3)
    n[:d] = normal
    across = F @ n
    if abs(across) > NOTHING * np.linalg.norm(F):
        arm = arm - (arm @ n) / across * F
    return np.asarray((c + arm)[:d])


def _find_place(space: FemSpace, load: Any) -> tuple[Array | None, Array | None]:
    """Return the centroid of where a load acts, and the normal of its facets if they are flat.

    Collective.
    """
    d = space.dimension
    facets = getattr(load, "facets", None)
    if facets is None:
        if not hasattr(load, "cells"):
            return None, None
        sizes, centroids = measure_cells(space.mesh)
        if load.cells is not None:
            own = load.cells.indices[load.cells.indices < len(sizes)]
            sizes, centroids = sizes[own], centroids[own]
        return _average(space, sizes, centroids), None
    if d == 1:
        return None, None
    sizes, centroids, corners = measure_facets(space.mesh, facets.indices)
    centroid = _average(space, sizes, centroids)

    # The plane through the centroid that is nearest to the corners, by their second moments.
    offsets = (corners - centroid).reshape(-1, d)
    moments = space.comm.sum(offsets.T @ offsets)
    squares, axes = np.linalg.eigh(moments)
    flat = squares[0] <= FLAT**2 * squares[-1]
    return centroid, axes[:, 0] if flat else None


def _average(space: FemSpace, sizes: Array, centroids: Array) -> Array:
    """Return the centroid (d,) of all ranks. Collective."""
    first = space.comm.sum(sizes @ centroids)
    whole = space.comm.sum(np.array([sizes.sum()]))
    return np.asarray(first / whole)
