"""Find hinges: nodes at which two bodies hang together by a point, or by a line in space.

A contact is glued there. Bodies that are drawn between the same corner points share these nodes,
although each has sides of its own. The tip of a crack is a shared node too, but there the material
goes on: its cells hang together through their facets, round the tip. So a node is a hinge if its
cells do not hang together through facets at the node.
"""

from collections.abc import Sequence

import numpy as np

from ...core.algebra import Array, Comm, Indices, Mask, from_each
from ...core.checks import describe_point
from ...core.errors import InputError
from .. import compat
from ..body.space import FemSpace
from ..mesh.nodal_space import parts_of
from ..mesh.numbering import node_numbers
from .nodes import Nodes, gather_rows

NAMED = 4  # hinges that a message names


def find_hinges(space: FemSpace, numbers: Indices) -> Indices:
    """Return those of these nodes that are hinges, the same on every rank. Collective.

    Things that are linked are pairs of a node and a facet at it: those of one cell and node are
    linked, and so, as a facet is of two cells and may be of two ranks, all those that hang together
    round the node. A node whose pairs fall into several parts is a hinge. Mid-points of edges and
    sides are none.

    Args:
        space: the bodies' unknowns.
        numbers: of the nodes in question, the same on every rank.
    """
    # facets at cells that have one of the nodes, and numbers of their own for pairs of a node and
    # a facet, the same on every rank
    mesh = space.mesh
    d = space.mesh.topology.dim
    names = node_numbers(mesh)
    vertices = len(compat.sub_entities(mesh, 0))
    corners = names[compat.geometry_dofmap(mesh)[:, :vertices]]
    cells = np.flatnonzero(np.isin(corners, numbers).any(axis=1))
    mesh.topology.create_entities(d - 1)
    mesh.topology.create_connectivity(d, d - 1)
    per_cell = len(compat.sub_entities(mesh, d - 1))  # sides; a rank may have no cells
    sides = mesh.topology.connectivity(d, d - 1).array.reshape(len(corners), per_cell)[cells]
    facets, side = np.unique(sides, return_inverse=True)
    nodes = names[compat.entities_to_geometry(mesh, d - 1, facets.astype(np.int32))]
    local = mesh.topology.index_map(d - 1)
    known = (
        local.local_to_global(facets.astype(np.int32)) if len(facets) else facets.astype(np.int64)
    )
    keys = nodes.astype(np.int64) * local.size_global + known[:, None]

    # the pairs of the nodes in question, and of which cell each is
    side = side.reshape(sides.shape)
    cell = np.broadcast_to(
        np.arange(len(cells))[:, None, None], (*sides.shape, nodes.shape[1])
    ).ravel()
    node = nodes[side].ravel()
    key = keys[side].ravel()
    wanted = np.isin(node, numbers)
    cell = cell[wanted]
    node = node[wanted]
    key = key[wanted]
    things, member = np.unique(key, return_inverse=True)

    # link the pairs of one cell and node
    order = np.lexsort((node, cell))
    same = (np.diff(cell[order]) == 0) & (np.diff(node[order]) == 0)
    start = member[order[:-1][same]]
    end = member[order[1:][same]]

    # ranks share the pairs of facets that are ghosts of some
    ghosts = np.concatenate(from_each(space.comm, known[facets >= local.size_local]))
    of_ghosts = np.isin(things % local.size_global, ghosts)
    part = parts_of(space.comm, start, end, things, np.flatnonzero(of_ghosts))

    # nodes with several parts
    pairs = np.unique(np.column_stack([things // local.size_global, part]), axis=0)
    pairs = np.unique(np.concatenate(from_each(space.comm, pairs)), axis=0)
    nodes_with_parts, parts = np.unique(pairs[:, 0], return_counts=True)
    return np.asarray(nodes_with_parts[parts > 1])


def mark_hinges(space: FemSpace, nodes: Nodes) -> Mask:
    """Return a mask (k,) of this rank's nodes that are hinges and not clamped. Collective."""
    free = ~nodes.held.all(axis=1)
    numbers = np.unique(np.concatenate(from_each(space.comm, nodes.numbers[free])))
    return np.asarray(free & np.isin(nodes.numbers, find_hinges(space, numbers)))


def refuse_hinges(owner: str, names: Sequence[str], points: Array) -> None:
    """Raise InputError for hinges at these points, if there are any.

    Args:
        owner: who asks.
        names: those of the boundaries, one or two.
        points: (k, d) places of the hinges, ordered [m].
    """
    if not len(points):
        return
    places = " and ".join(describe_point(point) for point in points[:NAMED])
    where = f"at {places}" if len(points) <= NAMED else f"the first at {places}"
    if len(names) == 2:
        shared = f"'{names[0]}' and '{names[1]}' share {len(points)} nodes"
    else:
        shared = f"'{names[0]}' shares {len(points)} nodes with another body"
    if len(points) == 1:
        shared = shared.replace(" 1 nodes", " a node")
    raise InputError(
        f"{owner}: {shared}, {where}, where bodies would hang together although they may part "
        "beside: give each body corner points of its own there, or say hinges=True where a "
        "hinge is meant"
    )


def gather_points(comm: Comm, nodes: Nodes, chosen: Mask) -> Array:
    """Return the points of the chosen nodes of all ranks, by their numbers. Collective.

    Args:
        comm: the ranks.
        nodes: those of this rank.
        chosen: which of them.
    """
    numbers, points = gather_rows(comm, nodes.numbers[chosen], nodes.points[chosen])
    return np.asarray(points[np.argsort(numbers)])
