"""Mesh a column of drums, each a body of its own.

The column stands on y = 0, its axis is that of y. In the plane a drum is a trapezium, in space it
is round: a polygon of four times as many sides as it has cells across.

Physical groups: cells "drums" and "drum_1", "drum_2", … from below; boundary "bottom", "top" (y)
and "side" of the column. With ground there are cells "ground" and boundary "ground_left",
"ground_right", "ground_bottom", "ground_top", "ground_back", "ground_front".
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.meshes.grid import Grid
from vi_contact.meshes.stones import (
    OfGrids,
    check_divisions,
    divide_unlike,
    make_box,
    make_ground,
    move_nodes,
    turn_grids,
)


@dataclass(frozen=True, kw_only=True)
class DrumsMesh(OfGrids):
    """Describe a column of drums, in the plane or round in space.

    Attributes:
        drums: above each other.
        height: of a drum [m].
        width: of the column at its foot, its diameter in space [m].
        top_width: at its top [m]; None for the same. Between both it changes linearly.
        space: whether the column is round, in space.
        divisions: cells across a drum and along its height.
        unlike: how many more cells a drum may have along a side, so that meshes of neighbours do
            not match; 0 for drums that are divided alike.
        simplices: whether rectangles and boxes are split.
        ground: depth of the ground below the column, three times as wide [m]; 0 for none.
        angle: of a turn about the origin, in space about the z axis [rad].

    Raises:
        InputError: sizes that make no column.
    """

    drums: Annotated[int, Positive] = 4
    height: Annotated[float, Positive, Unit("m")] = 1.0
    width: Annotated[float, Positive, Unit("m")] = 1.0
    top_width: Annotated[float | None, Positive, Unit("m")] = None
    space: bool = False
    divisions: tuple[int, int] = (4, 4)
    unlike: Annotated[int, NotNegative] = 0
    simplices: bool = False
    ground: Annotated[float, NotNegative, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        check_divisions("DrumsMesh", self.divisions, 2, self.drums)

    def grids(self) -> list[Grid]:
        """Return the grids of all drums from below, and that of the ground."""
        across, up = self.divisions
        cells = (across, up, across) if self.space else (across, up)
        d = len(cells)
        grids = []
        for number in range(self.drums):
            base = number == 0 and not self.ground
            top = number == self.drums - 1
            sides = [("side", "side"), ("bottom" if base else "", "top" if top else "")]
            low = [-1.0, number * self.height, -1.0]
            high = [1.0, (number + 1) * self.height, 1.0]
            divisions = divide_unlike(cells, number, self.unlike)
            square = make_box(
                low[:d],
                high[:d],
                (*divisions[:2], *divisions[:1])[:d],
                simplices=self.simplices,
                name=f"drum_{number + 1}",
                kin="drums",
                sides=[*sides, ("side", "side")][:d],
            )
            grids.append(move_nodes(square, self._shape))
        if self.ground:
            reach = 1.5 * self.width
            bed = (3 * across, up, 3 * across)[:d]
            grids.append(
                make_ground([-reach] * d, [reach] * d, self.ground, bed, simplices=self.simplices)
            )
        return turn_grids(grids, self.angle)

    def _shape(self, points: Array) -> Array:
        """Return points of the column [m] for those of a prism of half width 1."""
        top = self.width if self.top_width is None else self.top_width
        share = points[:, 1] / (self.drums * self.height)
        half = 0.5 * (self.width + (top - self.width) * share)
        moved = points.copy()
        if points.shape[1] == 2:
            moved[:, 0] *= half
        else:
            moved[:, [0, 2]] = half[:, None] * map_to_disk(points[:, [0, 2]])
        return moved


def map_to_disk(points: Array) -> Array:
    """Map the square |x|, |y| <= 1 onto the unit disk, squares round the origin onto circles.

    Even points on the rim of a square become even points on a circle, and areas keep their ratios:
    Shirley and Chiu, A low distortion map between disk and square, Journal of Graphics Tools 2
    (1997), 45-52.

    Args:
        points: (n, 2).
    """
    x = points[:, 0]
    y = points[:, 1]
    wide = np.abs(x) >= np.abs(y)
    radius = np.where(wide, x, y)  # with its sign
    other = np.where(wide, y, x)
    ratio = np.divide(other, radius, out=np.zeros_like(other), where=radius != 0.0)
    angle = 0.25 * np.pi * ratio
    along = radius * np.cos(angle)
    aside = radius * np.sin(angle)
    return np.column_stack([np.where(wide, along, aside), np.where(wide, aside, along)])
