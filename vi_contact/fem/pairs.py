"""Contact between two deformable bodies: the unknowns of side 1 become displacements relative to side 2.

Opposite node s of side 1 with frame Q_s = (n, t), the other body moves by sum_j P_sj u_j. With û_s = Q_sᵀ u_s, the
unknowns û of the nodal frames are written in new ones ǔ (design idea 3),

    û = R ǔ,   û_s = ǔ_s + Q_sᵀ sum_j P_sj u_j   at contact nodes of side 1,   û = ǔ elsewhere

so that the relative normal displacement ǔ_n is one unknown again: ǔ_n <= gap0 is the condition, friction acts on ǔ_t,
and the work of a reaction on ǔ is that of the pair of forces r on side 1 and -P_sjᵀ r on side 2: action is reaction.
n is the outward normal of side 1, from side 1 to side 2. Displacements are small: nobody's partner changes.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..algebra import Array
from ..errors import InputError
from ..surfaces import ContactSurface
from ..system import SemiDiscreteSystem
from . import compat
from .frames import Conditions, Facing, Frames, Nodes, at, surface_of
from .matching import Matched, Matching, NodeToNode, Side
from .mesh import Facets, node_numbers
from .space import FemSpace
from .trace import listed, nodes_on, snapped

log = logging.getLogger(__name__)


def contact_pair(
    system: SemiDiscreteSystem,
    facets1: Facets,
    facets2: Facets,
    *,
    matching: Matching | None = None,
    points: Sequence[Sequence[float]] | None = None,
) -> ContactSurface:
    """The contact conditions between two boundaries of deformable bodies, or two faces of a crack.

    They are those of the nodes of side 1: its normals, weights (times the section's thickness) and forces; r_n /
    weights is the pressure. Side 1 should be the smaller and finer one, or the softer body. Initial gaps are measured
    along the normals of side 1. Nodes that both sides share, at the tip of a crack, have no condition; nor have nodes
    clamped on both sides. Prescribed nodes of side 2 move as they are told: a moving obstacle.

    Args:
        matching: NodeToNode() by default, for sides meshed alike; DualMortar() for others, in 2D.
        points: (k, d) coordinates; only the nodes of side 1 nearest to them, in this order.
    Raises:
        InputError: sides that do not pair or do not face each other, bodies that overlap, sides of one and the same
            boundary, contact directions that are partly prescribed, clamped nodes that face free ones.
    """
    space = system.space
    if not isinstance(space, FemSpace):
        raise InputError("contact_pair needs a system made by fem.assemble")
    one, two = side_of(space, facets1), side_of(space, facets2)
    shared = np.isin(one.nodes.numbers, two.nodes.numbers)
    if shared.all():
        raise InputError(
            f"'{one.name}' and '{two.name}' are the same nodes, so that nothing can part there: mesh the bodies one by "
            "one, or cut the mesh open (meshes.cut.CutOpen)"
        )
    matched = (matching or NodeToNode()).match(one, two, space.size)
    matched = matched.pick(~shared[matched.rows])
    matched = _unclamped(space, one, two, matched)
    nodes = replace(one.nodes.pick(matched.rows), weights=matched.weights)
    if points is not None:
        chosen = listed(space, nodes, points, one.name).numbers
        rows = np.array([int(np.flatnonzero(nodes.numbers == number)[0]) for number in chosen])
        nodes, matched = nodes.pick(rows), matched.pick(rows)
    directions = snapped(nodes.normals)
    gap = _gap(space, one.name, two, nodes, directions, matched)
    conditions = Conditions(nodes, directions, Facing(two.nodes, matched.P))
    moving = _prescribed_motion(space, conditions)
    return surface_of(
        space, [conditions], gap0=gap, weights=matched.weights * space.forms.section.thickness, **moving
    )


def side_of(space: FemSpace, facets: Facets) -> Side:
    """All nodes and facets of a boundary, on every rank, in the order of the mesh's numbers. Collective."""
    mesh, nodes = space.mesh, nodes_on(space, facets)
    vertices = node_numbers(mesh)[compat.entities_to_geometry(mesh, mesh.topology.dim - 1, facets.indices)]
    rows = np.concatenate(space.comm.bcast(space.comm.gather(vertices.astype(np.int64))))
    _, first = np.unique(np.sort(rows, axis=1), axis=0, return_index=True)
    return Side(facets.name, nodes, np.searchsorted(nodes.numbers, rows[first]))


def _unclamped(space: FemSpace, one: Side, two: Side, matched: Matched) -> Matched:
    """Without the clamped nodes; InputError when one faces a free node, or when none is left."""
    clamped = one.nodes.held.all(axis=1)
    facing = np.asarray(matched.P.argmax(axis=1)).ravel()
    lost = np.flatnonzero(clamped[matched.rows] & ~two.nodes.held[facing].all(axis=1))
    if len(lost):
        raise InputError(
            f"contact node {at(one.nodes.points[matched.rows[lost[0]]])} of '{one.name}' is clamped but faces a free "
            f"node of '{two.name}': make '{two.name}' the first side, or clamp less"
        )
    if clamped[matched.rows].all():
        raise InputError(
            f"no contact nodes: every node of '{one.name}' that faces '{two.name}' is also clamped; clamp less"
        )
    if clamped[matched.rows].any() and space.comm.rank == 0:
        log.info("%d clamped nodes of '%s' are left out of the contact", clamped[matched.rows].sum(), one.name)
    return matched.pick(~clamped[matched.rows])


def _gap(space: FemSpace, name: str, two: Side, nodes: Nodes, directions: Array, matched: Matched) -> Array:
    """Initial gaps n·(P x_2 - x_1) >= 0; overlaps of round-off (1e-12 of the mesh's size) or of polygons count as 0."""
    gap = np.sum((matched.P @ two.nodes.points - nodes.points) * directions, axis=1)
    behind = -gap - np.maximum(matched.overlap, 1e-12 * space.size)
    if behind.max() > 0.0:
        worst = int(np.argmax(behind))
        raise InputError(
            f"'{two.name}' lies {-gap[worst]:.3g} m behind '{name}' at {at(nodes.points[worst])}: the bodies overlap "
            "there, or these are not the boundaries between them; move one body, or choose the sides that face"
        )
    if gap.min() < -1e-12 * space.size and space.comm.rank == 0:
        log.warning("'%s' and '%s' overlap by up to %.3g m: taken as touching there", name, two.name, -gap.min())
    return np.maximum(gap, 0.0)


def _prescribed_motion(space: FemSpace, conditions: Conditions) -> dict[str, Callable[[float], Array]]:
    """``motion`` and ``slide`` of a surface whose side 2 has prescribed nodes that move: none when none does."""
    frames, facing = Frames([conditions]), conditions.facing
    moves = any(condition.moves for condition in space.prescribed)
    if facing is None or not moves or not facing.nodes.held[np.unique(facing.P.indices)].any():
        return {}
    numbers, P = facing.nodes.numbers, facing.P
    held = conditions.nodes.held
    free = np.array([np.delete(~own, c) for own, c in zip(held, frames.column, strict=True)])
    tangents, nothing = frames.tangents, np.zeros(len(space.ids))

    def displacement(t: float) -> Array:
        return np.asarray(P @ space.sample(nothing, numbers, t))

    return {
        "motion": lambda t: -np.sum(displacement(t) * frames.directions, axis=1),
        "slide": lambda t: np.einsum("ijk,ij->ik", tangents, displacement(t)) * free,
    }
