"""Turn Gmsh's current model into plain arrays.

Nodes are renumbered, groups named, and what solvers choke on is refused; there is also the way
back.

DOLFINx's own readers fail on node tags that do not start at 1, on facets in two groups and on
missing groups, so nothing of them is used. Vertices stay in Gmsh's order here.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
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
"""Gmsh's number of a type -> node tags (n, n_vertices) of its elements.

With them comes the entity (n,) that holds each.
"""


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Hold a mesh without its library.

    `cell` is UFL's name, `points` (n_points, d) are in metres, `cells` (n_cells, n_nodes) rows of
    points, vertices first. Groups by name: of cells as masks (n_cells,), of facets as rows of
    points (n_facets, n_facet_vertices).
    """

    cell: str
    points: Array
    cells: Rows
    cell_groups: dict[str, Mask]
    facet_groups: dict[str, Rows]


def arrays_from_file(path: str | Path) -> MeshArrays:
    """Read a mesh file in Gmsh's own format, MSH 2 to 4, text or binary.

    InputError like `copied` and `extract`.
    """
    file = Path(path)
    with TemporaryDirectory(prefix="vi_contact-") as folder:
        copy = safe_copy(file, Path(folder))
        with session() as gmsh:
            try:
                gmsh.merge(str(copy))
            except Exception as error:  # the only class Gmsh raises
                said = str(error).replace(str(copy), file.name)
                raise InputError(f"Gmsh cannot read mesh file {file}: {said}") from error
            return extract(gmsh, str(file))


def arrays_from_script(mesh: MeshScript) -> MeshArrays:
    """Build a mesh in memory, without Gmsh where it is made of grids.

    Raises InputError like `extract`.
    """
    source = type(mesh).__name__
    grids: Sequence[Grid] = getattr(mesh, "grids", list)()
    if grids:
        return _of_grids(grids, source)
    with session() as gmsh:
        mesh.build(gmsh)
        return extract(gmsh, source)


def _of_grids(grids: Sequence[Grid], source: str) -> MeshArrays:
    """Return the arrays that `extract` would find in a model of these grids."""
    parts = [grid.number_nodes() for grid in grids]
    first = np.cumsum([0] + [len(points) for points, _, _ in parts])
    body = np.repeat(np.arange(len(grids)), [len(cells) for _, cells, _ in parts])
    points = np.concatenate([points for points, _, _ in parts])
    cells = np.concatenate([first[i] + cells for i, (_, cells, _) in enumerate(parts)])
    facets = {
        name: first[i] + rows
        for i, (_, _, sides) in enumerate(parts)
        for name, rows in sides.items()
    }
    cell = next(name for name, (number, _) in GMSH_NUMBERS.items() if number == grids[0].kinds[-1])
    _check_finite(points, source)
    check_cells(points, cells, cell, source)
    check_folds(points, cells, cell, source)
    check_sides(facets, cells, cell, source)
    return MeshArrays(
        cell, points, cells, {grid.body: body == i for i, grid in enumerate(grids)}, facets
    )


def _check_finite(points: Array, source: str) -> None:
    if not np.isfinite(points).all():
        raise InputError(
            f"{source} has nodes whose coordinates are not numbers: write it again from Gmsh"
        )


def extract(gmsh: Any, source: str) -> MeshArrays:
    """Return the mesh of Gmsh's current model; `source` names it in error messages.

    As in Gmsh, the mesh is what the physical groups of the highest dimension hold; without any, all
    cells are taken, as a group "all". Nodes no cell uses are dropped, the others numbered from 0 in
    the order of their tags. Raises InputError for a model without cells; mixed cells, or of an
    order above 2; cells without volume, twisted, or folded over a neighbour; a mesh of triangles or
    quadrilaterals outside the plane z = 0; named facets that are no sides of cells.
    """
    model = gmsh.model
    d = max(
        (model.mesh.getElementProperties(kind)[1] for kind in model.mesh.getElements()[0]),
        default=0,
    )
    body, sides = _named_entities(model, d), _named_entities(model, d - 1)
    if both := body.keys() & sides.keys():
        raise InputError(
            f"{source} calls both cells and facets '{min(both)}': give one of the groups another "
            "name"
        )
    named = sorted({entity for entities in body.values() for entity in entities})
    elements = _elements(model, d, named or [entity for _, entity in model.getEntities(d)])
    cell, number, side = _kind(model, elements, d, source)
    nodes, entity = elements[number]
    tags, cells = np.unique(nodes, return_inverse=True)
    points = _flat(_coordinates(model, tags, source), d, source)
    cells = cells.reshape(nodes.shape).astype(np.int64)
    kept, position = _without_repeats(cells)
    cells = cells[kept]
    corners = cells[:, : vertex_count(cell)]
    check_cells(points, corners, cell, source)
    check_folds(points, corners, cell, source)
    if cells.shape[1] > corners.shape[1]:
        refuse_cells(
            _folded(model, number, entity, d)[kept],
            "a fold between its curved sides",
            points,
            cells,
            source,
        )
    cell_groups = {} if body else {"all": np.ones(len(cells), dtype=bool)}
    for name, entities in body.items():
        cell_groups[name] = np.zeros(len(cells), dtype=bool)
        cell_groups[name][position[np.isin(entity, entities)]] = True
    facet_groups = {}
    for name, entities in sides.items():
        what = f"boundary group '{name}' of {source}"
        facets = _facets(model, entities, side, tags, points, what)
        if len(facets):
            facet_groups[name] = facets
    check_sides(facet_groups, corners, cell, source)
    return MeshArrays(cell, points, cells, cell_groups, facet_groups)


def _named_entities(model: Any, dim: int) -> dict[str, list[int]]:
    """Return the entities of each physical group of a dimension.

    A group without a name is called by its number.
    """
    groups: dict[str, list[int]] = {}
    for _, tag in model.getPhysicalGroups(dim) if dim >= 0 else ():
        name = model.getPhysicalName(dim, tag) or str(tag)
        groups.setdefault(name, []).extend(
            int(entity) for entity in model.getEntitiesForPhysicalGroup(dim, tag)
        )
    return groups


def _elements(model: Any, dim: int, entities: Iterable[int]) -> _Elements:
    """Return the elements of the entities."""
    parts: dict[int, list[tuple[Rows, int]]] = {}
    for entity in entities:
        kinds, tags, nodes = model.mesh.getElements(dim, entity)
        for kind, tag, node in zip(kinds, tags, nodes, strict=True):
            parts.setdefault(int(kind), []).append(
                (np.asarray(node, dtype=np.int64).reshape(len(tag), -1), entity)
            )
    return {
        kind: (
            np.concatenate([r for r, _ in found]),
            np.repeat([e for _, e in found], [len(r) for r, _ in found]),
        )
        for kind, found in parts.items()
    }


def _kind(model: Any, elements: _Elements, dim: int, source: str) -> tuple[str, int, int]:
    """Return the one type of cell there is: UFL's name, Gmsh's number, that of its sides."""
    if dim == 0 or not elements:
        raise InputError(f"{source} has no cells: mesh the geometry in Gmsh before saving it")
    names = {kind: model.mesh.getElementProperties(kind)[0] for kind in elements}
    known = {
        number: (cell, side)
        for kinds in (GMSH_NUMBERS, SECOND_ORDER)
        for cell, (number, side) in kinds.items()
    }
    high = [
        kind
        for kind in elements
        if model.mesh.getElementProperties(kind)[2] > 1 and kind not in known
    ]
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
    if (only := next(iter(elements))) not in known:
        raise InputError(
            f"{source} has cells of type {names[only]}: use {', '.join(GMSH_NUMBERS)} cells"
        )
    return known[only][0], only, known[only][1]


def _folded(model: Any, kind: int, entity: Rows, dim: int) -> Mask:
    """Tell which curved cells of entities are folded.

    They are in this order; a folded one has Jacobians of both signs at points of quadrature.
    """
    places, _ = model.mesh.getIntegrationPoints(kind, "Gauss4")
    bad = []
    for one in dict.fromkeys(entity.tolist()):
        jacobians = np.reshape(
            model.mesh.getJacobians(kind, places, one)[0], (-1, len(places) // 3, 3, 3)
        )
        det = np.linalg.det(jacobians[:, :, :dim, :dim])
        bad.append((det.min(axis=1) <= 0.0) & (det.max(axis=1) >= 0.0))
    return np.concatenate(bad)


def _coordinates(model: Any, tags: Rows, source: str) -> Array:
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


def _flat(points: Array, d: int, source: str) -> Array:
    """Return the first d coordinates; the others must be zero."""
    away = np.abs(points[:, d:]).max(initial=0.0)
    if away > 1e-9 * np.ptp(points, axis=0).max():
        plane, missing = ("plane z = 0", "volume") if d == 2 else ("axis y = z = 0", "surface")
        raise InputError(
            f"{source} has no cells of dimension {d + 1} and leaves the {plane} by {away:.3g} m: "
            f"move it there, or name the {missing} as a physical group so that Gmsh saves its cells"
        )
    return np.ascontiguousarray(points[:, :d])


def _without_repeats(rows: Rows) -> tuple[Rows, Rows]:
    """Return the rows kept, and the place of every row among these.

    Of rows with the same members the first is kept.
    """
    _, first, place = np.unique(number_alike(rows)[0], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place]


def _facets(
    model: Any, entities: list[int], kind: int, tags: Rows, points: Array, what: str
) -> Rows:
    """Return the facets of a group as rows of points at their vertices, each once.

    Nodes that are at no point are -1.

    OpenCASCADE may copy a curve or surface when it bounds a body with it, and the named original is
    then meshed by itself, with nodes at the places of the body's (dolfinx#2456). Such a node stands
    for the one point at its place.
    """
    found = _elements(model, model.mesh.getElementProperties(kind)[1], entities)
    if not found:
        return np.empty((0, 1), dtype=np.int64)
    if list(found) != [kind]:
        raise InputError(
            f"{what} is not of the shapes of the cells' sides: mesh body and boundary together"
        )
    nodes = found[kind][0][:, : model.mesh.getElementProperties(kind)[5]]
    place = np.minimum(np.searchsorted(tags, nodes), len(tags) - 1)
    rows = np.where(tags[place] == nodes, place, -1)
    if (rows < 0).any():
        rows[rows < 0] = _at_same_place(
            _coordinates(model, nodes[rows < 0], what)[:, : points.shape[1]], points
        )
    return rows[_without_repeats(rows)[0]]


def _at_same_place(places: Array, points: Array) -> Rows:
    """Find for each place the one point there.

    It is -1 if there is none or more than one (two bodies in touch).
    """
    tolerance = 1e-10 * np.ptp(points, axis=0).max()
    from scipy.spatial import cKDTree  # late: few meshes need it

    distance, nearest = cKDTree(points).query(places, k=2)
    return np.where((distance[:, 0] <= tolerance) & (distance[:, 1] > tolerance), nearest[:, 0], -1)


def arrays_of(source: Source) -> MeshArrays:
    """Return the arrays of a mesh file or of a script; InputError like `extract`."""
    return (
        arrays_from_file(source) if isinstance(source, str | Path) else arrays_from_script(source)
    )


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
    _add_groups(gmsh, d - 1, side, *_members(arrays.facet_groups))


def _members(groups: dict[str, Rows]) -> tuple[Rows, dict[str, Mask]]:
    """Return the rows of all groups, each once, and which of them are in each group."""
    if not groups:
        return np.zeros((0, 1), dtype=np.int64), {}
    numbers = number_alike(*groups.values())
    unique, first = np.unique(np.concatenate(numbers), return_index=True)
    rows = np.concatenate(list(groups.values()))[first]
    return rows, {name: np.isin(unique, own) for name, own in zip(groups, numbers, strict=True)}


def _add_groups(gmsh: Any, dim: int, kind: int, rows: Rows, groups: dict[str, Mask]) -> None:
    """Add the physical groups of elements that may be in several."""
    if not groups:
        return
    table = np.column_stack(list(groups.values()))
    signatures, place = np.unique(table, axis=0, return_inverse=True)
    entities = []
    for number in range(len(signatures)):
        entities.append(gmsh.model.addDiscreteEntity(dim))
        own = rows[place.reshape(-1) == number]
        gmsh.model.mesh.addElementsByType(entities[-1], kind, [], 1 + own.reshape(-1))
    for column, name in enumerate(groups):
        held = [
            entity
            for entity, signature in zip(entities, signatures, strict=True)
            if signature[column]
        ]
        if held:
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, held), name)
