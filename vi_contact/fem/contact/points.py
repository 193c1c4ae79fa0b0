"""Make contact conditions of listed nodes, for own matrices: nothing is known of facets there."""

from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices
from ...core.checks import array, instance, integers, optional, provides
from ...core.collective import agree, together
from ...core.errors import InputError
from ...core.obstacles import Obstacle, check_gap, locate_obstacle
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem
from ..matrices.own_matrices import MatrixSpace
from .conditions import Facing, NodalConditions
from .frames import snap_to_axes, surface_of
from .nodes import Nodes

OWNER = "contact_points"


def contact_points(
    system: SemiDiscreteSystem,
    nodes: Any,
    normals: Any,
    *,
    weights: Any = None,
    gap0: Any = None,
    obstacle: Obstacle | None = None,
    opposite: Any = None,
) -> ContactSurface:
    """Make one contact condition gap0 - u·n >= 0 at each listed node, in this order.

    With ``opposite`` nodes face nodes. All ranks give the same. Nodes at which the normal is
    oblique get frames of their own, and tangents for friction.

    Args:
        system: of ``system_from_arrays`` or ``fem.system_from_matrices``, whose numbers of nodes
            count.
        nodes: (m,) numbers; a node that is listed with several normals has a condition for each of
            these.
        normals: (m, d), or (d,) for all, from the body to what it may touch, of any length.
        weights: (m,) or one for all: the length times thickness [m²], or area, of each, so that r_n
            / weight is a pressure. None: 1, what is called a pressure then is the force in newtons.
        gap0: (m,) or one for all, the initial gap [m], >= 0. None: zero, or what lies between node
            and opposite node.
        obstacle: HalfSpace(…), AnalyticGap(…) or another, which says contact directions and gaps
            instead.
        opposite: (m,) numbers of nodes of another body, each of which the node faces: the gap is
            gap0 - (u - u_opp)·n.

    Raises:
        InputError: a system of another kind, nodes that do not exist, normals of no length or along
            components that stand still, gaps below zero, directions of one node that depend on one
            another.
    """
    instance(
        OWNER,
        "system",
        system,
        SemiDiscreteSystem,
        "give a system, such as system_from_arrays returns",
    )
    space = system.space
    if not isinstance(space, MatrixSpace):
        raise InputError(
            f"{OWNER} is for systems of own matrices; use fem.contact_surface(points=…) here"
        )
    agree(
        space.comm,
        OWNER,
        {
            "nodes": nodes,
            "normals": normals,
            "weights": weights,
            "gap0": gap0,
            "obstacle": obstacle,
            "opposite": opposite,
        },
    )
    optional(
        provides, OWNER, "obstacle", obstacle, ("directions", "gap"), "give HalfSpace(…) or another"
    )
    if obstacle is not None and (gap0 is not None or opposite is not None):
        raise InputError(
            f"{OWNER}: the obstacle gives the gaps; leave out gap0 and opposite, or the obstacle"
        )

    # nodes, unit vectors and weights, a row for each condition of all ranks
    numbers = integers(OWNER, "nodes", nodes, (None,))
    m = len(numbers)
    d = space.dimension
    if not m:
        raise InputError(f"{OWNER}: nodes is empty; list the nodes that may touch")
    outward = _spread("normals", normals, (m, d))
    length = np.linalg.norm(outward, axis=1)
    if not length.all():
        raise InputError(
            f"{OWNER}: the normal of node {numbers[np.argmin(length)]} is zero; give its direction"
        )
    area = _spread("weights", 1.0 if weights is None else weights, (m,), "m²")
    every = _gather_nodes(space, "nodes", numbers, outward / length[:, None], area)

    # directions and gaps: along the normals to what is given, to the obstacle, or to nodes opposite
    directions = every.normals
    faced = None
    gap = _spread("gap0", 0.0 if gap0 is None else gap0, (m,), "metres")
    if obstacle is not None:
        with together(space.comm):  # an obstacle of the user's may fail on one rank
            directions, gap = locate_obstacle(obstacle, every.points, every.normals)
    if opposite is not None:
        partners = integers(OWNER, "opposite", opposite, (m,))
        faced = _gather_nodes(space, "opposite", partners, -every.normals, area)
        if gap0 is None:
            gap = np.sum((faced.points - every.points) * directions, axis=1)
    with together(space.comm):
        gap = check_gap(gap, every.points, space.size)

    # each rank keeps the conditions of its own nodes
    own = np.flatnonzero(space.blocks_of(numbers) >= 0)
    facing = None if faced is None else Facing(faced, sp.identity(m, format="csr")[own])
    part = NodalConditions(every.pick(own), snap_to_axes(directions)[own], own, facing)
    return surface_of(space, [part], gap0=gap[own], weights=area[own])


def _spread(meaning: str, value: Any, shape: tuple[int, ...], unit: str = "") -> Array:
    """Return values of this shape, also given once for all nodes.

    Args:
        meaning: what messages call the value.
        value: numbers for each node, or once for all.
        shape: that of the result, nodes first.
        unit: what messages call its unit.
    """
    once = shape[1:] if np.ndim(value) < len(shape) else shape
    return np.array(np.broadcast_to(array(OWNER, meaning, value, once, unit=unit), shape))


def _gather_nodes(
    space: MatrixSpace, meaning: str, numbers: Indices, normals: Array, weights: Array
) -> Nodes:
    """Return what all ranks need to know of m nodes, on every rank. Collective.

    Args:
        space: the unknowns of the matrices.
        meaning: what messages call the nodes.
        numbers: (m,) of nodes on any ranks.
        normals: (m, d) outward unit normals.
        weights: (m,) shares of the boundary [m], [m²].

    Raises:
        InputError: a node that the system does not have.
    """
    d = space.dimension
    own = np.column_stack([np.ones(len(space.nodes)), space.points, space.held, space.numbers])
    # one row for each node from the rank that owns it, which a one in the first column tells
    rows = space.at_nodes(numbers, own)
    for number in numbers[rows[:, 0] == 0.0]:
        raise InputError(
            f"{OWNER}: {meaning} has node {number}, which the system does not have; give numbers "
            "from 0 on, in the order of its coordinates"
        )
    points, held, unknowns = np.split(rows[:, 1:], [d, 2 * d], axis=1)
    return Nodes(numbers, points, normals, weights, held > 0.0, unknowns.astype(np.int64))
