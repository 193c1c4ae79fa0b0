"""Draw the bodies of a run at some times, and a film.

They are in plane or space, and need a folder alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.arguments import check_arguments
from ...core.checks import number, optional
from ...core.errors import InputError
from ...core.files import list_frames, write_output
from ...run.files.reading import ContactGeometry, RunFolder
from .deformed import contact_states, nearest, plane_normals, read_frames
from .faces import (
    Painter,
    add_polygons,
    faces_of,
    leading,
    limit,
    moments,
    name_states,
    plot_faces,
    sheet,
)
from .histories import STYLE, plain, require_matplotlib, save, scale, scaled, shaken

# of the size of the bodies: how large their largest displacement is drawn, if it is not larger
DRAWN = 0.1
FILM_FRAMES = 48  # at most: a film of two megabytes
BODIES = ("0.35", "tab:blue", "tab:green", "tab:purple")  # edges of their elements
# from where it comes; sides along it have 0.6 of their brightness
LIGHT = np.array([0.3, -0.5, 0.81])
# of the size of the bodies: how far inside the dots are that show the contact in the plane
INWARDS = 0.015


@dataclass(frozen=True)
class Scene:
    """Hold what is seen of bodies at ``times`` (k,) [s].

    That is cells in the plane, in space the boundary's sides of cells.

    ``points`` (s, d) [m] of their nodes; ``polygons`` (p, corners), the number of the ``body`` (p,)
    of each; u (k, s, d) [m], drawn ``magnified`` times; von Mises stresses (k, p) [Pa].
    ``contact``: where it was recorded its conditions, their nodes (m,), the ``sides`` (n, corners)
    of elements between them, pressures [Pa] and states (k, m).
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

    @classmethod
    def of(cls, run: RunFolder, times: Sequence[float], magnified: float | None) -> "Scene":
        """Read the frames next to ``times``.

        ``magnified`` is a round number that shows the displacements when None.
        """
        frames, history = read_frames(run), run.history
        if frames.cells.shape[1] < 3:
            raise InputError(
                f"the run in '{run.folder}' has bars or points only: draw runs in the plane or in "
                "space"
            )
        optional(number, "pictures of a run", "magnified", magnified, positive=True)
        found = frames.t[np.unique(nearest(frames.t, times))]
        plane = frames.points.shape[1] == 2
        corners, cells = (frames.cells, np.arange(len(frames.cells))) if plane else frames.boundary
        contact = run.contact if "pressure" in history else None
        sides, nodes = (corners[:0], corners[:0, 0]) if contact is None else frames.facing(contact)
        seen = np.union1d(corners, nodes)  # of degree 2 contact is at mid-points too
        u, stress = map(
            np.array, zip(*((u[seen], s[cells]) for _, u, s in map(frames.at, found)), strict=True)
        )
        size, largest = (
            float(np.ptp(frames.points[seen], axis=0).max()),
            float(np.linalg.norm(u, axis=2).max()),
        )
        rows, pressure = nearest(history["t"], found), np.zeros((len(found), 0))
        states = pressure
        if contact is not None:
            pressure, states = history["pressure"][rows], contact_states(history)[rows]
        return cls(
            found,
            frames.points[seen],
            np.searchsorted(seen, corners),
            frames.bodies[cells],
            u,
            stress,
            magnified or _round_down(DRAWN * size / (largest or np.inf)),
            contact,
            sides,
            np.searchsorted(seen, nodes),
            pressure,
            states,
        )

    @property
    def up(self) -> str:
        """Return the axis that points upwards: y where contact is along y rather than z, else z."""
        along = np.zeros(1) if self.contact is None else np.abs(self.contact.normals.sum(axis=0))
        return "y" if along[1 % len(along)] > along[-1] else "z"

    def moved(self, k: int) -> Array:
        """Return where the nodes are drawn at the time number k, (s, d) [m]."""
        return np.asarray(self.points + self.magnified * self.u[k])

    @cached_property
    def stresses(self) -> Painter:
        """Return the colours of the stresses; the largest per cent has one colour."""
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        most = float(np.nan_to_num(np.percentile(self.stress, 99.0))) or 1.0
        factor, unit = scale(most, "Pa")
        return Painter(
            Normalize(0.0, factor * most), colormaps["YlGnBu"], f"von Mises stress [{unit}]", factor
        )

    @cached_property
    def pressures(self) -> Painter:
        """Return the colours of the pressures."""
        return Painter.of_pressure(self.pressure)

    def draw(self, axis: Any, k: int, states: bool = False) -> None:
        """Draw the bodies at the time number k.

        Each has edges of a colour of its own. In the plane there are dots inside of them with the
        contact pressure, or the ``states`` of the points, those of both sides of a corner apart.
        """
        moved, colours = self.moved(k), self.stresses.colours(self.stress[k])
        flat, polygons = moved.shape[1] == 2, moved[self.polygons]
        colours = np.full_like(colours, 0.95) if states else colours
        if not flat:
            colours[:, :3] *= 0.6 + 0.4 * np.abs(plane_normals(polygons) @ LIGHT)[:, None]
        edges = [BODIES[body % len(BODIES)] for body in self.body]
        thin = min(0.3, 600.0 / len(polygons))  # or fine meshes show nothing but their edges
        add_polygons(axis, polygons, facecolors=colours, edgecolors=edges, linewidths=thin)
        every = (self.points + self.magnified * self.u).reshape(-1, moved.shape[1])
        limit(axis, every.min(axis=0), every.max(axis=0), margin=0.03, up=self.up)
        if flat and self.contact is not None:
            inwards = INWARDS * float(np.ptp(self.points, axis=0).max()) * self.contact.normals
            painter, values = (
                (Painter.of_states(), self.states) if states else (self.pressures, self.pressure)
            )
            painter.dots(axis, moved[self.nodes] - inwards, values[k])


def _round_down(factor: float) -> float:
    """1, 2 or 5 times a power of ten, at least 1."""
    power = 10.0 ** np.floor(np.log10(max(factor, 1.0)))
    return float(max([1.0, *(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor)]))


@check_arguments
def plot_deformed(
    run: RunFolder,
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    magnified: float | None = None,
    title: str = "Deformed bodies",
) -> Path:
    """Draw the deformed bodies of a run in the frames next to ``times`` [s].

    They are coloured by von Mises stress.

    None: the first, the last, and when most happens. The edges of elements have the colour of their
    body. In the plane dots show the contact pressure, and below them which points are open, stick
    and slip. In space y points upwards where contact is along y rather than z, else z.
    ``magnified``: how many times larger displacements are drawn; None: a round number that shows
    them. InputError for a run without fields or in one dimension.
    """
    scene = Scene.of(run, moments(run.history) if times is None else times, magnified)
    flat = scene.points.shape[1] == 2
    with_states = flat and scene.contact is not None
    figure, axes = sheet([flat] * (1 + with_states), len(scene.times), (4.2, 3.8))
    for row, line in enumerate(axes):
        for k, axis in enumerate(line):
            scene.draw(axis, k, states=row > 0)
            axis.set_title(f"t = {scene.times[k]:.4g} s", fontsize=9)
    scene.stresses.bar(figure, list(axes[0]), extend="max")
    if with_states:
        scene.pressures.bar(figure, list(axes[0]))
        name_states(figure, "slip" in run.history)
    return save(figure, path, _headed(title, scene))


def _headed(title: str, scene: Scene) -> str:
    """Return a title on lines that fit above the picture."""
    told = f" (displacements x {scene.magnified:g})" if scene.magnified != 1.0 else ""
    return "\n".join(wrap(plain(title) + told, 64))


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

    Its frames are those next to ``times`` [s].

    None: up to 48 frames around the one in which most happens. In space the pressure on each
    contact face is beside the bodies. Below them is a ``column`` of the history with the moment
    marked, and dashed the motion of the ground. InputError for another kind of file, .mp4 without
    ffmpeg, a column that the run does not have, and as ``plot_deformed``.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.animation import FFMpegWriter, PillowWriter
    from matplotlib.figure import Figure

    if Path(path).suffix not in (".gif", ".mp4"):
        raise InputError(
            f"'{Path(path).name}' is not a .gif or .mp4: give such a name, or use plot_deformed"
        )
    if Path(path).suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            "an .mp4 needs ffmpeg, which is not found: install it, or name the film .gif"
        )
    scene = Scene.of(run, _around(run) if times is None else times, magnified)
    flat, contact = scene.points.shape[1] == 2, scene.contact
    faces = [] if flat or contact is None else faces_of(contact, scene.sides)
    writer = (PillowWriter if Path(path).suffix == ".gif" else FFMpegWriter)(fps=fps)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(6.6 + 3.4 * len(faces), 6.0), layout="constrained")
        wide = [1.6, *[1.0] * len(faces)]
        grid = figure.add_gridspec(2, len(wide), height_ratios=(3.6, 1.0), width_ratios=wide)
        planes = [flat, *(face.axes is not None for face in faces)]
        axes = [
            figure.add_subplot(grid[0, i], projection=None if plane else "3d")
            for i, plane in enumerate(planes)
        ]
        marker = _trace(
            figure.add_subplot(grid[1, :]), run, column or leading(run.history)[0], scene.times
        )
        scene.stresses.bar(figure, axes[0], extend="max", shrink=0.85)
        if contact is not None:
            scene.pressures.bar(figure, axes[-1], shrink=0.85)
        with TemporaryDirectory() as place:
            draft = Path(place) / Path(path).name
            with writer.saving(figure, str(draft), dpi=95):
                for k, t in enumerate(scene.times):
                    for axis in axes:
                        axis.clear()
                    scene.draw(axes[0], k)
                    for axis, face in zip(axes[1:], faces, strict=True):
                        scene.pressures.draw(axis, face, scene.pressure[k])
                        axis.set_title(face.name, fontsize=9)
                    marker.set_xdata([t, t])
                    figure.suptitle(
                        _headed(f"{title}, t = {t:.4g} s".removeprefix(", "), scene), fontsize=10
                    )
                    if k == 0:
                        figure.draw_without_rendering()
                        # the same places in every frame, laid out once
                        figure.set_layout_engine("none")
                    writer.grab_frame()
            write_output(path, draft.read_bytes())
    return Path(path)


def _around(run: RunFolder) -> list[float]:
    """Return the times of the frames next to the one in which most happens."""
    t = read_frames(run).t
    (middle,) = nearest(t, [moments(run.history)[1]])
    first = max(min(middle - FILM_FRAMES // 2, len(t) - FILM_FRAMES), 0)
    return list(t[first : first + FILM_FRAMES])


def _trace(axis: Any, run: RunFolder, column: str, times: Array) -> Any:
    """Draw a column of the history and, dashed the ground's acceleration.

    It is that during the film. The moment's line is returned.
    """
    history = run.history
    if column not in run.columns or np.ndim(history.get(column, 0)) != 1:
        raise InputError(f"the run has no column '{column}': see columns.json in its folder")
    values, unit = scaled(history[column], run.columns[column][0])
    axis.plot(history["t"], values, color="black", lw=1.0)
    shown = times if len(times) > 1 else history["t"]
    axis.set(xlabel="time [s]", xlim=(shown[0], shown[-1]))
    axis.set_ylabel(f"{column} [{unit}]", fontsize=8)
    if shaken(history):
        behind = axis.twinx()
        for ground in shaken(history):
            behind.plot(history["t"], history[f"a_g_{ground}"], color="0.6", lw=0.9, ls="--")
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
    """Draw the bodies of a run with fields into the folder ``out``.

    They are drawn as deformed.png and, in space with ``Contact()``, the contact faces as faces.png,
    next to the ``times`` [s]. None: the first, the last, and when most happens.

    ``magnified``: how many times larger displacements are drawn, None: so that they are seen.
    """
    drawn, contact, history = [], run.contact, run.history
    if list_frames(run.folder) and read_frames(run).cells.shape[1] > 2:  # no bars
        drawn.append(
            plot_deformed(
                run, Path(out) / "deformed.png", times=times, magnified=magnified, title=title
            )
        )
    if contact is not None and contact.points.shape[1] == 3 and "active" in history:
        drawn.append(plot_faces(run, Path(out) / "faces.png", times=times, title=title))
    return drawn
