"""Assign cells to ranks by repeated halving across the longest side, the same every time.

Graph partitioners give smaller interfaces but, in parallel, another answer, and so other results,
on every run.
"""

import numpy as np
import numpy.typing as npt

from vi_contact.core.algebra import Array
from vi_contact.meshes.rows import Rows, cell_sides, number_alike

Ranks = npt.NDArray[np.int32]


def halve(centres: Array, n: int) -> Ranks:
    """Return the owner, 0 to n - 1, of each of the points (n_points, d).

    Shares are equal but for one point.
    """
    owner = np.zeros(len(centres), dtype=np.int32)

    def split(rows: npt.NDArray[np.intp], first: int, count: int) -> None:
        """Give these points to as many owners, from the first one on.

        Args:
            rows: numbers of the points.
            first: number of the first owner.
            count: number of owners.
        """
        owner[rows] = first
        if count == 1 or not len(rows):
            return
        axis = np.ptp(centres[rows], axis=0).argmax()
        ordered = rows[np.argsort(centres[rows, axis], kind="stable")]
        lower = count // 2
        cut = len(rows) * lower // count
        split(ordered[:cut], first, lower)
        split(ordered[cut:], first + lower, count - lower)

    split(np.arange(len(centres)), 0, n)
    return owner


def destinations(points: Array, cells: Rows, cell: str, n: int) -> tuple[Ranks, Ranks]:
    """Return the ranks that each cell goes to.

    The first is its owner. The others have it as a ghost: they own its neighbours across a facet.

    Args:
        points: (n_points, d) [m].
        cells: (n_cells, n_vertices), rows of points.
        cell: name of the kind of cells.
        n: number of ranks.

    Returns:
        The ranks of all cells in one list, and the offsets (n_cells + 1,) of the cells in it.
    """
    owner = halve(points[cells].mean(axis=1), n)

    # Pairs of cells with a common side.
    sides, cell_of_side = cell_sides(cells, cell)
    (number,) = number_alike(sides)
    order = np.argsort(number, kind="stable")
    shared = np.flatnonzero(np.diff(number[order]) == 0)
    first = cell_of_side[order[shared]]
    second = cell_of_side[order[shared + 1]]

    # Where their owners differ, each is a ghost of the other's owner.
    apart = owner[first] != owner[second]
    cell_of_ghost = np.append(first[apart], second[apart])
    rank_of_ghost = np.append(owner[second[apart]], owner[first[apart]])
    ghosts = np.unique(np.stack([cell_of_ghost, rank_of_ghost], axis=1), axis=0)

    # One list, cell after cell, the owner in front.
    place = np.append(np.arange(len(cells)), ghosts[:, 0])
    ranks = np.append(owner, ghosts[:, 1])[np.argsort(place, kind="stable")]
    offsets = np.append(0, np.bincount(place).cumsum())
    return ranks.astype(np.int32), offsets.astype(np.int32)
