"""Number the nodes of a displacement space, the same on any number of ranks.

Nodes of P1 and Q1 are those of the mesh and have its numbers; so have those of P2 and Q2 on
second-order cells. On first-order cells P2 and Q2 have the mid-points of edges too, Q2 also those
of quadrilateral sides and of cells. They are numbered after the vertices: those of edges, of sides,
of cells, each in the order of the numbers of the vertices around them. Every rank sorts a share of
them, so that none holds them all.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh
from mpi4py import MPI

from ...core.algebra import Array, Indices
from ...core.checks import instance
from ...meshes.rows import number_alike
from .. import compat
from .communicators import MpiComm
from .nodal_space import parts_of


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Hold the nodes of a displacement space on this rank, as they are in its blocks of unknowns.

    Attributes:
        numbers: (blocks,) number of the node of each local block, owned ones first, then ghosts.
        points: (blocks, d) their coordinates [m].
        bodies: (blocks,) their bodies. Bodies are parts of the mesh that share no node, numbered
            from 0 in the order of their least node number.
        owned: how many of the blocks this rank owns.
        lonely: how many nodes of the mesh this rank owns without having a cell of them.
        curved: whether the cells have nodes beside their vertices.
        complete: whether each node of a cell of the mesh is a node of the space, and the reverse.
    """

    numbers: Indices
    points: Array
    bodies: Indices
    owned: int
    lonely: int
    curved: bool
    complete: bool


def node_numbers(mesh: Mesh) -> npt.NDArray[np.int64]:
    """Return the numbers of local geometry nodes (owned, then ghosts) as in the input.

    They count from 0, the rank among the nodes in use.

    Collective. A part of a mesh (``create_submesh``) knows the numbers of the whole, and is
    numbered in their order.
    """
    instance("node_numbers", "mesh", mesh, Mesh, "give a DOLFINx mesh")
    return _input_numbers(mesh)


def _input_numbers(mesh: Mesh) -> npt.NDArray[np.int64]:
    """Return the numbers of local geometry nodes, without asking whether it is a mesh."""
    given = np.asarray(mesh.geometry.input_global_indices, dtype=np.int64)
    largest = mesh.comm.allreduce(given.max(initial=-1), op=MPI.MAX)
    if largest < mesh.geometry.index_map().size_global:
        return given
    # a part of a mesh: the rank of each number among all those in use
    return np.searchsorted(np.unique(np.concatenate(mesh.comm.allgather(given))), given)


def is_curved(mesh: Any) -> bool:
    """Return whether the cells have nodes besides their vertices, as those of second order."""
    return compat.geometry_dofmap(mesh).shape[1] > len(compat.sub_entities(mesh, 0))


def supports(V: Any) -> list[list[int]]:
    """Return, for every node of a cell, the local vertices whose mean it is.

    This is one vertex, or those of its edge, side or cell.

    ``V``: a space of degree 1 or 2; the order is that of ``compat.cell_blocks``.
    """
    dim = V.mesh.topology.dim
    count = V.dofmap.dof_layout.num_dofs
    # vertices, edges, sides and the cell; a space of degree 1 has nodes at the first of them only
    entities: list[list[int]] = []
    for entity_dim in range(dim + 1):
        entities += compat.sub_entities(V.mesh, entity_dim)
    return entities[:count]


def number_nodes(V: Any) -> NodeTable:
    """Give numbers to the nodes of a displacement space of degree 1 or 2. Collective.

    Every array of the mesh that numbers, places and bodies need is read here, once.
    """
    mesh = V.mesh
    names = _input_numbers(mesh)
    corners = compat.geometry_dofmap(mesh)
    blocks = compat.cell_blocks(V)
    curved = corners.shape[1] > len(compat.sub_entities(mesh, 0))
    owned_nodes = np.arange(mesh.geometry.index_map().size_local)
    local = V.dofmap.index_map
    count = local.size_local + local.num_ghosts
    complete = blocks.shape[1] == corners.shape[1]
    if complete:
        # a block of unknowns is a node of the mesh: both have one row a cell, in one order
        node = np.full(count, -1, dtype=np.int32)
        node[blocks] = corners
        numbers = names[node]
        points = mesh.geometry.x[node][:, : mesh.geometry.dim]
    else:
        numbers, points = _with_mid_points(V, names, corners, blocks)
    bodies = np.empty_like(numbers)
    # the geometry owns its nodes by itself: ghosts are those after its own
    ghosts = names[len(owned_nodes) :]
    bodies[blocks] = number_bodies(mesh.comm, corners, names, ghosts)[corners[:, :1]]
    return NodeTable(
        numbers=numbers,
        points=points,
        bodies=bodies,
        owned=local.size_local,
        lonely=len(np.setdiff1d(owned_nodes, corners)),
        curved=curved,
        complete=complete,
    )


def number_bodies(comm: Any, cells: compat.Indices, numbers: Indices, ghosts: Indices) -> Indices:
    """Return the body (0, 1, ...) of each local geometry node. Collective.

    Bodies are in the order of their least node number.

    Args:
        comm: the communicator of the mesh.
        cells: (cells, n) local geometry nodes of each local cell.
        numbers: (nodes,) their numbers on any ranks.
        ghosts: numbers of the nodes that other ranks own.

    Returns:
        (nodes,) bodies.
    """
    # nodes of one cell are of one body: link the first node of a cell to the others
    first = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1)
    # parts of different ranks are one where they share a node: there are ghost nodes also where
    # there are no ghost cells
    shared = np.flatnonzero(np.isin(numbers, np.concatenate(comm.allgather(ghosts))))
    return parts_of(MpiComm(comm), first.ravel(), cells[:, 1:].ravel(), numbers, shared)


def _with_mid_points(
    V: Any, names: Indices, corners: compat.Indices, blocks: compat.Indices
) -> tuple[Indices, Array]:
    """Return (numbers, points) of a space with other nodes than its mesh. Collective.

    Args:
        V: a space of degree 2 on first-order cells.
        names: (nodes,) numbers of the geometry nodes.
        corners: (cells, vertices) geometry nodes of each local cell.
        blocks: (cells, n) blocks of unknowns of each local cell.

    Returns:
        numbers (blocks,) and points (blocks, d) [m] of the local blocks.
    """
    mesh = V.mesh
    around = supports(V)
    local = V.dofmap.index_map
    numbers = np.full(local.size_local + local.num_ghosts, -1, dtype=np.int64)
    points = np.zeros((len(numbers), mesh.geometry.dim))
    count = 1 + mesh.comm.allreduce(int(names.max(initial=-1)), op=MPI.MAX)
    first = count  # number of the next kind of node
    # nodes between one vertex (itself), two, four or eight, in this order
    for width in sorted({len(vertices) for vertices in around}):
        places = np.array([k for k, vertices in enumerate(around) if len(vertices) == width])
        # one cell of each node, and the place of the node in it
        known, first_at = np.unique(blocks[:, places], return_index=True)
        cell, place = np.divmod(first_at, len(places))
        vertices = corners[cell[:, None], np.array([around[p] for p in places])[place]]
        # the mean of vertices in ascending numbers is the same on every rank, to the last digit
        vertices = np.take_along_axis(vertices, np.argsort(names[vertices], axis=1), axis=1)
        points[known] = mesh.geometry.x[vertices][:, :, : points.shape[1]].mean(axis=1)
        numbers[known] = names[vertices[:, 0]]
        if width > 1:
            rank, total = _rank_rows(mesh.comm, names[vertices], count)
            numbers[known] = first + rank
            first += total
    return numbers, points


def _rank_rows(comm: Any, keys: Indices, count: int) -> tuple[Indices, int]:
    """Return the place of each row among the different rows of all ranks in order. Collective.

    Args:
        comm: the communicator.
        keys: (k, n) rows of this rank, whose members ascend and are less than ``count``.
        count: how many numbers there are.

    Returns:
        (k,) places, and how many different rows there are.
    """
    # the first member of a row tells which rank sorts it
    sorts = keys[:, 0] * comm.size // count
    order = np.argsort(sorts, kind="stable")
    received = comm.alltoall(
        np.split(keys[order], np.searchsorted(sorts[order], np.arange(1, comm.size)))
    )
    # number the rows of this share, after those of the ranks before
    (place,) = number_alike(np.concatenate(received))
    mine = int(place.max(initial=-1)) + 1
    place += comm.exscan(mine) or 0
    # send the numbers back to the ranks that have asked, and undo the sorting by ranks
    answers = comm.alltoall(np.split(place, np.cumsum([len(rows) for rows in received])[:-1]))
    ranks = np.empty(len(keys), dtype=np.int64)
    ranks[order] = np.concatenate(answers)
    return ranks, comm.allreduce(mine)


def facet_rows(V: Any, facets: Any) -> Indices:
    """Return the local blocks on each of these local facets. Collective.

    Args:
        V: a space of degree 1 or 2.
        facets: (k,) local numbers of facets.

    Returns:
        (k, n) blocks: those of the vertices of a facet come first, then those of mid-points.
    """
    mesh = V.mesh
    tdim = V.mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    mesh.topology.create_connectivity(tdim, tdim - 1)
    beside = mesh.topology.connectivity(tdim - 1, tdim)
    sides = mesh.topology.connectivity(tdim, tdim - 1)
    # the nodes on a side of a cell are those between vertices of that side
    around = supports(V)
    corners = compat.sub_entities(mesh, tdim - 1)
    on = np.array([_inside(around, set(side)) for side in corners])
    # one cell beside each facet, and which of its sides the facet is
    cells = beside.array[beside.offsets[:-1][facets]]
    table = sides.array.reshape(-1, len(corners))[cells]
    side = np.argmax(table == np.asarray(facets)[:, None], axis=1)
    return np.asarray(compat.cell_blocks(V)[cells[:, None], on[side]])


def _inside(around: list[list[int]], side: set[int]) -> list[int]:
    """Return the places of the nodes of a cell that lie between vertices of one side."""
    return [place for place, vertices in enumerate(around) if side.issuperset(vertices)]
