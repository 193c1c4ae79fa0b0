"""Mesh an array of bricks with gaps, each brick a body of its own, on a table or without one.

In the plane bricks stand beside each other along x, and in layers along y. In space z is the third
axis. The first layer stands on y = 0; without gaps along y the bricks of a column touch.

Physical groups: cells "bricks", and one for each brick, "brick_3_1" (third from the left, lowest
layer) or "brick_3_1_2" in space (second from the back); boundary "left", "right" (x lowest,
highest), "bottom", "top" (y), "back", "front" (z) of the array. The table is the body "ground",
with boundary "ground_left", "ground_right", "ground_bottom", "ground_top", "ground_back",
"ground_front".
"""

from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Annotated

from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.meshes.block import SIDES
from vi_contact.meshes.grid import Grid
from vi_contact.meshes.stones import (
    OfGrids,
    check_divisions,
    divide_unlike,
    make_box,
    make_ground,
    turn_grids,
)


@dataclass(frozen=True, kw_only=True)
class BricksMesh(OfGrids):
    """Describe an array of bricks with gaps, d = len(counts) = 2 or 3.

    Attributes:
        counts: (d,) bricks along x, y and z.
        lengths: (d,) of a brick [m].
        gaps: (d,) between neighbours [m].
        divisions: (d,) cells along the sides of a brick.
        unlike: how many more cells a brick may have along a side, so that meshes of neighbours do
            not match; 0 for bricks that are divided alike.
        simplices: whether rectangles and boxes are split.
        table: thickness of the table below the bricks [m]; 0 for none.
        overhang: by which the table reaches beyond the array on each side [m].
        angle: of a turn about the origin, in space about the z axis [rad].

    Raises:
        InputError: sizes that make no array.
    """

    counts: tuple[int, ...] = (9, 1)
    lengths: Annotated[tuple[float, ...], Positive, Unit("m")] = (0.1, 0.2)
    gaps: Annotated[tuple[float, ...], NotNegative, Unit("m")] = (0.002, 0.0)
    divisions: tuple[int, ...] = (2, 4)
    unlike: Annotated[int, NotNegative] = 0
    simplices: bool = False
    table: Annotated[float, NotNegative, Unit("m")] = 0.0
    overhang: Annotated[float, NotNegative, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        d = len(self.counts)
        if d not in (2, 3) or min(self.counts) < 1:
            raise InputError(
                f"BricksMesh: counts is {self.counts}; give 2 or 3 whole numbers of at least 1"
            )
        for name in ("lengths", "gaps"):
            if len(getattr(self, name)) != d:
                raise InputError(
                    f"BricksMesh: {name} is {getattr(self, name)} and counts {self.counts}; give "
                    "as many numbers of both"
                )
        check_divisions("BricksMesh", self.divisions, d, prod(self.counts))

    def grids(self) -> list[Grid]:
        """Return the grids of all bricks, layer by layer, and that of the table."""
        d = len(self.counts)
        steps = [length + gap for length, gap in zip(self.lengths, self.gaps, strict=True)]
        grids: list[Grid] = []
        # layers from below, in each from the back to the front and from the left to the right
        order = [range(n) for n in (self.counts[1], *self.counts[2:], self.counts[0])]
        for y, *z, x in product(*order):
            place = (x, y, *z)
            low = [step * i for step, i in zip(steps, place, strict=True)]
            high = [a + length for a, length in zip(low, self.lengths, strict=True)]
            grids.append(
                make_box(
                    low,
                    high,
                    divide_unlike(self.divisions, len(grids), self.unlike),
                    simplices=self.simplices,
                    name="_".join(["brick", *(str(i + 1) for i in place)]),
                    kin="bricks",
                    sides=self._name_sides(place),
                )
            )
        if self.table:
            grids.append(self._make_table(steps, d))
        return turn_grids(grids, self.angle)

    def _name_sides(self, place: tuple[int, ...]) -> list[tuple[str, str]]:
        """Return the names of the sides of the brick at a place, "" for those inside."""
        names = []
        for axis, (low, high) in enumerate(SIDES[: len(place)]):
            is_low = place[axis] == 0 and not (axis == 1 and self.table)
            is_high = place[axis] == self.counts[axis] - 1
            names.append((low if is_low else "", high if is_high else ""))
        return names

    def _make_table(self, steps: list[float], d: int) -> Grid:
        """Return the grid of the table, whose cells are as long as those of bricks.

        Args:
            steps: (d,) from one brick to the next [m].
            d: dimension.
        """
        low = [-self.overhang] * d
        high = []
        cells = []
        for axis in range(d):
            end = steps[axis] * self.counts[axis] - self.gaps[axis] + self.overhang
            size = self.lengths[axis] / self.divisions[axis]
            length = self.table if axis == 1 else end + self.overhang
            high.append(end)
            cells.append(max(1, round(length / size)))
        return make_ground(low, high, self.table, cells, simplices=self.simplices)
