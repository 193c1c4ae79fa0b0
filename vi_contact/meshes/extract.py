"""Turn Gmsh's current model into plain arrays, and arrays into a model.

Nodes are renumbered, groups named, and what solvers choke on is refused.

DOLFINx's own readers fail on node tags that do not start at 1, on facets in two groups and on
missing groups, so nothing of them is used. Vertices stay in Gmsh's order here.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from vi_contact.core.errors import InputError
from vi_contact.meshes.checks import Array, check_cells, check_folds, check_sides, refuse_cells
from vi_contact.meshes.gmsh_session import MeshScript, session
from vi_contact.meshes.grid import Grid
from vi_contact.meshes.mesh_file import safe_copy
from vi_contact.meshes.rows import (
    GMSH_NUMBERS,
    SECOND_ORDER,
    Mask,
    Rows,
    number_alike,
    vertex_count,
)

Source = MeshScript | str | Path
_Elements = dict[int, tuple[Rows, Rows]]
"""Gmsh's number of a type -> node tags (n, n_vertices) of its elements, and their entities (n,)."""


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Hold a mesh without its library.

    Attributes:
        cell: UFL's name of the kind of cells.
        points: (n_points, d) [m].
        cells: (n_cells, n_nodes) rows of points, vertices first.
        cell_groups: masks (n_cells,) by name.
        facet_groups: rows of points (n_facets, n_facet_vertices) by name.
    """

    cell: str
    points: Array
    cells: Rows
    cell_groups: dict[str, Mask]
    facet_groups: dict[str, Rows]


def arrays_from_file(path: str | Path) -> MeshArrays:
    """Read a mesh file in Gmsh's own format, MSH 2 to 4, text or binary.

    Raises InputError like `safe_copy` and `extract`.
    """
    file = Path(path)
    with TemporaryDirectory(prefix="vi_contact-") as folder:
        copy = safe_copy(file, Path(folder))
        with session() as gmsh:
            try:
                gmsh.merge(str(copy))
            except Exception as error:  # the only class Gmsh raises
                fault = str(error).replace(str(copy), file.name)
                raise InputError(f"Gmsh cannot read mesh file {file}: {fault}") from error
            return extract(gmsh, str(file))


def arrays_from_script(mesh: MeshScript) -> MeshArrays:
    """Build a mesh in memory, without Gmsh where it is made of grids.

    Raises InputError like `extract`.
    """
    source = type(mesh).__name__
    grids: Sequence[Grid] = getattr(mesh, "grids", list)()
    if grids:
        return _join_grids(grids, source)
    with session() as gmsh:
        mesh.build(gmsh)
        return extract(gmsh, source)


def _join_grids(grids: Sequence[Grid], source: str) -> MeshArrays:
    """Return the arrays that `extract` would find in a model of these grids."""
    points_of_grids = []
    cells_of_grids = []
    parts: dict[str, list[Rows]] = {}  # facets of the sides with a name
    first = 0  # number of the first point of a grid
    for grid in grids:
        grid_points, grid_cells, grid_sides = grid.number_nodes()
        points_of_grids.append(grid_points)
        cells_of_grids.append(first + grid_cells)
        for name, rows in grid_sides.items():
            parts.setdefault(name, []).append(first + rows)
        first += len(grid_points)
    facets = {name: np.concatenate(rows) for name, rows in parts.items()}
    points = np.concatenate(points_of_grids)
    cells = np.concatenate(cells_of_grids)
    body = np.repeat(np.arange(len(grids)), [len(part) for part in cells_of_grids])
    names = {number: name for name, (number, _) in GMSH_NUMBERS.items()}
    cell = names[grids[0].kinds[-1]]
    _check_finite(points, source)
    check_cells(points, cells, cell, source)
    check_folds(points, cells, cell, source)
    check_sides(facets, cells, cell, source)
    groups: dict[str, Mask] = {}
    for i, grid in enumerate(grids):
        for name in filter(None, (grid.body, grid.kin)):
            groups[name] = groups.get(name, False) | (body == i)
    return MeshArrays(cell, points, cells, groups, facets)


def _check_finite(points: Array, source: str) -> None:
    """Raise InputError for coordinates that are not finite numbers."""
    if not np.isfinite(points).all():
        raise InputError(
            f"{source} has nodes whose coordinates are not numbers: write it again from Gmsh"
        )


def extract(gmsh: Any, source: str) -> MeshArrays:
    """Return the mesh of Gmsh's current model; `source` names it in error messages.

    As in Gmsh, the mesh is what the physical groups of the highest dimension hold; without any, all
    cells are taken, as a group "all". Nodes that no cell uses are dropped, the others numbered from
    0 in the order of their tags.

    Raises:
        InputError: a model without cells; mixed cells, or cells of an order above 2; cells without
            volume, twisted, or folded over a neighbour; triangles or quadrilaterals outside the
            plane z = 0; named facets that are no sides of cells.
    """
    # What the groups of the highest dimension hold, and the groups of facets.
    model = gmsh.model
    kinds, _, _ = model.mesh.getElements()
    d = max((model.mesh.getElementProperties(kind)[1] for kind in kinds), default=0)
    body = _find_entities(model, d)
    sides = _find_entities(model, d - 1)
    common = body.keys() & sides.keys()
    if common:
        raise InputError(
            f"{source} calls both cells and facets '{min(common)}': give one of the groups another "
            "name"
        )
    named = sorted(set(chain.from_iterable(body.values())))
    elements = _collect_elements(model, d, named or [entity for _, entity in model.getEntities(d)])

    # Points in the order of their tags, and cells as rows of them, each once.
    cell, number, side = _find_kind(model, elements, d, source)
    nodes, entity = elements[number]
    tags, cells = np.unique(nodes, return_inverse=True)
    points = _drop_coordinates(_find_coordinates(model, tags, source), d, source)
    cells = cells.reshape(nodes.shape).astype(np.int64)
    first_rows, position = _drop_repeats(cells)
    cells = cells[first_rows]
    corners = cells[:, : vertex_count(cell)]
    check_cells(points, corners, cell, source)
    check_folds(points, corners, cell, source)
    if cells.shape[1] > corners.shape[1]:
        folded = _find_folded(model, number, entity, d)[first_rows]
        refuse_cells(folded, "a fold between its curved sides", points, cells, source)

    cell_groups = {} if body else {"all": np.ones(len(cells), dtype=bool)}
    for name, entities in body.items():
        cell_groups[name] = np.zeros(len(cells), dtype=bool)
        cell_groups[name][position[np.isin(entity, entities)]] = True
    facet_groups = {}
    for name, entities in sides.items():
        group = f"boundary group '{name}' of {source}"
        facets = _collect_facets(model, entities, side, tags, points, group)
        if len(facets):
            facet_groups[name] = facets
    check_sides(facet_groups, corners, cell, source)
    return MeshArrays(cell, points, cells, cell_groups, facet_groups)


def _find_entities(model: Any, dim: int) -> dict[str, list[int]]:
    """Return the entities of each physical group of a dimension.

    A group without a name is called by its number.
    """
    groups: dict[str, list[int]] = {}
    if dim < 0:
        return groups
    for _, tag in model.getPhysicalGroups(dim):
        name = model.getPhysicalName(dim, tag) or str(tag)
        entities = model.getEntitiesForPhysicalGroup(dim, tag)
        groups.setdefault(name, []).extend(int(entity) for entity in entities)
    return groups


def _collect_elements(model: Any, dim: int, entities: Iterable[int]) -> _Elements:
    """Return the elements of the entities."""
    nodes_of_kind: dict[int, list[Rows]] = {}
    entities_of_kind: dict[int, list[int]] = {}
    for entity in entities:
        kinds, tags, nodes = model.mesh.getElements(dim, entity)
        for kind, tags_of_kind, flat in zip(kinds, tags, nodes, strict=True):
            rows = np.asarray(flat, dtype=np.int64).reshape(len(tags_of_kind), -1)
            nodes_of_kind.setdefault(int(kind), []).append(rows)
            entities_of_kind.setdefault(int(kind), []).append(entity)
    elements = {}
    for number, parts in nodes_of_kind.items():
        counts = [len(rows) for rows in parts]
        elements[number] = (np.concatenate(parts), np.repeat(entities_of_kind[number], counts))
    return elements


def _find_kind(model: Any, elements: _Elements, dim: int, source: str) -> tuple[str, int, int]:
    """Return the one type of cell there is: UFL's name, Gmsh's number, that of its sides.

    Args:
        model: Gmsh's current model.
        elements: by Gmsh's number of their kind.
        dim: dimension of the cells.
        source: name of the mesh in messages.
    """
    if dim == 0 or not elements:
        raise InputError(f"{source} has no cells: mesh the geometry in Gmsh before saving it")
    known = {}
    for kinds in (GMSH_NUMBERS, SECOND_ORDER):
        for cell, (number, side) in kinds.items():
            known[number] = (cell, side)
    names = {}
    high = []  # kinds of an order above the first that are not known
    for kind in elements:
        names[kind], _, order, *_ = model.mesh.getElementProperties(kind)
        if order > 1 and kind not in known:
            high.append(kind)
    if high:
        raise InputError(
            f"{source} has cells of an order above 2, or without all mid-points "
            f"({names[high[0]]}): mesh it with Mesh.ElementOrder = 1, or with 2 and "
            "Mesh.SecondOrderIncomplete = 0"
        )
    if len(elements) > 1:
        raise InputError(
            f"{source} mixes cells ({', '.join(sorted(names.values()))}): mesh it with cells of "
            "one type"
        )
    (only,) = elements
    if only not in known:
        raise InputError(
            f"{source} has cells of type {names[only]}: use {', '.join(GMSH_NUMBERS)} cells"
        )
    cell, side = known[only]
    return cell, only, side


def _find_folded(model: Any, kind: int, entity: Rows, dim: int) -> Mask:
    """Tell which curved cells are folded: they have Jacobians of both signs.

    Args:
        model: Gmsh's current model.
        kind: Gmsh's number of the cells.
        entity: (n_cells,), the entity of each, those of one entity one behind the other.
        dim: dimension of the cells.
    """
    places, _ = model.mesh.getIntegrationPoints(kind, "Gauss4")
    folded = []
    for tag in dict.fromkeys(entity.tolist()):
        flat, _, _ = model.mesh.getJacobians(kind, places, tag)
        jacobians = np.reshape(flat, (-1, len(places) // 3, 3, 3))
        det = np.linalg.det(jacobians[:, :, :dim, :dim])
        folded.append((det.min(axis=1) <= 0.0) & (det.max(axis=1) >= 0.0))
    return np.concatenate(folded)


def _find_coordinates(model: Any, tags: Rows, source: str) -> Array:
    """Return the coordinates (n, 3) of the nodes with the given tags.

    The tags may start anywhere and have holes.
    """
    known, coordinates, _ = model.mesh.getNodes()
    order = np.argsort(known)
    place = order[np.minimum(np.searchsorted(known, tags, sorter=order), len(known) - 1)]
    if not np.array_equal(known[place], tags):
        raise InputError(
            f"{source} has cells on nodes it does not define: write it again from Gmsh"
        )
    points: Array = np.asarray(coordinates, dtype=np.float64).reshape(-1, 3)[place]
    _check_finite(points, source)
    return points


def _drop_coordinates(points: Array, d: int, source: str) -> Array:
    """Return the first d coordinates; the others must be zero."""
    away = np.abs(points[:, d:]).max(initial=0.0)
    if away > 1e-9 * np.ptp(points, axis=0).max():
        plane = "plane z = 0" if d == 2 else "axis y = z = 0"
        missing = "volume" if d == 2 else "surface"
        raise InputError(
            f"{source} has no cells of dimension {d + 1} and leaves the {plane} by {away:.3g} m: "
            f"move it there, or name the {missing} as a physical group so that Gmsh saves its cells"
        )
    return np.ascontiguousarray(points[:, :d])


def _drop_repeats(rows: Rows) -> tuple[Rows, Rows]:
    """Return the first of all rows with the same members, and the place of every row among these.

    Both are numbers of rows.
    """
    (number,) = number_alike(rows)
    _, first, place = np.unique(number, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place]


def _collect_facets(
    model: Any, entities: list[int], kind: int, tags: Rows, points: Array, group: str
) -> Rows:
    """Return the facets of a group as rows of points at their vertices, each once.

    Nodes that are at no point are -1.

    Args:
        model: Gmsh's current model.
        entities: of the group.
        kind: Gmsh's number of the sides of the cells.
        tags: of the nodes of the points, ascending.
        points: (n_points, d) [m].
        group: its name in messages.

    OpenCASCADE may copy a curve or surface when it bounds a body with it, and the named original is
    then meshed by itself, with nodes at the places of the body's (dolfinx#2456). Such a node stands
    for the one point at its place.
    """
    _, dimension, _, _, _, vertices, *_ = model.mesh.getElementProperties(kind)
    elements = _collect_elements(model, dimension, entities)
    if not elements:
        return np.empty((0, 1), dtype=np.int64)
    if list(elements) != [kind]:
        raise InputError(
            f"{group} is not of the shapes of the cells' sides: mesh body and boundary together"
        )
    all_nodes, _ = elements[kind]
    nodes = all_nodes[:, :vertices]
    place = np.minimum(np.searchsorted(tags, nodes), len(tags) - 1)
    rows = np.where(tags[place] == nodes, place, -1)
    unknown = rows < 0
    if unknown.any():
        places = _find_coordinates(model, nodes[unknown], group)[:, : points.shape[1]]
        rows[unknown] = _find_points(places, points)
    first_rows, _ = _drop_repeats(rows)
    return rows[first_rows]


def _find_points(places: Array, points: Array) -> Rows:
    """Return the one point at each place.

    It is -1 where there is none, or more than one, as where two bodies touch.
    """
    from scipy.spatial import cKDTree  # late: few meshes need it

    tolerance = 1e-10 * np.ptp(points, axis=0).max()
    distance, nearest = cKDTree(points).query(places, k=2)
    only_one = (distance[:, 0] <= tolerance) & (distance[:, 1] > tolerance)
    return np.where(only_one, nearest[:, 0], -1)


def arrays_of(source: Source) -> MeshArrays:
    """Return the arrays of a mesh file or of a script, or raise InputError like `extract`."""
    if isinstance(source, str | Path):
        return arrays_from_file(source)
    return arrays_from_script(source)


def add_arrays(gmsh: Any, arrays: MeshArrays) -> None:
    """Add a mesh to the empty current model.

    Its points come in order, with a discrete entity for every set of groups.
    """
    d = arrays.points.shape[1]
    cell, side = GMSH_NUMBERS[arrays.cell]
    points = np.zeros((len(arrays.points), 3))
    points[:, :d] = arrays.points
    home = gmsh.model.addDiscreteEntity(d)  # holds the nodes
    gmsh.model.mesh.addNodes(d, home, 1 + np.arange(len(points)), points.reshape(-1))
    _add_groups(gmsh, d, cell, arrays.cells, arrays.cell_groups)
    _add_groups(gmsh, d - 1, side, *_join_groups(arrays.facet_groups))


def _join_groups(groups: dict[str, Rows]) -> tuple[Rows, dict[str, Mask]]:
    """Return the rows of all groups, each once, and which of them are in each group."""
    if not groups:
        return np.zeros((0, 1), dtype=np.int64), {}
    numbers = number_alike(*groups.values())
    unique, first = np.unique(np.concatenate(numbers), return_index=True)
    rows = np.concatenate(list(groups.values()))[first]
    masks = {}
    for name, numbers_of_group in zip(groups, numbers, strict=True):
        masks[name] = np.isin(unique, numbers_of_group)
    return rows, masks


def _add_groups(gmsh: Any, dim: int, kind: int, rows: Rows, groups: dict[str, Mask]) -> None:
    """Add the physical groups of elements that may be in several.

    Args:
        gmsh: the module.
        dim: dimension of the elements.
        kind: Gmsh's number of the elements.
        rows: the elements, as rows of points.
        groups: masks of these by name.
    """
    if not groups:
        return
    # Elements in the same groups make one entity.
    table = np.column_stack(list(groups.values()))
    signatures, place = np.unique(table, axis=0, return_inverse=True)
    entities = []
    for number in range(len(signatures)):
        entities.append(gmsh.model.addDiscreteEntity(dim))
        elements = rows[place.reshape(-1) == number]
        gmsh.model.mesh.addElementsByType(entities[-1], kind, [], 1 + elements.reshape(-1))
    for column, name in enumerate(groups):
        members = np.array(entities)[signatures[:, column]].tolist()
        if members:
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, members), name)
