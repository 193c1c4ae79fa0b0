"""Mesh a U-shaped channel in a soil layer on bedrock.

It is that of Fig. 6 of the boundary method: two bodies with nodes of their own.

Physical groups: cells "channel", "soil"; boundary "bedrock" (y = 0), "left_side", "right_side" (x =
0, width), "surface" (y = depth); the interface from both sides, "channel_left", "channel_base",
"channel_right" and "soil_left", "soil_base", "soil_right", divided alike; "channel_inside" (what
the water wets) and "channel_top" (the tops of its walls, which end at the surface). Of two nodes at
one place the channel's comes first.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, counted
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit
from vi_contact.meshes.extract import MeshArrays, add_arrays
from vi_contact.meshes.grid import Array, add_outline
from vi_contact.meshes.rows import Mask, Rows


@dataclass(frozen=True, kw_only=True)
class ChannelMesh:
    """Describe a layer, width x depth, and a channel in it.

    The channel is `outer_width` x `height`, of `wall` and `slab`.

    `left` is x of the outer left side of the channel, which is in the middle by default. Every part
    is divided evenly into rectangles of about `size`, or with `triangles` into their halves.
    With `far` the mesh has irregular triangles, which grow from `size` at the channel to `far`
    at bedrock and sides. Raises InputError for sizes that make no such layer.
    """

    width: Annotated[float, Positive, Unit("m")] = 24.0
    depth: Annotated[float, Positive, Unit("m")] = 8.0
    outer_width: Annotated[float, Positive, Unit("m")] = 4.0
    height: Annotated[float, Positive, Unit("m")] = 3.0
    wall: Annotated[float, Positive, Unit("m")] = 0.5
    slab: Annotated[float, Positive, Unit("m")] = 0.5
    left: Annotated[float | None, Unit("m")] = None
    size: Annotated[float, Positive, Unit("m")] = 0.5
    far: Annotated[float | None, Positive, Unit("m")] = None
    triangles: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if not (2.0 * self.wall < self.outer_width and self.slab < self.height < self.depth):
            raise InputError(
                f"channel {self.outer_width} x {self.height} m with walls of {self.wall} m and a "
                f"slab of {self.slab} m does not fit a layer {self.depth} m deep: leave room "
                "inside it, and soil below it"
            )
        if not 0.0 < self.x[1] < self.x[4] < self.width:
            ends = f"from x = {self.x[1]} to {self.x[4]} m"
            raise InputError(
                f"channel {ends} needs soil on both sides: keep it between 0 and {self.width} m"
            )
        if self.far is not None and self.far < self.size:
            raise InputError(
                f"far is {self.far} m: give at least the cell size at the channel, {self.size} m"
            )
        grid = self.width / self.size * (self.depth / self.size)
        around = (self.outer_width + 2.0 * self.height) / self.size + self.width / (
            self.far or self.size
        )
        cells = (
            grid
            if self.far is None
            else max(around, self.width / self.far * (self.depth / self.far))
        )
        counted("channel", f"a cell size of {self.size} m", cells, "cells", most=MOST_CELLS)

    @property
    def x(self) -> tuple[float, ...]:
        """Return the ends of the layer, outer and inner sides of the walls.

        They go from left to right [m].
        """
        left = 0.5 * (self.width - self.outer_width) if self.left is None else self.left
        right = left + self.outer_width
        return 0.0, left, left + self.wall, right - self.wall, right, self.width

    @property
    def y(self) -> tuple[float, ...]:
        """Return the heights of bedrock, lower and upper side of the slab, surface [m]."""
        return 0.0, self.depth - self.height, self.depth - self.height + self.slab, self.depth

    def build(self, gmsh: Any) -> None:
        """Add both bodies to Gmsh's current model."""
        x, y, size = self.x, self.y, self.size
        if self.far is None:
            add_arrays(gmsh, channel_grid(x, y, size, triangles=self.triangles))
            return
        sides = ("left", "base", "right")
        u = [(x[1], y[3]), (x[1], y[1]), (x[4], y[1]), (x[4], y[3])]  # what both bodies share
        inside = [(x[3], y[3]), (x[3], y[2]), (x[2], y[2]), (x[2], y[3])]
        names = [
            *(f"channel_{side}" for side in sides),
            "channel_top",
            *["channel_inside"] * 3,
            "channel_top",
        ]
        # on both bodies
        shared = [max(round(math.dist(one, two) / size), 1) for one, two in pairwise(u)]
        add_outline(gmsh.model, "channel", u + inside, names, [size] * 8, shared)
        layer = [(x[5], y[3]), (x[5], 0.0), (0.0, 0.0), (0.0, y[3])]
        names = [
            *(f"soil_{side}" for side in sides),
            "surface",
            "right_side",
            "bedrock",
            "left_side",
            "surface",
        ]
        add_outline(gmsh.model, "soil", u + layer, names, [size] * 4 + [self.far] * 4, shared)
        gmsh.model.mesh.generate(2)


def channel_grid(
    x: Sequence[float], y: Sequence[float], size: float, *, triangles: bool = False
) -> MeshArrays:
    """Divide channel and soil between the lines x (6,) and y (4,) of `ChannelMesh`.

    The cells are of about `size` [m].

    Diagonals of triangles run upwards to the middle of the channel on both sides of it: symmetric
    layers stay so.
    """
    xs, ys = _divided(x, size), _divided(y, size)
    middle_x, middle_y = (0.5 * (line[1:] + line[:-1]) for line in (xs, ys))
    right, up = np.meshgrid(middle_x, middle_y, indexing="ij")
    notch = (x[1] < right) & (right < x[4]) & (up > y[1])
    inside = (x[2] < right) & (right < x[3]) & (up > y[2])
    bodies = [
        _body(xs, ys, kept, 0.5 * (x[1] + x[4]), triangles) for kept in (notch & ~inside, ~notch)
    ]
    (points, cells, corner), (soil_points, soil_cells, soil_corner) = bodies
    interface = {"left": [(x[1:2], y[1:])], "base": [(x[1:5], y[1:2])], "right": [(x[4:5], y[1:])]}
    channel_lines = {f"channel_{side}": line for side, line in interface.items()} | {
        "channel_top": [(x[1:3], y[3:]), (x[3:5], y[3:])],
        "channel_inside": [(x[2:3], y[2:]), (x[2:4], y[2:3]), (x[3:4], y[2:])],
    }
    soil_lines = {f"soil_{side}": line for side, line in interface.items()} | {
        "bedrock": [(x, y[:1])],
        "left_side": [(x[:1], y)],
        "right_side": [(x[5:], y)],
        "surface": [(x[:2], y[3:]), (x[4:], y[3:])],
    }
    soil_corner = np.where(soil_corner < 0, -1, soil_corner + len(points))
    facets = {
        name: np.concatenate([_along(xs, ys, number, *line) for line in lines])
        for number, table in ((corner, channel_lines), (soil_corner, soil_lines))
        for name, lines in table.items()
    }
    channel = np.arange(len(cells) + len(soil_cells)) < len(cells)
    cells = np.concatenate([cells, soil_cells + len(points)])
    return MeshArrays(
        "triangle" if triangles else "quadrilateral",
        np.concatenate([points, soil_points]),
        cells,
        {"channel": channel, "soil": ~channel},
        facets,
    )


def _divided(places: Sequence[float], size: float) -> Array:
    """Divide every part between two places evenly into cells of about `size`."""
    parts = [
        low + (high - low) * np.arange(n) / n
        for low, high in pairwise(places)
        for n in [max(round((high - low) / size), 1)]
    ]
    return np.append(np.concatenate(parts), places[-1])


def _body(
    xs: Array, ys: Array, kept: Mask, middle: float, triangles: bool
) -> tuple[Array, Rows, Rows]:
    """Return (points, cells, numbers of the points) of the kept boxes.

    The numbers are those of the point at every node of the grid, -1 for none.
    """
    column, row = np.nonzero(kept)
    around = (
        np.stack([column, column + 1, column + 1, column]),
        np.stack([row, row, row + 1, row + 1]),
    )
    used = np.zeros((len(xs), len(ys)), dtype=bool)
    used[around] = True
    number = np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1)
    place = np.argwhere(used)
    boxes = number[around].T
    if triangles:
        rising, falling = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
        on_left = 0.5 * (xs[column] + xs[column + 1]) < middle
        boxes = np.where(on_left[:, None, None], boxes[:, rising], boxes[:, falling]).reshape(-1, 3)
    return (
        np.column_stack([xs[place[:, 0]], ys[place[:, 1]]]),
        boxes.astype(np.int64),
        number.astype(np.int64),
    )


def _along(xs: Array, ys: Array, number: Rows, x: Sequence[float], y: Sequence[float]) -> Rows:
    """Return the facets of a body on a straight line.

    It goes from x[0] to x[-1] at one y, or from y[0] to y[-1] at one x.
    """
    i, j = (
        np.flatnonzero((line >= ends[0]) & (line <= ends[-1])) for line, ends in ((xs, x), (ys, y))
    )
    nodes = number[np.ix_(i, j)].reshape(-1)
    return np.column_stack([nodes[:-1], nodes[1:]])
