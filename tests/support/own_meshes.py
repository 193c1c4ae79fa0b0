"""Meshes as a user of DOLFINx makes them, of all five kinds of cells and with any ghosts."""

from __future__ import annotations

from typing import Any

import dolfinx.mesh
import numpy as np
from dolfinx.mesh import CellType, GhostMode, meshtags

OWN = {
    "interval": ((2.0,), (6,)),
    "triangle": ((2.0, 1.5), (5, 4)),
    "quadrilateral": ((2.0, 1.5), (5, 4)),
    "tetrahedron": ((2.0, 1.5, 1.2), (3, 2, 3)),
    "hexahedron": ((2.0, 1.5, 1.2), (3, 2, 3)),
}


def own_mesh(comm: Any, cell: str, ghosts: str = "shared_facet", times: int = 1) -> Any:
    """A block with a corner at the origin, made by DOLFINx; ``times`` as many cells along each
    edge."""
    lengths, divisions = OWN[cell]
    mode, counts = getattr(GhostMode, ghosts), [times * n for n in divisions]
    if cell == "interval":
        return dolfinx.mesh.create_interval(comm, counts[0], [0.0, lengths[0]], ghost_mode=mode)
    create = dolfinx.mesh.create_rectangle if len(lengths) == 2 else dolfinx.mesh.create_box
    corners = [np.zeros(len(lengths)), np.array(lengths)]
    return create(comm, corners, counts, getattr(CellType, cell), ghost_mode=mode)


def at(axis: int, value: float) -> Any:
    """A marker of the points of a plane."""
    return lambda x: np.isclose(x[axis], value)


def tags_where(mesh: Any, dim: int, **values: Any) -> Any:
    """MeshTags with the value 7 where the first marker holds, 8 where the second does, and so
    on."""
    mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    found = [dolfinx.mesh.locate_entities(mesh, dim, marker) for marker in values.values()]
    numbers, first = np.unique(np.concatenate(found), return_index=True)
    tags = np.concatenate(
        [np.full(len(one), 7 + k, dtype=np.int32) for k, one in enumerate(found)]
    )[first]
    return meshtags(mesh, dim, numbers.astype(np.int32), tags)
