"""Draw contact faces in space at some times: pressure; open, sticking and slipping points; slip."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...core.algebra import Array, Indices
from ...core.arguments import check_arguments
from ...core.corners import FEATURE_ANGLE
from ...core.errors import InputError
from ...core.files import list_frames
from ...core.step import AXES
from ...meshes.rows import connected
from ...run.files.reading import RunFolder
from ...run.recorders.contact_parts import Geometry, make_tangent_vectors
from .deformed import OPEN, SAME, SLIP, STICK, contact_states, nearest, read_frames, stored_tangents
from .histories import STYLE, History, length_unit, plain, require_matplotlib, save, scale

ARROW = 0.15  # of the size of the face: how long the longest arrow is
NEIGHBOURS = 24  # nearest points that make one face if they point the same way
STATES = {OPEN: ("open", "white"), STICK: ("stick", "tab:blue"), SLIP: ("slip", "tab:orange")}


@dataclass(frozen=True)
class Face:
    """Hold a contact face.

    It has conditions (k,) and their ``points`` (k, 3); ``axes`` (3, 2) of the plane it lies in,
    None if it is curved; parts of the sides of elements (p, 4, 3) with the condition (p,) of each,
    and none without fields.
    """

    name: str
    conditions: Indices
    points: Array
    axes: Array | None
    parts: Array
    owners: Indices

    def seen(self, vectors: Array) -> Array:
        """Return vectors (..., 3) in the plane of the face, (..., 2).

        They are as they are where it is curved.
        """
        return vectors if self.axes is None else vectors @ self.axes


def faces_of(contact: Geometry, sides: Indices) -> list[Face]:
    """Return the faces of a contact surface.

    They are points near to each other whose directions differ by less than 30°; pieces in one plane
    are one face. ``sides`` of elements, as conditions (n, corners), are shared by their corners.
    """
    points, normals = contact.points, contact.normals
    m, size = len(points), float(np.ptp(points, axis=0).max()) or 1.0
    near = cKDTree(points).query(points, k=min(NEIGHBOURS, m))[1].reshape(m, -1)
    alike = np.einsum("mki,mi->mk", normals[near], normals) > np.cos(FEATURE_ANGLE)
    rows = np.repeat(np.arange(m), alike.sum(axis=1))
    piece = connected(m, rows, near[alike])
    planes: dict[Any, list[Indices]] = {}
    for own in (np.flatnonzero(piece == number) for number in range(piece.max() + 1)):
        normal = normals[own[0]]
        level = points[own] @ normal / size
        flat = max(float(np.ptp(level)), float(np.abs(normals[own] - normal).max())) <= SAME
        planes.setdefault(
            (*np.round(normal / SAME), round(level[0] / SAME)) if flat else own[0], []
        ).append(own)
    found = []
    for key, pieces in planes.items():
        own, flat = np.sort(np.concatenate(pieces)), isinstance(key, tuple)
        normal, mine = normals[own[:1]], sides[np.all(np.isin(sides, own), axis=1)]
        name = f"face towards {direction(normal[0])}" if flat else "curved face"
        axes = make_tangent_vectors(normal, np.zeros(1, dtype=np.int64))[0] if flat else None
        found.append(Face(name, own, points[own], axes, shares(points[mine]), mine.ravel()))
    return found


def shares(corners: Array) -> Array:
    """Return the parts (n corners, 4, 3) of sides (n, corners, 3), each around a corner."""
    before, after = (0.5 * (corners + np.roll(corners, way, axis=1)) for way in (1, -1))
    middle = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    return np.stack([corners, after, middle, before], axis=2).reshape(-1, 4, 3)


def direction(way: Array) -> str:
    """Return the name of a direction (d,): its axis with its sign, or its components."""
    axis = int(np.argmax(np.abs(way)))
    if abs(way[axis]) > 1.0 - SAME:
        return ("-" if way[axis] < 0.0 else "") + AXES[axis]
    return "(" + ", ".join(f"{one + 0.0:.2g}" for one in way) + ")"


@dataclass(frozen=True)
class Painter:
    """Draw on faces.

    The colours are by ``norm`` and ``cmap`` of values times ``factor``, named ``label``.
    """

    norm: Any
    cmap: Any
    label: str = ""
    factor: float = 1.0

    @classmethod
    def of_pressure(cls, pressure: Array) -> "Painter":
        """Make the colours for all drawn pressures [Pa].

        Open points are white, on a root scale, as edges of faces carry much more than the rest;
        where some points pull, these are drawn blue, on a linear one.
        """
        from matplotlib import colormaps
        from matplotlib.colors import ListedColormap, Normalize, PowerNorm

        size = float(np.abs(pressure).max(initial=0.0)) or 1.0
        factor, unit = scale(size, "Pa")
        label, size = f"contact pressure [{unit}]", factor * size
        if np.any(pressure < 0.0):
            return cls(
                Normalize(-size, size), colormaps["RdBu_r"], f"{label}, negative: pull", factor
            )
        palette = colormaps["YlOrRd"](np.linspace(0.0, 1.0, 256))
        palette[0] = 1.0  # zero, and on this scale less than 2e-5 of the largest
        return cls(
            PowerNorm(0.5, 0.0, size), ListedColormap(palette), f"{label}, white: open", factor
        )

    @classmethod
    def of_states(cls) -> "Painter":
        """Make the colours of open, sticking and slipping points."""
        from matplotlib.colors import BoundaryNorm, ListedColormap

        return cls(
            BoundaryNorm([0.5, 1.5, 2.5, 3.5], 3),
            ListedColormap([colour for _, colour in STATES.values()]),
        )

    def colours(self, values: Array) -> Array:
        """Return the colours (…, 4) of values (…)."""
        return np.asarray(self.cmap(self.norm(self.factor * values)))

    def bar(self, figure: Any, axes: Any, **look: Any) -> None:
        """Draw the colour bar beside axes."""
        from matplotlib.cm import ScalarMappable

        shown = ScalarMappable(self.norm, self.cmap)
        figure.colorbar(shown, ax=axes, label=self.label, fraction=0.04, aspect=25, **look)

    def draw(self, axis: Any, face: Face, values: Array) -> None:
        """Draw values (m,) of all conditions on a face.

        Each is drawn on its share of the element sides, and as a dot where there are none.
        """
        if len(face.parts):
            look = {"norm": self.norm, "cmap": self.cmap, "edgecolors": "0.7", "linewidths": 0.2}
            parts = add_polygons(axis, face.seen(face.parts), **look)
            parts.set_array(self.factor * values[face.owners])
        else:
            self.dots(axis, face.seen(face.points), values[face.conditions])
        names = AXES if face.axes is None else [direction(way) for way in face.axes.T]
        seen = face.seen(face.points)
        # with room for arrows
        limit(axis, seen.min(axis=0), seen.max(axis=0), names, margin=1.2 * ARROW)

    def dots(self, axis: Any, places: Array, values: Array) -> None:
        """Draw values (k,) as dots at places (k, d)."""
        look = {
            "norm": self.norm,
            "cmap": self.cmap,
            "edgecolors": "0.3",
            "linewidths": 0.4,
            "zorder": 4,
        }
        axis.scatter(*places.T, c=self.factor * values, s=24, **look)


def add_polygons(axis: Any, polygons: Array, **look: Any) -> Any:
    """Add polygons (p, corners, d) to an axis, in space to one in projection; return them."""
    from matplotlib.collections import PolyCollection
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    if polygons.shape[2] == 3:
        return axis.add_collection3d(Poly3DCollection(polygons, **look))
    return axis.add_collection(PolyCollection(polygons, **look))


def limit(
    axis: Any,
    low: Array,
    high: Array,
    names: Sequence[str] = AXES,
    *,
    margin: float = 0.0,
    up: str = "z",
) -> None:
    """Set limits (d,) [m], one scale along all axes, and their names.

    ``margin`` is a part of the largest size; ``up`` is the axis that points upwards in projection.
    """
    room = margin * (float((high - low).max()) or 1.0)
    axis.grid(False)
    for letter, name, a, b in zip(AXES, names, low - room, high + room, strict=False):
        axis.set(
            **{
                f"{letter}lim": (a, b),
                f"{letter}label": f"{name if len(name) == 1 else f'along {name}'} [m]",
            }
        )
        # narrow panels have room for few numbers
        share = (b - a) / (float((high - low).max() + 2.0 * room) or 1.0)
        axis.locator_params(
            letter, nbins=5 if len(low) == 3 else int(np.clip(6.0 * share, 1.0, 5.0)), min_n_ticks=1
        )
    if len(low) == 3:
        axis.set_box_aspect(high - low + 2.0 * room, zoom=0.85)  # with room for names
        axis.view_init(25.0, -60.0, vertical_axis=up)
        axis.tick_params(labelsize=7)
    else:
        axis.set_aspect("equal")


def leading(history: History) -> tuple[str, int]:
    """Return the column and the row that tell when most happens.

    Of uplift, largest pressure and displacements it is the first one that is not largest in size at
    the start.
    """
    names = (
        "contact_uplift",
        "contact_max_pressure",
        *(name for name in history if name.startswith("u_")),
    )
    most = (
        (name, int(np.argmax(np.abs(np.nan_to_num(history[name])))))
        for name in names
        if name in history
    )
    return next((found for found in most if found[1] > 0), ("iterations", 0))


def moments(history: History) -> list[float]:
    """Return the first time, the one when most happens (``leading``), and the last."""
    return history["t"][[0, leading(history)[1], -1]].tolist()


@check_arguments
def plot_faces(
    run: RunFolder,
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    title: str = "Contact faces",
) -> Path:
    """Draw the contact faces of a run in space, a column for each of ``times`` [s].

    Every face has a row with its pressure, and one with its open, sticking and slipping points and
    its slip. Flat faces are drawn in their plane, curved ones in projection. Each point colours its
    share of the element sides around it, where the run stored fields, or is a dot. Arrows are the
    tangential displacements on the support of closed points. InputError for a run in the plane or
    without arrays of ``Contact()``.
    """
    contact, history = run.contact, run.history
    if contact is None or "active" not in history or contact.points.shape[1] != 3:
        raise InputError(
            f"'{run.folder}' is not a finished run in space with Contact(): finish one that has it"
        )
    sides = (
        read_frames(run).facing(contact)[0]
        if list_frames(run.folder)
        else np.zeros((0, 3), dtype=np.int64)
    )
    faces = faces_of(contact, sides)
    rows = nearest(history["t"], sorted({*moments(history)}) if times is None else times)
    states, slip = contact_states(history)[rows], np.zeros((len(rows), *contact.points.shape))
    if "slip" in history:
        slip += np.einsum("rmj,mij->rmi", history["slip"][rows], stored_tangents(contact))
    slip[states == OPEN] = 0.0
    figure, axes = sheet(
        [face.axes is not None for face in faces for _ in "ab"], len(rows), (3.4, 2.8)
    )
    pressure, painter = history["pressure"][rows], Painter.of_pressure(history["pressure"][rows])
    longest = float(np.linalg.norm(slip, axis=2).max())
    drawn = (
        ARROW * max(float(np.ptp(face.points, axis=0).max()) for face in faces) / (longest or 1.0)
    )
    for place, face in enumerate(faces):
        for column, row in enumerate(rows):
            over, under = axes[2 * place : 2 * place + 2, column]
            painter.draw(over, face, pressure[column])
            Painter.of_states().draw(under, face, states[column])
            _arrows(under, face, drawn * slip[column])
            over.set_title(f"{face.name}, t = {history['t'][row]:.4g} s", fontsize=9)
    painter.bar(figure, list(axes.ravel()))
    name_states(figure, "slip" in history, longest)
    return save(figure, path, plain(title))


def sheet(flat: Sequence[bool], columns: int, size: tuple[float, float]) -> tuple[Any, Array]:
    """Make (figure, axes (rows, columns)), each of a size [inches].

    Rows that are not flat are in projection.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(
            figsize=(size[0] * columns + 1.4, size[1] * len(flat) + 0.9), layout="constrained"
        )
        grid = figure.add_gridspec(len(flat), columns)
        axes = [
            [
                figure.add_subplot(grid[row, column], projection=None if plane else "3d")
                for column in range(columns)
            ]
            for row, plane in enumerate(flat)
        ]
    return figure, np.array(axes, dtype=object)


def _arrows(axis: Any, face: Face, slip: Array) -> None:
    """Return the slips (m, 3) of a face as long as they are to be drawn; specks are left out."""
    own = np.linalg.norm(slip[face.conditions], axis=1) > SAME * float(
        np.ptp(face.points, axis=0).max()
    )
    if own.any():
        flat = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.006, "zorder": 3}
        ends, ways = face.seen(face.points[own]).T, face.seen(slip[face.conditions[own]]).T
        axis.quiver(*ends, *ways, color="black", **(flat if face.axes is not None else {"lw": 0.8}))


def name_states(figure: Any, frictional: bool, longest: float = 0.0) -> None:
    """Write below what the colours of the states mean.

    Where there are arrows, say too how long the longest is [m].
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown = STATES if frictional else {OPEN: STATES[OPEN], STICK: ("closed", STATES[STICK][1])}
    handles = [
        Patch(facecolor=colour, edgecolor="0.5", label=name) for name, colour in shown.values()
    ]
    if longest > 0.0:
        metres, unit = length_unit(longest)
        handles.append(
            Line2D(
                [],
                [],
                color="black",
                marker=r"$\rightarrow$",
                ms=14,
                ls="none",
                label=f"slip of the body, the longest {longest / metres:.3g} {unit}",
            )
        )
    # keeps room for the legend, which the layout of matplotlib 3.6 does not
    figure.supxlabel(" ", fontsize=16)
    figure.legend(handles=handles, loc="lower center", ncol=len(handles), fontsize=9, frameon=False)
