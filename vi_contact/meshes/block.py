"""Mesh a bar, rectangle or box, evenly divided, bent by a smooth map and turned as wanted.

Physical groups: cells "block"; boundary "left", "right" (x lowest, highest), "bottom", "top" (y),
"back", "front" (z, front towards the viewer). A bar has the first two, a rectangle four, a box
six.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Unit
from vi_contact.meshes.grid import Array, Grid, add_grids, lattice

SIDES = (("left", "right"), ("bottom", "top"), ("back", "front"))


@dataclass(frozen=True, kw_only=True)
class BlockMesh:
    """Describe a mesh of a d-dimensional box, d = len(lengths) = 1, 2 or 3.

    A node starts at corner + (i lengths_x/n_x, ...), is moved by `deform`, then turned.

    Attributes:
        lengths: (d,) of the sides [m].
        divisions: (d,) number of cells along each side.
        simplices: whether rectangles and boxes are split along a diagonal.
        corner: (d,) where the lowest corner is [m]; None for the origin.
        deform: function of points (n, d) that returns points (n, d) [m]; None for no change.
        angle: of a turn about the origin, or about the z axis in space [rad].

    Raises:
        InputError: sizes that make no box.
    """

    lengths: Annotated[tuple[float, ...], Unit("m")] = (1.0, 1.0)
    divisions: tuple[int, ...] = (1, 1)
    simplices: bool = False
    corner: Annotated[tuple[float, ...] | None, Unit("m")] = None
    deform: Annotated[Callable[[Array], Array] | None, Unit("m")] = None
    angle: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        check_box(self.lengths, self.divisions)
        if self.corner is not None and len(self.corner) != len(self.lengths):
            raise InputError(
                f"block corner is {self.corner}: give {len(self.lengths)} coordinates, one per "
                "length"
            )
        if self.angle and len(self.lengths) == 1:
            raise InputError(
                "a bar in one dimension cannot be turned: leave the angle out or give two lengths"
            )

    def points(self) -> Array:
        """Return all nodes (n_1+1, ..., n_d+1, d) [m]."""
        nodes = lattice(self.lengths, self.divisions)
        if self.corner is not None:
            nodes = nodes + np.asarray(self.corner)
        if self.deform is not None:
            straight = nodes.reshape(-1, nodes.shape[-1])
            moved = np.asarray(self.deform(straight))
            if moved.shape != straight.shape:
                raise InputError(
                    f"deform returned shape {moved.shape} for points {straight.shape}: return that "
                    "shape"
                )
            nodes = moved.reshape(nodes.shape)
        if self.angle:
            x = nodes[..., 0]
            y = nodes[..., 1]
            c = math.cos(self.angle)
            s = math.sin(self.angle)
            turned = np.stack([c * x - s * y, s * x + c * y], axis=-1)
            nodes = np.concatenate([turned, nodes[..., 2:]], axis=-1)
        return nodes

    def build(self, gmsh: Any) -> None:
        """Add the block to Gmsh's current model."""
        add_grids(gmsh, self.grids())

    def grids(self) -> list[Grid]:
        """Return the one grid it is."""
        return [Grid(self.points(), self.simplices, "block", SIDES[: len(self.lengths)])]


def check_box(lengths: Sequence[float], divisions: Sequence[int]) -> None:
    """Raise InputError unless there are 1 to 3 positive lengths [m] and numbers of divisions."""
    if not 1 <= len(lengths) <= 3 or len(divisions) != len(lengths):
        raise InputError(
            f"lengths {tuple(lengths)} and divisions {tuple(divisions)}: give 1, 2 or 3 numbers of "
            "both"
        )
    if not all(math.isfinite(length) and length > 0.0 for length in lengths):
        raise InputError(f"lengths is {tuple(lengths)}: give positive numbers of metres")
    if not all(n == n // 1 and n >= 1 for n in divisions):
        raise InputError(
            f"divisions is {tuple(divisions)}: give whole numbers of cells, at least 1"
        )
    check_count(
        "mesh", f"divisions {tuple(divisions)}", math.prod(divisions), "cells", most=MOST_CELLS
    )
