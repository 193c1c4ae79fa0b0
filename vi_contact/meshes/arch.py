"""Mesh a round arch of voussoirs with radial joints, each a body of its own.

The centre is the origin, the arch is symmetric to the y axis, and its joints divide the opening
evenly.

Physical groups: cells "voussoirs" and "voussoir_1", "voussoir_2", … from the left; boundary
"intrados", "extrados" (the inner and the outer side), "left_springing", "right_springing" and in
space "back", "front" (z). With abutments the springings have no names, as they are joints: there
are cells "left_abutment", "right_abutment" and boundary "left_end", "right_end", their far sides.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Between, NotNegative, Positive, Unit
from vi_contact.meshes.grid import Grid
from vi_contact.meshes.stones import (
    OfGrids,
    check_divisions,
    divide_unlike,
    make_box,
    move_nodes,
    turn_grids,
)


@dataclass(frozen=True, kw_only=True)
class ArchMesh(OfGrids):
    """Describe a round arch of voussoirs, in the plane or in space.

    Attributes:
        voussoirs: of equal angles.
        radius: of the centre line [m].
        thickness: of the ring [m].
        opening: angle of the whole arch [rad]; pi for a semicircle.
        depth: along z [m]; None for an arch in the plane.
        curved: whether the nodes of inner and outer sides lie on circles; otherwise these sides are
            straight.
        divisions: (d,) cells along the arch, across the ring and along z; None for 2, 4 and 2.
        unlike: how many more cells a voussoir may have along a side, so that meshes of neighbours
            do not match; 0 for voussoirs that are divided alike.
        simplices: whether rectangles and boxes are split.
        abutment: length of a body at each springing, as thick as the ring [m]; 0 for none.
        angle: of a turn about the origin, in space about the z axis [rad].

    Raises:
        InputError: sizes that make no arch.
    """

    voussoirs: Annotated[int, Positive] = 16
    radius: Annotated[float, Positive, Unit("m")] = 1.0
    thickness: Annotated[float, Positive, Unit("m")] = 0.15
    opening: Annotated[float, Between(0.0, 6.0, "(]"), Unit("rad")] = math.pi
    depth: Annotated[float | None, Positive, Unit("m")] = None
    curved: bool = False
    divisions: tuple[int, ...] | None = None
    unlike: Annotated[int, NotNegative] = 0
    simplices: bool = False
    abutment: Annotated[float, NotNegative, Unit("m")] = 0.0
    angle: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        check_divisions("ArchMesh", self.cells, 2 if self.depth is None else 3, self.voussoirs)
        if self.thickness >= 2.0 * self.radius:
            raise InputError(
                f"ArchMesh: thickness is {self.thickness} m and radius {self.radius} m; give a "
                "ring that leaves its centre free"
            )
        if self.opening / self.voussoirs >= math.pi:
            raise InputError(
                f"ArchMesh: {self.voussoirs} voussoirs for an opening of {self.opening:g} rad; "
                "give more, so that each turns by less than pi"
            )

    @property
    def cells(self) -> tuple[int, ...]:
        """Return the cells along the sides of a voussoir."""
        if self.divisions is not None:
            return tuple(self.divisions)
        return (2, 4) if self.depth is None else (2, 4, 2)

    @property
    def joint_angles(self) -> Array:
        """Return the angles (voussoirs + 1,) of the joints to the y axis, from the left [rad]."""
        n = self.voussoirs
        # symmetric to the last digit
        return 0.5 * self.opening * (2.0 * np.arange(n + 1) - n) / n

    def grids(self) -> list[Grid]:
        """Return the grids of all voussoirs from the left, and those of the abutments."""
        last = self.voussoirs - 1
        grids = []
        for number in range(self.voussoirs):
            free = not self.abutment
            along = (
                "left_springing" if free and number == 0 else "",
                "right_springing" if free and number == last else "",
            )
            sides = [along, ("intrados", "extrados"), ("back", "front")]
            cells = divide_unlike(self.cells, number, self.unlike)
            grids.append(self._make_voussoir(number, cells, sides))
        if self.abutment:
            grids += [self._make_abutment(right=False), self._make_abutment(right=True)]
        return turn_grids(grids, self.angle)

    def _make_voussoir(
        self, number: int, cells: tuple[int, ...], sides: list[tuple[str, str]]
    ) -> Grid:
        """Return the grid of a voussoir.

        Args:
            number: its number, from 0.
            cells: along its sides.
            sides: names of its sides.
        """
        start, end = self.joint_angles[number : number + 2]
        box = self._make_unit(cells, f"voussoir_{number + 1}", "voussoirs", sides)

        def shape(points: Array) -> Array:
            share = points[:, 0]
            if self.curved:
                return self._place((1.0 - share) * start + share * end, points)
            first = self._place(np.full_like(share, start), points)
            second = self._place(np.full_like(share, end), points)
            return (1.0 - share)[:, None] * first + share[:, None] * second

        return move_nodes(box, shape)

    def _make_abutment(self, *, right: bool) -> Grid:
        """Return the grid of an abutment: the ring goes straight on from the last joint."""
        side = "right" if right else "left"
        ends = ("", "right_end") if right else ("left_end", "")
        angle = self.joint_angles[-1 if right else 0]
        tangent = np.array([math.cos(angle), -math.sin(angle), 0.0])
        box = self._make_unit(self.cells, f"{side}_abutment", "", [ends, ("", ""), ("", "")])

        def shape(points: Array) -> Array:
            way = points[:, 0] if right else points[:, 0] - 1.0
            moved = self._place(np.full_like(way, angle), points)
            return moved + self.abutment * way[:, None] * tangent[: points.shape[1]]

        return move_nodes(box, shape)

    def _make_unit(
        self, cells: tuple[int, ...], name: str, kin: str, sides: list[tuple[str, str]]
    ) -> Grid:
        """Return the grid of the unit square, or of a box of this depth."""
        d = len(cells)
        high = [1.0, 1.0, 1.0 if self.depth is None else self.depth]
        return make_box(
            [0.0] * d,
            high[:d],
            cells,
            simplices=self.simplices,
            name=name,
            kin=kin,
            sides=sides[:d],
        )

    def _place(self, angle: Array, points: Array) -> Array:
        """Return points (n, d) of the ring [m].

        Args:
            angle: (n,) to the y axis [rad].
            points: (n, d), whose second coordinate is the share of the thickness from within.
        """
        radius = self.radius + self.thickness * (points[:, 1] - 0.5)
        moved = points.copy()
        moved[:, 0] = radius * np.sin(angle)
        moved[:, 1] = radius * np.cos(angle)
        return moved
