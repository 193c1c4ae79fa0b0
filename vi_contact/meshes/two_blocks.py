"""Mesh bars, rectangles or boxes that touch without sharing a node.

They are bodies of their own, meshed each for itself.

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

    InputError for blocks of different dimension or cells.
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
        return [
            Grid(
                one.points(),
                one.simplices,
                name,
                [(f"{name}_{low}", f"{name}_{high}") for low, high in sides],
            )
            for name, one in self.blocks.items()
            for sides in [SIDES[: len(one.lengths)]]
        ]


@dataclass(frozen=True, kw_only=True)
class TwoBlocks:
    """Describe a block "upper" on top of a block "lower", in one dimension to the right of it.

    The lower one has a corner at the origin; the upper one begins at `offset` [m] along the
    interface (x, and z of a box), `gap` [m] above it. Interface "lower_top" and "upper_bottom", of
    bars "lower_right" and "upper_left": nodes at the same places when lengths and divisions match,
    never the same nodes. `angle` [rad] turns both about the origin.
    """

    lower: BlockMesh = field(default_factory=BlockMesh)
    upper: BlockMesh = field(default_factory=BlockMesh)
    offset: Annotated[tuple[float, ...], Unit("m")] = (0.0, 0.0)
    gap: Annotated[float, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    @property
    def interface(self) -> tuple[str, str]:
        """Return the names of the side of the upper block and of that of the lower one."""
        return (
            ("upper_left", "lower_right")
            if len(self.lower.lengths) == 1
            else ("upper_bottom", "lower_top")
        )

    def blocks(self) -> Blocks:
        """Return both blocks where they are."""
        height = self.lower.lengths[:2][-1] + self.gap
        x, z = (*self.offset, 0.0, 0.0)[:2]
        corner = {1: (height,), 2: (x, height), 3: (x, height, z)}[len(self.lower.lengths)]
        upper = replace(self.upper, corner=corner, angle=self.angle)
        return Blocks({"lower": replace(self.lower, angle=self.angle), "upper": upper})

    def build(self, gmsh: Any) -> None:
        """Add both to Gmsh's current model."""
        self.blocks().build(gmsh)
