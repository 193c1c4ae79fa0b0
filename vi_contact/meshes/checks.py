"""Check what a solver asks of a mesh.

Cells need a volume, and may be neither twisted nor folded; boundary groups are of their sides.

Pure arithmetic on arrays: points (n, d) [m], cells (n_cells, n_vertices) as rows of points,
vertices in Gmsh's order. Cells may run either way round (finite elements use |det J|), neighbours
may not lie on the same side of a facet.
"""

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.meshes.rows import CORNERS, Mask, Rows, are_among, cell_sides, number_alike

_ROUND_OFF = 1024 * np.finfo(float).eps


def check_cells(points: Array, cells: Rows, cell: str, source: str) -> None:
    """Raise InputError for cells of no volume and for twisted ones.

    A twisted cell has det J of both signs at the corners.

    Args:
        points: (n_points, d) [m].
        cells: (n_cells, n_vertices), rows of points.
        cell: name of the kind of cells.
        source: name of the mesh in messages.
    """
    corners = np.array(CORNERS[cell])
    x = points[cells[:, corners]]  # (n_cells, n_corners, 1 + d, d)
    edges = x[:, :, 1:] - x[:, :, :1]
    det = np.linalg.det(edges)
    d = points.shape[1]

    # Error of det J from the rounding of coordinates.
    longest = np.sqrt((edges**2).sum(axis=-1)).max(axis=(1, 2))
    noise = _ROUND_OFF * np.abs(points).max() * longest ** (d - 1)
    flat = np.abs(det).min(axis=1) <= noise
    twisted = ~flat & (det.min(axis=1) < 0.0) & (det.max(axis=1) > 0.0)
    refuse_cells(flat, "no volume", points, cells, source)
    refuse_cells(twisted, "crossing sides", points, cells, source)


def check_folds(points: Array, cells: Rows, cell: str, source: str) -> None:
    """Raise InputError where three cells share a facet, or two of them lie on one side of it.

    Args:
        points: (n_points, d) [m].
        cells: (n_cells, n_vertices), rows of points.
        cell: name of the kind of cells.
        source: name of the mesh in messages.
    """
    sides, owner = cell_sides(cells, cell)
    (number,) = number_alike(sides)
    x = points[sides[:, : points.shape[1]]]
    centres = points[cells].mean(axis=1)
    height = ((centres[owner] - x[:, 0]) * _compute_normals(x)).sum(axis=1)

    # Of two cells on either side of a facet the signs add up to zero.
    count = np.bincount(number)
    balance = np.bincount(number, weights=np.sign(height))
    wrong = (count > 2) | ((count == 2) & (balance != 0.0))
    bad = np.zeros(len(cells), dtype=bool)
    bad[owner[wrong[number]]] = True
    refuse_cells(bad, "a neighbour on the same side of a common facet", points, cells, source)


def check_sides(groups: dict[str, Rows], cells: Rows, cell: str, source: str) -> None:
    """Raise InputError if a facet of a group is no side of a cell.

    Args:
        groups: facets by the names of groups, as rows of points.
        cells: (n_cells, n_vertices), rows of points.
        cell: name of the kind of cells.
        source: name of the mesh in messages.
    """
    all_sides, _ = cell_sides(cells, cell)
    sides, *named = number_alike(all_sides, *groups.values())
    for name, numbers in zip(groups, named, strict=True):
        missing = int(np.sum(~are_among(numbers, sides)))
        if missing:
            facets = "1 facet that is" if missing == 1 else f"{missing} facets that are"
            raise InputError(
                f"boundary group '{name}' of {source} has {facets} no side of a cell: remove "
                "duplicate nodes, and curves or surfaces that do not bound the named cells"
            )


def _compute_normals(x: Array) -> Array:
    """Return the normals (n, d) of facets through their first d vertices (n, d, d).

    They have any length and direction.
    """
    d = x.shape[-1]
    if d == 1:
        return np.ones((len(x), 1))
    if d == 2:
        return np.stack([x[:, 1, 1] - x[:, 0, 1], x[:, 0, 0] - x[:, 1, 0]], axis=1)
    return np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])


def refuse_cells(bad: Mask, fault: str, points: Array, cells: Rows, source: str) -> None:
    """Raise InputError that counts the bad cells and says where the first one is.

    Args:
        bad: (n_cells,), the cells to refuse.
        fault: that they have.
        points: (n_points, d) [m].
        cells: (n_cells, n_vertices), rows of points.
        source: name of the mesh.
    """
    if not bad.any():
        return
    centre = points[cells[bad.argmax()]].mean(axis=0)
    where = ", ".join(f"{x:.6g}" for x in centre)
    number = bad.sum()
    who = f"1 cell of {source} has" if number == 1 else f"{number} cells of {source} have"
    raise InputError(f"{who} {fault}, first at ({where}): mesh it again")
