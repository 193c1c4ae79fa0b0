"""Draw deformed bodies in the plane with their contact tractions, from the folders of runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from demos.parts.pictures.tractions import Tractions, read_tractions
from vi_contact.core.algebra import Array
from vi_contact.practice.plots.deformed import StoredFrames, read_frames
from vi_contact.practice.plots.histories import canvas, save, scale, scale_values

ARROW = 0.3  # length of the longest arrow over the size of the body


def plot_snapshots(
    folders: Mapping[str, str | Path],
    times: Sequence[float],
    path: str | Path,
    *,
    title: str,
    support: Callable[[float], float],
    magnified: float = 1.0,
) -> Path:
    """Draw a row per run (name -> folder), a column per time [s].

    There are the deformed mesh and the contact tractions on it.

    Cells are coloured by von Mises stress, tractions drawn as arrows with one scale for all.
    ``support``: height y [m] of the rigid support at a time; displacements (not ``support``) are
    drawn ``magnified`` times.
    """
    runs = {name: (read_frames(folder), read_tractions(folder)) for name, folder in folders.items()}
    shots = [[frames.at(t) for t in times] for frames, _ in runs.values()]
    stresses = np.array([stress.max() for row in shots for *_, stress in row])
    shown, unit = scale_values(stresses, "Pa")
    longest = max(
        float(np.linalg.norm(_arrows(tractions, t), axis=1).max(initial=0.0))
        for _, tractions in runs.values()
        for t in times
    )
    points = next(iter(runs.values()))[0].points
    size = float(np.ptp(points, axis=0).max())
    low, high = _limits([points + magnified * u for row in shots for _, u, _ in row], size)
    height = 2.4 * (high[1] - low[1]) / (high[0] - low[0]) + 0.4
    sheet = (2.5 * len(times) + 1.6, height * len(runs) + 0.8)
    figure, axes = canvas(len(runs), len(times), sheet, lattice=False, sharex=True, sharey=True)
    axes[0, 0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    for row, row_shots, (name, (frames, tractions)) in zip(axes, shots, runs.items(), strict=True):
        for axis, (t, u, stress) in zip(row, row_shots, strict=True):
            _draw_support(axis, support(t), size)
            moved = frames.points + magnified * u
            cells = _draw_body(axis, moved[frames.cells], stress * (shown.max() / stresses.max()))
            cells.set_clim(0.0, shown.max())
            _draw_tractions(axis, frames, tractions, magnified * u, t, longest / (ARROW * size))
            axis.set_title(f"{name}, {_moment(t)}", fontsize=9)
    figure.supxlabel("x [m]", fontsize=10)
    figure.supylabel("y [m]", fontsize=10)
    figure.colorbar(cells, ax=axes, label=f"von Mises stress [{unit}]", shrink=0.7)
    figure.suptitle(title + (f" (displacements x {magnified:g})" if magnified != 1.0 else ""))
    return save(figure, path)


def _moment(t: float) -> str:
    """Return t with its unit."""
    return f"t = {1e3 * t:.4g} ms" if 0.0 < t < 0.1 else f"t = {t:.4g} s"


def _limits(moved: Sequence[Array], size: float) -> tuple[Array, Array]:
    """Corners of what is drawn, with room for the arrows below."""
    low = np.min([points.min(axis=0) for points in moved], axis=0)
    high = np.max([points.max(axis=0) for points in moved], axis=0)
    return low - size * np.array([0.2, 0.35]), high + size * np.array([0.2, 0.1])


def _draw_body(axis: Any, cells: Array, stress: Array) -> Any:
    """Draw the cells where they are now, coloured."""
    from matplotlib.collections import PolyCollection

    drawn = PolyCollection(list(cells), cmap="YlOrRd", edgecolor="0.35", linewidth=0.3)
    drawn.set_array(stress)
    axis.add_collection(drawn)
    axis.set_aspect("equal")
    return drawn


def _draw_tractions(
    axis: Any, frames: StoredFrames, tractions: Tractions, u: Array, t: float, scale: float
) -> None:
    """Arrows that end at the contact points; nothing at open ones. scale: Pa per metre of arrow."""
    arrows = _arrows(tractions, t)
    acts = np.any(arrows != 0.0, axis=1)
    if not acts.any():
        return
    points = tractions.points[acts]
    nodes = [int(np.argmin(np.sum((frames.points - point) ** 2, axis=1))) for point in points]
    tips = points + u[nodes]
    axis.quiver(
        *tips.T,
        *arrows[acts].T,
        angles="xy",
        scale_units="xy",
        scale=scale,
        pivot="tip",
        width=0.004,
        color="tab:blue",
        zorder=3,
    )


def _arrows(tractions: Tractions, t: float) -> Array:
    """Tractions (m, 2) [Pa] of the support on the body."""
    pressure, shear = tractions.at(t)
    return shear - pressure[:, None] * tractions.normals


def _draw_support(axis: Any, height: float, size: float) -> None:
    axis.axhline(height, color="black", lw=1.0, zorder=2)
    axis.axhspan(height - 0.05 * size, height, color="0.8", lw=0.0, zorder=0)


def plot_tractions(
    folders: Mapping[str, str | Path], times: Sequence[float], path: str | Path, *, title: str
) -> Path:
    """Draw contact pressure p_n and shear traction p_t over x.

    There is a column per run, and a curve per time [s].

    The shear is that of the support on the body and positive along +x, as in the pictures of
    boundary elements.
    """
    from matplotlib import colormaps

    figure, axes = canvas(
        2, len(folders), (3.8 * len(folders) + 0.5, 5.4), sharex=True, sharey="row"
    )
    runs = {name: read_tractions(folder) for name, folder in folders.items()}
    size = max(
        float(np.abs(part).max(initial=0.0))
        for run in runs.values()
        for t in times
        for part in run.at(t)
    )
    factor, unit = scale(size, "Pa")
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(times)))
    for column, (name, tractions) in zip(axes.T, runs.items(), strict=True):
        x = tractions.points[:, 0]
        order = np.argsort(tractions.points[:, 0])
        for t, colour in zip(times, colours, strict=True):
            pressure, shear = tractions.at(t)
            along = np.linalg.norm(shear, axis=1) * np.sign(shear[:, 0])
            for axis, values in zip(column, (pressure, along), strict=True):
                axis.plot(
                    x[order],
                    factor * values[order],
                    ".-",
                    ms=3,
                    lw=0.9,
                    color=colour,
                    label=_moment(t),
                )
        column[0].set_title(name, fontsize=10)
        column[1].set_xlabel("x [m]")
    axes[0, 0].set_ylabel(f"pressure $p_n$ [{unit}]")
    axes[1, 0].set_ylabel(f"shear $p_t$ on the body,\nalong +x [{unit}]")
    axes[0, -1].legend(fontsize=8)
    figure.suptitle(title)
    return save(figure, path)
