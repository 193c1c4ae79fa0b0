"""Which nodes hang together: the bodies of a mesh, counted in the same order on any number of ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..core.algebra import Indices
from . import compat


def body_numbers(mesh: Any, numbers: Indices) -> Indices:
    """The body (0, 1, ..., in the order of their smallest node number) of each local geometry node. Collective.

    numbers: original numbers of the local geometry nodes.
    """
    cells = compat.geometry_dofmap(mesh)
    n, count = len(numbers), mesh.topology.index_map(mesh.topology.dim).size_local
    first, others = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel(), cells[:, 1:].ravel()
    graph = sp.coo_matrix((np.ones(len(first)), (first, others)), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    smallest = np.full(part.max(initial=-1) + 1, np.iinfo(np.int64).max)
    np.minimum.at(smallest, part, numbers)
    shared = np.unique(cells[count:])  # nodes of ghost cells: there parts of different ranks meet
    names = _joined(mesh.comm, numbers[shared], smallest[part[shared]], smallest)
    order = np.unique(np.fromiter(names.values(), dtype=np.int64))
    return np.searchsorted(order, np.array([names[int(name)] for name in smallest], dtype=np.int64)[part])


def _joined(comm: Any, shared: Indices, name: Indices, all_names: Indices) -> dict[int, int]:
    """Name of a part (its smallest node number) -> smallest node number of its whole body: parts of several ranks that
    have a node in common are one body."""
    pairs = np.unique(np.concatenate(comm.allgather(np.column_stack([shared, name]))), axis=0)
    found = np.unique(np.concatenate(comm.allgather(all_names)))
    index = np.searchsorted(found, pairs[:, 1])
    same = np.flatnonzero(pairs[1:, 0] == pairs[:-1, 0])
    graph = sp.coo_matrix((np.ones(len(same)), (index[same], index[same + 1])), shape=(len(found), len(found)))
    _, body = connected_components(graph, directed=False)
    smallest = np.full(body.max(initial=-1) + 1, np.iinfo(np.int64).max)
    np.minimum.at(smallest, body, found)
    return dict(zip(found.tolist(), smallest[body].tolist(), strict=True))
