"""Mesh a wall of stones in running bond, each stone a body of its own.

The wall stands on y = 0, from x = 0 on. Courses are counted from below. In every other course the
stones are moved by half a stone, with half stones at both ends. A wall in space has one row of
stones across, or several; with several the stones of every other course are moved by half a stone
across too, so that a stone lies on four.

Physical groups: cells "stones", and one for each stone, "stone_2_3" (course 2, third from the left)
or "stone_2_3_1" in space (first from the back); boundary "left", "right" (x lowest, highest),
"bottom", "top" (y), "back", "front" (z) of the wall. With ground there are cells "ground" and
boundary "ground_left", "ground_right", "ground_bottom", "ground_top", "ground_back",
"ground_front".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Annotated

from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import NotNegative, Positive, Unit
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
class MasonryMesh(OfGrids):
    """Describe a wall in running bond, in the plane or in space.

    Nodes of joints coincide where the numbers of cells along and across a stone are even and
    ``unlike`` is 0.

    Attributes:
        stones: in a course, two halves counted as one.
        courses: above each other.
        length: of a stone, along x [m].
        height: of a course, along y [m].
        depth: of a stone, along z [m]; None for a wall in the plane.
        rows: of stones across the wall, in space.
        half_first: whether half stones stand in courses 1, 3, 5, … instead of 2, 4, 6, ….
        head_gap: between neighbours in a course [m].
        divisions: (d,) cells along the sides of a whole stone; None for 4, 2 and 2.
        unlike: how many more cells a stone may have along a side, so that meshes of neighbours do
            not match; 0 for stones that are divided alike.
        simplices: whether rectangles and boxes are split.
        ground: depth of the ground below the wall, wider by a stone on each side [m]; 0 for none.
        angle: of a turn about the origin, in space about the z axis [rad].

    Raises:
        InputError: sizes that make no wall.
    """

    stones: Annotated[int, Positive] = 5
    courses: Annotated[int, Positive] = 6
    length: Annotated[float, Positive, Unit("m")] = 0.4
    height: Annotated[float, Positive, Unit("m")] = 0.175
    depth: Annotated[float | None, Positive, Unit("m")] = None
    rows: Annotated[int, Positive] = 1
    half_first: bool = False
    head_gap: Annotated[float, NotNegative, Unit("m")] = 0.0
    divisions: tuple[int, ...] | None = None
    unlike: Annotated[int, NotNegative] = 0
    simplices: bool = False
    ground: Annotated[float, NotNegative, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        dimension = 2 if self.depth is None else 3
        count = (self.stones + 1) * self.courses * (self.rows + 1)
        check_divisions("MasonryMesh", self.cells, dimension, count)
        if dimension == 2 and self.rows > 1:
            raise InputError(
                f"MasonryMesh: rows is {self.rows} and depth is None; give the depth of a stone "
                "along z, or one row"
            )
        least = 0.5 * min(self.length, self.length if self.depth is None else self.depth)
        if self.head_gap >= least:
            raise InputError(
                f"MasonryMesh: head_gap is {self.head_gap} m and half a stone {least:g} m; give a "
                "gap that leaves half stones some length"
            )

    @property
    def cells(self) -> tuple[int, ...]:
        """Return the cells along the sides of a whole stone."""
        if self.divisions is not None:
            return tuple(self.divisions)
        return (4, 2) if self.depth is None else (4, 2, 2)

    def grids(self) -> list[Grid]:
        """Return the grids of all stones, course by course, and that of the ground."""
        grids: list[Grid] = []
        for course in range(self.courses):
            halved = (course % 2 == 0) == self.half_first
            columns = _lay_row(self.stones, self.length, halved, self.head_gap)
            rows = [(0.0, 1.0)]  # of the plane, not read
            if self.depth is not None:
                rows = _lay_row(self.rows, self.depth, halved and self.rows > 1, self.head_gap)
            for (i, column), (k, row) in product(enumerate(columns), enumerate(rows)):
                ends = (i == 0, i == len(columns) - 1, k == 0, k == len(rows) - 1)
                grids.append(self._make_stone(len(grids), course, (i, k), column, row, ends))
        if self.ground:
            grids.append(self._make_ground())
        return turn_grids(grids, self.angle)

    def _make_stone(
        self,
        number: int,
        course: int,
        place: tuple[int, int],
        column: tuple[float, float],
        row: tuple[float, float],
        ends: tuple[bool, bool, bool, bool],
    ) -> Grid:
        """Return the grid of one stone.

        Args:
            number: of the stone, from 0.
            course: its course, from 0.
            place: its place along and across the wall, from 0.
            column: from where to where it reaches along the wall [m].
            row: from where to where it reaches across the wall [m].
            ends: whether it stands at the left, right, back, front end.
        """
        low = [column[0], course * self.height]
        high = [column[1], (course + 1) * self.height]
        base = course == 0 and not self.ground
        top = course == self.courses - 1
        sides = [
            ("left" if ends[0] else "", "right" if ends[1] else ""),
            ("bottom" if base else "", "top" if top else ""),
        ]
        name = f"stone_{course + 1}_{place[0] + 1}"
        cells = [_divide_part(self.cells[0], column, self.length), self.cells[1]]
        if self.depth is not None:
            low.append(row[0])
            high.append(row[1])
            sides.append(("back" if ends[2] else "", "front" if ends[3] else ""))
            name = f"{name}_{place[1] + 1}"
            cells.append(_divide_part(self.cells[2], row, self.depth))
        return make_box(
            low,
            high,
            divide_unlike(cells, number, self.unlike),
            simplices=self.simplices,
            name=name,
            kin="stones",
            sides=sides,
        )

    def _make_ground(self) -> Grid:
        """Return the grid of the ground, divided like whole stones."""
        low = [-self.length, 0.0]
        high = [(self.stones + 1) * self.length, 0.0]
        cells = [(self.stones + 2) * self.cells[0], self.cells[1]]
        if self.depth is not None:
            low.append(-self.depth)
            high.append((self.rows + 1) * self.depth)
            cells.append((self.rows + 2) * self.cells[2])
        return make_ground(low, high, self.ground, cells, simplices=self.simplices)


def _lay_row(count: int, length: float, halved: bool, gap: float) -> list[tuple[float, float]]:
    """Return from where to where each stone of a row reaches [m].

    Args:
        count: of whole stones.
        length: of a whole stone with its gap [m].
        halved: whether the row begins and ends with half a stone.
        gap: between neighbours [m].
    """
    places = [float(i) for i in range(count + 1)]
    if halved:
        places = [0.0, *(i + 0.5 for i in range(count)), float(count)]
    parts = []
    for first, last in pairwise(places):
        low = first * length + (0.5 * gap if first > 0.0 else 0.0)
        high = last * length - (0.5 * gap if last < count else 0.0)
        parts.append((low, high))
    return parts


def _divide_part(cells: int, part: Sequence[float], length: float) -> int:
    """Return the cells of a part of a stone: as many as it has, or half of them rounded up."""
    is_half = part[1] - part[0] < 0.75 * length
    return -(-cells // 2) if is_half else cells
