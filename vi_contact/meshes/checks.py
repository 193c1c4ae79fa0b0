"""Check what a solver asks of a mesh.

Cells need a volume, and may be neither twisted nor folded; boundary groups are of their sides.

Pure arithmetic on arrays: points (n, d) [m], cells (n_cells, n_vertices) as rows of points,
vertices in Gmsh's order. Cells may run either way round (finite elements use |det J|), neighbours
may not lie on the same side of a facet.
"""

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.meshes.rows import CORNERS, Mask, Rows, cell_sides, found_in, number_alike

_ROUND_OFF = 1024 * np.finfo(float).eps


def check_cells(points: Array, cells: Rows, cell: str, source: str) -> None:
    """Raise InputError for cells of no volume and for twisted ones.

    A twisted cell has det J of both signs at the corners.
    """
    corners = np.array(CORNERS[cell])
    x = points[cells[:, corners]]  # (n_cells, n_corners, 1 + d, d)
    edges = x[:, :, 1:] - x[:, :, :1]
    det = np.linalg.det(edges)
    d = points.shape[1]
    longest = np.sqrt((edges**2).sum(axis=-1)).max(axis=(1, 2))
    # error of det from the rounding of coordinates
    noise = _ROUND_OFF * np.abs(points).max() * longest ** (d - 1)
    flat = np.abs(det).min(axis=1) <= noise
    twisted = ~flat & (det.min(axis=1) < 0.0) & (det.max(axis=1) > 0.0)
    refuse_cells(flat, "no volume", points, cells, source)
    refuse_cells(twisted, "crossing sides", points, cells, source)


def check_folds(points: Array, cells: Rows, cell: str, source: str) -> None:
    """Raise InputError where three cells share a facet or two lie on one side of it.

    Such two are neighbours.
    """
    sides, owner = cell_sides(cells, cell)
    (number,) = number_alike(sides)
    x = points[sides[:, : points.shape[1]]]
    height = ((points[cells].mean(axis=1)[owner] - x[:, 0]) * _normals(x)).sum(axis=1)
    count, balance = np.bincount(number), np.bincount(number, weights=np.sign(height))
    wrong = (count > 2) | ((count == 2) & (balance != 0.0))
    bad = np.zeros(len(cells), dtype=bool)
    bad[owner[wrong[number]]] = True
    refuse_cells(bad, "a neighbour on the same side of a common facet", points, cells, source)


def check_sides(groups: dict[str, Rows], cells: Rows, cell: str, source: str) -> None:
    """Raise InputError if a facet of a group, given as rows of points, is no side of a cell."""
    sides, *named = number_alike(cell_sides(cells, cell)[0], *groups.values())
    for name, numbers in zip(groups, named, strict=True):
        if missing := int(np.sum(~found_in(numbers, sides))):
            facets = "1 facet that is" if missing == 1 else f"{missing} facets that are"
            raise InputError(
                f"boundary group '{name}' of {source} has {facets} no side of a cell: remove "
                "duplicate nodes, and curves or surfaces that do not bound the named cells"
            )


def _normals(x: Array) -> Array:
    """Return the normals of facets through their first d vertices.

    It is (n, d, d) -> (n, d), of any length and direction.
    """
    d = x.shape[-1]
    if d == 1:
        return np.ones((len(x), 1))
    if d == 2:
        return np.stack([x[:, 1, 1] - x[:, 0, 1], x[:, 0, 0] - x[:, 1, 0]], axis=1)
    return np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])


def refuse_cells(bad: Mask, what: str, points: Array, cells: Rows, source: str) -> None:
    """Raise InputError that counts the bad cells and says where the first one is."""
    if bad.any():
        count, have = ("1 cell", "has") if bad.sum() == 1 else (f"{bad.sum()} cells", "have")
        where = ", ".join(f"{x:.6g}" for x in points[cells[bad.argmax()]].mean(axis=0))
        raise InputError(f"{count} of {source} {have} {what}, first at ({where}): mesh it again")
