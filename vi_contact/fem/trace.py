"""From facets of a mesh to contact conditions: nodal normals, weights, gaps and the rotated basis (design idea 3)."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from ..algebra import Array, Indices
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
    nodes = _trace(space, facets)
    nodes = _free_nodes(space, nodes, facets.name) if points is None else _listed(space, nodes, points, facets.name)
    obstacle = obstacle or Touching()
    directions = _snapped(np.asarray(obstacle.directions(nodes.points, nodes.normals), dtype=float))
    gap = admissible_gap(np.asarray(obstacle.gap(nodes.points, nodes.normals), dtype=float), nodes.points, space.size)
    owned, slots, tangents, basis = _basis(space, nodes, directions)
    count = len(nodes.numbers)
    return ContactSurface(
        comm=space.comm,
        points=nodes.points,
        normals=directions,
        weights=nodes.weights * space.forms.section.thickness,
        gap0=gap,
        bilateral=np.zeros(count, dtype=bool),
        compliance=np.zeros(count),
        owned=owned,
        slots=slots,
        tangents=tangents,
        basis=basis,
    )


class _Nodes:
    """Contact nodes, the same on every rank: original numbers, coordinates, body normals, weights, held components."""

    def __init__(self, numbers: Indices, points: Array, normals: Array, weights: Array, held: Any) -> None:
        self.numbers, self.points, self.normals, self.weights, self.held = numbers, points, normals, weights, held

    def pick(self, rows: Any) -> _Nodes:
        return _Nodes(self.numbers[rows], self.points[rows], self.normals[rows], self.weights[rows], self.held[rows])


def _trace(space: FemSpace, facets: Facets) -> _Nodes:
    """All nodes of the facets, ordered by original node number."""
    mesh, d = space.mesh, space.dimension
    ds = compat.measure(mesh, mesh.topology.dim - 1, facets.indices)
    v = ufl.TestFunction(space.V)
    n = ufl.FacetNormal(mesh)
    one = compat.assemble_vector(compat.compile_form(sum(v[c] for c in range(d)) * ds)).array_r.reshape(-1, d)
    normal = compat.assemble_vector(compat.compile_form(ufl.inner(n, v) * ds)).array_r.reshape(-1, d)
    blocks = space.facet_blocks(facets.indices)
    local = (space.nodes[blocks], space.points[blocks], normal[blocks], one[blocks, 0], space.held[blocks])
    parts = space.comm.bcast(space.comm.gather(local))
    numbers, points, normals, weights, held = (np.concatenate([part[i] for part in parts]) for i in range(5))
    if len(numbers) == 0:
        raise InputError(f"no contact nodes: boundary group '{facets.name}' is empty, choose a group that has facets")
    order = np.argsort(numbers)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    return _Nodes(numbers, points, normals, weights, held).pick(order)


def _free_nodes(space: FemSpace, nodes: _Nodes, name: str) -> _Nodes:
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


def _listed(space: FemSpace, nodes: _Nodes, points: Sequence[Sequence[float]], name: str) -> _Nodes:
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


def _snapped(directions: Array) -> Array:
    """Directions along an axis to the last bit, where they are to round-off: keeps axis-aligned walls unrotated."""
    snapped = np.where(np.abs(directions) < 1e-13, 0.0, directions)
    return np.asarray(snapped / np.linalg.norm(snapped, axis=1)[:, None])


def _refuse_prescribed(nodes: _Nodes, directions: Array) -> None:
    """InputError, on all ranks, for a node whose contact direction is partly prescribed."""
    for slot in np.flatnonzero(np.any(nodes.held & (directions != 0.0), axis=1)):
        at = ", ".join(f"{x:g}" for x in nodes.points[slot])
        raise InputError(
            f"contact node ({at}) is also prescribed along its contact direction: "
            "free that component or leave the node out of the contact surface"
        )


def _block(frame: Array) -> tuple[int, Array]:
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


def _basis(space: FemSpace, nodes: _Nodes, directions: Array) -> tuple[Indices, Indices, Indices, PetscMatrix | None]:
    """(owned, slots, tangents, T): which unknowns of û are normal and tangential, and the matrix u = T û."""
    d = space.dimension
    _refuse_prescribed(nodes, directions)
    frames = nodal_frames(directions)
    where = space._where(nodes.numbers)
    owned, slots, tangents, blocks = [], [], [], []
    for slot in np.flatnonzero(where >= 0):
        normal, block = _block(frames[slot])
        index = space.free_index[where[slot] * d + np.arange(d)]
        owned.append(index[normal])
        slots.append(slot)
        tangents.append(np.delete(index, normal))
        blocks.append((index, block))
    turned = any(not np.array_equal(block, np.eye(d)) for _, block in blocks)
    turned = bool(space.comm.max(np.array([float(turned)]))[0])
    basis = _rotation(space, blocks) if turned else None
    shape = np.array(tangents, dtype=np.int64).reshape(len(owned), d - 1)
    return np.array(owned, dtype=np.int64), np.array(slots, dtype=np.int64), shape, basis


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
