"""Draw and film bodies that yield: displaced cells in the colour of their plastic strain."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.fem.output.fields import FrameValues
from vi_contact.practice.plots.histories import canvas, save

CORNERS = {3: (0, 1, 2), 6: (0, 1, 2), 4: (0, 1, 2, 3), 9: (0, 1, 2, 3)}  # nodes -> round a cell

SHOWN = 0.97  # of the cells have a plastic strain within the scale of colours


@dataclass(frozen=True)
class Snapshot:
    """Hold what is drawn of a state.

    Attributes:
        polygons: (cells, corners, 2) where they were [m].
        shift: (cells, corners, 2) how far corners have moved [m].
        strain: (cells,) plastic strain.
        text: stands above the picture.
    """

    polygons: Array
    shift: Array
    strain: Array
    text: str


def take(problem: ContactProblem, state: State, text: str) -> Snapshot:
    """Return a snapshot of a state, on rank 0. Collective.

    Args:
        problem: in the plane, of materials that yield.
        state: of it.
        text: stands above the picture.
    """
    values = FrameValues("snapshot", problem, {})
    nodal, cellwise = values.gather(state, np.zeros_like(state.u), None)
    cells = values.grid.cells[:, list(CORNERS[values.grid.cells.shape[1]])]
    points = values.grid.points[:, :2]
    return Snapshot(points[cells], nodal["u"][:, :2][cells], cellwise["plastic_strain"], text)


def make_drawer(
    snapshots: Sequence[Snapshot], size: tuple[float, float], magnified: float
) -> tuple[Any, Any, Callable[[int], None]]:
    """Return a figure, the axis below the bodies, and what draws a snapshot by its number.

    Args:
        snapshots: all of the film, which share one scale of colours.
        size: of the figure [inches].
        magnified: how many times larger displacements are drawn.
    """
    from matplotlib.collections import PolyCollection

    figure, ((above,), (below,)) = canvas(2, 1, size, lattice=False, height_ratios=(3.2, 1.0))
    # a few cells at an edge flow much more than the mechanism, and would leave the rest pale
    most = max(float(np.quantile(one.strain, SHOWN)) for one in snapshots)
    collection = PolyCollection(
        snapshots[0].polygons, cmap="YlOrRd", edgecolors="#7a7a7a", linewidths=0.25
    )
    collection.set_clim(0.0, most or 1.0)
    above.add_collection(collection)
    ends = snapshots[0].polygons.reshape(-1, 2)
    reach = 0.04 * float(np.ptp(ends, axis=0).max())
    above.set_xlim(ends[:, 0].min() - reach, ends[:, 0].max() + reach)
    above.set_ylim(ends[:, 1].min() - reach, ends[:, 1].max() + 2.0 * reach)
    above.set_aspect("equal")
    above.set_xlabel("x [m]")
    above.set_ylabel("y [m]")
    figure.colorbar(collection, ax=above, label="plastic strain", shrink=0.8, extend="max")

    def draw(k: int) -> None:
        one = snapshots[k]
        collection.set_verts(one.polygons + magnified * one.shift)
        collection.set_array(one.strain)
        above.set_title(f"{one.text}, displacements x {magnified:g}", fontsize=10)

    return figure, below, draw


def write_film(figure: Any, draw: Callable[[int], None], count: int, path: Path) -> Path:
    """Write a GIF of so many snapshots.

    Args:
        figure: of ``make_drawer``.
        draw: what changes the figure to the snapshot of a number.
        count: of the snapshots.
        path: of the film.
    """
    from matplotlib.animation import PillowWriter

    writer = PillowWriter(fps=10)
    with writer.saving(figure, str(path), dpi=90):
        for k in range(count):
            draw(k)
            if k == 0:  # the same places in every frame, laid out once
                figure.draw_without_rendering()
                figure.set_layout_engine("none")
            writer.grab_frame()
    return path


def film_punch(
    snapshots: Sequence[Snapshot], pushed: Array, loads: Array, exact: float, path: Path
) -> Path:
    """Film soil under a footing, with the load over the cohesion below it.

    Args:
        snapshots: one of each load step.
        pushed: (steps,) [m].
        loads: (steps,) mean pressures over the cohesion.
        exact: the limit by hand.
        path: of the film; its last frame is beside it as a .png.
    """
    largest = float(np.abs(snapshots[-1].shift).max())
    span = float(np.ptp(snapshots[-1].polygons.reshape(-1, 2), axis=0).max())
    magnified = float(f"{0.05 * span / largest:.1g}")
    figure, below, show = make_drawer(snapshots, (7.5, 5.6), magnified)
    below.axhline(exact, color="0.4", ls="--", lw=1.0)
    below.text(0.0, exact, " 2 + π", va="bottom", fontsize=8, color="0.3")
    below.plot(1e3 * pushed, loads, color="black", lw=1.0)
    (dot,) = below.plot([], [], "o", color="#c8201e")
    below.set_xlabel("settlement [mm]")
    below.set_ylabel("pressure / c")
    below.set_ylim(0.0, 1.25 * exact)

    def draw(k: int) -> None:
        show(k)
        dot.set_data([1e3 * pushed[k]], [loads[k]])

    write_film(figure, draw, len(snapshots), path)
    save(figure, path.with_suffix(".png"))
    return path


def film_motion(snapshots: Sequence[Snapshot], times: Array, pushed: Array, path: Path) -> Path:
    """Film a wall and its fill in a motion, with the sliding of the base below.

    Args:
        snapshots: at equal distances in time, the last one at the end.
        times: (steps,) [s].
        pushed: (steps,) how far the base has slid away from the fill [m].
        path: of the film; its last frame is beside it as a .png.
    """
    largest = max(float(np.abs(one.shift).max()) for one in snapshots)
    span = float(np.ptp(snapshots[0].polygons.reshape(-1, 2), axis=0).max())
    magnified = float(f"{0.04 * span / largest:.1g}")
    figure, below, show = make_drawer(snapshots, (8.0, 6.0), magnified)
    below.plot(times, 1e3 * pushed, color="black", lw=1.0)
    marker = below.axvline(0.0, color="#c8201e", lw=1.0)
    below.set_xlabel("time [s]")
    below.set_ylabel("base slid [mm]")
    moments = np.linspace(times[0], times[-1], len(snapshots))

    def draw(k: int) -> None:
        show(k)
        marker.set_xdata([moments[k], moments[k]])

    write_film(figure, draw, len(snapshots), path)
    save(figure, path.with_suffix(".png"))
    return path
