"""Meshes in which chosen nodes at one place are made one, as when bodies are drawn between the same
points."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vi_contact.meshes.extract import MeshArrays, add_arrays, arrays_of


@dataclass(frozen=True)
class Merged:
    """Describe the mesh of a script with the nodes at one place made one where ``where(x)`` is true
    of it."""

    source: Any
    where: Any

    def arrays(self) -> MeshArrays:
        arrays = arrays_of(self.source)
        target = np.arange(len(arrays.points))
        for node in np.flatnonzero(self.where(arrays.points.T)):
            alike = np.flatnonzero(
                np.linalg.norm(arrays.points - arrays.points[node], axis=1) < 1e-9
            )
            target[node] = alike[0]
        kept, number = np.unique(target, return_inverse=True)
        groups = {name: number[rows] for name, rows in arrays.facet_groups.items()}
        return MeshArrays(
            arrays.cell, arrays.points[kept], number[arrays.cells], arrays.cell_groups, groups
        )

    def build(self, gmsh: Any) -> None:
        add_arrays(gmsh, self.arrays())
