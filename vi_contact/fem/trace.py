"""From facets of a mesh to contact conditions: nodal normals, weights, gaps and the rotated basis (design idea 3)."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import ufl

from ..algebra import Array, Mask
from ..errors import InputError
from ..surfaces import ContactSurface, Obstacle, Touching, admissible_gap
from ..system import SemiDiscreteSystem
from . import compat
from .frames import Conditions, Nodes, at, surface_of
from .mesh import Facets
from .space import FemSpace

log = logging.getLogger(__name__)
LEANING = 0.9  # cosine of the angle (26°) up to which a normal counts as lying in a symmetry plane


def contact_surface(
    system: SemiDiscreteSystem,
    facets: Facets,
    *,
    obstacle: Obstacle | None = None,
    points: Sequence[Sequence[float]] | None = None,
) -> ContactSurface:
    """The contact conditions of a boundary part, or only of the listed points of it (seed 000's case a).

    Nodal weights are ∫ phi_i times the section's thickness (so that r_n / weights is in Pa), nodal normals the
    direction of ∫ phi_i n over the facets, on rollers (a symmetry plane) without the component held there. Nodes of
    the facets that are clamped in every component (where the boundary meets a clamped part) are left out.

    Args:
        obstacle: Touching() by default, HalfSpace, AnalyticGap or the user's own.
        points: (k, d) coordinates; each stands for the nearest node of the facets. The order is kept.
    Raises:
        InputError: no contact nodes, a listed point that is clamped or not on the facets, a contact direction that is
            partly prescribed, initial penetration.
    """
    space = system.space
    if not isinstance(space, FemSpace):
        raise InputError("contact_surface needs a system made by fem.assemble")
    nodes = nodes_on(space, facets)
    nodes = free_nodes(space, nodes, facets.name) if points is None else listed(space, nodes, points, facets.name)
    obstacle = obstacle or Touching()
    directions = snapped(np.asarray(obstacle.directions(nodes.points, nodes.normals), dtype=float))
    gap = admissible_gap(np.asarray(obstacle.gap(nodes.points, nodes.normals), dtype=float), nodes.points, space.size)
    weights = nodes.weights * space.forms.section.thickness
    _refuse_tied(space, nodes, facets.name)
    return surface_of(space, [Conditions(nodes, directions)], gap0=gap, weights=weights)


def nodes_on(space: FemSpace, facets: Facets) -> Nodes:
    """All nodes of the facets, ordered by original node number."""
    mesh, d = space.mesh, space.dimension
    ds = compat.measure(mesh, mesh.topology.dim - 1, facets.indices)
    v = ufl.TestFunction(space.V)
    n = ufl.FacetNormal(mesh)
    one = compat.assemble_vector(compat.compile_form(sum(v[c] for c in range(d)) * ds)).array_r.reshape(-1, d)
    normal = compat.assemble_vector(compat.compile_form(ufl.inner(n, v) * ds)).array_r.reshape(-1, d)
    blocks = space.facet_blocks(facets.indices)
    first = int(mesh.comm.exscan(len(space.ids)) or 0)
    unknowns = np.where(space.free, first + space.free_index, -1).reshape(-1, d)
    local = (space.nodes, space.points, normal, one[:, 0], space.held, unknowns)
    parts = space.comm.bcast(space.comm.gather(tuple(values[blocks] for values in local)))
    nodes = Nodes(*(np.concatenate([part[i] for part in parts]) for i in range(6)))
    if len(nodes.numbers) == 0:
        raise InputError(f"no contact nodes: boundary group '{facets.name}' is empty, choose a group that has facets")
    if not nodes.weights.all():
        raise InputError(
            f"boundary group '{facets.name}' lies inside the body, where cells on both sides share its nodes: cut the "
            "mesh open there (meshes.cut.CutOpen), or choose an outer boundary"
        )
    normals = in_symmetry_planes(nodes.normals / np.linalg.norm(nodes.normals, axis=1)[:, None], nodes.held)
    return replace(nodes, normals=normals).pick(np.argsort(nodes.numbers))


def in_symmetry_planes(normals: Array, held: Mask) -> Array:
    """Normals (k, d) without the prescribed components of their nodes, where that turns them by little.

    On a symmetry plane the true normal lies in the plane; that of the facets on one side of it leans to that side.
    """
    inside = np.where(held, 0.0, normals)
    length = np.linalg.norm(inside, axis=1)[:, None]
    return np.asarray(np.where(length > LEANING, inside / np.maximum(length, LEANING), normals))


def free_nodes(space: FemSpace, nodes: Nodes, name: str) -> Nodes:
    """The nodes that are not clamped; InputError when none is left."""
    clamped = nodes.held.all(axis=1)
    if clamped.all():
        raise InputError(
            f"no contact nodes: every node of boundary group '{name}' is also clamped, "
            "a point cannot be clamped and in contact; choose another boundary or clamp less"
        )
    if clamped.any():
        log.info("%d clamped nodes of '%s' are left out of the contact surface", clamped.sum(), name)
    return nodes.pick(~clamped)


def listed(space: FemSpace, nodes: Nodes, points: Sequence[Sequence[float]], name: str) -> Nodes:
    """The nodes nearest to the listed points, in their order."""
    rows = []
    for point in points:
        x = np.asarray(point, dtype=float)
        if x.shape != (space.dimension,):
            raise InputError(f"contact point {tuple(point)}: give {space.dimension} coordinates")
        distance = np.linalg.norm(nodes.points - x, axis=1)
        row = int(np.argmin(distance))
        where = ", ".join(f"{c:g}" for c in x)
        if distance[row] > 0.05 * space.size:
            raise InputError(
                f"contact point ({where}) is {distance[row]:.3g} m away from boundary group '{name}': "
                "give a point on it"
            )
        if distance[row] > 1e-6 * space.size and space.comm.rank == 0:
            log.warning("contact point (%s) stands for the nearest node, %.3g m away", where, distance[row])
        if nodes.held[row].all():
            raise InputError(f"contact point ({where}) is also clamped: leave it out, or clamp less")
        if row in rows:
            raise InputError(
                f"contact point ({where}) is listed twice (nearest node {nodes.numbers[row]}): list each once"
            )
        rows.append(row)
    if not rows:
        raise InputError(f"no contact nodes: the list of contact points on '{name}' is empty")
    return nodes.pick(rows)


def _refuse_tied(space: FemSpace, nodes: Nodes, name: str) -> None:
    for row in np.flatnonzero(np.isin(nodes.numbers, space.tied_nodes)):
        raise InputError(
            f"contact node {at(nodes.points[row])} of '{name}' is tied to another: leave it out (points=), or tie "
            "boundaries that end before the contact"
        )


def snapped(directions: Array) -> Array:
    """Directions along an axis to the last bit, where they are to round-off: keeps axis-aligned walls unrotated."""
    snapped = np.where(np.abs(directions) < 1e-13, 0.0, directions)
    return np.asarray(snapped / np.linalg.norm(snapped, axis=1)[:, None])
