"""Measure the cells of a model, and gather the lines that draw it, before it runs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array
from .. import compat
from ..body.absent import find_present
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
    """Return where facets are, how large they are, and the cells beside them.

    Args:
        mesh: the mesh.
        facets: local facets; those whose cell this rank does not own are left out.

    Returns:
        (k, d) their middles [m], (k,) mean distances of their corners [m], (k,) local cells.
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
    """Return the lines that draw a body, the same on any number of ranks. Collective.

    What is absent is not drawn.

    In the plane these are the facets of the boundary and of its groups, and the borders of each
    region; in space and on a line the edges of a box round each region.

    Args:
        space: the body's unknowns.
        tags: groups by name.
        regions: local cells of each region.

    Returns:
        on rank 0 a group with the lines [x0, y0, x1, y1] [m] (in space six numbers, on a line two)
        for each: "" for the boundary, borders and boxes, else the name of the group. Borders and
        boxes have the number of their region too.
    """
    if space.dimension != 2:
        boxes = [_draw_box(space, cells) for cells in regions]
        return [_describe_region(number, lines) for number, lines in enumerate(boxes)]
    mesh = space.mesh
    boundary = Facets.where("", mesh, lambda x: np.ones(x.shape[1], dtype=bool))
    groups = [boundary, *(group for group in tags.values() if isinstance(group, Facets))]
    drawn = []
    for group in groups:
        # each facet is drawn by its owner, with the end of least coordinates first
        present = group.indices[find_present(mesh, space.absent, group)]
        own = present[present < mesh.topology.index_map(1).size_local]
        corners = mesh.geometry.x[compat.entities_to_geometry(mesh, 1, own)][..., :2].tolist()
        lines = []
        for ends in corners:
            first, second = sorted(ends)
            lines.append([*first, *second])
        parts = mesh.comm.gather(lines) or []
        drawn.append({"group": group.name, "lines": sorted(sum(parts, []))})
    for number, cells in enumerate(regions):
        drawn.append(_describe_region(number, _draw_border(mesh, cells)))
    return drawn


def _describe_region(number: int, lines: list[list[float]]) -> dict[str, Any]:
    """Return the lines round the region of this number, as ``outline`` does."""
    return {"group": "", "region": number, "lines": lines}


def _draw_border(mesh: Any, cells: Indices) -> list[list[float]]:
    """Return the lines around local cells of all ranks in the plane, on rank 0. Collective.

    A facet between two of the cells is theirs twice, one on the border once.
    """
    owned = cells[cells < mesh.topology.index_map(2).size_local]
    mesh.topology.create_connectivity(2, 1)
    facets_of = mesh.topology.connectivity(2, 1)
    own = [facets_of.links(cell) for cell in owned]
    facets = np.concatenate(own) if own else np.zeros(0, dtype=np.int32)
    ends = mesh.geometry.x[compat.entities_to_geometry(mesh, 1, facets)][..., :2]

    # The end of least coordinates first, so that both cells tell the same of a facet.
    x = ends[..., 0]
    y = ends[..., 1]
    turned = (x[:, 0] > x[:, 1]) | ((x[:, 0] == x[:, 1]) & (y[:, 0] > y[:, 1]))
    ends[turned] = ends[turned, ::-1]
    parts = mesh.comm.gather(ends.reshape(-1, 4))
    if parts is None:
        return []
    lines, counts = np.unique(np.concatenate(parts), axis=0, return_counts=True)
    return list(lines[counts == 1].tolist())


def _draw_box(space: FemSpace, cells: Indices) -> list[list[float]]:
    """Return the edges of the box round local cells of all ranks, as ``outline`` does. Collective.

    Corner i of the box has the upper end of axis c where bit c of i is set, and an edge goes from a
    corner to another one with one bit more.
    """
    d = space.dimension
    mesh = space.mesh
    points = mesh.geometry.x[compat.geometry_dofmap(mesh)[cells]].reshape(-1, 3)
    low = -space.comm.max(np.max(-points, axis=0, initial=-np.inf))
    high = space.comm.max(np.max(points, axis=0, initial=-np.inf))
    corners = []
    for i in range(2**d):
        corners.append([(high if i >> c & 1 else low)[c] for c in range(d)])
    lines = []
    for i in range(2**d):
        for c in range(d):
            if not i >> c & 1:
                lines.append([*corners[i], *corners[i | 1 << c]])
    return lines
