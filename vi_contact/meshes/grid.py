"""Mesh bars, rectangles and boxes node by node: Gmsh's transfinite curves are only exact to 1e-11.

A script that says which ``grids`` it is made of needs no Gmsh to become arrays, only to be written
as a file.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt

from vi_contact.core.algebra import Array

_SIMPLEX_TYPE = (15, 1, 2, 4)  # Gmsh's numbers of point, line, triangle, tetrahedron
_BOX_TYPE = (15, 1, 3, 5)  # point, line, quadrangle, hexahedron


def lattice(lengths: Sequence[float], divisions: Sequence[int]) -> Array:
    """Return the nodes of an evenly divided box with one corner at the origin.

    They are (n_1+1, ..., n_d+1, d) [m].
    """
    axes = [length * np.arange(n + 1) / n for length, n in zip(lengths, divisions, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


@dataclass(frozen=True, eq=False)
class Grid:
    """Describe a structured mesh of one body.

    `nodes` (n_1+1, ..., n_d+1, d) are the points of the deformed lattice [m]; `sides[a]` names the
    two sides on which lattice index a is lowest and highest; `body` names all cells. `simplices`
    splits boxes along a diagonal (Kuhn).
    """

    nodes: Array
    simplices: bool
    body: str
    sides: Sequence[tuple[str, str]]

    @property
    def kinds(self) -> tuple[int, ...]:
        """Return Gmsh's numbers of the shapes of 0, 1, ... d dimensions."""
        return (_SIMPLEX_TYPE if self.simplices else _BOX_TYPE)[: self.nodes.shape[-1] + 1]

    def numbered(self) -> tuple[Array, npt.NDArray[np.int_], dict[str, npt.NDArray[np.int_]]]:
        """Return points (n, d), cells and the facets of every side as rows of points."""
        *shape, d = self.nodes.shape
        number = np.arange(np.prod(shape)).reshape(shape, order="F")
        points = np.empty((number.size, d))
        points[number.reshape(-1)] = self.nodes.reshape(-1, d)
        faces = {
            name: _cells(np.asarray(np.take(number, end, axis=axis)), self.simplices)
            for axis, pair in enumerate(self.sides)
            for name, end in zip(pair, (0, -1), strict=True)
        }
        return points, _cells(number, self.simplices), faces


def add_grids(gmsh: Any, grids: Sequence[Grid]) -> None:
    """Add structured meshes to the current model as discrete entities.

    They get named physical groups.
    """
    model, first = gmsh.model, 1  # tag of the first node
    for grid in grids:
        points, cells, faces = grid.numbered()
        n, d = points.shape
        boundary = [_add_entity(model, d - 1, name) for name in faces]
        volume = _add_entity(model, d, grid.body, boundary)
        places = np.zeros((n, 3))
        places[:, :d] = points
        model.mesh.addNodes(d, volume, first + np.arange(n), places.reshape(-1))
        model.mesh.addElementsByType(volume, grid.kinds[d], [], (first + cells).reshape(-1))
        for entity, face in zip(boundary, faces.values(), strict=True):
            model.mesh.addElementsByType(entity, grid.kinds[d - 1], [], (first + face).reshape(-1))
        first += n


def add_outline(
    model: Any,
    name: str,
    outline: Sequence[tuple[float, float]],
    names: Sequence[str],
    sizes: Sequence[float],
    cells: Sequence[int] = (),
) -> int:
    """Add a surface within an outline, to be meshed irregularly.

    Its curves are in the groups ``names``; its tag is returned.

    ``sizes``: of the cells at the corners [m]; ``cells``: exact numbers of them on the first
    curves.
    """
    points = [
        model.geo.addPoint(*place, 0.0, size) for place, size in zip(outline, sizes, strict=True)
    ]
    curves = [
        model.geo.addLine(one, two)
        for one, two in zip(points, [*points[1:], points[0]], strict=True)
    ]
    for curve, count in zip(curves, cells, strict=False):
        model.geo.mesh.setTransfiniteCurve(curve, count + 1)
    surface: int = model.geo.addPlaneSurface([model.geo.addCurveLoop(curves)])
    model.geo.synchronize()
    for group in dict.fromkeys(names):
        held = [curve for curve, one in zip(curves, names, strict=True) if one == group]
        model.setPhysicalName(1, model.addPhysicalGroup(1, held), group)
    model.setPhysicalName(2, model.addPhysicalGroup(2, [surface]), name)
    return surface


def _add_entity(model: Any, dim: int, name: str, boundary: Sequence[int] = ()) -> int:
    entity: int = model.addDiscreteEntity(dim, -1, list(boundary))
    model.setPhysicalName(dim, model.addPhysicalGroup(dim, [entity]), name)
    return entity


def _cells(tags: npt.NDArray[np.int_], simplices: bool) -> npt.NDArray[np.int_]:
    """Return the vertices of every cell of a lattice of node tags.

    They are in Gmsh's order, (n_cells, n_vertices).
    """
    d = tags.ndim
    shapes = _kuhn_simplices(d) if simplices else [_box_corners(d)]
    count = [n - 1 for n in tags.shape]
    corner = {
        o: tags[tuple(slice(i, i + n) for i, n in zip(o, count, strict=True))]
        for o in np.ndindex(*(2,) * d)
    }
    cells = np.stack([corner[o].reshape(-1) for shape in shapes for o in shape], axis=-1)
    return cells.reshape(-1, len(shapes[0]))


def _box_corners(d: int) -> list[tuple[int, ...]]:
    loop = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners: list[list[tuple[int, ...]]] = [
        [()],
        [(0,), (1,)],
        [*loop],
        [(x, y, z) for z in (0, 1) for x, y in loop],
    ]
    return corners[d]


def _kuhn_simplices(d: int) -> list[list[tuple[int, ...]]]:
    """Return the d! simplices of a cell, positively oriented.

    They are walked from corner (0,...,0) to (1,...,1) along the axes.
    """
    simplices = []
    for order in permutations(range(d)):
        steps = np.eye(d, dtype=int)[list(order)]
        walk = [
            tuple(int(c) for c in corner)
            for corner in np.vstack([np.zeros((1, d), int), steps.cumsum(axis=0)])
        ]
        if d and np.linalg.det(steps) < 0.0:
            walk[-1], walk[-2] = walk[-2], walk[-1]
        simplices.append(walk)
    return simplices
