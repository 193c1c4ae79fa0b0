"""Handle rows of vertices: the sides of cells, rows with the same members, what hangs together."""

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix

Rows = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

# Cells are called as UFL calls them. Gmsh's numbers of a cell and of its side:
GMSH_NUMBERS = {
    "interval": [1, 15],
    "triangle": [2, 1],
    "quadrilateral": [3, 1],
    "tetrahedron": [4, 2],
    "hexahedron": [5, 3],
}
# Of those with a node in the middle of every edge, side and cell, after their vertices:
SECOND_ORDER = {
    "interval": [8, 15],
    "triangle": [9, 8],
    "quadrilateral": [10, 8],
    "tetrahedron": [11, 9],
    "hexahedron": [12, 10],
}
# The corners of the sides of a cell, in the order of VTK:
SIDES = {
    "interval": [[0], [1]],
    "triangle": [[0, 1], [1, 2], [2, 0]],
    "quadrilateral": [[0, 1], [1, 2], [2, 3], [3, 0]],
    "tetrahedron": [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]],
    "hexahedron": [
        [0, 1, 2, 3],
        [4, 5, 6, 7],
        [0, 1, 5, 4],
        [1, 2, 6, 5],
        [2, 3, 7, 6],
        [3, 0, 4, 7],
    ],
}
# A vertex and its d neighbours, right-handed in an unturned cell:
CORNERS = {
    "interval": [[0, 1]],
    "triangle": [[0, 1, 2]],
    "quadrilateral": [[0, 1, 3], [1, 2, 0], [2, 3, 1], [3, 0, 2]],
    "tetrahedron": [[0, 1, 2, 3]],
    "hexahedron": [
        [0, 1, 3, 4],
        [1, 2, 0, 5],
        [2, 3, 1, 6],
        [3, 0, 2, 7],
        [4, 7, 5, 0],
        [5, 4, 6, 1],
        [6, 5, 7, 2],
        [7, 6, 4, 3],
    ],
}


def vertex_count(cell: str) -> int:
    """Return how many vertices a cell has: the first of its nodes."""
    return len({vertex for side in SIDES[cell] for vertex in side})


def cell_sides(cells: Rows, cell: str) -> tuple[Rows, Rows]:
    """Return all sides (n_cells * n_sides, n_side_vertices), and the cell of each.

    The vertices of a side are ascending.
    """
    sides = np.array(SIDES[cell])
    rows = np.sort(cells[:, sides].reshape(-1, sides.shape[1]), axis=1)
    return rows, np.repeat(np.arange(len(cells)), len(sides))


def number_alike(*tables: Rows) -> list[Rows]:
    """Give numbers to the rows of tables of one width.

    Rows with equal members, in any order, have equal numbers. Members are at least -1. This is much
    faster than np.unique(axis=0).
    """
    rows = np.sort(np.concatenate(tables), axis=1) + 1
    if not len(rows):
        return [np.zeros(0, dtype=np.int64) for _ in tables]

    # Column by column: the number so far and the next member make one integer, then are numbered
    # anew so that it stays small.
    base = int(rows.max()) + 1
    numbers = rows[:, 0]
    for column in rows.T[1:]:
        _, numbers = np.unique(numbers * base + column, return_inverse=True)
    ends = np.cumsum([len(table) for table in tables])
    return np.split(numbers.astype(np.int64), ends[:-1])


def are_among(numbers: Rows, among: Rows) -> Mask:
    """Tell which of the numbers (>= 0) occur ``among`` the others."""
    known = np.zeros(max(numbers.max(initial=0), among.max(initial=0)) + 1, dtype=bool)
    known[among] = True
    return known[numbers]


def number_parts(count: int, first: Rows, second: Rows) -> Rows:
    """Return the number of the connected part of each of so many things.

    Args:
        count: number of things.
        first: things that are linked with those of ``second``.
        second: the same number of things.
    """
    from scipy.sparse.csgraph import connected_components  # late: it takes a while

    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    _, part = connected_components(graph, directed=False)
    return np.asarray(part, dtype=np.int64)
