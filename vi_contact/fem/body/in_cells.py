"""Find the cell that a point is in, and what its nodes weigh there.

A field u of nodal values is u(X) = Σ phi_i(X) u_i in a cell, with the shape functions phi_i of its
nodes: the numbers phi_i(X) are the weights of the nodes at X.
"""

from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, from_each
from .. import compat

INSIDE = 1e-9  # a share of a cell that is round-off: a point so far outside is on its boundary
BULGE = 0.1  # of its size: how far a curved side may leave the box of a cell's nodes


def find_nodes_of_cells(space: Any, cells: Indices) -> Indices:
    """Return the numbers of the nodes of cells, the same on all ranks. Collective.

    Args:
        space: a ``FemSpace``.
        cells: local numbers of this rank's, ghosts' too.
    """
    own = space.node_of_block[compat.cell_blocks(space.V)[cells]].ravel()
    return np.unique(np.concatenate(from_each(space.comm, own)))


def find_in_cells(
    space: Any, points: Array, among: Indices | None = None
) -> list[tuple[Indices, Array] | None]:
    """Return for each point the numbers (n,) of the nodes of its cell, and their weights (n,).

    Where cells share the point, on a side, the one with the lowest number counts: every number of
    ranks has the same answer. Collective.

    Args:
        space: a ``FemSpace``.
        points: (p, d) [m].
        among: local numbers of the cells that count; None: all.

    Returns:
        A pair for each point, None for one that is outside of all cells.
    """
    mesh = space.mesh
    nodes = compat.cell_blocks(space.V)
    numbers = compat.cell_numbers(mesh)
    low, high = _compute_boxes(mesh, len(numbers))
    counts = np.ones(len(numbers), dtype=bool)
    if among is not None:
        counts = np.isin(np.arange(len(numbers)), among)
    judge = _Weights(compat.lagrange(mesh, 1))
    weigh = judge if space.degree == 1 else _Weights(space.V)

    # What this rank's cells say: rows of (point, number of the cell, nodes, weights).
    width = nodes.shape[1]
    rows = [np.zeros((0, 2 + 2 * width))]
    for k, point in enumerate(points):
        place = np.append(point, np.zeros(3 - len(point)))
        near = counts & np.all((low <= point) & (point <= high), axis=1)
        for cell in np.flatnonzero(near):
            # vertex functions of the first degree are negative outside of a cell alone
            if np.min(judge(place, cell)) >= -INSIDE:
                own = space.node_of_block[nodes[cell]]
                rows.append(np.concatenate([[k, numbers[cell]], own, weigh(place, cell)])[None])

    # What all say: of each point the cell with the lowest number.
    table = np.concatenate(from_each(space.comm, np.concatenate(rows)))
    answers: list[tuple[Indices, Array] | None] = []
    for k in range(len(points)):
        candidates = table[table[:, 0] == k]
        if not len(candidates):
            answers.append(None)
            continue
        row = candidates[np.argmin(candidates[:, 1])]
        answers.append((row[2 : 2 + width].astype(np.int64), row[2 + width :]))
    return answers


def _compute_boxes(mesh: Any, count: int) -> tuple[Array, Array]:
    """Return the corners (count, d) of boxes around the first cells, wide enough for curved ones.

    Args:
        mesh: the mesh.
        count: how many cells this rank owns.
    """
    d = mesh.geometry.dim
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[:count], :d]
    low = corners.min(axis=1, initial=np.inf)
    high = corners.max(axis=1, initial=-np.inf)
    slack = BULGE * np.max(high - low, axis=1, keepdims=True, initial=0.0)
    return low - slack, high + slack


class _Weights:
    """Evaluate the shape functions of a cell, one node after the other."""

    def __init__(self, space: Any) -> None:
        self._field = compat.function(space)
        self._blocks = compat.cell_blocks(space)
        self._size = space.dofmap.index_map_bs

    def __call__(self, point: Array, cell: int) -> Array:
        """Return the weights (n,) of the nodes of a local cell at a point (3,) [m]."""
        values = self._field.x.array
        weights = []
        for block in self._blocks[cell]:
            values[self._size * block] = 1.0
            try:
                weights.append(compat.evaluate(self._field, point, cell)[0])
            except RuntimeError:  # far outside of a cell that is no simplex no Newton finds a place
                weights.append(-1.0)
            values[self._size * block] = 0.0
        return np.array(weights)
