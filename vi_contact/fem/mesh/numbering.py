"""Number the nodes of a displacement space, the same on any number of ranks.

Nodes of P1 and Q1 are those of the mesh and have its numbers; so have those of P2 and Q2 on
second-order cells. On first-order cells P2 and Q2 have the mid-points of edges too, Q2 also those
of quadrilateral sides and of cells. They are numbered after the vertices: those of edges, of sides,
of cells, each in the order of the numbers of the vertices around them. Every rank sorts a share of
them, so that none holds them all.
"""

from typing import Any

import numpy as np
from mpi4py import MPI

from ...core.algebra import Array, Indices
from ...meshes.rows import number_alike
from .. import compat
from .tagged_mesh import node_numbers


def is_curved(mesh: Any) -> bool:
    """Return whether the cells have nodes besides their vertices, as those of second order."""
    return compat.geometry_dofmap(mesh).shape[1] > len(compat.sub_entities(mesh, 0))


def supports(V: Any) -> list[list[int]]:
    """Return, for every node of a cell, the local vertices whose mean it is.

    This is one vertex, or those of its edge, side or cell.

    ``V``: a space of degree 1 or 2; the order is that of ``compat.cell_blocks``.
    """
    dim, count = V.mesh.topology.dim, V.dofmap.dof_layout.num_dofs
    return [vertices for one in range(dim + 1) for vertices in compat.sub_entities(V.mesh, one)][
        :count
    ]


def numbered(V: Any) -> tuple[Indices, Array]:
    """Return (numbers, points (k, gdim)) of the local blocks of a space. Collective.

    They are blocks of unknowns, owned, then ghosts.
    """
    mesh = V.mesh
    if compat.cell_blocks(V).shape[1] == compat.geometry_dofmap(mesh).shape[1]:
        nodes = compat.dof_to_node(V)
        return node_numbers(mesh)[nodes], mesh.geometry.x[nodes][:, : mesh.geometry.dim]
    return _with_mid_points(V)


def _with_mid_points(V: Any) -> tuple[Indices, Array]:
    """Return (numbers, points) of a space of degree 2 on first-order cells. Collective."""
    mesh, blocks, around, local = V.mesh, compat.cell_blocks(V), supports(V), V.dofmap.index_map
    corners, names = compat.geometry_dofmap(mesh), node_numbers(mesh)
    numbers = np.full(local.size_local + local.num_ghosts, -1, dtype=np.int64)
    points = np.zeros((len(numbers), mesh.geometry.dim))
    first = count = 1 + mesh.comm.allreduce(int(names.max(initial=-1)), op=MPI.MAX)
    for width in sorted({len(one) for one in around}):
        places = np.array([place for place, one in enumerate(around) if len(one) == width])
        known, found = np.unique(blocks[:, places], return_index=True)
        cell, place = np.divmod(found, len(places))
        vertices = corners[cell[:, None], np.array([around[p] for p in places])[place]]
        vertices = np.take_along_axis(vertices, np.argsort(names[vertices], axis=1), axis=1)
        points[known] = mesh.geometry.x[vertices][:, :, : points.shape[1]].mean(axis=1)
        numbers[known] = names[vertices[:, 0]]
        if width > 1:
            place, total = _ranked(mesh.comm, names[vertices], count)
            numbers[known] = first + place
            first += total
    return numbers, points


def _ranked(comm: Any, keys: Indices, count: int) -> tuple[Indices, int]:
    """Return (place of each of this rank's rows, how many different ones there are).

    The places are among the different rows of all ranks in order.

    Members are less than ``count`` and ascend in a row: its first one tells which rank sorts it.
    Collective.
    """
    sorts = keys[:, 0] * comm.size // count
    order = np.argsort(sorts, kind="stable")
    received = comm.alltoall(
        np.split(keys[order], np.searchsorted(sorts[order], np.arange(1, comm.size)))
    )
    (place,) = number_alike(np.concatenate(received))
    mine = int(place.max(initial=-1)) + 1
    place += comm.exscan(mine) or 0
    answers = comm.alltoall(np.split(place, np.cumsum([len(one) for one in received])[:-1]))
    ranks = np.empty(len(keys), dtype=np.int64)
    ranks[order] = np.concatenate(answers)
    return ranks, comm.allreduce(mine)


def facet_rows(V: Any, facets: Any) -> Indices:
    """Return the local blocks (k, n) on each of these local facets.

    Those of its vertices come first, then those of mid-points.

    Collective.
    """
    mesh, tdim = V.mesh, V.mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    mesh.topology.create_connectivity(tdim, tdim - 1)
    beside, sides = (
        mesh.topology.connectivity(*pair) for pair in ((tdim - 1, tdim), (tdim, tdim - 1))
    )
    around, corners = supports(V), compat.sub_entities(mesh, tdim - 1)
    on = np.array(
        [[place for place, one in enumerate(around) if set(one) <= set(side)] for side in corners]
    )
    cells = beside.array[beside.offsets[:-1][facets]]
    side = np.argmax(
        sides.array.reshape(-1, len(corners))[cells] == np.asarray(facets)[:, None], axis=1
    )
    return np.asarray(compat.cell_blocks(V)[cells[:, None], on[side]])
