"""Meshes with curved cells: grids that get mid-points, all of whose nodes are then moved by a
smooth map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import MeshArrays, arrays_from_script


def wavy(x: Array) -> Array:
    """Bend the inside of a block of height 1.5 and length 2 (and depth 1.2), but none of its
    sides."""
    lengths = np.array([2.0, 1.5, 1.2])[: x.shape[1]]
    bump = np.prod(np.sin(np.pi * x / lengths), axis=1)
    return x + 0.12 * bump[:, None] * np.array([1.0, -0.7, 0.5])[: x.shape[1]]


# Gmsh's number of a type of second order, and the vertices whose means its further nodes are, in
# its order
MIDDLES = {
    "interval": (8, [(0, 1)]),
    "triangle": (9, [(0, 1), (1, 2), (2, 0)]),
    "quadrilateral": (10, [(0, 1), (1, 2), (2, 3), (3, 0), (0, 1, 2, 3)]),
    "tetrahedron": (11, [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)]),
    "hexahedron": (
        12,
        [
            (0, 1),
            (0, 3),
            (0, 4),
            (1, 2),
            (1, 5),
            (2, 3),
            (2, 6),
            (3, 7),
            (4, 5),
            (4, 7),
            (5, 6),
            (6, 7),
            (0, 1, 2, 3),
            (0, 1, 4, 5),
            (0, 3, 4, 7),
            (1, 2, 5, 6),
            (2, 3, 6, 7),
            (4, 5, 6, 7),
            (0, 1, 2, 3, 4, 5, 6, 7),
        ],
    ),
}


@dataclass(frozen=True)
class Curved:
    """A mesh of grids, or arrays, with mid-points, all of whose nodes are moved by a smooth map:
    cells with curved sides."""

    mesh: Any
    move: Any = wavy

    def build(self, gmsh: Any) -> None:
        arrays = self.mesh if isinstance(self.mesh, MeshArrays) else arrays_from_script(self.mesh)
        d, known, points = arrays.points.shape[1], {}, list(arrays.points)
        side = {"tetrahedron": "triangle", "hexahedron": "quadrilateral"}.get(
            arrays.cell, "interval"
        )

        def raised(rows: Any, cell: str) -> Any:
            for row in rows.tolist():
                for around in MIDDLES[cell][1]:
                    key = tuple(sorted(row[i] for i in around))
                    if key not in known:
                        known[key] = len(points)
                        points.append(arrays.points[list(key)].mean(axis=0))
                    row.append(known[key])
                yield row

        parts = [
            (d, arrays.cell, name, list(raised(arrays.cells[mask], arrays.cell)))
            for name, mask in arrays.cell_groups.items()
        ]
        parts += [
            (d - 1, side, name, list(raised(rows, side)))
            for name, rows in arrays.facet_groups.items()
        ]
        places = np.zeros((len(points), 3))
        places[:, :d] = self.move(np.array(points))
        home = gmsh.model.addDiscreteEntity(d)
        gmsh.model.mesh.addNodes(d, home, 1 + np.arange(len(points)), places.ravel())
        for dim, cell, name, rows in parts:
            entity = gmsh.model.addDiscreteEntity(dim)
            gmsh.model.mesh.addElementsByType(
                entity, MIDDLES[cell][0], [], 1 + np.array(rows).ravel()
            )
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, [entity]), name)


SHAPES: dict[str, dict[str, Any]] = {
    "triangles": {"lengths": (2.0, 1.5), "divisions": (3, 3), "simplices": True},
    "quadrilaterals": {"lengths": (2.0, 1.5), "divisions": (3, 3)},
    "hexahedra": {"lengths": (2.0, 1.5, 1.2), "divisions": (2, 2, 2)},
    "tetrahedra": {"lengths": (2.0, 1.5, 1.2), "divisions": (2, 2, 2), "simplices": True},
}


def mesh_of(name: str, curved: bool) -> Any:
    """A block of distorted cells with straight sides, or of cells with curved ones."""
    return Curved(BlockMesh(**SHAPES[name])) if curved else BlockMesh(**SHAPES[name], deform=wavy)
