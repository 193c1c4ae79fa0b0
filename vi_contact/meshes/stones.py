"""Make the grids of stones: what walls, columns, arches and arrays of bricks have in common.

Every stone is a body with nodes of its own. It is a cell group by itself, and all stones together
are another one. Sides that look outwards carry the names of the whole; joints have no names, as
they are found from the geometry (``fem.find_joints``).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import SIDES, BlockMesh
from vi_contact.meshes.grid import Grid, add_grids

# of a bed, such as the ground: names of its sides
BED_SIDES = [(f"ground_{low}", f"ground_{high}") for low, high in SIDES]


class OfGrids(ABC):
    """Put the grids of a mesh into Gmsh's model."""

    @abstractmethod
    def grids(self) -> list[Grid]:
        """Return the grids of all bodies."""

    def build(self, gmsh: Any) -> None:
        """Add all bodies to Gmsh's current model."""
        add_grids(gmsh, self.grids())


def divide_unlike(divisions: Sequence[int], number: int, unlike: int) -> tuple[int, ...]:
    """Return the cells of a stone along each axis.

    Along each axis the stone number k has (k + 2 axis) mod (unlike + 1) cells more than it is asked
    for, so that neighbours in a row are divided differently.

    Args:
        divisions: cells that are asked for.
        number: of the stone.
        unlike: how many more there may be; 0 for stones that are divided alike.
    """
    return tuple(n + (number + 2 * axis) % (unlike + 1) for axis, n in enumerate(divisions))


def make_box(
    low: Sequence[float],
    high: Sequence[float],
    divisions: Sequence[int],
    *,
    simplices: bool,
    name: str,
    kin: str = "",
    sides: Sequence[tuple[str, str]] | None = None,
) -> Grid:
    """Return the grid of a stone between two corners.

    Args:
        low: (d,) its lowest corner [m].
        high: (d,) its highest corner [m].
        divisions: (d,) cells along its sides.
        simplices: whether rectangles and boxes are split.
        name: of its cells.
        kin: of the group of all stones.
        sides: names of its sides, as ``Grid`` has them; None for none.
    """
    lengths = tuple(b - a for a, b in zip(low, high, strict=True))
    box = BlockMesh(
        lengths=lengths, divisions=tuple(divisions), corner=tuple(low), simplices=simplices
    )
    names = [("", "")] * len(lengths) if sides is None else sides
    return Grid(box.points(), simplices, name, names, kin)


def make_ground(
    low: Sequence[float],
    high: Sequence[float],
    depth: float,
    divisions: Sequence[int],
    *,
    simplices: bool,
) -> Grid:
    """Return the grid of the ground below y = 0, the body "ground".

    Args:
        low: (d,) least coordinates of it; that along y is not read [m].
        high: (d,) largest ones [m].
        depth: of the ground [m].
        divisions: (d,) cells along its sides.
        simplices: whether rectangles and boxes are split.
    """
    bottom = (low[0], -depth, *low[2:])
    top = (high[0], 0.0, *high[2:])
    sides = BED_SIDES[: len(bottom)]
    return make_box(bottom, top, divisions, simplices=simplices, name="ground", sides=sides)


def move_nodes(grid: Grid, move: Callable[[Array], Array]) -> Grid:
    """Return the grid with its nodes moved.

    Args:
        grid: of a body.
        move: points (n, d) [m] -> points (n, d) [m].
    """
    d = grid.nodes.shape[-1]
    return replace(grid, nodes=move(grid.nodes.reshape(-1, d)).reshape(grid.nodes.shape))


def turn_grids(grids: Sequence[Grid], angle: float) -> list[Grid]:
    """Return the grids turned about the origin, in space about the z axis, by an angle [rad]."""
    if not angle:
        return list(grids)
    turn = np.eye(grids[0].nodes.shape[-1])
    turn[0, 0] = math.cos(angle)
    turn[0, 1] = -math.sin(angle)
    turn[1, 0] = math.sin(angle)
    turn[1, 1] = math.cos(angle)
    return [move_nodes(grid, lambda points: points @ turn.T) for grid in grids]


def check_divisions(owner: str, divisions: Sequence[int], dimension: int, stones: int) -> None:
    """Raise InputError for the wrong number of divisions, for none, and for too many cells.

    Args:
        owner: the mesh that asks.
        divisions: cells along the sides of one stone.
        dimension: 2 or 3.
        stones: how many there are.
    """
    if len(divisions) != dimension or min(divisions) < 1:
        raise InputError(
            f"{owner}: divisions is {tuple(divisions)}; give {dimension} whole numbers of cells of "
            "at least 1, one for each side of a stone"
        )
    cells = stones * math.prod(divisions)
    check_count(owner, f"divisions {tuple(divisions)}", cells, "cells", most=MOST_CELLS)
