"""Make joints and cracks: double the nodes along an inner boundary, or weld those of two bodies.

Two bodies that may part need nodes of their own on either side. A mesh of one geometry, fragmented
along the joint and conforming there, gets them by `CutOpen`; bodies meshed one by one have them
already.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.checks import describe_point, quote
from vi_contact.core.errors import InputError
from vi_contact.meshes.extract import MeshArrays, Source, add_arrays, arrays_of
from vi_contact.meshes.rows import Mask, Rows, cell_sides, number_alike, number_parts, vertex_count


@dataclass(frozen=True)
class CutOpen:
    """Describe the mesh of a script or of a file, cut open along an inner boundary.

    Attributes:
        source: the mesh.
        group: inner boundary group along which it is cut.
        inside: group of cells on side 1 of the cut.
        towards: vector that leads from side 1 to side 2, in the place of ``inside``.
        between: two groups of cells, in the place of a group. Their joint is called
            "<first>_<second>", and side 1 is the first's.
    """

    source: Source
    group: str | None = None
    inside: str | None = None
    towards: tuple[float, ...] | None = None
    between: tuple[str, str] | None = None

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        cut = cut_open(
            arrays_of(self.source),
            self.group,
            inside=self.inside,
            towards=self.towards,
            between=self.between,
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
        add_arrays(gmsh, weld(arrays_of(self.source), self.first, self.second))


def cut_open(
    arrays: MeshArrays,
    group: str | None = None,
    *,
    inside: str | None = None,
    towards: Sequence[float] | None = None,
    between: Sequence[str] | None = None,
) -> MeshArrays:
    """Double the nodes along an inner boundary.

    Its two sides become the groups "<group>_1" and "<group>_2".

    Cells around a node of the boundary keep a common node as long as they hang together through
    other facets: a crack that ends inside a body stays closed at its tip, and boundaries cut one
    after the other may meet and cross. Where they cross, every arm needs a group of its own, cut
    `towards` in turn, so that round the crossing every node is on side 1 of both its pairs, or on
    side 2 of both.

    Args:
        arrays: the mesh.
        group: the inner boundary.
        inside: the group of cells on side 1.
        towards: the vector that leads from side 1 across the boundary. Give it or ``inside``.
        between: two groups of cells, in the place of ``group``, ``inside`` and ``towards``. The
            boundary is all that lies between them, its name "<first>_<second>", and side 1 that of
            the first.

    Returns:
        The mesh with both sides in the place of the boundary group.

    Raises:
        InputError: a group that does not exist or lies on the outside; sides that cannot be told;
            cell groups without a common facet; names of sides that the mesh has already.
    """
    if (group is None) == (between is None):
        raise InputError(
            "CutOpen: give group=, the name of an inner boundary, or between=, two groups of cells"
        )
    if between is not None:
        arrays, group, inside = _make_joint(arrays, between, inside, towards)
    assert group is not None
    facets = _get_facets(arrays, group)
    _refuse_unclear_sides(arrays, group, inside, towards)

    # Sides of cells, with equal numbers for the same facet; every inner facet has two of them.
    sides, owner = cell_sides(arrays.cells, arrays.cell)
    side, *numbers = number_alike(sides, *arrays.facet_groups.values())
    numbers_of_group = dict(zip(arrays.facet_groups, numbers, strict=True))
    boundary = numbers_of_group[group]
    first_twin, second_twin = find_twins(side)
    cut = np.isin(side[first_twin], boundary)
    if cut.sum() < len(np.unique(boundary)):
        raise InputError(
            f"boundary group '{group}' has facets without cells on both sides: cut inner "
            "boundaries only"
        )
    is_first = _tell_first_side(
        arrays, group, owner[first_twin[cut]], owner[second_twin[cut]], inside, towards
    )
    cells, points = double_nodes(
        arrays, np.unique(facets), sides, owner, first_twin[~cut], second_twin[~cut]
    )

    # All other groups keep their facets, each once or, where a cut has parted it, twice.
    beside = Beside(arrays.cells, cells, owner, side)
    groups = {}
    for name, rows in arrays.facet_groups.items():
        if name != group:
            groups[name] = beside.renew_group(rows, numbers_of_group[name])

    # The cut boundary becomes two groups, of the cells on either side.
    side_1 = np.where(is_first, first_twin[cut], second_twin[cut])
    side_2 = np.where(is_first, second_twin[cut], first_twin[cut])
    groups[f"{group}_1"] = beside.renew(facets, boundary, side_1)
    groups[f"{group}_2"] = beside.renew(facets, boundary, side_2)
    return replace(arrays, points=points, cells=cells, facet_groups=groups)


@dataclass(frozen=True, eq=False)
class Beside:
    """Know the cells beside the sides of cells, before and after nodes were doubled.

    Attributes:
        before: (n_cells, n_vertices), the cells as they were.
        after: (n_cells, n_vertices), as they are now.
        owner: (n_sides,), the cell of each side.
        side: (n_sides,), the number of each side, equal for the two of one facet.
    """

    before: Rows
    after: Rows
    owner: Rows
    side: Rows

    def renew(self, rows: Rows, number: Rows, on: Rows) -> Rows:
        """Return facets as the cells beside them know them now.

        Args:
            rows: the facets of a group, as it was.
            number: their numbers.
            on: sides of cells on which the facets are wanted.
        """
        known, place = np.unique(number, return_index=True)
        facets = rows[place[np.searchsorted(known, self.side[on])]]
        match = self.before[self.owner[on]][:, None, :] == facets[:, :, None]
        return np.asarray(
            np.take_along_axis(self.after[self.owner[on]], match.argmax(axis=2), axis=1)
        )

    def renew_group(self, rows: Rows, number: Rows) -> Rows:
        """Return the facets of a group, each once or, where a cut has parted it, twice.

        Args:
            rows: the facets, as they were.
            number: their numbers.
        """
        renewed = self.renew(rows, number, np.flatnonzero(np.isin(self.side, number)))
        (alike,) = number_alike(renewed)
        _, first_of_each = np.unique(alike, return_index=True)
        return renewed[np.sort(first_of_each)]


def _refuse_unclear_sides(
    arrays: MeshArrays, group: str, inside: str | None, towards: Sequence[float] | None
) -> None:
    """Raise InputError unless the names of both sides are free, and it is said which is the first.

    Args:
        arrays: the mesh.
        group: name of the boundary.
        inside: the group of cells on side 1, or None.
        towards: the vector from side 1 to side 2, or None.
    """
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


def find_twins(number: Rows) -> tuple[Rows, Rows]:
    """Return the places of equal numbers, of which no more than two are alike."""
    order = np.argsort(number, kind="stable")
    inner = np.flatnonzero(np.diff(number[order]) == 0)
    return order[inner], order[inner + 1]


def weld(arrays: MeshArrays, first: str, second: str) -> MeshArrays:
    """Replace every node of the group `second` by the node of `first` at its place.

    Both groups remain, as the same inner boundary.

    Args:
        arrays: the mesh.
        first: boundary group whose nodes stay.
        second: boundary group whose nodes are replaced.

    Raises:
        InputError: nodes of `second` without a partner within 1e-9 of the size, or with several.
    """
    from scipy.spatial import cKDTree  # late: it takes a while

    staying = np.unique(_get_facets(arrays, first))
    replaced = np.unique(_get_facets(arrays, second))
    size = float(np.ptp(arrays.points, axis=0).max())
    tree = cKDTree(arrays.points[staying])
    distance, nearest = tree.query(arrays.points[replaced])
    partners = tree.query_ball_point(arrays.points[replaced], 1e-9 * size, return_length=True)
    several = replaced[partners > 1]
    if len(several):
        raise InputError(
            f"group '{first}' has several nodes at {describe_point(arrays.points[several[0]])}, of "
            f"bodies that meet there, and '{second}' can be welded to one only: weld these bodies "
            f"first, or give '{second}' first"
        )
    if distance.max(initial=0.0) > 1e-9 * size:
        where = describe_point(arrays.points[replaced[np.argmax(distance)]])
        raise InputError(
            f"group '{second}' has a node at {where}, {distance.max():.3g} m away from every node "
            f"of '{first}': weld only sides that are divided alike"
        )
    target = np.arange(len(arrays.points))
    target[replaced] = staying[nearest]
    remaining, number = np.unique(target, return_inverse=True)
    groups = {name: number[rows] for name, rows in arrays.facet_groups.items()}
    points = arrays.points[remaining]
    return replace(arrays, points=points, cells=number[arrays.cells], facet_groups=groups)


def _get_facets(arrays: MeshArrays, name: str) -> Rows:
    """Return the facets of a boundary group, or raise InputError if there is none."""
    if arrays.cells.shape[1] > vertex_count(arrays.cell):
        raise InputError(
            "a mesh of second order cannot be cut or welded: mesh it with Mesh.ElementOrder = 1"
        )
    if name not in arrays.facet_groups:
        names = ", ".join(arrays.facet_groups) or "none"
        raise InputError(
            f"mesh has no boundary group '{name}'; it has {names}: name it in Gmsh as a physical "
            "group"
        )
    return arrays.facet_groups[name]


def _make_joint(
    arrays: MeshArrays, between: Sequence[str], inside: str | None, towards: Sequence[float] | None
) -> tuple[MeshArrays, str, str]:
    """Make a boundary group of all facets between two cell groups.

    Args:
        arrays: the mesh.
        between: names of the two groups of cells, side 1 first.
        inside: has to be None.
        towards: has to be None.

    Returns:
        The mesh with this group, the name of the group, the cell group on side 1.
    """
    names = tuple(between) if not isinstance(between, str) else ()
    if len(names) != 2 or names[0] == names[1]:
        raise InputError(
            f"CutOpen: between is {quote(between)}; give the names of two groups of cells"
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
    first_twin, second_twin = find_twins(number)
    forward = first[owner[first_twin]] & second[owner[second_twin]]
    backward = second[owner[first_twin]] & first[owner[second_twin]]
    across = forward | backward
    if not across.any():
        raise InputError(
            f"cell groups '{names[0]}' and '{names[1]}' have no common facet, so that there is "
            "nothing to cut: bodies with nodes of their own touch by their boundaries, "
            "contact_pair(…)"
        )
    groups = arrays.facet_groups | {joint: sides[first_twin[across]]}
    return replace(arrays, facet_groups=groups), joint, names[0]


def _tell_first_side(
    arrays: MeshArrays,
    group: str,
    first_cell: Rows,
    second_cell: Rows,
    inside: str | None,
    towards: Sequence[float] | None,
) -> Mask:
    """Tell for every cut facet whether the first of its two cells is on side 1.

    Args:
        arrays: the mesh.
        group: name of the boundary.
        first_cell: (n,), one cell of every cut facet.
        second_cell: (n,), its other cell.
        inside: the group of cells on side 1.
        towards: the vector from side 1 to side 2; it is read where ``inside`` is None.
    """
    if inside is not None:
        if inside not in arrays.cell_groups:
            raise InputError(
                f"mesh has no cell group '{inside}'; it has {', '.join(arrays.cell_groups)}"
            )
        mask = arrays.cell_groups[inside]
        if np.any(mask[first_cell] == mask[second_cell]):
            raise InputError(
                f"cell group '{inside}' is not on one side of '{group}' only: give towards=vector "
                "instead"
            )
        return np.asarray(mask[first_cell])
    way = np.asarray(towards, dtype=float)
    centres = arrays.points[arrays.cells].mean(axis=1)
    across = centres[second_cell] - centres[first_cell]
    ahead = across @ way
    if np.any(np.abs(ahead) <= 1e-9 * np.linalg.norm(across, axis=1) * np.linalg.norm(way)):
        vector = tuple(float(x) for x in way)
        raise InputError(
            f"towards={vector} runs along '{group}' somewhere: give inside=a cell group instead"
        )
    return np.asarray(ahead > 0.0)


def double_nodes(
    arrays: MeshArrays, nodes: Rows, sides: Rows, owner: Rows, first: Rows, second: Rows
) -> tuple[Rows, Array]:
    """Give each node a copy for every part of its cells that facets connect.

    Args:
        arrays: the mesh.
        nodes: (m,), nodes of the cut.
        sides: vertices of all sides of cells.
        owner: the cells of these sides.
        first: sides, as rows of ``sides``, that hang together with those of ``second``.
        second: the same number of sides.

    Returns:
        The cells and the points with the copies.
    """
    # One entry for every node of the cut in every cell around it, known by the key of both.
    n = len(arrays.points)
    around, column = np.nonzero(np.isin(arrays.cells, nodes))
    node = arrays.cells[around, column]
    key = around * n + node  # ascending within a cell's row only
    order = np.argsort(key)

    def entries_on(rows: Rows) -> Rows:
        """Return the entries of the vertices of some sides that are nodes of the cut."""
        vertices = sides[rows]
        keys = owner[rows][:, None] * n + vertices
        keys_of_cut = keys[np.isin(vertices, nodes)]
        return order[np.searchsorted(key[order], keys_of_cut)]

    # Entries hang together across facets that are not cut. The part of the first cell around a node
    # keeps the node; all others get new ones, in the order of the old.
    part = number_parts(len(key), entries_on(first), entries_on(second))
    _, first_entry = np.unique(node, return_index=True)
    keeps = np.isin(part, part[first_entry])
    _, number = np.unique(node[~keeps] * len(key) + part[~keeps], return_inverse=True)
    cells = arrays.cells.copy()
    cells[around[~keeps], column[~keeps]] = n + number
    origin = np.zeros(int(number.max(initial=-1)) + 1, dtype=np.int64)
    origin[number] = node[~keeps]
    return cells, np.concatenate([arrays.points, arrays.points[origin]])
