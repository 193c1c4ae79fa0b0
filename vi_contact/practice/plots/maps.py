"""Draw maps of contact quantities over position and time.

They are for surfaces that are lines: straight, bent or U-shaped.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from .faces import PULLS
from .histories import cell_edges, scale_values

STRAIGHT = 1e-6  # what a line of points may deviate, over its length
NO_GAP = 1e-15  # gaps below it are none, over the length of the contact line
# Over the size of an axis that faces share: widths of a panel and of its colour bar, and what is
# between two panels.
PANEL = 0.92
BAR = 0.015
BETWEEN = 0.09
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


def draw_cells(
    axis: Any, t: Array, position: Array, values: Array, unit: str, colours: str
) -> tuple[Any, str, bool]:
    """Draw values over time and place in colours, without a colour bar.

    The colours go from white upwards or, where some values are negative, get darker all the way
    from the least one and change their hue at zero.

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
    from matplotlib.colors import LinearSegmentedColormap

    order = np.argsort(position, kind="stable")
    scaled, prefixed = scale_values(values[:, order], unit)
    size = float(np.nanmax(np.abs(scaled), initial=0.0)) or 1.0
    pulling = bool(np.any(scaled < 0.0))
    palette = LinearSegmentedColormap.from_list("pulls", PULLS)
    if not pulling:
        palette = colormaps[colours].with_extremes(under="white")
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


def name_faces(contact: Any, model: Mapping[str, Any] | None) -> dict[str, slice]:
    """Return the rows of each named part of the contact, as model.json lists them.

    Args:
        contact: the conditions of a run.
        model: model.json; None or without parts that fit: all conditions are one part without name.

    Returns:
        name -> its conditions.
    """
    everything = {"": slice(0, len(contact.points))}
    parts = (model or {}).get("contact")
    if not isinstance(parts, list | tuple):
        return everything
    size = float(np.ptp(contact.points, axis=0).max()) or 1.0
    faces: dict[str, slice] = {}
    first = 0
    for part in parts:
        try:
            places = np.array(part["places"], dtype=float).reshape(-1, contact.points.shape[1])
            name = str(part["name"])
        except (KeyError, TypeError, ValueError):
            return everything
        rows = slice(first, first + len(places))
        first = rows.stop
        own = contact.points[rows]
        # Conditions stand in the order of the parts: what is elsewhere is another model's.
        if len(own) != len(places) or np.any(np.abs(own - places) > STRAIGHT * size):
            return everything
        if len(places):
            faces[name] = rows
    return faces if faces and first == len(contact.points) else everything


def list_maps(run: Any, model: Mapping[str, Any] | None = None) -> list[Drawing]:
    """List what draws the maps of the contact line of a run.

    The maps are those of its pressure and, if it opens, of its opening. Each has a panel for every
    named face.

    Args:
        run: RunFolder.
        model: model.json, which names the faces; None: they are drawn along one line.
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
    faces = name_faces(contact, model)
    maps = [_Map.read(run, column, unit) for column, unit in columns]
    return [partial(_draw_faces, shown=shown, faces=faces) for shown in maps]


@dataclass(frozen=True)
class _Map:
    """Hold a quantity of the contact over time.

    Attributes:
        title: what it is.
        unit: its SI unit.
        colours: matplotlib's name of a colour map that begins white.
        contact: the conditions.
        t: (rows,) instants [s].
        values: (rows, m) of the conditions.
    """

    title: str
    unit: str
    colours: str
    contact: Any
    t: Array
    values: Array

    @classmethod
    def read(cls, run: Any, column: str, unit: str) -> "_Map":
        """Read the pressure of a run, or its gap where it is open."""
        values = np.reshape(run.history[column], (len(run.history["t"]), -1))
        opening = column == "gap"
        t, thinned = thin_rows(run.history["t"], np.maximum(values, 0.0) if opening else values)
        if opening:
            return cls("opening", unit, "Blues", run.contact, t, thinned)
        return cls("contact pressure", unit, "magma_r", run.contact, t, thinned)

    def draw(self, panel: Any, rows: slice) -> tuple[Any, str]:
        """Draw some of the conditions; return (image, unit with its prefix)."""
        position, label = arc_position(self.contact.points[rows], self.contact.normals[rows])
        image, prefixed, _ = draw_cells(
            panel, self.t, position, self.values[:, rows], self.unit, self.colours
        )
        panel.set_ylabel(label)
        return image, prefixed


def _draw_faces(axis: Any, shown: _Map, faces: Mapping[str, slice]) -> None:
    """Draw a map on an axis, which several faces share as panels above each other."""
    if shown.title == "opening":
        # Faces that stay closed have nothing to show.
        opens = {name: rows for name, rows in faces.items() if np.any(shown.values[:, rows])}
        faces = opens or faces
    if len(faces) == 1:
        ((name, rows),) = faces.items()
        image, unit = shown.draw(axis, rows)
        axis.figure.colorbar(image, ax=axis, pad=0.02, fraction=0.06)
        axis.set_xlabel("time [s]")
        where = f", {name}" if name else ""
        axis.set_title(f"{shown.title}{where} [{unit}] (white: none)", loc="left")
        return

    # The axis only keeps the room; each face has a panel with a colour bar, as sizes differ.
    axis.set_axis_off()
    axis.set_title(f"{shown.title} (white: none)", loc="left", pad=14.0)
    height = (1.0 - BETWEEN * (len(faces) - 1)) / len(faces)
    for place, (name, rows) in enumerate(faces.items()):
        bottom = 1.0 - height - place * (height + BETWEEN)
        panel = axis.inset_axes([0.0, bottom, PANEL, height])
        bar = axis.inset_axes([PANEL + BAR, bottom, BAR, height])
        image, unit = shown.draw(panel, rows)
        bar.grid(False)
        axis.figure.colorbar(image, cax=bar, label=f"[{unit}]")
        panel.set_title(name, loc="left", pad=2.0, fontsize=8)
        panel.locator_params("y", nbins=4)
        bar.locator_params("y", nbins=4)
        if place + 1 < len(faces):
            panel.tick_params(labelbottom=False)
        else:
            panel.set_xlabel("time [s]")
