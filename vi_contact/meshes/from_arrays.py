"""Turn plain arrays into a Gmsh model: meshes that ``cut`` changed are written and built like any other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.meshes.extract import MeshArrays, arrays_from_file, arrays_from_script
from vi_contact.meshes.gmsh_session import MeshScript
from vi_contact.meshes.rows import GMSH_NUMBERS, Mask, Rows, number_alike

Source = MeshScript | str | Path


def arrays_of(source: Source) -> MeshArrays:
    """Return the arrays of a mesh file or of a script; InputError like `vi_contact.meshes.extract`."""
    return arrays_from_file(source) if isinstance(source, str | Path) else arrays_from_script(source)


def add_arrays(gmsh: Any, arrays: MeshArrays) -> None:
    """Add a mesh to the empty current model: its points in order, a discrete entity for every set of groups."""
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
        held = [entity for entity, signature in zip(entities, signatures, strict=True) if signature[column]]
        if held:
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, held), name)
