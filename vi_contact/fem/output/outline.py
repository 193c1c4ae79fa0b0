"""Measure the cells of a model, and gather the lines that draw it, before it runs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array
from .. import compat
from ..body.space import FemSpace
from ..compat import Indices
from ..mesh.tagged_mesh import Facets


def cell_volumes(mesh: Any) -> Array:
    """Return the volumes of the owned cells [m³], in the plane areas [m²]. Collective."""
    cell = ufl.TestFunction(compat.cell_space(mesh))
    form = compat.compile_form(cell * ufl.dx(metadata={"quadrature_degree": 2}))
    return np.array(compat.assemble_vector(form).array_r)


def longest_edge(mesh: Any, cells: Indices) -> float:
    """Return the longest edge of some local cells of this rank [m], 0 for none."""
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[cells]]
    ends = np.transpose(compat.sub_entities(mesh, 1))
    return float(
        np.max(np.linalg.norm(corners[:, ends[0]] - corners[:, ends[1]], axis=2), initial=0.0)
    )


def facets_with_cells(mesh: Any, facets: Indices) -> tuple[Array, Array, Indices]:
    """Return middles (k, d), mean distances of their corners (k,) [m] and cells (k,) of facets.

    They are those local facets whose cell this rank owns.
    """
    tdim = mesh.topology.dim
    cell_of = mesh.topology.connectivity(tdim - 1, tdim)
    cells = cell_of.array[cell_of.offsets[:-1][facets]]
    own = cells < mesh.topology.index_map(tdim).size_local
    corners = mesh.geometry.x[compat.entities_to_geometry(mesh, tdim - 1, facets[own])][
        ..., : mesh.geometry.dim
    ]
    v = corners.shape[1]
    apart = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).sum(axis=(1, 2))
    return corners.mean(axis=1), apart / max(v * (v - 1), 1), cells[own]


def outline(
    space: FemSpace, tags: Mapping[str, Any], regions: Sequence[Indices]
) -> list[dict[str, Any]]:
    """Return on rank 0 the lines (x0, y0, x1, y1) [m] of the boundary and its groups. Collective.

    They are those of the boundary, group "", and of each group of it; in space and on a line the
    edges of a box around each region of local cells. The same on any ranks.

    Args:
        space: the body's unknowns.
        tags: groups by name.
        regions: local cells of each region.
    """
    mesh = space.mesh
    d = space.dimension
    if d != 2:
        edges = [(i, i | 1 << c) for i in range(2**d) for c in range(d) if not i >> c & 1]
        points = [
            mesh.geometry.x[compat.geometry_dofmap(mesh)[cells]].reshape(-1, 3) for cells in regions
        ]
        boxes = [
            [
                -space.comm.max(np.max(-one, axis=0, initial=-np.inf)),
                space.comm.max(np.max(one, axis=0, initial=-np.inf)),
            ]
            for one in points
        ]
        return [
            {
                "group": "",
                "lines": [[box[i >> c & 1][c] for i in ends for c in range(d)] for ends in edges],
            }
            for box in boxes
        ]
    found = []
    boundary = Facets.where("", mesh, lambda x: np.ones(x.shape[1], dtype=bool))
    for one in (boundary, *(one for one in tags.values() if isinstance(one, Facets))):
        own = one.indices[one.indices < mesh.topology.index_map(1).size_local]
        corners = mesh.geometry.x[compat.entities_to_geometry(mesh, 1, own)][..., :2].tolist()
        parts = (
            mesh.comm.gather([[x for end in sorted(ends) for x in end] for ends in corners]) or []
        )
        found.append({"group": one.name, "lines": sorted(line for part in parts for line in part)})
    return found
