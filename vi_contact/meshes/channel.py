"""Mesh a U-shaped channel in a soil layer on bedrock, Fig. 6 of the boundary method.

The channel and the soil are two bodies with nodes of their own.

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
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit
from vi_contact.meshes.extract import MeshArrays, add_arrays
from vi_contact.meshes.grid import Array, add_outline
from vi_contact.meshes.rows import Mask, Rows


@dataclass(frozen=True, kw_only=True)
class ChannelMesh:
    """Describe a soil layer and a channel in it.

    Every part is divided evenly into rectangles or their halves; with ``far`` the mesh has
    irregular triangles.

    Attributes:
        width: of the layer [m].
        depth: of the layer [m].
        outer_width: of the channel, from outer side to outer side [m].
        height: of the channel, which ends at the surface [m].
        wall: thickness of its walls [m].
        slab: thickness of its slab [m].
        left: x of the outer left side of the channel [m]; None for a channel in the middle.
        size: of the cells, or of those at the channel [m].
        far: size of irregular triangles at bedrock and sides [m]; None for an even mesh.
        triangles: whether rectangles are halved.

    Raises:
        InputError: sizes that make no such layer.
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
        if self.far is None:
            cells = self.width / self.size * (self.depth / self.size)
        else:
            around = (self.outer_width + 2.0 * self.height) / self.size + self.width / self.far
            cells = max(around, self.width / self.far * (self.depth / self.far))
        check_count("channel", f"a cell size of {self.size} m", cells, "cells", most=MOST_CELLS)

    @property
    def x(self) -> tuple[float, ...]:
        """Return, from left to right, the ends of the layer and the sides of both walls [m]."""
        left = 0.5 * (self.width - self.outer_width) if self.left is None else self.left
        right = left + self.outer_width
        return 0.0, left, left + self.wall, right - self.wall, right, self.width

    @property
    def y(self) -> tuple[float, ...]:
        """Return the heights of bedrock, lower and upper side of the slab, surface [m]."""
        return 0.0, self.depth - self.height, self.depth - self.height + self.slab, self.depth

    def build(self, gmsh: Any) -> None:
        """Add both bodies to Gmsh's current model."""
        x = self.x
        y = self.y
        size = self.size
        if self.far is None:
            add_arrays(gmsh, channel_grid(x, y, size, triangles=self.triangles))
            return
        # The U that both bodies share, divided alike on both.
        u = [(x[1], y[3]), (x[1], y[1]), (x[4], y[1]), (x[4], y[3])]
        shared = [max(round(math.dist(start, end) / size), 1) for start, end in pairwise(u)]

        inside = [(x[3], y[3]), (x[3], y[2]), (x[2], y[2]), (x[2], y[3])]
        names = [
            "channel_left",
            "channel_base",
            "channel_right",
            "channel_top",
            "channel_inside",
            "channel_inside",
            "channel_inside",
            "channel_top",
        ]
        add_outline(gmsh.model, "channel", u + inside, names, [size] * 8, shared)

        layer = [(x[5], y[3]), (x[5], 0.0), (0.0, 0.0), (0.0, y[3])]
        names = [
            "soil_left",
            "soil_base",
            "soil_right",
            "surface",
            "right_side",
            "bedrock",
            "left_side",
            "surface",
        ]
        sizes = [size] * 4 + [self.far] * 4
        add_outline(gmsh.model, "soil", u + layer, names, sizes, shared)
        gmsh.model.mesh.generate(2)


def channel_grid(
    x: Sequence[float], y: Sequence[float], size: float, *, triangles: bool = False
) -> MeshArrays:
    """Divide channel and soil into cells of about one size.

    Diagonals of triangles run upwards to the middle of the channel on both sides of it: symmetric
    layers stay so.

    Args:
        x: (6,), vertical lines of `ChannelMesh` [m].
        y: (4,), horizontal lines of `ChannelMesh` [m].
        size: of the cells [m].
        triangles: whether rectangles are halved.
    """
    # All boxes of one grid: those of the channel, those that are cut out inside it, the others.
    xs = _divide(x, size)
    ys = _divide(y, size)
    middle_x = 0.5 * (xs[1:] + xs[:-1])
    middle_y = 0.5 * (ys[1:] + ys[:-1])
    right, up = np.meshgrid(middle_x, middle_y, indexing="ij")
    notch = (x[1] < right) & (right < x[4]) & (up > y[1])
    inside = (x[2] < right) & (right < x[3]) & (up > y[2])
    middle = 0.5 * (x[1] + x[4])
    points, cells, corner = _mesh_body(xs, ys, notch & ~inside, middle, triangles)
    soil_points, soil_cells, soil_corner = _mesh_body(xs, ys, ~notch, middle, triangles)

    # Boundary groups, as lines (x, y) of the grid.
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
    facets = {}
    for number, table in ((corner, channel_lines), (soil_corner, soil_lines)):
        for name, lines in table.items():
            on_lines = [_collect_facets(xs, ys, number, *line) for line in lines]
            facets[name] = np.concatenate(on_lines)

    # Both bodies in one mesh, the channel first.
    channel = np.arange(len(cells) + len(soil_cells)) < len(cells)
    cells = np.concatenate([cells, soil_cells + len(points)])
    return MeshArrays(
        "triangle" if triangles else "quadrilateral",
        np.concatenate([points, soil_points]),
        cells,
        {"channel": channel, "soil": ~channel},
        facets,
    )


def _divide(places: Sequence[float], size: float) -> Array:
    """Divide every part between two places evenly into cells of about `size`."""
    parts = []
    for low, high in pairwise(places):
        n = max(round((high - low) / size), 1)
        parts.append(low + (high - low) * np.arange(n) / n)
    return np.append(np.concatenate(parts), places[-1])


def _mesh_body(
    xs: Array, ys: Array, chosen: Mask, middle: float, triangles: bool
) -> tuple[Array, Rows, Rows]:
    """Mesh the chosen boxes of a grid.

    Args:
        xs: (n + 1,), vertical lines of the grid [m].
        ys: (m + 1,), horizontal lines of the grid [m].
        chosen: (n, m), which boxes are part of the body.
        middle: x on both sides of which diagonals rise to it [m].
        triangles: whether boxes are halved.

    Returns:
        The points, the cells, and the number of the point at every node (n + 1, m + 1) of the grid,
        -1 for none.
    """
    column, row = np.nonzero(chosen)
    columns_around = np.stack([column, column + 1, column + 1, column])
    rows_around = np.stack([row, row, row + 1, row + 1])
    around = (columns_around, rows_around)
    has_point = np.zeros((len(xs), len(ys)), dtype=bool)
    has_point[around] = True
    number = np.where(has_point, np.cumsum(has_point).reshape(has_point.shape) - 1, -1)
    place = np.argwhere(has_point)
    boxes = number[around].T
    if triangles:
        rising = [[0, 1, 2], [0, 2, 3]]
        falling = [[0, 1, 3], [1, 2, 3]]
        on_left = 0.5 * (xs[column] + xs[column + 1]) < middle
        boxes = np.where(on_left[:, None, None], boxes[:, rising], boxes[:, falling]).reshape(-1, 3)
    points = np.column_stack([xs[place[:, 0]], ys[place[:, 1]]])
    return points, boxes.astype(np.int64), number.astype(np.int64)


def _collect_facets(
    xs: Array, ys: Array, number: Rows, x: Sequence[float], y: Sequence[float]
) -> Rows:
    """Return the facets of a body on a straight line of the grid.

    Args:
        xs: vertical lines of the grid [m].
        ys: horizontal lines of the grid [m].
        number: of the point at every node of the grid.
        x: from x[0] to x[-1], or one x [m].
        y: from y[0] to y[-1], or one y [m].
    """
    i = np.flatnonzero((xs >= x[0]) & (xs <= x[-1]))
    j = np.flatnonzero((ys >= y[0]) & (ys <= y[-1]))
    nodes = number[np.ix_(i, j)].reshape(-1)
    return np.column_stack([nodes[:-1], nodes[1:]])
