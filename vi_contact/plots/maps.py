"""Draw maps of contact quantities over position and time, for surfaces that are lines: straight, bent or U-shaped."""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.algebra import Array, Indices
from .histories import History, cell_edges, panels, save, scaled

STRAIGHT = 1e-6  # of its length: what a line of points may deviate
ROWS = 1200  # of a map: more instants than a page has dots are gathered


def arc_position(points: Array, normals: Array | None = None) -> tuple[Array, str]:
    """Return (place (m,) along the line of points (m, 2) [m], name of the axis).

    With ``normals`` (m, 2) the conditions of a corner follow each other as its sides do, by nothing that can be seen.

    Points on a straight line along an axis: their coordinate; on another one: the length along it; else the arc length
    of the chain that starts at the highest point (of those the leftmost) and goes on to the nearest one each time.
    """
    arms = points - points.mean(axis=0)
    _, values, axes = np.linalg.svd(arms, full_matrices=False)
    if values[-1] <= STRAIGHT * values[0]:
        for i, name in enumerate("xy"):
            if abs(axes[0, i]) >= 1.0 - STRAIGHT:
                return np.array(points[:, i]), f"{name} [m]"
        along = axes[0] if axes[0, int(np.argmax(np.abs(axes[0])))] > 0.0 else -axes[0]
        place = arms @ along
        return np.asarray(place - place.min()), "length along the surface [m]"
    if normals is not None:
        points = np.column_stack([points, STRAIGHT * float(np.ptp(points, axis=0).max()) * normals])
    order = chain(points)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[order], axis=0), axis=1))])
    place = np.empty(len(points))
    place[order] = lengths
    return place, "arc length [m]"


def chain(points: Array) -> Indices:
    """Order the points from the highest (leftmost) one, each time to the nearest that is left."""
    size = float(np.ptp(points, axis=0).max()) or 1.0
    top = points[:, 1] >= points[:, 1].max() - STRAIGHT * size
    order = [int(np.flatnonzero(top)[np.argmin(points[top, 0])])]
    while len(order) < len(points):
        way = np.linalg.norm(points - points[order[-1]], axis=1)
        way[order] = np.inf
        order.append(int(np.argmin(way)))
    return np.array(order)


def thinned(t: Array, values: Array, rows: int = ROWS) -> tuple[Array, Array]:
    """Return at most ``rows`` instants: of neighbours the value of every point that is largest in size: peaks stay."""
    if len(t) <= rows:
        return t, values
    starts = np.linspace(0, len(t), rows, endpoint=False).astype(int)
    high, low = np.maximum.reduceat(values, starts, axis=0), np.minimum.reduceat(values, starts, axis=0)
    return t[starts], np.where(high >= -low, high, low)


def draw_map(
    axis: Any, t: Array, position: Array, values: Array, unit: str, *, title: str, axis_label: str, colours: str
) -> None:
    """Draw values (rows, m) as colours, zero white; points at the same place (corners) side by side in their order."""
    image, prefixed, _ = _coloured(axis, t, position, values, unit, colours)
    axis.figure.colorbar(image, ax=axis, pad=0.02, fraction=0.06)
    axis.set(xlabel="time [s]", ylabel=axis_label)
    axis.set_title(f"{title} [{prefixed}] (white: none)", loc="left")


def plot_contact(history: History, path: str | Path, *, position: Array, axis_label: str = "position [m]") -> Path:
    """Draw a map of contact pressure over position and time, and the uplift ratio. ``position``: (m,) of the points.

    Open points are white; held points that pull are blue.
    """
    figure, (top, bottom) = panels(2, (9.0, 6.0), height_ratios=(3, 1))
    pressure = np.reshape(history["pressure"], (len(history["t"]), -1))
    image, unit, pulling = _coloured(top, history["t"], position, pressure, "Pa", "magma_r")
    meaning = "negative: pull" if pulling else "white: open"
    figure.colorbar(image, ax=top, label=f"contact pressure [{unit}] ({meaning})")
    top.set(ylabel=axis_label, title="Contact pressure")
    bottom.plot(history["t"], history["contact_uplift"], color="black", lw=0.9)
    bottom.set(ylabel="uplift ratio [-]", ylim=(-0.05, 1.05))
    return save(figure, path)


def _coloured(axis: Any, t: Array, position: Array, values: Array, unit: str, colours: str) -> tuple[Any, str, bool]:
    """(image, unit with its prefix, whether some values are negative): from white upwards, or to both sides of it."""
    from matplotlib import colormaps

    order = np.argsort(position, kind="stable")
    shown, prefixed = scaled(values[:, order], unit)
    size = float(np.nanmax(np.abs(shown), initial=0.0)) or 1.0
    pulling = bool(np.any(shown < 0.0))
    palette = colormaps["RdBu_r" if pulling else colours].with_extremes(under="white")
    low = -size if pulling else 1e-9 * size
    axis.grid(False)
    image = axis.pcolormesh(
        cell_edges(t), cell_edges(position[order]), shown.T, cmap=palette, vmin=low, vmax=size, rasterized=True
    )
    return image, prefixed, pulling
