"""Draw maps of contact quantities over position and time.

They are for surfaces that are lines: straight, bent or U-shaped.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from .histories import cell_edges, scale_values

STRAIGHT = 1e-6  # what a line of points may deviate, over its length
NO_GAP = 1e-15  # gaps below it are none, over the length of the contact line
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
    # The principal axes of the points tell whether they lie on a straight line: the second
    # singular value is then nothing beside the first.
    arms = points - points.mean(axis=0)
    _, values, axes = np.linalg.svd(arms, full_matrices=False)
    if values[-1] <= STRAIGHT * values[0]:
        line = axes[0]
        for i, name in enumerate("xy"):
            if abs(line[i]) >= 1.0 - STRAIGHT:
                return np.array(points[:, i]), f"{name} [m]"
        # The sign of a singular vector is arbitrary: its largest component shall be positive.
        along = line if line[int(np.argmax(np.abs(line)))] > 0.0 else -line
        place = arms @ along
        return np.asarray(place - place.min()), "length along the surface [m]"

    # A bent line: points of a corner are moved apart by a little, each the way it faces.
    if normals is not None:
        nothing = STRAIGHT * float(np.ptp(points, axis=0).max())
        points = np.column_stack([points, nothing * normals])
    order = order_points(points)
    steps = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    place = np.empty(len(points))
    place[order] = np.concatenate([[0.0], np.cumsum(steps)])
    return place, "arc length [m]"


def order_points(points: Array) -> Indices:
    """Order the points from the highest (leftmost) one, each time to the nearest that is left."""
    size = float(np.ptp(points, axis=0).max()) or 1.0
    top = points[:, 1] >= points[:, 1].max() - STRAIGHT * size
    order = [int(np.flatnonzero(top)[np.argmin(points[top, 0])])]
    while len(order) < len(points):
        distance = np.linalg.norm(points - points[order[-1]], axis=1)
        distance[order] = np.inf
        order.append(int(np.argmin(distance)))
    return np.array(order)


def thin_rows(t: Array, values: Array, rows: int = ROWS) -> tuple[Array, Array]:
    """Thin a history so that its peaks stay.

    Args:
        t: (n,) instants [s].
        values: (n, m) of m points.
        rows: the most instants that are left.

    Returns:
        the first instant of each group of neighbours, and of each point the value that is largest
        in size in the group, with its sign.
    """
    if len(t) <= rows:
        return t, values
    starts = np.linspace(0, len(t), rows, endpoint=False).astype(int)
    high = np.maximum.reduceat(values, starts, axis=0)
    low = np.minimum.reduceat(values, starts, axis=0)
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
    """Draw values over time and place as colours, zero white.

    Points at the same place (corners) stand side by side in their order.

    Args:
        axis: matplotlib's.
        t: (rows,) instants [s].
        position: (m,) places along the contact line [m].
        values: (rows, m).
        unit: of the values, without a prefix.
        title: what the values are.
        axis_label: what the places are, with their unit.
        colours: matplotlib's name of a colour map that begins white.
    """
    image, prefixed, _ = draw_cells(axis, t, position, values, unit, colours)
    axis.figure.colorbar(image, ax=axis, pad=0.02, fraction=0.06)
    axis.set(xlabel="time [s]", ylabel=axis_label)
    axis.set_title(f"{title} [{prefixed}] (white: none)", loc="left")


def draw_cells(
    axis: Any, t: Array, position: Array, values: Array, unit: str, colours: str
) -> tuple[Any, str, bool]:
    """Draw values over time and place in colours, without a colour bar.

    The colours go from white upwards or, where some values are negative, to both sides of it.

    Args:
        axis: matplotlib's.
        t: (rows,) instants [s].
        position: (m,) places along the contact line [m].
        values: (rows, m).
        unit: of the values, without a prefix.
        colours: matplotlib's name of a colour map, for values that are not negative.

    Returns:
        (image, unit with its prefix, whether some values are negative).
    """
    from matplotlib import colormaps

    order = np.argsort(position, kind="stable")
    scaled, prefixed = scale_values(values[:, order], unit)
    size = float(np.nanmax(np.abs(scaled), initial=0.0)) or 1.0
    pulling = bool(np.any(scaled < 0.0))
    palette = colormaps["RdBu_r" if pulling else colours].with_extremes(under="white")
    low = -size if pulling else 1e-9 * size
    axis.grid(False)
    image = axis.pcolormesh(
        cell_edges(t),
        cell_edges(position[order]),
        scaled.T,
        cmap=palette,
        vmin=low,
        vmax=size,
        rasterized=True,
    )
    return image, prefixed, pulling


def list_maps(run: Any) -> list[Drawing]:
    """List what draws the maps of the contact line of a run.

    The maps are those of its pressure and, if it opens, of its opening.
    """
    contact = run.contact
    history = run.history
    if contact is None or "pressure" not in history:
        return []
    if contact.points.shape[1] != 2 or len(contact.points) < 3:
        return []
    columns = []
    if np.any(history["pressure"]):
        columns.append(("pressure", "Pa"))
    size = float(np.ptp(contact.points, axis=0).max())
    if float(np.max(history["gap"])) > NO_GAP * size:
        columns.append(("gap", "m"))
    return [partial(_draw_column, run=run, column=column, unit=unit) for column, unit in columns]


def _draw_column(axis: Any, run: Any, column: str, unit: str) -> None:
    """Draw the map of the pressure, or of the gap where it is open."""
    position, label = arc_position(run.contact.points, run.contact.normals)
    values = np.reshape(run.history[column], (len(run.history["t"]), -1))
    opening = column == "gap"
    t, thinned = thin_rows(run.history["t"], np.maximum(values, 0.0) if opening else values)
    draw_map(
        axis,
        t,
        position,
        thinned,
        unit,
        title="opening" if opening else "contact pressure",
        axis_label=label,
        colours="Blues" if opening else "magma_r",
    )
