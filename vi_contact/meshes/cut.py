"""Make joints and cracks.

Nodes along an inner boundary are doubled, or those of two bodies welded into one.

Two bodies that may part need nodes of their own on either side. A mesh of one geometry, fragmented
along the joint and conforming there, gets them by `CutOpen`; bodies meshed one by one have them
already.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.checks import at, shown
from vi_contact.core.errors import InputError
from vi_contact.meshes.extract import MeshArrays, Source, add_arrays, arrays_of
from vi_contact.meshes.rows import Mask, Rows, cell_sides, connected, number_alike, vertex_count


@dataclass(frozen=True)
class CutOpen:
    """Describe the mesh of `source`, cut open.

    The source is a script or a file. It is cut along its inner boundary group, or between two
    groups of cells, which need no boundary group then: their joint is called "<first>_<second>",
    side 1 is the first's.
    """

    source: Source
    group: str | None = None
    inside: str | None = None
    towards: tuple[float, ...] | None = None
    between: tuple[str, str] | None = None

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        arrays = arrays_of(self.source)
        cut = cut_open(
            arrays, self.group, inside=self.inside, towards=self.towards, between=self.between
        )
        add_arrays(gmsh, cut)


@dataclass(frozen=True)
class Welded:
    """Describe the mesh of `source` with the coinciding nodes of two boundary groups made one."""

    source: Source
    first: str
    second: str

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        add_arrays(gmsh, welded(arrays_of(self.source), self.first, self.second))


def cut_open(
    arrays: MeshArrays,
    group: str | None = None,
    *,
    inside: str | None = None,
    towards: Sequence[float] | None = None,
    between: Sequence[str] | None = None,
) -> MeshArrays:
    """Double the nodes along an inner boundary.

    Its two sides become the groups "<group>_1", "<group>_2".

    Side 1 is that of the cell group `inside`, or the one from which the vector `towards` leads
    across the boundary: give one of them. With `between`, two groups of cells, the boundary is all
    that lies between them, `group` is "<first>_<second>" and side 1 that of the first.

    Cells around a node of the boundary keep a common node as long as they hang together through
    other facets: a crack that ends inside a body stays closed at its tip, and boundaries cut one
    after the other may meet and cross. Where they cross, every arm needs a group of its own, cut
    `towards` in turn, so that round the crossing every node is on side 1 of both its pairs, or on
    side 2 of both.

    InputError for a group that does not exist or lies on the outside, sides that cannot be told,
    cell groups without a common facet, and names of sides that the mesh has already.
    """
    if (group is None) == (between is None):
        raise InputError(
            "CutOpen: give group=, the name of an inner boundary, or between=, two groups of cells"
        )
    if between is not None:
        arrays, group, inside = _joint(arrays, between, inside, towards)
    assert group is not None
    facets = _group(arrays, group)
    for name in (f"{group}_1", f"{group}_2"):
        if name in arrays.facet_groups or name in arrays.cell_groups:
            raise InputError(
                f"cut of '{group}': the mesh has a group '{name}' already, the name of a side of "
                "the cut: give one of them another name"
            )
    if (inside is None) == (towards is None):
        raise InputError(
            f"cut of '{group}': give its first side, either by inside=a cell group or by towards=a "
            "vector"
        )
    sides, owner = cell_sides(arrays.cells, arrays.cell)
    side, *numbers = number_alike(sides, *arrays.facet_groups.values())
    named = dict(zip(arrays.facet_groups, numbers, strict=True))
    wanted = named[group]
    order = np.argsort(side, kind="stable")
    inner = np.flatnonzero(side[order][1:] == side[order][:-1])
    one, other = order[inner], order[inner + 1]  # rows of sides: the two of every inner facet
    cut = np.isin(side[one], wanted)
    if cut.sum() < len(np.unique(wanted)):
        raise InputError(
            f"boundary group '{group}' has facets without cells on both sides: cut inner "
            "boundaries only"
        )
    first = _on_first_side(arrays, group, owner[one[cut]], owner[other[cut]], inside, towards)
    cells, points = _doubled(arrays, np.unique(facets), sides, owner, one[~cut], other[~cut])

    def moved(rows: Rows, number: Rows, at: Rows) -> Rows:
        """Return the facets `rows` as the cells beside them know them now.

        The rows are those of these numbers; `at` are rows of sides.
        """
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

    Both groups remain, as the same inner boundary. InputError for nodes of `second` without a
    partner (1e-9 of size).
    """
    one, two = (np.unique(_group(arrays, name)) for name in (first, second))
    size = float(np.ptp(arrays.points, axis=0).max())
    from scipy.spatial import cKDTree  # late: it takes a while

    distance, nearest = cKDTree(arrays.points[one]).query(arrays.points[two])
    there = cKDTree(arrays.points[one]).query_ball_point(
        arrays.points[two], 1e-9 * size, return_length=True
    )
    for node in two[there > 1][:1]:
        raise InputError(
            f"group '{first}' has several nodes at {at(arrays.points[node])}, of bodies that meet "
            f"there, and '{second}' can be welded to one only: weld these bodies first, or give "
            f"'{second}' first"
        )
    if distance.max(initial=0.0) > 1e-9 * size:
        where = at(arrays.points[two[np.argmax(distance)]])
        raise InputError(
            f"group '{second}' has a node at {where}, {distance.max():.3g} m away from every node "
            f"of '{first}': weld only sides that are divided alike"
        )
    target = np.arange(len(arrays.points))
    target[two] = one[nearest]
    kept, number = np.unique(target, return_inverse=True)
    groups = {name: number[rows] for name, rows in arrays.facet_groups.items()}
    return replace(
        arrays, points=arrays.points[kept], cells=number[arrays.cells], facet_groups=groups
    )


def _group(arrays: MeshArrays, name: str) -> Rows:
    if arrays.cells.shape[1] > vertex_count(arrays.cell):
        raise InputError(
            "a mesh of second order cannot be cut or welded: mesh it with Mesh.ElementOrder = 1"
        )
    if name not in arrays.facet_groups:
        has = ", ".join(arrays.facet_groups) or "none"
        raise InputError(
            f"mesh has no boundary group '{name}'; it has {has}: name it in Gmsh as a physical "
            "group"
        )
    return arrays.facet_groups[name]


def _joint(
    arrays: MeshArrays, between: Sequence[str], inside: str | None, towards: Sequence[float] | None
) -> tuple[MeshArrays, str, str]:
    """Return (the mesh with a boundary group of all facets, its name, the group of side 1).

    The facets are those between two cell groups.
    """
    names = tuple(between) if not isinstance(between, str) else ()
    if len(names) != 2 or names[0] == names[1]:
        raise InputError(
            f"CutOpen: between is {shown(between)}; give the names of two groups of cells"
        )
    if inside is not None or towards is not None:
        raise InputError(
            f"CutOpen: between={names} has its first side in '{names[0]}': leave out inside and "
            "towards"
        )
    for name in names:
        if name not in arrays.cell_groups:
            raise InputError(
                f"mesh has no cell group '{name}'; it has {', '.join(arrays.cell_groups)}"
            )
    first, second = (arrays.cell_groups[name] for name in names)
    if np.any(first & second):
        raise InputError(
            f"cell groups '{names[0]}' and '{names[1]}' have common cells, so that nothing lies "
            "between them: give groups without common cells"
        )
    joint = "_".join(names)
    if joint in arrays.facet_groups or joint in arrays.cell_groups:
        raise InputError(
            f"CutOpen: the mesh has a group '{joint}' already: give it as group=, or another name"
        )
    sides, owner = cell_sides(arrays.cells[:, : vertex_count(arrays.cell)], arrays.cell)
    (number,) = number_alike(sides)
    order = np.argsort(number, kind="stable")
    inner = np.flatnonzero(np.diff(number[order]) == 0)
    one, other = order[inner], order[inner + 1]
    across = (first[owner[one]] & second[owner[other]]) | (second[owner[one]] & first[owner[other]])
    if not across.any():
        raise InputError(
            f"cell groups '{names[0]}' and '{names[1]}' have no common facet, so that there is "
            "nothing to cut: bodies with nodes of their own touch by their boundaries, "
            "contact_pair(…)"
        )
    return (
        replace(arrays, facet_groups=arrays.facet_groups | {joint: sides[one[across]]}),
        joint,
        names[0],
    )


def _on_first_side(
    arrays: MeshArrays,
    group: str,
    one: Rows,
    other: Rows,
    inside: str | None,
    towards: Sequence[float] | None,
) -> Mask:
    """Tell for every cut facet whether the first of its two cells is on side 1."""
    if inside is not None:
        if inside not in arrays.cell_groups:
            raise InputError(
                f"mesh has no cell group '{inside}'; it has {', '.join(arrays.cell_groups)}"
            )
        mask = arrays.cell_groups[inside]
        if np.any(mask[one] == mask[other]):
            raise InputError(
                f"cell group '{inside}' is not on one side of '{group}' only: give towards=vector "
                "instead"
            )
        return np.asarray(mask[one])
    way = np.asarray(towards, dtype=float)
    centres = arrays.points[arrays.cells].mean(axis=1)
    across = centres[other] - centres[one]
    ahead = across @ way
    if np.any(np.abs(ahead) <= 1e-9 * np.linalg.norm(across, axis=1) * np.linalg.norm(way)):
        given = tuple(float(x) for x in way)
        raise InputError(
            f"towards={given} runs along '{group}' somewhere: give inside=a cell group instead"
        )
    return np.asarray(ahead > 0.0)


def _doubled(
    arrays: MeshArrays, nodes: Rows, sides: Rows, owner: Rows, one: Rows, other: Rows
) -> tuple[Rows, Array]:
    """Give each node a copy for every part of its cells that facets connect.

    The facets are the rows `one` and `other`; the result is (cells, points).
    """
    n = len(arrays.points)
    around, column = np.nonzero(np.isin(arrays.cells, nodes))
    node = arrays.cells[around, column]
    key = around * n + node  # ascending within a cell's row only
    order = np.argsort(key)

    def place(rows: Rows) -> Rows:
        """Return the places among `key` of the vertices of sides that are nodes of the cut."""
        vertices = sides[rows]
        return order[
            np.searchsorted(
                key[order], (owner[rows][:, None] * n + vertices)[np.isin(vertices, nodes)]
            )
        ]

    links = place(one), place(other)
    part = connected(len(key), *links)
    _, first = np.unique(node, return_index=True)
    keeps = np.isin(part, part[first])  # the part of the first cell around a node keeps it
    # new nodes in order of the old
    _, number = np.unique(node[~keeps] * len(key) + part[~keeps], return_inverse=True)
    cells = arrays.cells.copy()
    cells[around[~keeps], column[~keeps]] = n + number
    origin = np.zeros(int(number.max(initial=-1)) + 1, dtype=np.int64)
    origin[number] = node[~keeps]
    return cells, np.concatenate([arrays.points, arrays.points[origin]])
