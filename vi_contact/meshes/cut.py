"""Make joints and cracks: nodes along an inner boundary are doubled, or those of two bodies welded into one.

Two bodies that may part need nodes of their own on either side. A mesh of one geometry, fragmented along the joint and
conforming there, gets them by `CutOpen`; bodies meshed one by one have them already."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.checks import at
from vi_contact.core.errors import InputError
from vi_contact.meshes.extract import MeshArrays, Source, add_arrays, arrays_of
from vi_contact.meshes.rows import Mask, Rows, cell_sides, connected, number_alike, vertex_count


@dataclass(frozen=True)
class CutOpen:
    """Describe the mesh of `source`, a script or a file, cut open along its inner boundary group."""

    source: Source
    group: str
    inside: str | None = None
    towards: tuple[float, ...] | None = None

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        add_arrays(gmsh, cut_open(arrays_of(self.source), self.group, inside=self.inside, towards=self.towards))


@dataclass(frozen=True)
class Welded:
    """Describe the mesh of `source` with the coinciding nodes of two boundary groups made one."""

    source: Source
    first: str
    second: str

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        add_arrays(gmsh, welded(arrays_of(self.source), self.first, self.second))


def cut_open(arrays: MeshArrays, group: str, *, inside: str | None = None,
             towards: Sequence[float] | None = None) -> MeshArrays:
    """Double the nodes along an inner boundary; its two sides become the groups "<group>_1", "<group>_2".

    Side 1 is that of the cell group `inside`, or the one from which the vector `towards` leads across the boundary:
    give one of them. Cells around a node of the boundary keep a common node as long as they hang together through
    other facets: a crack that ends inside a body stays closed at its tip, and boundaries cut one after the other may
    meet and cross. InputError for a group that does not exist or lies on the outside, or sides that cannot be told."""
    facets = _group(arrays, group)
    if (inside is None) == (towards is None):
        raise InputError(f"cut of '{group}': give its first side, either by inside=a cell group or by towards=a vector")
    sides, owner = cell_sides(arrays.cells, arrays.cell)
    side, *numbers = number_alike(sides, *arrays.facet_groups.values())
    named = dict(zip(arrays.facet_groups, numbers, strict=True))
    wanted = named[group]
    order = np.argsort(side, kind="stable")
    inner = np.flatnonzero(side[order][1:] == side[order][:-1])
    one, other = order[inner], order[inner + 1]  # rows of sides: the two of every inner facet
    cut = np.isin(side[one], wanted)
    if cut.sum() < len(np.unique(wanted)):
        raise InputError(f"boundary group '{group}' has facets without cells on both sides: cut inner boundaries only")
    first = _on_first_side(arrays, group, owner[one[cut]], owner[other[cut]], inside, towards)
    cells, points = _doubled(arrays, np.unique(facets), sides, owner, one[~cut], other[~cut])

    def moved(rows: Rows, number: Rows, at: Rows) -> Rows:
        """Return the facets `rows` of these numbers as the cells beside them know them now; `at`: rows of sides."""
        known, place = np.unique(number, return_index=True)
        before = rows[place[np.searchsorted(known, side[at])]]
        match = arrays.cells[owner[at]][:, None, :] == before[:, :, None]
        return np.asarray(np.take_along_axis(cells[owner[at]], match.argmax(axis=2), axis=1))

    groups = {}
    for name, rows in arrays.facet_groups.items():
        found = moved(rows, named[name], np.flatnonzero(np.isin(side, named[name])))
        groups[name] = found[np.sort(np.unique(number_alike(found)[0], return_index=True)[1])]
    del groups[group]
    near, far = np.where(first, one[cut], other[cut]), np.where(first, other[cut], one[cut])
    groups |= {f"{group}_1": moved(facets, wanted, near), f"{group}_2": moved(facets, wanted, far)}
    return replace(arrays, points=points, cells=cells, facet_groups=groups)


def welded(arrays: MeshArrays, first: str, second: str) -> MeshArrays:
    """Replace every node of the group `second` by the node of `first` at its place.

    Both groups remain, as the same inner boundary. InputError for nodes of `second` without a partner (1e-9 of size).
    """
    one, two = (np.unique(_group(arrays, name)) for name in (first, second))
    size = float(np.ptp(arrays.points, axis=0).max())
    from scipy.spatial import cKDTree  # late: it takes a while

    distance, nearest = cKDTree(arrays.points[one]).query(arrays.points[two])
    if distance.max(initial=0.0) > 1e-9 * size:
        where = at(arrays.points[two[np.argmax(distance)]])
        raise InputError(f"group '{second}' has a node at {where}, {distance.max():.3g} m away from every node of "
                         f"'{first}': weld only sides that are divided alike")
    target = np.arange(len(arrays.points))
    target[two] = one[nearest]
    kept, number = np.unique(target, return_inverse=True)
    groups = {name: number[rows] for name, rows in arrays.facet_groups.items()}
    return replace(arrays, points=arrays.points[kept], cells=number[arrays.cells], facet_groups=groups)


def _group(arrays: MeshArrays, name: str) -> Rows:
    if arrays.cells.shape[1] > vertex_count(arrays.cell):
        raise InputError("a mesh of second order cannot be cut or welded: mesh it with Mesh.ElementOrder = 1")
    if name not in arrays.facet_groups:
        has = ", ".join(arrays.facet_groups) or "none"
        raise InputError(f"mesh has no boundary group '{name}'; it has {has}: name it in Gmsh as a physical group")
    return arrays.facet_groups[name]


def _on_first_side(arrays: MeshArrays, group: str, one: Rows, other: Rows, inside: str | None,
                   towards: Sequence[float] | None) -> Mask:
    """Tell for every cut facet whether the first of its two cells is on side 1."""
    if inside is not None:
        if inside not in arrays.cell_groups:
            raise InputError(f"mesh has no cell group '{inside}'; it has {', '.join(arrays.cell_groups)}")
        mask = arrays.cell_groups[inside]
        if np.any(mask[one] == mask[other]):
            raise InputError(f"cell group '{inside}' is not on one side of '{group}' only: give towards=vector instead")
        return np.asarray(mask[one])
    way = np.asarray(towards, dtype=float)
    centres = arrays.points[arrays.cells].mean(axis=1)
    across = centres[other] - centres[one]
    ahead = across @ way
    if np.any(np.abs(ahead) <= 1e-9 * np.linalg.norm(across, axis=1) * np.linalg.norm(way)):
        given = tuple(float(x) for x in way)
        raise InputError(f"towards={given} runs along '{group}' somewhere: give inside=a cell group instead")
    return np.asarray(ahead > 0.0)


def _doubled(arrays: MeshArrays, nodes: Rows, sides: Rows, owner: Rows, one: Rows, other: Rows) -> tuple[Rows, Array]:
    """Give each node a copy for every part of its cells that facets (rows `one`, `other`) connect: (cells, points)."""
    n = len(arrays.points)
    around, column = np.nonzero(np.isin(arrays.cells, nodes))
    node = arrays.cells[around, column]
    key = around * n + node  # ascending within a cell's row only
    order = np.argsort(key)

    def place(rows: Rows) -> Rows:
        """Return the places among `key` of the vertices of sides that are nodes of the cut."""
        vertices = sides[rows]
        return order[np.searchsorted(key[order], (owner[rows][:, None] * n + vertices)[np.isin(vertices, nodes)])]

    links = place(one), place(other)
    part = connected(len(key), *links)
    _, first = np.unique(node, return_index=True)
    keeps = np.isin(part, part[first])  # the part of the first cell around a node keeps it
    _, number = np.unique(node[~keeps] * len(key) + part[~keeps], return_inverse=True)  # new nodes in order of the old
    cells = arrays.cells.copy()
    cells[around[~keeps], column[~keeps]] = n + number
    origin = np.zeros(int(number.max(initial=-1)) + 1, dtype=np.int64)
    origin[number] = node[~keeps]
    return cells, np.concatenate([arrays.points, arrays.points[origin]])
