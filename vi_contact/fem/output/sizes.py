"""Measure cells and facets: how large each is, and where its centroid lies."""

from math import factorial
from typing import Any

import numpy as np

from ...core.algebra import Array
from .. import compat
from ..compat import Indices
from .cut_cells import simplices


def measure_cells(mesh: Any) -> tuple[Array, Array]:
    """Return sizes and centroids of the owned cells.

    Returns:
        (cells,) volumes [m³], in the plane areas [m²], and (cells, d) [m].
    """
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    nodes = compat.geometry_dofmap(mesh)[:owned]
    vertices = len(compat.sub_entities(mesh, 0))
    return _measure(mesh, nodes[:, :vertices], mesh.topology.dim)


def measure_facets(mesh: Any, facets: Indices) -> tuple[Array, Array, Array]:
    """Return sizes, centroids and corners of those of some facets that this rank owns. Collective.

    Args:
        mesh: the mesh.
        facets: local facets, ghosts among them.

    Returns:
        (k,) areas [m²], in the plane lengths [m], (k, d) [m] and (k, v, d) [m].
    """
    dimension = mesh.topology.dim - 1
    own = facets[facets < mesh.topology.index_map(dimension).size_local]
    nodes = compat.entities_to_geometry(mesh, dimension, own)
    sizes, centroids = _measure(mesh, nodes, dimension)
    return sizes, centroids, mesh.geometry.x[nodes][..., : mesh.geometry.dim]


def _measure(mesh: Any, nodes: Indices, dimension: int) -> tuple[Array, Array]:
    """Return sizes (k,) and centroids (k, d) of entities with these vertices (k, v)."""
    corners = mesh.geometry.x[nodes][..., : mesh.geometry.dim]

    # Each entity is cut into simplices. The size of one is the root of det(S Sᵀ) of its sides S,
    # over n!, and its centroid the mean of its corners.
    shares = simplices(nodes.shape[1], dimension)
    cut = np.einsum("scv,kvd->kscd", shares, corners)
    sides = cut[:, :, 1:] - cut[:, :, :1]
    squares = np.linalg.det(sides @ np.swapaxes(sides, 2, 3))
    pieces = np.sqrt(np.maximum(squares, 0.0)) / factorial(dimension)
    sizes = pieces.sum(axis=1)
    first = np.einsum("ks,ksd->kd", pieces, cut.mean(axis=2))
    return sizes, first / np.where(sizes > 0.0, sizes, 1.0)[:, None]
