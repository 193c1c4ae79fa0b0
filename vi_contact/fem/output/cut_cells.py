"""Integrate over the parts of cells, or of their facets, on one side of a plane that cuts them.

Cells are divided into simplices, a quadrilateral into the 2 triangles and a hexahedron into the 6
tetrahedra round a diagonal. The plane cuts each simplex into smaller ones. Nodal values are taken
for linear in a simplex, which is exact for linear fields on cells with parallel sides.

A corner of a simplex is stored as the shares that the vertices of its cell have in it, so that
every nodal field is interpolated there by one product.
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
    """Integrate density motion·phi_i over the parts of crossed cells where level <= 0. Collective.

    With a traction it is integrated over the parts of its facets that lie there. Products with
    nodal values f_i give the work ∫ density motion·f of a field f on each motion.

    Args:
        space: the body's unknowns.
        crossed: (local cells,) which cells count.
        level: points (…, d) -> (…), not positive in the parts that count.
        motion: points (k, d) -> virtual displacements (motions, k, d), linear in them.
        density: a number, or (local cells,).
        load: a traction or body force, None for ``density`` alone.

    Returns:
        (motions, owned nodes d) the integrals for the components of the owned nodes.
    """
    # the simplices on this side, and their corners as points (p, n, d)
    d = space.dimension
    surface = isinstance(load, Traction)
    if isinstance(load, BodyForce) and load.cells is not None:  # the force acts on these alone
        crossed = crossed & np.isin(np.arange(len(crossed)), load.cells.indices)
    cells, nodes = _list_entities(
        space.mesh, crossed, load.facets.indices if isinstance(load, Traction) else None
    )
    whole = space.mesh.geometry.x[nodes][:, :, :d]
    divided = simplices(nodes.shape[1], d - 1 if surface else d)
    corners, owner = parts(divided, level(whole))
    points = np.matmul(corners, whole[owner])
    edges = points[:, 1:] - points[:, :1]

    # the motions r (motions, p, n, d) there, or what of them the load works on: the part along the
    # facet, or the part against its normal, which meets a pressure p as first component of a field
    r = motion(points.reshape(-1, d))
    r = r.reshape(len(r), *points.shape)
    if isinstance(load, TangentialTraction):
        r = r @ (np.linalg.pinv(edges) @ edges)
    if isinstance(load, Pressure):
        normals = _outward(space.mesh, cells[owner], whole[owner])
        r = -(r @ normals.swapaxes(1, 2)) * np.eye(d)[0]

    # ∫ f g over a simplex of n corners: (Σf Σg + Σ f g) of its size / (n (n + 1))
    n = corners.shape[1]
    size = np.sqrt(np.abs(np.linalg.det(edges @ edges.swapaxes(1, 2)))) / factorial(n + 1)
    size = size * np.broadcast_to(density, len(crossed))[cells[owner]]
    shares = np.einsum("p,pnv,jpmd,nm->pvjd", size, corners, r, 1.0 + np.eye(n), optimize=True)

    # summed at the nodes, which other ranks may own
    sums = np.zeros((len(space.nodes), len(r), d))
    for numbers, values in from_each(
        space.comm, (node_numbers(space.mesh)[nodes[owner]].ravel(), shares)
    ):
        own = space.blocks_of(numbers)
        np.add.at(sums, own[own >= 0], values.reshape(-1, len(r), d)[own >= 0])
    return sums.swapaxes(0, 1).reshape(len(r), -1)


def _outward(mesh: Any, cells: Any, corners: Array) -> Array:
    """Return the outward unit normals (k, 1, d) of facets.

    A normal is what is left of the way from the middle of the cell to the facet without its part
    along the facet.

    Args:
        mesh: the mesh.
        cells: (k,) the local cell beside each facet.
        corners: (k, v, d) the vertices of the facets [m].
    """
    d = corners.shape[2]
    centres = mesh.geometry.x[compat.geometry_dofmap(mesh)[cells]].mean(axis=1)[:, None, :d]
    sides = np.diff(corners, axis=1)
    away = corners[:, :1] - centres
    outward = away - away @ np.linalg.pinv(sides) @ sides
    return np.asarray(outward / np.linalg.norm(outward, axis=2, keepdims=True))


def _list_entities(mesh: Any, crossed: Mask, facets: Any) -> tuple[Any, Any]:
    """Return the crossed cells (k,) that this rank owns, and their geometry nodes (k, v).

    With facets, these are the cells beside outer facets, and the nodes of the facets.

    Args:
        mesh: the mesh.
        crossed: (local cells,) mask.
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
    # a facet between two cells is no outer one
    chosen = (np.diff(beside.offsets)[facets] == 1) & crossed[cells]
    return cells[chosen], compat.entities_to_geometry(mesh, dim - 1, facets[chosen])


def simplices(vertices: int, dimension: int) -> Array:
    """Return the k simplices of n corners that make up a cell.

    Args:
        vertices: how many the cell has.
        dimension: that of the cell.

    Returns:
        (k, n, vertices) shares of the vertices of the cell in the corners of the simplices.
    """
    if vertices == dimension + 1:
        paths = [list(range(vertices))]
    else:
        # each order of the axes is a way along edges from the first vertex to the last, and the
        # vertices on it are those of one simplex; vertex numbers are sums of 2**axis
        paths = []
        for order in permutations(range(dimension)):
            steps = [2**axis for axis in order]
            paths.append(np.cumsum([0, *steps]).tolist())
    return np.array([np.eye(vertices)[path] for path in paths])


def parts(whole: Array, level: Array) -> tuple[Array, Indices]:
    """Return the parts of simplices where a level that is linear in them is not positive.

    A simplex with corners on both sides is divided at the point of level 0 on the edge from its
    lowest corner to its highest one: this point takes the place of the highest corner in one half,
    and of the lowest in the other. Each half has one corner less on one of the sides, so that after
    n - 1 rounds no simplex of n corners has corners on both.

    Args:
        whole: (k, n, v) the simplices that make up each entity, as shares of its vertices.
        level: (entities, v) at the vertices.

    Returns:
        (p, n, v) shares of the vertices in the corners of the parts, and (p,) the entity of each.
    """
    owner = np.repeat(np.arange(len(level)), len(whole))
    corners = np.tile(whole, (len(level), 1, 1))
    # the level of a corner is stored beside its shares, as the last one
    corners = np.concatenate([corners, corners @ level[owner][:, :, None]], axis=2)
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
        middle[:, -1] = 0.0  # without round-off
        corners[cut, high[cut]] = middle
        rest[np.arange(len(cut)), low[cut]] = middle
        corners = np.concatenate([corners, rest])
        owner = np.concatenate([owner, owner[cut]])
    inside = (corners[:, :, -1] <= 0.0).all(axis=1)
    return corners[inside, :, :-1], owner[inside]
