"""Draw the cells of bodies moved by the mechanism of a limit load that load steps have found."""

from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.errors import InputError
from ...fem import compat
from ...run.limit_load import LimitLoad
from .axes_in_plane import FIXED, STONES, make_axis

STILL = 1e-3  # of the largest displacement: a body that moves less stays in grey
# corners -> their order round a cell
ROUND = {3: (0, 1, 2), 4: (0, 1, 3, 2)}


def draw_moved_cells(limit: LimitLoad, size: float) -> Any:
    """Return a figure of cells where they stand, in grey, and moved.

    Args:
        limit: of ``limit_load`` or ``tilt``, of bodies in the plane on one rank.
        size: largest displacement, over the size of the whole.

    Raises:
        InputError: bodies without a mesh in the plane, bodies on several ranks.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    space: Any = limit.problem.system.space
    if getattr(space, "V", None) is None or space.dimension != 2:
        raise InputError(
            "plot_mechanism: the bodies have no mesh in the plane: write fields instead"
        )
    if limit.problem.surface.comm.size > 1:
        raise InputError("plot_mechanism: the bodies are on several ranks: draw those of one rank")

    # the increment alone, without what supports prescribe
    d = limit.problem.cartesian(limit.mechanism.u)
    shift = space.expand(d, 0.0) - space.expand(np.zeros_like(d), 0.0)
    cells = compat.cell_blocks(space.V)
    if space.absent is not None:
        cells = cells[~space.absent]
    corners = cells[:, _find_corners(cells.shape[1])]
    polygons = space.points[corners]
    whole = float(np.ptp(space.points, axis=0).max())
    moved = polygons + size * whole * shift[corners]
    figure, axis = make_axis(np.concatenate([polygons.reshape(-1, 2), moved.reshape(-1, 2)]))
    axis.add_collection(LineCollection(_list_sides(polygons), colors="#bbbbbb", lw=0.6, zorder=1))
    colours = _choose_colours(shift[corners], space.body_of_block[corners[:, 0]])
    axis.add_collection(
        PolyCollection(moved, facecolors=colours, edgecolors="#5a5244", lw=0.4, zorder=2)
    )
    axis.autoscale_view()
    return figure


def _find_corners(nodes: int) -> list[int]:
    """Return the places of the corners of a cell of so many nodes, in their order round it."""
    return list(ROUND[3 if nodes in (3, 6) else 4])


def _list_sides(polygons: Array) -> Array:
    """Return the sides (k, 2, 2) of polygons (c, corners, 2)."""
    ends = np.roll(polygons, -1, axis=1)
    return np.stack([polygons, ends], axis=2).reshape(-1, 2, 2)


def _choose_colours(shift: Array, bodies: Indices) -> list[str]:
    """Return a colour for each cell: grey for those of bodies that stay.

    Args:
        shift: (c, corners, 2) displacements, the largest component of all one.
        bodies: (c,) numbers of bodies.
    """
    largest = np.zeros(int(bodies.max()) + 1)
    np.maximum.at(largest, bodies, np.abs(shift).max(axis=(1, 2)))
    return [FIXED if largest[body] < STILL else STONES[body % len(STONES)] for body in bodies]
