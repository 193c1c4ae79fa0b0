"""Integrate over what lies on one side of a plane that goes through cells: parts of these cells and of their facets.

They are cut as simplices, a quadrilateral as the 2 triangles and a hexahedron as the 6 tetrahedra round a diagonal, in
which nodal values are taken for linear: exact for linear fields on cells with parallel sides.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from math import factorial
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask, from_each
from .. import compat
from ..loads import BodyForce, TangentialTraction, Traction
from ..mesh import node_numbers
from ..space import FemSpace

Motion = Callable[[Array], Array]  # points (…, d) -> virtual displacements (…, d)


@dataclass(frozen=True)
class OneSide:
    """Hold what of the ``crossed`` cells (local mask) lies where ``level`` of points (…, d) [m] is not positive."""

    space: FemSpace
    crossed: Mask
    level: Callable[[Array], Array]

    def row(self, motion: Motion, density: Array | float, load: Traction | BodyForce | None = None) -> Array:
        """Return (owned components,) ∫ density motion·phi_i over the parts of cells, or of the facets of a traction.

        ``density``: one value for all, or one of each local cell. Collective.
        """
        cells, nodes = self._facets(load) if isinstance(load, Traction) else self._cells()
        mesh, d = self.space.mesh, self.space.dimension
        whole = mesh.geometry.x[nodes][:, :, :d]
        corners, owner = parts(simplices(nodes.shape[1], mesh.topology.dim - isinstance(load, Traction)),
                               self.level(whole))
        at = np.matmul(corners, whole[owner])
        edges, r = at[:, 1:] - at[:, :1], motion(at)
        if isinstance(load, TangentialTraction):
            r = r @ (np.linalg.pinv(edges) @ edges)
        n = corners.shape[1]  # ∫ f g over a simplex of n corners: (Σf Σg + Σ f g) of its size / (n (n + 1))
        size = np.sqrt(np.abs(np.linalg.det(edges @ edges.swapaxes(1, 2)))) / factorial(n - 1)
        shares = np.einsum("knv,knd->kvd", corners, r) + corners.sum(axis=1)[:, :, None] * r.sum(axis=1)[:, None, :]
        shares *= (np.broadcast_to(density, len(self.crossed))[cells[owner]] * size / (n * (n + 1)))[:, None, None]
        found = np.zeros((len(self.space.nodes), d))
        for numbers, values in from_each(self.space.comm, (node_numbers(mesh)[nodes[owner]].ravel(), shares)):
            own = self.space.blocks_of(numbers)
            np.add.at(found, own[own >= 0], values.reshape(-1, d)[own >= 0])
        return found.ravel()

    def _cells(self) -> tuple[Any, Any]:
        """The crossed cells that this rank owns, and their geometry nodes."""
        mesh = self.space.mesh
        cells = np.flatnonzero(self.crossed[: mesh.topology.index_map(mesh.topology.dim).size_local])
        return cells, compat.geometry_dofmap(mesh)[cells]

    def _facets(self, load: Traction) -> tuple[Any, Any]:
        """The crossed cells beside those outer facets of a load that this rank owns, and the nodes of the facets."""
        mesh: Any = self.space.mesh
        dim = mesh.topology.dim - 1
        facets = load.facets.indices[load.facets.indices < mesh.topology.index_map(dim).size_local]
        compat.entities_to_geometry(mesh, dim, facets)  # makes the connectivity
        beside = mesh.topology.connectivity(dim, dim + 1)
        outer = np.diff(beside.offsets)[facets] == 1
        cells = beside.array[beside.offsets[:-1][facets]]
        kept = outer & self.crossed[cells]
        return cells[kept], compat.entities_to_geometry(mesh, dim, facets[kept])


def simplices(vertices: int, dimension: int) -> Array:
    """Return (k, n, vertices) shares of the vertices in the corners of the simplices that make up a cell."""
    paths = [range(vertices)]
    if vertices > dimension + 1:  # from the first vertex to the last along the axes, in every order
        paths = [np.cumsum([0, *(2**axis for axis in order)]) for order in permutations(range(dimension))]
    return np.array([np.eye(vertices)[list(path)] for path in paths])


def parts(whole: Array, level: Array) -> tuple[Array, Indices]:
    """Return (shares of the vertices in corners (p, n, v), entity (p,)) of simplices: what of the simplices ``whole``
    (k, n, v) of each entity lies where the level of its vertices (entities, v), linear in them, is not positive."""
    k, n, v = whole.shape
    corners, owner = np.tile(whole, (len(level), 1, 1)), np.repeat(np.arange(len(level)), k)
    height = np.einsum("pnv,pv->pn", corners, level[owner])
    for _ in range(n - 1):  # every cut of an edge leaves one corner less on the wrong side in both halves
        every = np.arange(len(height))
        low, high = height.argmin(axis=1), height.argmax(axis=1)
        below, above = height[every, low], height[every, high]
        cut = (below < 0.0) & (above > 0.0)
        share = np.divide(below, below - above, out=np.zeros_like(below), where=cut)[:, None]
        middle = (1.0 - share) * corners[every, low] + share * corners[every, high]
        other, other_height = corners[cut], height[cut]
        rows = np.flatnonzero(cut)
        corners[rows, high[cut]], height[rows, high[cut]] = middle[cut], 0.0
        other[np.arange(len(rows)), low[cut]], other_height[np.arange(len(rows)), low[cut]] = middle[cut], 0.0
        corners, height = np.concatenate([corners, other]), np.concatenate([height, other_height])
        owner = np.concatenate([owner, owner[rows]])
    kept = (height <= 0.0).all(axis=1)
    return corners[kept], owner[kept]
