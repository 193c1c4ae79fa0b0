"""Draw maps of contact quantities over position and time.

They are for surfaces that are lines: straight, bent or U-shaped.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from .histories import cell_edges, scale_values

STRAIGHT = 1e-6  # of its length: what a line of points may deviate
NO_GAP = 1e-15  # of the length of the contact line
ROWS = 1200  # of a map: more instants than a page has dots are gathered
Drawing = Callable[[Any], None]  # draws on one axis


def arc_position(points: Array, normals: Array | None = None) -> tuple[Array, str]:
    """Return (place (m,) along the line of points (m, 2) [m], name of the axis).

    With ``normals`` (m, 2) the conditions of a corner follow each other as its sides do, by nothing
    that can be seen.

    Points on a straight line along an axis: their coordinate; on another one: the length along it;
    else the arc length of the chain that starts at the highest point (of those the leftmost) and
    goes on to the nearest one each time.
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
    order = order_points(points)
    lengths = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(points[order], axis=0), axis=1))]
    )
    place = np.empty(len(points))
    place[order] = lengths
    return place, "arc length [m]"


def order_points(points: Array) -> Indices:
    """Order the points from the highest (leftmost) one, each time to the nearest that is left."""
    size = float(np.ptp(points, axis=0).max()) or 1.0
    top = points[:, 1] >= points[:, 1].max() - STRAIGHT * size
    order = [int(np.flatnonzero(top)[np.argmin(points[top, 0])])]
    while len(order) < len(points):
        way = np.linalg.norm(points - points[order[-1]], axis=1)
        way[order] = np.inf
        order.append(int(np.argmin(way)))
    return np.array(order)


def thin_rows(t: Array, values: Array, rows: int = ROWS) -> tuple[Array, Array]:
    """Return at most ``rows`` instants.

    Of neighbours it takes the value of every point that is largest in size, so that peaks stay.
    """
    if len(t) <= rows:
        return t, values
    starts = np.linspace(0, len(t), rows, endpoint=False).astype(int)
    high, low = (
        np.maximum.reduceat(values, starts, axis=0),
        np.minimum.reduceat(values, starts, axis=0),
    )
    return t[starts], np.where(high >= -low, high, low)


def draw_map(
    axis: Any,
    t: Array,
    position: Array,
    values: Array,
    unit: str,
    *,
    title: str,
    axis_label: str,
    colours: str,
) -> None:
    """Draw values (rows, m) as colours, zero white.

    Points at the same place (corners) stand side by side in their order.
    """
    image, prefixed, _ = draw_cells(axis, t, position, values, unit, colours)
    axis.figure.colorbar(image, ax=axis, pad=0.02, fraction=0.06)
    axis.set(xlabel="time [s]", ylabel=axis_label)
    axis.set_title(f"{title} [{prefixed}] (white: none)", loc="left")


def draw_cells(
    axis: Any, t: Array, position: Array, values: Array, unit: str, colours: str
) -> tuple[Any, str, bool]:
    """Draw values in colours.

    It returns (image, unit with its prefix, whether some are negative). The colours go from white
    upwards, or to both sides of it.
    """
    from matplotlib import colormaps

    order = np.argsort(position, kind="stable")
    shown, prefixed = scale_values(values[:, order], unit)
    size = float(np.nanmax(np.abs(shown), initial=0.0)) or 1.0
    pulling = bool(np.any(shown < 0.0))
    palette = colormaps["RdBu_r" if pulling else colours].with_extremes(under="white")
    low = -size if pulling else 1e-9 * size
    axis.grid(False)
    image = axis.pcolormesh(
        cell_edges(t),
        cell_edges(position[order]),
        shown.T,
        cmap=palette,
        vmin=low,
        vmax=size,
        rasterized=True,
    )
    return image, prefixed, pulling


def maps_of(run: Any) -> list[Drawing]:
    """Return what draws the maps of the contact line of a run.

    The maps are those of its pressure and, if it opens, of its opening.
    """
    contact, history = run.contact, run.history
    if (
        contact is None
        or "pressure" not in history
        or contact.points.shape[1] != 2
        or len(contact.points) < 3
    ):
        return []
    shown = [("pressure", "Pa")] if np.any(history["pressure"]) else []
    size = float(np.ptp(contact.points, axis=0).max())
    if float(np.max(history["gap"])) > NO_GAP * size:
        shown.append(("gap", "m"))
    return [partial(_map, run=run, column=column, unit=unit) for column, unit in shown]


def _map(axis: Any, run: Any, column: str, unit: str) -> None:
    position, label = arc_position(run.contact.points, run.contact.normals)
    values = np.reshape(run.history[column], (len(run.history["t"]), -1))
    open_gap = column == "gap"
    t, shown = thin_rows(run.history["t"], np.maximum(values, 0.0) if open_gap else values)
    draw_map(
        axis,
        t,
        position,
        shown,
        unit,
        title="opening" if open_gap else "contact pressure",
        axis_label=label,
        colours="Blues" if open_gap else "magma_r",
    )
