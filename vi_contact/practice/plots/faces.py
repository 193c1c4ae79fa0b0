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
from ...core.step import AXES
from ...meshes.rows import number_parts
from ...run.files.reading import RunFolder
from ...run.recorders.contact_parts import Geometry, make_tangent_vectors
from .deformed import (
    OPEN,
    SAME,
    SLIP,
    STICK,
    compute_tangents,
    contact_states,
    find_nearest,
    has_frames,
    read_frames,
)
from .histories import STYLE, History, escape_dollars, length_unit, require_matplotlib, save, scale

ARROW = 0.15  # length of the longest arrow, over the size of the largest face
NEIGHBOURS = 24  # nearest points that make one face if they point the same way
# State -> what it is called, and its colour: in grey white, dark and between.
STATES = {OPEN: ("open", "white"), STICK: ("stick", "#3f7fbf"), SLIP: ("slip", "#f5a623")}
# Colours of pressures that pull and press: lightness falls all the way, the hue changes at zero.
PULLS = ("#e8f4ff", "#9ecae8", "#b0a090", "#b03020", "#3a0606")


@dataclass(frozen=True)
class Face:
    """Hold a contact face.

    Attributes:
        name: what it is called in pictures.
        conditions: (k,) contact conditions on it.
        points: (k, 3) their points [m].
        axes: (3, 2) unit vectors in its plane; None if it is curved.
        parts: (p, 4, 3) corners of the shares of element sides [m]; none without fields.
        owners: (p,) the condition of each share.
    """

    name: str
    conditions: Indices
    points: Array
    axes: Array | None
    parts: Array
    owners: Indices

    def project(self, vectors: Array) -> Array:
        """Return vectors (..., 3) in the plane of the face, (..., 2); as they are if curved."""
        return vectors if self.axes is None else vectors @ self.axes


def split_faces(contact: Geometry, sides: Indices) -> list[Face]:
    """Split a contact surface into its faces.

    A face is points near to each other whose directions differ by less than 30°. Pieces in one
    plane are one face.

    Args:
        contact: points and normals (m, 3) of the conditions.
        sides: (n, corners) sides of elements, as conditions; each is shared by its corners.
    """
    points = contact.points
    normals = contact.normals
    m = len(points)
    size = float(np.ptp(points, axis=0).max()) or 1.0

    # Pieces: points that are connected by neighbours which point the same way.
    near = cKDTree(points).query(points, k=min(NEIGHBOURS, m))[1].reshape(m, -1)
    alike = np.einsum("mki,mi->mk", normals[near], normals) > np.cos(FEATURE_ANGLE)
    rows = np.repeat(np.arange(m), alike.sum(axis=1))
    piece = number_parts(m, rows, near[alike])

    # Flat pieces are gathered by their planes; a curved piece is a face of its own.
    pieces_of_face: dict[tuple[float, ...] | int, list[Indices]] = {}
    for number in range(piece.max() + 1):
        own = np.flatnonzero(piece == number)
        plane = _find_plane(points[own], normals[own], size)
        pieces_of_face.setdefault(number if plane is None else plane, []).append(own)
    faces = []
    for key, pieces in pieces_of_face.items():
        own = np.sort(np.concatenate(pieces))
        faces.append(_make_face(contact, sides, own, flat=isinstance(key, tuple)))
    return faces


def _find_plane(points: Array, normals: Array, size: float) -> tuple[float, ...] | None:
    """Return normal and level of the plane of a piece, rounded so that equal planes are equal.

    Args:
        points: (k, 3) of the piece [m].
        normals: (k, 3) their directions.
        size: of the whole contact surface [m], by which levels are divided.

    Returns:
        the plane, or None for a curved piece.
    """
    normal = normals[0]
    level = points @ normal / size
    if max(float(np.ptp(level)), float(np.abs(normals - normal).max())) > SAME:
        return None
    return (*np.round(normal / SAME), round(level[0] / SAME))


def _make_face(contact: Geometry, sides: Indices, own: Indices, *, flat: bool) -> Face:
    """Make the face of some conditions, with the sides whose corners are all among them."""
    points = contact.points
    normal = contact.normals[own[:1]]
    within = sides[np.all(np.isin(sides, own), axis=1)]
    return Face(
        name=f"face towards {name_direction(normal[0])}" if flat else "curved face",
        conditions=own,
        points=points[own],
        axes=make_tangent_vectors(normal, np.zeros(1, dtype=np.int64))[0] if flat else None,
        parts=cut_shares(points[within]),
        owners=within.ravel(),
    )


def cut_shares(corners: Array) -> Array:
    """Cut sides (n, corners, 3) into shares (n corners, 4, 3), each around a corner.

    A share goes from its corner to the middles of both edges and to the middle of the side.
    """
    before = 0.5 * (corners + np.roll(corners, 1, axis=1))
    after = 0.5 * (corners + np.roll(corners, -1, axis=1))
    middle = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    return np.stack([corners, after, middle, before], axis=2).reshape(-1, 4, 3)


def name_direction(direction: Array) -> str:
    """Return the name of a unit vector (d,): its axis with its sign, or its components."""
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > 1.0 - SAME:
        sign = "-" if direction[axis] < 0.0 else ""
        return sign + AXES[axis]
    # adding zero turns -0 into 0
    return "(" + ", ".join(f"{component + 0.0:.2g}" for component in direction) + ")"


@dataclass(frozen=True)
class Painter:
    """Draw values in colours.

    Attributes:
        norm: matplotlib's, of the values times ``factor``.
        cmap: matplotlib's.
        label: stands beside the colour bar.
        factor: from SI units to those of the label.
    """

    norm: Any
    cmap: Any
    label: str = ""
    factor: float = 1.0

    @classmethod
    def of_pressure(cls, pressure: Array) -> "Painter":
        """Make the colours for all drawn pressures [Pa].

        Open points are white, on a root scale, as edges of faces carry much more than the rest;
        where some points pull, these are drawn blue and lighter than zero, on a linear one.
        """
        from matplotlib import colormaps
        from matplotlib.colors import (
            LinearSegmentedColormap,
            ListedColormap,
            Normalize,
            PowerNorm,
        )

        largest = float(np.abs(pressure).max(initial=0.0)) or 1.0
        factor, unit = scale(largest, "Pa")
        label = f"contact pressure [{unit}]"
        size = factor * largest
        if np.any(pressure < 0.0):
            pulls = LinearSegmentedColormap.from_list("pulls", PULLS)
            return cls(Normalize(-size, size), pulls, f"{label}, negative: pull", factor)
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

    def map_colours(self, values: Array) -> Array:
        """Return the colours (…, 4) of values (…)."""
        return np.asarray(self.cmap(self.norm(self.factor * values)))

    def draw_bar(self, figure: Any, axes: Any, **look: Any) -> None:
        """Draw the colour bar beside axes."""
        from matplotlib.cm import ScalarMappable

        mappable = ScalarMappable(self.norm, self.cmap)
        figure.colorbar(mappable, ax=axes, label=self.label, fraction=0.04, aspect=25, **look)

    def fill_bar(self, figure: Any, axis: Any, **look: Any) -> None:
        """Draw the colour bar on an axis of its own."""
        from matplotlib.cm import ScalarMappable

        axis.grid(False)
        mappable = ScalarMappable(self.norm, self.cmap)
        figure.colorbar(mappable, cax=axis, label=self.label, **look)

    def draw_values(self, axis: Any, face: Face, values: Array) -> None:
        """Draw the values on a face.

        Each is drawn on its share of the element sides, and as a dot where there are none.

        Args:
            axis: in projection where the face is curved.
            face: where to draw.
            values: (m,) of all conditions of the contact, not of the face alone.
        """
        if len(face.parts):
            look = {"norm": self.norm, "cmap": self.cmap, "edgecolors": "0.7", "linewidths": 0.2}
            parts = add_polygons(axis, face.project(face.parts), **look)
            parts.set_array(self.factor * values[face.owners])
        else:
            self.draw_dots(axis, face.project(face.points), values[face.conditions])
        names = AXES if face.axes is None else [name_direction(column) for column in face.axes.T]
        places = face.project(face.points)
        # with room for arrows
        set_limits(axis, places.min(axis=0), places.max(axis=0), names, margin=1.2 * ARROW)

    def draw_dots(self, axis: Any, places: Array, values: Array, size: float = 24.0) -> None:
        """Draw values as dots.

        Args:
            axis: in projection where the places are in space.
            places: (k, d) of the dots [m].
            values: (k,) of the dots.
            size: area of a dot [square points].
        """
        look = {
            "norm": self.norm,
            "cmap": self.cmap,
            "edgecolors": "0.3",
            "linewidths": 0.4,
            "zorder": 4,
        }
        axis.scatter(*places.T, c=self.factor * values, s=size, **look)


def add_polygons(axis: Any, polygons: Array, **look: Any) -> Any:
    """Add polygons (p, corners, d) to an axis, in space to one in projection; return them."""
    from matplotlib.collections import PolyCollection
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    if polygons.shape[2] == 3:
        return axis.add_collection3d(Poly3DCollection(polygons, **look))
    return axis.add_collection(PolyCollection(polygons, **look))


def set_limits(
    axis: Any,
    low: Array,
    high: Array,
    names: Sequence[str] = AXES,
    *,
    margin: float = 0.0,
    up: str = "z",
) -> None:
    """Set the limits of an axis, one scale along all directions, and their names.

    Args:
        axis: in projection where the limits are in space.
        low: (d,) least coordinates [m].
        high: (d,) largest coordinates [m].
        names: of the directions: a letter, or words after "along".
        margin: room around, over the largest size.
        up: the direction that points upwards in projection.
    """
    in_space = len(low) == 3
    room = margin * (float((high - low).max()) or 1.0)
    axis.grid(False)
    for letter, name, first, last in zip(AXES, names, low - room, high + room, strict=False):
        label = name if len(name) == 1 else f"along {name}"
        axis.set(**{f"{letter}lim": (first, last), f"{letter}label": f"{label} [m]"})
        # narrow panels have room for few numbers
        share = (last - first) / (float((high - low).max() + 2.0 * room) or 1.0)
        bins = 5 if in_space else int(np.clip(6.0 * share, 1.0, 5.0))
        axis.locator_params(letter, nbins=bins, min_n_ticks=min(bins, 2))
    if in_space:
        axis.set_box_aspect(high - low + 2.0 * room, zoom=0.85)  # with room for names
        axis.view_init(25.0, -60.0, vertical_axis=up)
        axis.tick_params(labelsize=7)
    else:
        axis.set_aspect("equal")


def find_leading_column(history: History) -> tuple[str, int]:
    """Return the column and the row that tell when most happens.

    Of uplift, largest pressure and displacements it is the first column that is not largest in size
    at the start; without one it is the column of iterations, at the start.
    """
    names = ["contact_uplift", "contact_max_pressure"]
    names += [name for name in history if name.startswith("u_")]
    for name in names:
        if name in history:
            row = int(np.argmax(np.abs(np.nan_to_num(history[name]))))
            if row > 0:
                return name, row
    return "iterations", 0


def choose_times(history: History) -> list[float]:
    """Return the first time, the one when most happens (``find_leading_column``), and the last."""
    _, row = find_leading_column(history)
    return history["t"][[0, row, -1]].tolist()


@check_arguments
def plot_faces(
    run: RunFolder,
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    title: str = "Contact faces",
) -> Path:
    """Draw the contact faces of a run in space, a column for each time.

    Every face has a row with its pressure, and one with its open, sticking and slipping points and
    its slip. Flat faces are drawn in their plane, curved ones in projection. Each point colours its
    share of the element sides around it, where the run stored fields, or is a dot. Arrows are the
    tangential displacements on the support of closed points.

    Args:
        run: it recorded ``Contact()``.
        path: the picture; its ending says the format.
        times: moments [s], of which the nearest rows of the history are drawn; None: the first, the
            last, and when most happens.
        title: stands above the picture.

    Returns:
        the path.

    Raises:
        InputError: the run is in the plane, or has no arrays of ``Contact()``.
    """
    contact = run.contact
    history = run.history
    if contact is None or "active" not in history or contact.points.shape[1] != 3:
        raise InputError(
            f"'{run.folder}' is not a finished run in space with Contact(): finish one that has it"
        )
    if has_frames(run.folder):
        sides, _ = read_frames(run).facing(contact)
    else:
        sides = np.zeros((0, 3), dtype=np.int64)
    faces = split_faces(contact, sides)
    rows = find_nearest(history["t"], sorted({*choose_times(history)}) if times is None else times)
    pressure = history["pressure"][rows]
    states = contact_states(history)[rows]

    # Slip of closed points in space, from its components along the tangents.
    slip = np.zeros((len(rows), *contact.points.shape))
    if "slip" in history:
        slip += np.einsum("rmj,mij->rmi", history["slip"][rows], compute_tangents(contact))
    slip[states == OPEN] = 0.0

    # One factor for all arrows: the longest is a part of the largest face.
    longest = float(np.linalg.norm(slip, axis=2).max())
    size = max(float(np.ptp(face.points, axis=0).max()) for face in faces)
    arrows = ARROW * size / (longest or 1.0)

    flat = [face.axes is not None for face in faces for _ in ("pressure", "states")]
    figure, axes = sheet(flat, len(rows), (3.4, 2.8))
    painter = Painter.of_pressure(pressure)
    for place, face in enumerate(faces):
        for column, row in enumerate(rows):
            upper, lower = axes[2 * place : 2 * place + 2, column]
            painter.draw_values(upper, face, pressure[column])
            Painter.of_states().draw_values(lower, face, states[column])
            _draw_arrows(lower, face, arrows * slip[column])
            upper.set_title(f"{face.name}, t = {history['t'][row]:.4g} s", fontsize=9)
    painter.draw_bar(figure, list(axes.ravel()))
    name_states(figure, "slip" in history, longest)
    return save(figure, path, escape_dollars(title))


def sheet(flat: Sequence[bool], columns: int, size: tuple[float, float]) -> tuple[Any, Array]:
    """Make (figure, axes (rows, columns)).

    Args:
        flat: for each row whether it is drawn in a plane; others are in projection.
        columns: their number.
        size: width and height of each axis [inches].
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    axes = np.empty((len(flat), columns), dtype=object)
    with matplotlib.rc_context(STYLE):
        figure = Figure(
            figsize=(size[0] * columns + 1.4, size[1] * len(flat) + 0.9), layout="constrained"
        )
        grid = figure.add_gridspec(len(flat), columns)
        for row, plane in enumerate(flat):
            for column in range(columns):
                projection = None if plane else "3d"
                axes[row, column] = figure.add_subplot(grid[row, column], projection=projection)
    return figure, axes


def _draw_arrows(axis: Any, face: Face, slip: Array) -> None:
    """Draw slips (m, 3) of all conditions on a face, as long as they are; specks are left out."""
    size = float(np.ptp(face.points, axis=0).max())
    own = np.linalg.norm(slip[face.conditions], axis=1) > SAME * size
    if not own.any():
        return
    look: dict[str, Any] = {"lw": 0.8}
    if face.axes is not None:
        look = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.006, "zorder": 3}
    starts = face.project(face.points[own]).T
    arrows = face.project(slip[face.conditions[own]]).T
    axis.quiver(*starts, *arrows, color="black", **look)


def name_states(figure: Any, frictional: bool, longest: float = 0.0) -> None:
    """Write below a figure what the colours of the states mean.

    Args:
        figure: matplotlib's.
        frictional: whether there is friction; without it closed points do not stick or slip.
        longest: slip of the longest arrow [m], which is written; zero where there are no arrows.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    states = STATES
    if not frictional:
        _, closed_colour = STATES[STICK]
        states = {OPEN: STATES[OPEN], STICK: ("closed", closed_colour)}
    handles = [
        Patch(facecolor=colour, edgecolor="0.5", label=name) for name, colour in states.values()
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
