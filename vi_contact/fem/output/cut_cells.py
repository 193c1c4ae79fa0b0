"""Integrate over what lies on one side of a plane that goes through cells.

These are parts of these cells and of their facets.

They are cut as simplices, a quadrilateral as the 2 triangles and a hexahedron as the 6 tetrahedra
round a diagonal, in which nodal values are taken for linear: exact for linear fields on cells with
parallel sides.
"""

from collections.abc import Callable
from itertools import permutations
from math import factorial
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask, from_each
from .. import compat
from ..body.loads import BodyForce, Pressure, TangentialTraction, Traction
from ..body.space import FemSpace
from ..mesh.numbering import node_numbers


def work_beyond(
    space: FemSpace,
    crossed: Mask,
    level: Callable[[Array], Array],
    motion: Callable[[Array], Array],
    density: Array | float,
    load: Traction | BodyForce | None,
) -> Array:
    """Return (motions, owned components) ∫ density motion·phi_i over parts of cells.

    Or it is over parts of the facets of a traction.

    They are the parts of crossed cells where the level is not positive. Collective.

    Args:
        space: the body's unknowns.
        crossed: mask of local cells that count.
        level: points (…, d) -> (…), not positive in the parts that count.
        motion: points (k, d) -> virtual displacements (motions, k, d), linear in them.
        density: a number, or one of each local cell.
        load: a traction or body force, None for ``density`` alone.
    """
    d = space.dimension
    if isinstance(load, BodyForce) and load.cells is not None:  # it acts on these alone
        crossed = crossed & np.isin(np.arange(len(crossed)), load.cells.indices)
    cells, nodes = _entities(
        space.mesh, crossed, load.facets.indices if isinstance(load, Traction) else None
    )
    whole = space.mesh.geometry.x[nodes][:, :, :d]
    corners, owner = parts(simplices(nodes.shape[1], d - isinstance(load, Traction)), level(whole))
    at = np.matmul(corners, whole[owner])
    edges = at[:, 1:] - at[:, :1]
    r = motion(at.reshape(-1, d))
    r = r.reshape(len(r), *at.shape)
    if isinstance(load, TangentialTraction):
        r = r @ (np.linalg.pinv(edges) @ edges)
    if isinstance(load, Pressure):  # which is the first component of its field
        centres = space.mesh.geometry.x[compat.geometry_dofmap(space.mesh)[cells]].mean(axis=1)[
            owner, None, :d
        ]
        sides = np.diff(whole, axis=1)[owner]
        away = whole[owner, :1] - centres
        outward = away - away @ np.linalg.pinv(sides) @ sides
        r = (
            -(r @ (outward / np.linalg.norm(outward, axis=2, keepdims=True)).swapaxes(1, 2))
            * np.eye(d)[0]
        )
    # ∫ f g over a simplex of n corners: (Σf Σg + Σ f g) of its size / (n (n + 1))
    n = corners.shape[1]
    size = np.sqrt(np.abs(np.linalg.det(edges @ edges.swapaxes(1, 2)))) / factorial(n + 1)
    size = size * np.broadcast_to(density, len(crossed))[cells[owner]]
    shares = np.einsum("p,pnv,jpmd,nm->pvjd", size, corners, r, 1.0 + np.eye(n), optimize=True)
    found = np.zeros((len(space.nodes), len(r), d))
    for numbers, values in from_each(
        space.comm, (node_numbers(space.mesh)[nodes[owner]].ravel(), shares)
    ):
        own = space.blocks_of(numbers)
        np.add.at(found, own[own >= 0], values.reshape(-1, len(r), d)[own >= 0])
    return found.swapaxes(0, 1).reshape(len(r), -1)


def _entities(mesh: Any, crossed: Mask, facets: Any) -> tuple[Any, Any]:
    """Return (cells, geometry nodes) of the crossed cells of this rank.

    Or the nodes are those of the outer facets beside them.

    Args:
        mesh: the mesh.
        crossed: mask of local cells.
        facets: local facets of a traction, or None for cells.
    """
    dim = mesh.topology.dim
    owned = mesh.topology.index_map
    if facets is None:
        cells = np.flatnonzero(crossed[: owned(dim).size_local])
        return cells, compat.geometry_dofmap(mesh)[cells]
    facets = facets[facets < owned(dim - 1).size_local]
    beside = mesh.topology.connectivity(dim - 1, dim)  # made with the measure of the traction
    cells = beside.array[beside.offsets[:-1][facets]]
    kept = (np.diff(beside.offsets)[facets] == 1) & crossed[cells]
    return cells[kept], compat.entities_to_geometry(mesh, dim - 1, facets[kept])


def simplices(vertices: int, dimension: int) -> Array:
    """Return (k, n, vertices) shares of the vertices in the corners of simplices.

    These simplices make up a cell.
    """
    paths = [range(vertices)]
    if vertices > dimension + 1:  # from the first vertex to the last along the axes, in every order
        paths = [
            np.cumsum([0, *(2**axis for axis in order)]) for order in permutations(range(dimension))
        ]
    return np.array([np.eye(vertices)[list(path)] for path in paths])


def parts(whole: Array, level: Array) -> tuple[Array, Indices]:
    """Return (shares of the vertices in corners (p, n, v), entity (p,)) of simplices.

    They are what of the simplices ``whole`` (k, n, v) of each entity lies where the level of its
    vertices (entities, v), linear in them, is not positive.
    """
    owner = np.repeat(np.arange(len(level)), len(whole))
    corners = np.tile(whole, (len(level), 1, 1))
    # their level as last share
    corners = np.concatenate([corners, corners @ level[owner][:, :, None]], axis=2)
    # a cut edge leaves one corner less on the wrong side in both halves
    for _ in range(whole.shape[1] - 1):
        low = corners[:, :, -1].argmin(axis=1)
        high = corners[:, :, -1].argmax(axis=1)
        every = np.arange(len(owner))
        below = corners[every, low]
        above = corners[every, high]
        cut = np.flatnonzero((below[:, -1] < 0.0) & (above[:, -1] > 0.0))
        below = below[cut]
        above = above[cut]
        rest = corners[cut]
        middle = (above[:, -1:] * below - below[:, -1:] * above) / (above - below)[:, -1:]
        middle[:, -1] = 0.0
        corners[cut, high[cut]] = rest[np.arange(len(cut)), low[cut]] = middle
        corners = np.concatenate([corners, rest])
        owner = np.concatenate([owner, owner[cut]])
    kept = (corners[:, :, -1] <= 0.0).all(axis=1)
    return corners[kept, :, :-1], owner[kept]
