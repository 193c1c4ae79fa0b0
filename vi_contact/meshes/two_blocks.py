"""Mesh bars, rectangles or boxes, each a body of its own, that touch without sharing a node.

Physical groups of a body called "lower": cells "lower"; boundary "lower_left", "lower_right" (x
lowest, highest), "lower_bottom", "lower_top" (y), "lower_back", "lower_front" (z).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Unit
from vi_contact.meshes.block import SIDES, BlockMesh
from vi_contact.meshes.grid import Grid, add_grids


@dataclass(frozen=True)
class Blocks:
    """Hold blocks by name, each a body of its own.

    Raises InputError for blocks of different dimensions or kinds of cells.
    """

    blocks: Mapping[str, BlockMesh]

    def __post_init__(self) -> None:
        check_fields(self)
        kinds = {(len(block.lengths), block.simplices) for block in self.blocks.values()}
        if len(kinds) != 1:
            raise InputError(
                "give the blocks of one mesh the same number of lengths and the same kind of cells"
            )

    def build(self, gmsh: Any) -> None:
        """Add the blocks to Gmsh's current model."""
        add_grids(gmsh, self.grids())

    def grids(self) -> list[Grid]:
        """Return the grids of all bodies."""
        grids = []
        for name, block in self.blocks.items():
            sides = SIDES[: len(block.lengths)]
            own_sides = [(f"{name}_{low}", f"{name}_{high}") for low, high in sides]
            grids.append(Grid(block.points(), block.simplices, name, own_sides))
        return grids


@dataclass(frozen=True, kw_only=True)
class TwoBlocks:
    """Describe a block "upper" on top of a block "lower", in one dimension to the right of it.

    The interface is "lower_top" and "upper_bottom", of bars "lower_right" and "upper_left". It has
    nodes at the same places when lengths and divisions match, never the same nodes.

    Attributes:
        lower: the lower block, with a corner at the origin.
        upper: the upper block.
        offset: where the upper block begins along the interface: x, and z of a box [m].
        gap: between both [m].
        angle: that turns both about the origin [rad].
    """

    lower: BlockMesh = field(default_factory=BlockMesh)
    upper: BlockMesh = field(default_factory=BlockMesh)
    offset: Annotated[tuple[float, ...], Unit("m")] = (0.0, 0.0)
    gap: Annotated[float, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    @property
    def interface(self) -> tuple[str, str]:
        """Return the names of the side of the upper block and of that of the lower one."""
        if len(self.lower.lengths) == 1:
            return "upper_left", "lower_right"
        return "upper_bottom", "lower_top"

    def blocks(self) -> Blocks:
        """Return both blocks where they are."""
        dimension = len(self.lower.lengths)
        height = self.lower.lengths[min(dimension, 2) - 1] + self.gap  # of bars: along x
        x, z = (*self.offset, 0.0, 0.0)[:2]
        corners = {1: (height,), 2: (x, height), 3: (x, height, z)}
        lower = replace(self.lower, angle=self.angle)
        upper = replace(self.upper, corner=corners[dimension], angle=self.angle)
        return Blocks({"lower": lower, "upper": upper})

    def build(self, gmsh: Any) -> None:
        """Add both to Gmsh's current model."""
        self.blocks().build(gmsh)
