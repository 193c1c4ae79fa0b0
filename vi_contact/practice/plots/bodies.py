"""Draw the bodies of a run at some times, and film them, in the plane and in space.

Pictures need nothing but the folder of a run that wrote fields.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.arguments import check_arguments
from ...core.checks import number, optional
from ...core.errors import InputError
from ...core.files import write_output
from ...run.files.reading import ContactGeometry, RunFolder
from .deformed import compute_normals, contact_states, find_nearest, has_frames, read_frames
from .faces import (
    Face,
    Painter,
    add_polygons,
    choose_times,
    find_leading_column,
    name_states,
    plot_faces,
    set_limits,
    sheet,
    split_faces,
)
from .histories import (
    STYLE,
    escape_dollars,
    list_shaken_axes,
    require_matplotlib,
    save,
    scale,
    scale_values,
)

# How large the largest displacement is drawn if it is not larger, over the size of the bodies.
DRAWN = 0.1
FILM_FRAMES = 48  # at most: a film of two megabytes
BODIES = ("0.35", "tab:blue", "tab:green", "tab:purple")  # edges of their elements
# Direction from which the light comes; sides along it have 0.6 of their brightness.
LIGHT = np.array([0.3, -0.5, 0.81])
# How far inside the dots are that show the contact in the plane, over the size of what is shown.
INWARDS = 0.008
DOT = 11.0  # area of a dot [square points]: larger ones hide a stem
# A picture shows the structure with as much around it, over its size along the same axis, and at
# least so much over its largest size; and the whole model where that is not larger than by this.
AROUND = 0.5
LEAST_AROUND = 0.15
WHOLE_MARGIN = 0.03  # around a whole model, over its largest size
WORTH = 0.6
# Edges of elements [points], and how many on a line across the picture are still seen apart.
EDGE = 0.2
FINE = 60
OUTLINE = 0.8  # of a body in the plane [points]
# Of a picture in the plane [inches]: width of a panel, bounds of its height, what is beside it.
PANEL = 2.7
NUMBERS = 0.45  # on the left of a panel
HEIGHTS = (1.3, 4.6)
BESIDE = 1.5
TOGETHER = "\u00a0"  # a blank at which no line breaks
SMALL = {"font.size": 8, "xtick.labelsize": 7, "ytick.labelsize": 7}


@dataclass(frozen=True)
class Scene:
    """Hold what is seen of bodies at some times.

    In the plane that is the cells, in space the sides of cells on the boundary.

    Attributes:
        times: (k,) those of the frames [s].
        points: (s, d) nodes of what is drawn [m].
        polygons: (p, corners) rows of ``points``.
        body: (p,) number of the body of each polygon.
        u: (k, s, d) displacements [m].
        stress: (k, p) von Mises stresses [Pa].
        magnified: how many times larger displacements are drawn.
        contact: the conditions of the contact, where it was recorded.
        sides: (n, corners) sides of elements between contact points, as conditions.
        nodes: (m,) row of ``points`` of each condition.
        pressure: (k, m) contact pressures [Pa], (k, 0) without contact.
        states: (k, m) as of ``contact_states``.
        structure: (p,) which polygons are of bodies that are no ground; all where none is.
        outlines: (o, 2) rows of ``points`` of the borders of bodies in the plane; none in space.
    """

    times: Array
    points: Array
    polygons: Indices
    body: Indices
    u: Array
    stress: Array
    magnified: float
    contact: ContactGeometry | None
    sides: Indices
    nodes: Indices
    pressure: Array
    states: Array
    structure: Mask
    outlines: Indices

    @classmethod
    def read(cls, run: RunFolder, times: Sequence[float], magnified: float | None) -> "Scene":
        """Read the frames next to some times.

        Args:
            run: its folder holds fields.
            times: moments that are wanted [s].
            magnified: how many times larger displacements are drawn; None: a round number that
                shows them.

        Returns:
            the bodies, and their contact where it was recorded.

        Raises:
            InputError: the run has bars or points only, or a number is wrong.
        """
        frames = read_frames(run)
        history = run.history
        if frames.cells.shape[1] < 3:
            raise InputError(
                f"the run in '{run.folder}' has bars or points only: draw runs in the plane or in "
                "space"
            )
        optional(number, "pictures of a run", "magnified", magnified, positive=True)
        t = frames.t[np.unique(find_nearest(frames.t, times))]

        # The polygons: cells of the plane, or what is seen of a body in space from outside.
        flat = frames.points.shape[1] == 2
        boundary, cells = frames.boundary
        if flat:
            corners = frames.cells
            cells = np.arange(len(frames.cells))
            outlines = boundary
        else:
            corners = boundary
            outlines = boundary[:0, :2]

        contact = run.contact if "pressure" in history else None
        if contact is None:
            sides = corners[:0]
            nodes = corners[:0, 0]
        else:
            sides, nodes = frames.facing(contact)

        # Of all nodes those that are drawn: of degree 2 contact is at mid-points too.
        drawn = np.union1d(corners, nodes)
        displacements = []
        stresses = []
        for moment in t:
            _, u, stress = frames.at(moment)
            displacements.append(u[drawn])
            stresses.append(stress[cells])
        u_of_times = np.array(displacements)

        if contact is None:
            pressure = states = np.zeros((len(t), 0))
        else:
            rows = find_nearest(history["t"], t)
            pressure = history["pressure"][rows]
            states = contact_states(history)[rows]

        up = 1 if flat else "xyz".index(_find_up(contact))
        structure = frames.find_structure(up)[cells]
        size = float(np.ptp(frames.points[drawn], axis=0).max())
        largest = float(np.linalg.norm(u_of_times, axis=2).max())
        return cls(
            times=t,
            points=frames.points[drawn],
            polygons=np.searchsorted(drawn, corners),
            body=frames.bodies[cells],
            u=u_of_times,
            stress=np.array(stresses),
            magnified=magnified or _round_down(DRAWN * size / (largest or np.inf)),
            contact=contact,
            sides=sides,
            nodes=np.searchsorted(drawn, nodes),
            pressure=pressure,
            states=states,
            structure=structure if structure.any() else ~structure,
            outlines=np.searchsorted(drawn, outlines),
        )

    @property
    def up(self) -> str:
        """Return the axis that points upwards: y where contact is along y rather than z, else z."""
        return _find_up(self.contact)

    @cached_property
    def reached(self) -> tuple[Array, Array]:
        """Return the least and the largest coordinates (d,) that are drawn at all times [m]."""
        return self._find_limits(np.unique(self.polygons))

    @cached_property
    def window(self) -> tuple[Array, Array]:
        """Return the least and the largest coordinates (d,) of the pictures [m].

        They are the structure's with a margin of its size, and the whole model's where this is not
        much more. They hold for all times, so that pictures can be compared.
        """
        low, high = self.reached
        room = WHOLE_MARGIN * float((high - low).max())
        low = low - room
        high = high + room
        nodes = np.unique(self.polygons[self.structure])
        size = np.ptp(self.points[nodes], axis=0)
        around = np.maximum(AROUND * size, LEAST_AROUND * float(size.max()))
        first, last = self._find_limits(nodes)
        first = np.maximum(first - around, low)
        last = np.minimum(last + around, high)
        if np.prod(last - first) > WORTH * np.prod(high - low):
            return low, high
        return first, last

    @property
    def zoomed(self) -> bool:
        """Return whether the pictures show less than the whole model."""
        low, high = self.reached
        first, last = self.window
        return bool(np.any(first > low) or np.any(last < high))

    @cached_property
    def seen(self) -> Mask:
        """Return which polygons (p,) have their middle in the window before they move."""
        low, high = self.window
        middles = self.points[self.polygons].mean(axis=1)
        return np.asarray(np.all((middles >= low) & (middles <= high), axis=1))

    def _find_limits(self, nodes: Indices) -> tuple[Array, Array]:
        """Return the least and the largest coordinates (d,) that nodes reach [m]."""
        places = self.points[nodes] + self.magnified * self.u[:, nodes]
        return places.min(axis=(0, 1)), places.max(axis=(0, 1))

    def displace(self, k: int) -> Array:
        """Return where the nodes are drawn at the time number k, (s, d) [m]."""
        return np.asarray(self.points + self.magnified * self.u[k])

    @cached_property
    def stresses(self) -> Painter:
        """Return the colours of the stresses that are seen; the largest per cent has one colour."""
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        most = float(np.nan_to_num(np.percentile(self.stress[:, self.seen], 99.0))) or 1.0
        factor, unit = scale(most, "Pa")
        return Painter(
            Normalize(0.0, factor * most), colormaps["YlGnBu"], f"von Mises stress [{unit}]", factor
        )

    @cached_property
    def pressures(self) -> Painter:
        """Return the colours of the pressures."""
        return Painter.of_pressure(self.pressure)

    def draw(self, axis: Any, k: int, states: bool = False) -> None:
        """Draw the bodies at one time.

        Elements have thin edges, where they are not too many to be seen; in the plane bodies have
        outlines, in space the edges of each have a colour of its own. In the plane, dots inside of
        bodies show the contact, those of both sides of a corner apart.

        Args:
            axis: in projection where the bodies are in space.
            k: number of the time.
            states: whether dots are coloured by the states of the points on pale bodies, in place
                of the contact pressure on bodies coloured by their stress.
        """
        places = self.displace(k)
        flat = places.shape[1] == 2
        # An axis in projection does not cut what is beyond its limits.
        shown = np.ones(len(self.polygons), dtype=bool) if flat else self.seen
        polygons = places[self.polygons[shown]]
        colours = self.stresses.map_colours(self.stress[k, shown])
        if states:
            colours = np.full_like(colours, 0.95)
        if not flat:
            # Sides along the light are darker, or the shape of a body could not be seen.
            colours[:, :3] *= 0.6 + 0.4 * np.abs(compute_normals(polygons) @ LIGHT)[:, None]
        edges: Any = "0.45"
        if states or np.sqrt(np.count_nonzero(self.seen)) > FINE:
            # A fine mesh would show nothing but its edges. The colours are said in full, as
            # Matplotlib 3.6 does not know the word "face" for polygons in space.
            edges = colours
        elif not flat:
            edges = [BODIES[body % len(BODIES)] for body in self.body[shown]]
        add_polygons(axis, polygons, facecolors=colours, edgecolors=edges, linewidths=EDGE)
        if flat:
            look = {"facecolors": "none", "edgecolors": "0.1", "linewidths": OUTLINE, "zorder": 3}
            add_polygons(axis, places[self.outlines], **look)
        set_limits(axis, *self.window, up=self.up)

        if flat and self.contact is not None:
            low, high = self.window
            inwards = INWARDS * float((high - low).max()) * self.contact.normals
            if states:
                painter = Painter.of_states()
                values = self.states[k]
            else:
                painter = self.pressures
                values = self.pressure[k]
            painter.draw_dots(axis, places[self.nodes] - inwards, values, DOT)

    def draw_whole(self, axis: Any) -> None:
        """Draw the outlines of all bodies in the plane as they were, and what the window shows."""
        from matplotlib.patches import Rectangle

        look = {"facecolors": "none", "edgecolors": "0.3", "linewidths": 0.5}
        add_polygons(axis, self.points[self.outlines], **look)
        low, high = self.window
        axis.add_patch(Rectangle(low, *(high - low), fill=False, edgecolor="black", lw=1.2))
        set_limits(axis, *self.reached, margin=WHOLE_MARGIN)
        axis.set_axis_off()
        axis.set_title("what is shown", fontsize=7)


def _find_up(contact: ContactGeometry | None) -> str:
    """Return the axis that points upwards: y where contact is along y rather than z, else z."""
    along = np.zeros(1) if contact is None else np.abs(contact.normals.sum(axis=0))
    return "y" if along[1 % len(along)] > along[-1] else "z"


def _round_down(factor: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above the factor but at least 1."""
    power = 10.0 ** np.floor(np.log10(max(factor, 1.0)))
    steps = [step * power for step in (1.0, 2.0, 5.0) if step * power <= factor]
    return float(max([1.0, *steps]))


@check_arguments
def plot_deformed(
    run: RunFolder,
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    magnified: float | None = None,
    title: str = "Deformed bodies",
) -> Path:
    """Draw the deformed bodies of a run at some times, coloured by von Mises stress.

    The edges of elements have the colour of their body. In the plane dots show the contact
    pressure, and below them which points are open, stick and slip. In space y points upwards where
    contact is along y rather than z, else z.

    Args:
        run: its folder holds fields.
        path: the picture; its ending says the format.
        times: moments [s], of which the nearest frames are drawn; None: the first, the last, and
            when most happens.
        magnified: how many times larger displacements are drawn; None: a round number that shows
            them.
        title: stands above the picture.

    Returns:
        the path.

    Raises:
        InputError: the run has no fields, or is in one dimension.
    """
    scene = Scene.read(run, choose_times(run.history) if times is None else times, magnified)
    if scene.points.shape[1] == 2:
        figure, axes = _lay_out_plane(scene, "slip" in run.history)
    else:
        figure, axes = sheet([False], len(scene.times), (4.2, 3.8))
        scene.stresses.draw_bar(figure, list(axes[0]), extend="max")
    for row, line in enumerate(axes):
        for k, axis in enumerate(line):
            scene.draw(axis, k, states=row > 0)
            axis.set_title(f"t = {scene.times[k]:.4g} s", fontsize=9)
            if scene.points.shape[1] == 2:
                axis.set_xlabel(axis.get_xlabel() if row == len(axes) - 1 else "")
                axis.set_ylabel(axis.get_ylabel() if k == 0 else "")
    return save(figure, path, _compose_title(title, scene))


def _lay_out_plane(scene: Scene, frictional: bool) -> tuple[Any, Array]:
    """Make (figure, axes (rows, times)) of bodies in the plane.

    Panels are as high as what they show. The last column has the colour bars and, where panels show
    a part of the model, the whole of it.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    low, high = scene.window
    ratio = float((high - low)[1] / (high - low)[0])
    height = float(np.clip((PANEL - NUMBERS) * ratio, *HEIGHTS))
    rows = 1 if scene.contact is None else 2
    columns = len(scene.times)
    with matplotlib.rc_context(STYLE | SMALL):
        figure = Figure(
            figsize=(PANEL * columns + BESIDE, rows * (height + 0.45) + 0.9), layout="constrained"
        )
        grid = figure.add_gridspec(rows, columns + 1, width_ratios=[*[PANEL] * columns, BESIDE])
        axes = np.empty((rows, columns), dtype=object)
        for row in range(rows):
            for column in range(columns):
                axes[row, column] = figure.add_subplot(grid[row, column])

        # The colour bars beside the first row.
        room = figure.add_subplot(grid[0, columns])
        room.set_axis_off()
        scene.stresses.fill_bar(figure, room.inset_axes([0.0, 0.0, 0.1, 1.0]), extend="max")
        if rows == 2:
            scene.pressures.fill_bar(figure, room.inset_axes([0.55, 0.0, 0.1, 1.0]))
            name_states(figure, frictional)
            if scene.zoomed:
                scene.draw_whole(figure.add_subplot(grid[1, columns]))
    return figure, axes


def _compose_title(title: str, scene: Scene) -> str:
    """Return a title on lines that fit above the picture, with the factor of displacements."""
    factor = ""
    if scene.magnified != 1.0:
        factor = f" (displacements{TOGETHER}x{TOGETHER}{scene.magnified:g})"
    lines = wrap(escape_dollars(title) + factor, 64)
    return "\n".join(lines).replace(TOGETHER, " ")


@check_arguments
def film(
    run: RunFolder,
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    magnified: float | None = None,
    column: str | None = None,
    title: str = "",
    fps: int = 10,
) -> Path:
    """Write a film of the bodies of a run, a GIF or with ffmpeg an MP4.

    In space the pressure on each contact face is beside the bodies. Below them is a column of the
    history with the moment marked, and dashed the motion of the ground.

    Args:
        run: its folder holds fields.
        path: the film, .gif or .mp4.
        times: moments [s], of which the nearest frames are shown; None: up to 48 frames around the
            one in which most happens.
        magnified: how many times larger displacements are drawn; None: a round number that shows
            them.
        column: what is drawn below; None: what tells when most happens.
        title: stands above the film, before the moment.
        fps: frames per second.

    Returns:
        the path.

    Raises:
        InputError: another kind of file, .mp4 without ffmpeg, a column that the run does not have,
            and as of ``plot_deformed``.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.animation import FFMpegWriter, PillowWriter

    path = Path(path)
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(
            f"'{path.name}' is not a .gif or .mp4: give such a name, or use plot_deformed"
        )
    if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            "an .mp4 needs ffmpeg, which is not found: install it, or name the film .gif"
        )
    scene = Scene.read(run, _choose_film_times(run) if times is None else times, magnified)
    flat = scene.points.shape[1] == 2
    faces = [] if flat or scene.contact is None else split_faces(scene.contact, scene.sides)
    writer = PillowWriter(fps=fps) if path.suffix == ".gif" else FFMpegWriter(fps=fps)
    with matplotlib.rc_context(STYLE):
        figure, axes, below = _lay_out_film(scene, faces)
        marker = _draw_trace(below, run, column or find_leading_column(run.history)[0], scene.times)
        scene.stresses.draw_bar(figure, axes[0], extend="max", shrink=0.85)
        if scene.contact is not None:
            scene.pressures.draw_bar(figure, axes[-1], shrink=0.85)
        with TemporaryDirectory() as folder:
            draft = Path(folder) / path.name
            with writer.saving(figure, str(draft), dpi=95):
                for k, t in enumerate(scene.times):
                    _draw_film_frame(axes, scene, faces, k)
                    marker.set_xdata([t, t])
                    moment = f"{title}, t = {t:.4g} s".removeprefix(", ")
                    figure.suptitle(_compose_title(moment, scene), fontsize=10)
                    if k == 0:
                        figure.draw_without_rendering()
                        # the same places in every frame, laid out once
                        figure.set_layout_engine("none")
                    writer.grab_frame()
            write_output(path, draft.read_bytes())
    return path


def _lay_out_film(scene: Scene, faces: Sequence[Face]) -> tuple[Any, list[Any], Any]:
    """Make (figure, axes of the bodies and of each contact face, axis of the history below)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.6 + 3.4 * len(faces), 6.0), layout="constrained")
    widths = [1.6, *[1.0] * len(faces)]
    grid = figure.add_gridspec(2, len(widths), height_ratios=(3.6, 1.0), width_ratios=widths)
    planes = [scene.points.shape[1] == 2, *(face.axes is not None for face in faces)]
    axes = [
        figure.add_subplot(grid[0, i], projection=None if plane else "3d")
        for i, plane in enumerate(planes)
    ]
    return figure, axes, figure.add_subplot(grid[1, :])


def _draw_film_frame(axes: Sequence[Any], scene: Scene, faces: Sequence[Face], k: int) -> None:
    """Draw the bodies, and the pressure on each contact face, at the time number k."""
    for axis in axes:
        axis.clear()
    scene.draw(axes[0], k)
    for axis, face in zip(axes[1:], faces, strict=True):
        scene.pressures.draw_values(axis, face, scene.pressure[k])
        axis.set_title(face.name, fontsize=9)


def _choose_film_times(run: RunFolder) -> list[float]:
    """Return the times of the frames next to the one in which most happens."""
    t = read_frames(run).t
    (middle,) = find_nearest(t, [choose_times(run.history)[1]])
    first = max(min(middle - FILM_FRAMES // 2, len(t) - FILM_FRAMES), 0)
    return list(t[first : first + FILM_FRAMES])


def _draw_trace(axis: Any, run: RunFolder, column: str, times: Array) -> Any:
    """Draw a column of the history, and dashed the acceleration of the ground.

    Both are shown during the film.

    Returns:
        the line that marks the moment.

    Raises:
        InputError: the run has no such column.
    """
    history = run.history
    if column not in run.columns or np.ndim(history.get(column, 0)) != 1:
        raise InputError(f"the run has no column '{column}': see columns.json in its folder")
    values, unit = scale_values(history[column], run.columns[column][0])
    axis.plot(history["t"], values, color="black", lw=1.0)
    span = times if len(times) > 1 else history["t"]
    axis.set(xlabel="time [s]", xlim=(span[0], span[-1]))
    axis.set_ylabel(f"{column} [{unit}]", fontsize=8)

    directions = list_shaken_axes(history)
    if directions:
        behind = axis.twinx()
        for direction in directions:
            ground = history[f"a_g_{direction}"]
            behind.plot(history["t"], ground, color="0.6", lw=0.9, ls="--")
        behind.set_ylabel("$a_g$ [m/s²]", color="0.4")
    return axis.axvline(times[0], color="tab:red", lw=1.2)


@check_arguments
def draw_run(
    run: RunFolder,
    out: str | Path,
    *,
    title: str,
    times: Sequence[float] | None = None,
    magnified: float | None = None,
) -> list[Path]:
    """Draw all pictures of the bodies of a run for which its folder has data.

    With fields the bodies are drawn as deformed.png; in space with ``Contact()`` the contact faces
    are drawn as faces.png.

    Args:
        run: what ``read_run`` returned.
        out: folder of the pictures.
        title: stands above them.
        times: moments [s], of which the nearest are drawn; None: the first, the last, and when most
            happens.
        magnified: how many times larger displacements are drawn; None: so that they are seen.

    Returns:
        the pictures that were written.
    """
    pictures = []
    if has_frames(run.folder) and read_frames(run).cells.shape[1] > 2:  # no bars
        path = Path(out) / "deformed.png"
        pictures.append(plot_deformed(run, path, times=times, magnified=magnified, title=title))
    contact = run.contact
    if contact is not None and contact.points.shape[1] == 3 and "active" in run.history:
        pictures.append(plot_faces(run, Path(out) / "faces.png", times=times, title=title))
    return pictures
