"""Divide the channel and its layer into cells of one grid whose lines follow all their sides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vi_contact.meshes.extract import MeshArrays
from vi_contact.meshes.grid import Array
from vi_contact.meshes.rows import Mask, Rows


def channel_grid(x: Sequence[float], y: Sequence[float], size: float, *, triangles: bool = False) -> MeshArrays:
    """Divide channel and soil between the lines x (6,) and y (4,) of `ChannelMesh` into cells of about `size` [m].

    Diagonals of triangles run upwards to the middle of the channel on both sides of it: a symmetric layer has a
    symmetric mesh.
    """
    xs, ys = _divided(x, size), _divided(y, size)
    middle_x, middle_y = (0.5 * (line[1:] + line[:-1]) for line in (xs, ys))
    right, up = np.meshgrid(middle_x, middle_y, indexing="ij")
    notch = (x[1] < right) & (right < x[4]) & (up > y[1])
    inside = (x[2] < right) & (right < x[3]) & (up > y[2])
    bodies = [_body(xs, ys, kept, 0.5 * (x[1] + x[4]), triangles) for kept in (notch & ~inside, ~notch)]
    (points, cells, corner), (soil_points, soil_cells, soil_corner) = bodies
    interface = {"left": [(x[1:2], y[1:])], "base": [(x[1:5], y[1:2])], "right": [(x[4:5], y[1:])]}
    channel_lines = {f"channel_{side}": line for side, line in interface.items()} | {
        "channel_top": [(x[1:3], y[3:]), (x[3:5], y[3:])],
        "channel_inside": [(x[2:3], y[2:]), (x[2:4], y[2:3]), (x[3:4], y[2:])],
    }
    soil_lines = {f"soil_{side}": line for side, line in interface.items()} | {
        "bedrock": [(x, y[:1])], "left_side": [(x[:1], y)], "right_side": [(x[5:], y)],
        "surface": [(x[:2], y[3:]), (x[4:], y[3:])],
    }
    soil_corner = np.where(soil_corner < 0, -1, soil_corner + len(points))
    facets = {
        name: np.concatenate([_along(xs, ys, number, *line) for line in lines])
        for number, table in ((corner, channel_lines), (soil_corner, soil_lines)) for name, lines in table.items()
    }
    channel = np.arange(len(cells) + len(soil_cells)) < len(cells)
    return MeshArrays(
        "triangle" if triangles else "quadrilateral",
        np.concatenate([points, soil_points]),
        np.concatenate([cells, soil_cells + len(points)]),
        {"channel": channel, "soil": ~channel},
        facets,
    )


def _divided(places: Sequence[float], size: float) -> Array:
    """Divide every part between two places evenly into cells of about `size`."""
    parts = [
        low + (high - low) * np.arange(n) / n
        for low, high in zip(places, places[1:], strict=False)
        for n in [max(round((high - low) / size), 1)]
    ]
    return np.append(np.concatenate(parts), places[-1])


def _body(xs: Array, ys: Array, kept: Mask, middle: float, triangles: bool) -> tuple[Array, Rows, Rows]:
    """Return (points, cells, number of the point at every node of the grid, -1 for none) of the kept boxes."""
    column, row = np.nonzero(kept)
    around = np.stack([column, column + 1, column + 1, column]), np.stack([row, row, row + 1, row + 1])
    used = np.zeros((len(xs), len(ys)), dtype=bool)
    used[around] = True
    number = np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1)
    place = np.argwhere(used)
    boxes = number[around].T
    if triangles:
        rising, falling = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
        on_left = 0.5 * (xs[column] + xs[column + 1]) < middle
        boxes = np.where(on_left[:, None, None], boxes[:, rising], boxes[:, falling]).reshape(-1, 3)
    return np.column_stack([xs[place[:, 0]], ys[place[:, 1]]]), boxes.astype(np.int64), number.astype(np.int64)


def _along(xs: Array, ys: Array, number: Rows, x: Sequence[float], y: Sequence[float]) -> Rows:
    """Return the facets of a body on a straight line: from x[0] to x[-1] at one y, or from y[0] to y[-1] at one x."""
    i, j = (np.flatnonzero((line >= ends[0]) & (line <= ends[-1])) for line, ends in ((xs, x), (ys, y)))
    nodes = number[np.ix_(i, j)].reshape(-1)
    return np.column_stack([nodes[:-1], nodes[1:]])
