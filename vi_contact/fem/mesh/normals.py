"""Find the outward normals of facets."""

from typing import Any

import numpy as np

from ...core.algebra import Array
from .. import compat


def outward_normals(mesh: Any, facets: Any, geometry: Any) -> Array:
    """Return outward unit normals (k, d) of the planes of local facets. Collective.

    Those of curved facets, and of quadrilaterals that are not plane, are those of their vertices.

    Args:
        mesh: the DOLFINx mesh.
        facets: (k,) local numbers.
        geometry: (k, v) local geometry nodes of their vertices.
    """
    d = mesh.geometry.dim
    x = mesh.geometry.x[geometry][:, :, :d]
    middle = x.mean(axis=1)
    normals = np.linalg.svd(x - middle[:, None, :])[2][:, -1]  # along which the facet extends least
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    cell_of = mesh.topology.connectivity(tdim - 1, tdim)
    cells = cell_of.array[cell_of.offsets[facets]]  # the first cell of each
    inside = mesh.geometry.x[compat.geometry_dofmap(mesh)[cells]][:, :, :d].mean(axis=1)
    inward = np.sum((middle - inside) * normals, axis=1)[:, None] < 0.0
    return np.asarray(np.where(inward, -normals, normals))
