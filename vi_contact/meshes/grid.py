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
    """Return the nodes (n_1+1, ..., n_d+1, d) [m] of an evenly divided box at the origin."""
    axes = [length * np.arange(n + 1) / n for length, n in zip(lengths, divisions, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


@dataclass(frozen=True, eq=False)
class Grid:
    """Describe a structured mesh of one body.

    Attributes:
        nodes: (n_1+1, ..., n_d+1, d) points of the deformed lattice [m].
        simplices: whether boxes are split along a diagonal (Kuhn).
        body: name of all cells.
        sides: names of the two sides on which each lattice index is lowest and highest; "" for a
            side without a name. Grids of one mesh may share names of sides.
        kin: name of a group of cells that the body is in beside its own; "" for none.
    """

    nodes: Array
    simplices: bool
    body: str
    sides: Sequence[tuple[str, str]]
    kin: str = ""

    @property
    def kinds(self) -> tuple[int, ...]:
        """Return Gmsh's numbers of the shapes of 0, 1, ... d dimensions."""
        kinds = _SIMPLEX_TYPE if self.simplices else _BOX_TYPE
        dimension = self.nodes.shape[-1]
        return kinds[: dimension + 1]

    def number_nodes(self) -> tuple[Array, npt.NDArray[np.int_], dict[str, npt.NDArray[np.int_]]]:
        """Return points (n, d), cells and the facets of every side as rows of points."""
        *shape, d = self.nodes.shape
        number = np.arange(np.prod(shape)).reshape(shape, order="F")
        points = np.empty((number.size, d))
        points[number.reshape(-1)] = self.nodes.reshape(-1, d)
        parts: dict[str, list[npt.NDArray[np.int_]]] = {}
        for axis, (low, high) in enumerate(self.sides):
            for name, end in ((low, 0), (high, -1)):
                if name:
                    on_side = np.asarray(np.take(number, end, axis=axis))
                    parts.setdefault(name, []).append(_divide(on_side, self.simplices))
        faces = {name: np.concatenate(rows) for name, rows in parts.items()}
        return points, _divide(number, self.simplices), faces


def add_grids(gmsh: Any, grids: Sequence[Grid]) -> None:
    """Add structured meshes to the current model, as discrete entities with named groups."""
    model = gmsh.model
    first = 1  # tag of the first node of a grid
    groups: dict[tuple[int, str], list[int]] = {}  # dimension and name -> tags of the entities
    for grid in grids:
        points, cells, faces = grid.number_nodes()
        n, d = points.shape
        boundary = [model.addDiscreteEntity(d - 1) for _ in faces]
        volume = model.addDiscreteEntity(d, -1, boundary)
        for entity, name in zip(boundary, faces, strict=True):
            groups.setdefault((d - 1, name), []).append(entity)
        for name in filter(None, (grid.body, grid.kin)):
            groups.setdefault((d, name), []).append(volume)
        places = np.zeros((n, 3))
        places[:, :d] = points
        model.mesh.addNodes(d, volume, first + np.arange(n), places.reshape(-1))
        model.mesh.addElementsByType(volume, grid.kinds[d], [], (first + cells).reshape(-1))
        for entity, face in zip(boundary, faces.values(), strict=True):
            model.mesh.addElementsByType(entity, grid.kinds[d - 1], [], (first + face).reshape(-1))
        first += n
    for (dim, name), entities in groups.items():
        model.setPhysicalName(dim, model.addPhysicalGroup(dim, entities), name)


def add_outline(
    model: Any,
    name: str,
    outline: Sequence[tuple[float, float]],
    names: Sequence[str],
    sizes: Sequence[float],
    cells: Sequence[int] = (),
) -> int:
    """Add a surface within an outline, to be meshed irregularly.

    Args:
        model: Gmsh's current model.
        name: of the group of the surface.
        outline: corners (x, y) [m]; a curve leads from each to the next one.
        names: of the groups of the curves.
        sizes: of the cells at the corners [m].
        cells: exact numbers of cells on the first curves.

    Returns:
        The tag of the surface.
    """
    points = []
    for place, size in zip(outline, sizes, strict=True):
        points.append(model.geo.addPoint(*place, 0.0, size))
    ends = [*points[1:], points[0]]
    curves = [model.geo.addLine(start, end) for start, end in zip(points, ends, strict=True)]
    for curve, count in zip(curves, cells, strict=False):
        model.geo.mesh.setTransfiniteCurve(curve, count + 1)
    surface: int = model.geo.addPlaneSurface([model.geo.addCurveLoop(curves)])
    model.geo.synchronize()
    for group in dict.fromkeys(names):
        members = [curve for curve, own in zip(curves, names, strict=True) if own == group]
        model.setPhysicalName(1, model.addPhysicalGroup(1, members), group)
    model.setPhysicalName(2, model.addPhysicalGroup(2, [surface]), name)
    return surface


def _divide(tags: npt.NDArray[np.int_], simplices: bool) -> npt.NDArray[np.int_]:
    """Return the vertices (n_cells, n_vertices) of every cell of a lattice of node tags.

    They are in Gmsh's order. A box of the lattice is one cell, or d! simplices.
    """
    d = tags.ndim
    shapes = _kuhn_simplices(d) if simplices else [_box_corners(d)]

    # The node at one corner of all boxes: the lattice without its first or last layer.
    at_corner = {}
    for corner in np.ndindex(*(2,) * d):
        layers = [slice(i, i + n - 1) for i, n in zip(corner, tags.shape, strict=True)]
        at_corner[corner] = tags[tuple(layers)].reshape(-1)
    vertices = [at_corner[corner] for shape in shapes for corner in shape]
    return np.stack(vertices, axis=-1).reshape(-1, len(shapes[0]))


def _box_corners(d: int) -> list[tuple[int, ...]]:
    """Return the corners of a box of d dimensions in Gmsh's order."""
    if d == 0:
        return [()]
    if d == 1:
        return [(0,), (1,)]
    loop: list[tuple[int, ...]] = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if d == 2:
        return loop
    return [(*corner, z) for z in (0, 1) for corner in loop]


def _kuhn_simplices(d: int) -> list[list[tuple[int, ...]]]:
    """Return the d! simplices of a box, positively oriented (Kuhn).

    Each is a walk from corner (0, ..., 0) to (1, ..., 1) along the axes, in one of their orders.
    """
    simplices = []
    for order in permutations(range(d)):
        steps = np.eye(d, dtype=int)[list(order)]
        corners = np.vstack([np.zeros((1, d), int), steps.cumsum(axis=0)])
        walk = [tuple(corner) for corner in corners.tolist()]
        if d and np.linalg.det(steps) < 0.0:
            walk[-1], walk[-2] = walk[-2], walk[-1]  # a left-handed one
        simplices.append(walk)
    return simplices
