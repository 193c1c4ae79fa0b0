"""From facets of a mesh to contact conditions: nodal normals, weights, gaps and the rotated basis (design idea 3)."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from ..algebra import Array, Indices, Mask
from ..errors import InputError
from ..surfaces import ContactSurface, Obstacle, Touching, admissible_gap, nodal_frames
from ..system import SemiDiscreteSystem
from . import compat
from .mesh import Facets
from .petsc_algebra import PetscMatrix
from .space import FemSpace

log = logging.getLogger(__name__)


def contact_surface(
    system: SemiDiscreteSystem,
    facets: Facets,
    *,
    obstacle: Obstacle | None = None,
    points: Sequence[Sequence[float]] | None = None,
) -> ContactSurface:
    """The contact conditions of a boundary part, or only of the listed points of it (seed 000's case a).

    Nodal weights are ∫ phi_i times the section's thickness (so that r_n / weights is in Pa), nodal normals the
    direction of ∫ phi_i n over the facets. Nodes of the facets that are clamped in every component (where the boundary
    meets a clamped part) are left out.

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
    return surface_on(space, nodes, directions, gap, frames_of(space, nodes, directions))


def surface_on(
    space: FemSpace, nodes: Nodes, directions: Array, gap: Array, frames: Sequence[Frame]
) -> ContactSurface:
    """The conditions u·direction <= gap at nodes with these frames, those of this rank. Collective."""
    d, count = space.dimension, len(nodes.numbers)
    tangents = [np.delete(frame.index, frame.normal) for frame in frames]
    return ContactSurface(
        comm=space.comm,
        points=nodes.points,
        normals=directions,
        weights=nodes.weights * space.forms.section.thickness,
        gap0=gap,
        bilateral=np.zeros(count, dtype=bool),
        compliance=np.zeros(count),
        owned=np.array([frame.index[frame.normal] for frame in frames], dtype=np.int64),
        slots=np.array([frame.slot for frame in frames], dtype=np.int64),
        tangents=np.array(tangents, dtype=np.int64).reshape(len(frames), d - 1),
        basis=_basis(space, frames),
    )


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of a boundary, the same on every rank: original numbers, coordinates, body normals, weights, held
    components, and the numbers over all ranks of their free unknowns, -1 for held ones."""

    numbers: Indices
    points: Array
    normals: Array
    weights: Array
    held: Mask
    unknowns: Indices

    def pick(self, rows: Any) -> Nodes:
        """Some of them."""
        return Nodes(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False)
class Frame:
    """The frame of a contact node that this rank owns: ``index`` of its unknowns (-1 where held), ``block`` with the
    frame's vectors as columns, the contact direction in column ``normal``."""

    slot: int
    index: Indices
    normal: int
    block: Array


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
    normals = nodes.normals / np.linalg.norm(nodes.normals, axis=1)[:, None]
    return replace(nodes, normals=normals).pick(np.argsort(nodes.numbers))


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


def snapped(directions: Array) -> Array:
    """Directions along an axis to the last bit, where they are to round-off: keeps axis-aligned walls unrotated."""
    snapped = np.where(np.abs(directions) < 1e-13, 0.0, directions)
    return np.asarray(snapped / np.linalg.norm(snapped, axis=1)[:, None])


def _refuse_prescribed(nodes: Nodes, directions: Array) -> None:
    """InputError, on all ranks, for a node whose contact direction is partly prescribed."""
    for slot in np.flatnonzero(np.any(nodes.held & (directions != 0.0), axis=1)):
        at = ", ".join(f"{x:g}" for x in nodes.points[slot])
        raise InputError(
            f"contact node ({at}) is also prescribed along its contact direction: "
            "free that component or leave the node out of the contact surface"
        )


def block_of(frame: Array) -> tuple[int, Array]:
    """(c, Q): a nodal frame with the contact direction in column c, so that component c becomes the normal unknown.

    c is the direction's largest component. Axes at right angles to the direction keep their own columns: these are the
    components that may be prescribed.
    """
    d = len(frame)
    direction = frame[:, 0]
    normal = int(np.argmax(np.abs(direction)))
    others = [c for c in range(d) if c != normal]
    block = np.empty((d, d))
    block[:, normal] = direction
    if np.count_nonzero(direction) == 1:
        block[:, others] = np.eye(d)[:, others]
    else:
        others.sort(key=lambda c: abs(direction[c]))  # the first tangent is made of the axis least aligned
        block[:, others] = frame[:, 1:]
    return normal, block


def frames_of(space: FemSpace, nodes: Nodes, directions: Array) -> list[Frame]:
    """Frames of the nodes this rank owns; InputError, on all ranks, where a contact direction is partly prescribed."""
    _refuse_prescribed(nodes, directions)
    axes, where = nodal_frames(directions), space._where(nodes.numbers)
    frames = []
    for slot in np.flatnonzero(where >= 0):
        index = space.free_index[where[slot] * space.dimension + np.arange(space.dimension)]
        frames.append(Frame(int(slot), index, *block_of(axes[slot])))
    return frames


def _basis(space: FemSpace, frames: Sequence[Frame]) -> PetscMatrix | None:
    """T with u = T û, None when all frames point along the axes."""
    turned = any(not np.array_equal(frame.block, np.eye(space.dimension)) for frame in frames)
    turned = bool(space.comm.max(np.array([float(turned)]))[0])
    return _rotation(space, [(frame.index, frame.block) for frame in frames]) if turned else None


def _rotation(space: FemSpace, blocks: list[tuple[Indices, Array]]) -> PetscMatrix:
    """T as a PETSc matrix: identity but for the nodal blocks (columns: frame vectors) of the contact nodes."""
    rows = len(space.ids)
    T = PETSc.Mat().createAIJ(((rows, None), (rows, None)), nnz=(space.dimension, 0), comm=space.mesh.comm)
    T.setUp()
    start = T.getOwnershipRange()[0]
    plain = np.ones(rows, dtype=bool)
    for index, block in blocks:
        free = index >= 0
        plain[index[free]] = False
        rotated = (start + index[free]).astype(PETSc.IntType)
        T.setValues(rotated, rotated, np.ascontiguousarray(block[np.ix_(free, free)]))
    for row in np.flatnonzero(plain):
        T.setValue(start + row, start + row, 1.0)
    T.assemble()
    return PetscMatrix(T)
