"""Mesh bars, rectangles and boxes node by node: Gmsh's transfinite curves are only exact to 1e-11."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt

from vi_contact.core.algebra import Array

_SIMPLEX_TYPE = (15, 1, 2, 4)  # Gmsh's numbers of point, line, triangle, tetrahedron
_BOX_TYPE = (15, 1, 3, 5)  # point, line, quadrangle, hexahedron


def lattice(lengths: Sequence[float], divisions: Sequence[int]) -> Array:
    """Return the nodes of an evenly divided box with one corner at the origin, (n_1+1, ..., n_d+1, d) [m]."""
    axes = [length * np.arange(n + 1) / n for length, n in zip(lengths, divisions, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def add_grid(
    gmsh: Any, nodes: Array, *, simplices: bool, body: str, sides: Sequence[tuple[str, str]], first: int = 1
) -> None:
    """Add a structured mesh to the current model as discrete entities with named physical groups.

    `nodes` (n_1+1, ..., n_d+1, d) are the points of the deformed lattice [m]; `sides[a]` names the two sides on which
    lattice index a is lowest and highest; `body` names all cells. `simplices` splits every box along its diagonal
    (Kuhn). `first` is the tag of the first node: above those of the bodies that are there already.
    """
    d = nodes.shape[-1]
    shape = nodes.shape[:-1]
    number = np.arange(np.prod(shape)).reshape(shape, order="F")
    tags = first + number
    points = np.zeros((tags.size, 3))
    points[number.reshape(-1), :d] = nodes.reshape(-1, d)
    model, types = gmsh.model, _SIMPLEX_TYPE if simplices else _BOX_TYPE
    boundary = [_add_entity(model, d - 1, name) for pair in sides for name in pair]
    volume = _add_entity(model, d, body, boundary)
    model.mesh.addNodes(d, volume, first + np.arange(tags.size), points.reshape(-1))
    model.mesh.addElementsByType(volume, types[d], [], _cells(tags, simplices).reshape(-1))
    faces = [np.take(tags, end, axis=axis) for axis in range(d) for end in (0, -1)]
    for entity, face in zip(boundary, faces, strict=True):
        model.mesh.addElementsByType(entity, types[d - 1], [], _cells(np.asarray(face), simplices).reshape(-1))


def add_outline(
    model: Any, name: str, outline: Sequence[tuple[float, float]], names: Sequence[str], sizes: Sequence[float],
    cells: Sequence[int] = (),
) -> int:
    """Add a surface within an outline, its curves in the groups ``names``; return its tag, to be meshed irregularly.

    ``sizes``: of the cells at the corners [m]; ``cells``: exact numbers of them on the first curves.
    """
    points = [model.geo.addPoint(*place, 0.0, size) for place, size in zip(outline, sizes, strict=True)]
    curves = [model.geo.addLine(one, two) for one, two in zip(points, [*points[1:], points[0]], strict=True)]
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
    """Return the vertices of every cell of a lattice of node tags, in Gmsh's order, (n_cells, n_vertices)."""
    d = tags.ndim
    shapes = _kuhn_simplices(d) if simplices else [_box_corners(d)]
    count = [n - 1 for n in tags.shape]
    corner = {o: tags[tuple(slice(i, i + n) for i, n in zip(o, count, strict=True))] for o in np.ndindex(*(2,) * d)}
    cells = np.stack([corner[o].reshape(-1) for shape in shapes for o in shape], axis=-1)
    return cells.reshape(-1, len(shapes[0]))


def _box_corners(d: int) -> list[tuple[int, ...]]:
    loop = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners: list[list[tuple[int, ...]]] = [[()], [(0,), (1,)], [*loop], [(x, y, z) for z in (0, 1) for x, y in loop]]
    return corners[d]


def _kuhn_simplices(d: int) -> list[list[tuple[int, ...]]]:
    """Return the d! simplices walked from corner (0,...,0) to (1,...,1) along the axes, positively oriented."""
    simplices = []
    for order in permutations(range(d)):
        steps = np.eye(d, dtype=int)[list(order)]
        walk = [tuple(int(c) for c in corner) for corner in np.vstack([np.zeros((1, d), int), steps.cumsum(axis=0)])]
        if d and np.linalg.det(steps) < 0.0:
            walk[-1], walk[-2] = walk[-2], walk[-1]
        simplices.append(walk)
    return simplices
