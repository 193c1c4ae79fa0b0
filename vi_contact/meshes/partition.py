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
    """Return the owner of each of the points (n_points, d).

    It is 0 to n - 1; shares are equal but for one point.
    """
    owner = np.zeros(len(centres), dtype=np.int32)

    def split(rows: npt.NDArray[np.intp], first: int, count: int) -> None:
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
    """Return the ranks each cell goes to.

    They are one list and the n_cells + 1 offsets of the cells in it.

    First its owner, then, as a ghost, the owners of its neighbours across a facet.
    """
    owner = halve(points[cells].mean(axis=1), n)
    sides, at = cell_sides(cells, cell)
    (number,) = number_alike(sides)
    order = np.argsort(number, kind="stable")
    shared = np.diff(number[order]) == 0
    one, other = at[order[:-1][shared]], at[order[1:][shared]]
    apart = owner[one] != owner[other]
    pairs = np.stack([np.append(one, other), np.append(owner[other], owner[one])], axis=1)[
        np.append(apart, apart)
    ]
    ghosts = np.unique(pairs, axis=0)
    where = np.append(np.arange(len(cells)), ghosts[:, 0])
    ranks = np.append(owner, ghosts[:, 1])[np.argsort(where, kind="stable")]
    return ranks.astype(np.int32), np.append(0, np.bincount(where).cumsum()).astype(np.int32)
