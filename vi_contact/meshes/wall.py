"""Mesh the wall of Fig. 2 of the boundary method, a rectangle on its base.

One-sided supports stand along its right side.

Physical groups: cells "wall"; boundary "base" (y = 0), "face" (x = width: the contact side), "top",
"back" (x = 0). The defaults are the mesh of the published example: 8 x 12 cells, 40 boundary nodes
0.75 m apart.
"""

from dataclasses import dataclass
from typing import Annotated, Any

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Unit
from vi_contact.meshes.block import check_box
from vi_contact.meshes.grid import Grid, add_grids, add_outline, lattice

_PUBLISHED = (8, 12)


@dataclass(frozen=True, kw_only=True)
class WallMesh:
    """Describe a mesh of a wall.

    Attributes:
        height: of the wall [m].
        width: of the wall [m].
        divisions: exact numbers of cells along width and height. None for 8 x 12, or for an
            irregular mesh.
        size: of the cells of an irregular mesh [m]; None for an even one.
        triangles: whether the cells are triangles instead of quadrilaterals.

    Raises:
        InputError: sizes that make no wall.
    """

    height: Annotated[float, Unit("m")] = 9.0
    width: Annotated[float, Unit("m")] = 6.0
    divisions: tuple[int, int] | None = None
    size: Annotated[float | None, Unit("m")] = None
    triangles: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if self.divisions is not None and self.size is not None:
            raise InputError("a wall has divisions and a cell size: leave one of them out")
        check_box((self.width, self.height), self.divisions or _PUBLISHED)
        if self.size is not None:
            if not 0.0 < self.size <= min(self.width, self.height):
                raise InputError(
                    f"the cell size is {self.size} m: give one above 0 and up to the wall's sides"
                )
            cells = self.width / self.size * (self.height / self.size)
            check_count("wall", f"a cell size of {self.size} m", cells, "cells", most=MOST_CELLS)

    def build(self, gmsh: Any) -> None:
        """Add the wall to Gmsh's current model."""
        if self.size is None:
            add_grids(gmsh, self.grids())
            return
        corners = ((0.0, 0.0), (self.width, 0.0), (self.width, self.height), (0.0, self.height))
        sides = ("base", "face", "top", "back")
        surface = add_outline(gmsh.model, "wall", corners, sides, [self.size] * 4)
        if not self.triangles:
            gmsh.model.mesh.setRecombine(2, surface)
        gmsh.model.mesh.generate(2)

    def grids(self) -> list[Grid]:
        """Return the one grid that the mesh is, or none where it is irregular."""
        if self.size is not None:
            return []
        nodes = lattice((self.width, self.height), self.divisions or _PUBLISHED)
        return [Grid(nodes, self.triangles, "wall", (("back", "face"), ("base", "top")))]
