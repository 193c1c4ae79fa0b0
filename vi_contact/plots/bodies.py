"""Draw the bodies of a run where they are at some times, in the plane and in space, and a film of them: from its folder
alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError
from ..run.files.reading import RunFolder
from .deformed import StoredFrames, read_frames
from .faces import Face, Painter, faces_of, leading, limit, moments, sheet
from .histories import STYLE, plain, save, scale, scaled, shaken

DRAWN = 0.1  # of the size of the bodies: how large their largest displacement is drawn, if it is not larger
FILM_FRAMES = 48  # at most: a film of two megabytes
BODIES = ("0.35", "tab:blue", "tab:green", "tab:purple")  # edges of their elements
LIGHT = np.array([0.3, -0.5, 0.81])  # from where it comes
INWARDS = 0.015  # of the size of the bodies: how far inside the dots are that show the contact in the plane


@dataclass(frozen=True)
class Scene:
    """Hold what is drawn of a run at ``times`` [s]: its frames, displacements (k, n, d) [m], von Mises stresses (k, c)
    [Pa]; displacements are drawn ``magnified`` times, in space with the axis ``up`` upwards: y where contact is along
    y rather than z, else z."""

    frames: StoredFrames
    times: Array
    u: Array
    stress: Array
    magnified: float
    up: str

    @classmethod
    def of(cls, run: RunFolder, times: Sequence[float], magnified: float | None) -> "Scene":
        """Read the frames next to ``times``; ``magnified``: a round number that shows the displacements when None."""
        frames = read_frames(run)
        if frames.cells.shape[1] < 3:
            raise InputError(f"the run in '{run.folder}' is of bars in one dimension: there is nothing to deform")
        nearest = sorted({float(frames.t[np.argmin(np.abs(frames.t - t))]) for t in times})
        shown, u, stress = (np.array(part) for part in zip(*map(frames.at, nearest), strict=True))
        largest = float(np.linalg.norm(u, axis=2).max())
        factor = magnified or _round_down(DRAWN * _size(frames) / (largest or np.inf))
        along = np.zeros(3) if run.contact is None else np.abs(run.contact.normals.sum(axis=0))
        return cls(frames, shown, u, stress, factor, "y" if along[1] > along[-1] else "z")

    @cached_property
    def polygons(self) -> tuple[Indices, Indices]:
        """Return what is seen of the bodies: nodes (p, corners), cell (p,); cells in the plane, else boundary sides."""
        plane = self.frames.points.shape[1] == 2
        return (self.frames.cells, np.arange(len(self.frames.cells))) if plane else self.frames.boundary

    @cached_property
    def painter(self) -> Painter:
        """Return the colours of the stresses of what is seen; the largest per cent has one colour."""
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        most = float(np.percentile(self.stress[:, self.polygons[1]], 99.0)) or 1.0
        factor, unit = scale(most, "Pa")
        return Painter(Normalize(0.0, factor * most), colormaps["YlGnBu"], f"von Mises stress [{unit}]", factor)

    def draw(self, axis: Any, k: int) -> Array:
        """Draw the bodies at the time number k; return where their nodes are drawn, (n, d)."""
        from matplotlib.collections import PolyCollection
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        nodes, cells = self.polygons
        moved = self.moved(k)
        colours = self.painter.cmap(self.painter.norm(self.painter.factor * self.stress[k, cells]))
        edges = [BODIES[body % len(BODIES)] for body in self.frames.bodies[cells]]
        look: dict[str, Any] = {"edgecolors": edges, "linewidths": 0.3}
        if moved.shape[1] == 2:
            axis.add_collection(PolyCollection(moved[nodes], facecolors=colours, **look))
        else:
            colours[:, :3] *= shades(moved[nodes])[:, None]
            axis.add_collection3d(Poly3DCollection(moved[nodes], facecolors=colours, **look))
        every = self.frames.points + self.magnified * self.u
        limit(axis, every.min(axis=(0, 1)), every.max(axis=(0, 1)), up=self.up)
        return moved

    def moved(self, k: int) -> Array:
        """Return where the nodes are drawn at the time number k, (n, d) [m]."""
        return np.asarray(self.frames.points + self.magnified * self.u[k])


def shades(polygons: Array) -> Array:
    """Return how bright polygons (p, corners, 3) are, 0.6 to 1: by the angle of the light to their planes."""
    normals = np.cross(polygons[:, 2] - polygons[:, 0], polygons[:, -1] - polygons[:, 1])
    sizes = np.linalg.norm(normals, axis=1)
    return np.asarray(0.6 + 0.4 * np.abs(normals @ LIGHT) / np.where(sizes > 0.0, sizes, 1.0))


def _size(frames: StoredFrames) -> float:
    return float(np.ptp(frames.points, axis=0).max())


def _round_down(factor: float) -> float:
    """1, 2 or 5 times a power of ten, at least 1."""
    if not factor > 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= factor) * power)


def plot_deformed(
    run: RunFolder, path: str | Path, *, times: Sequence[float] | None = None, magnified: float | None = None,
    title: str = "Deformed bodies",
) -> Path:
    """Draw the bodies of a run with fields, in plane or space, in the frames next to ``times`` [s] (None: see
    ``faces.moments``), coloured by von Mises stress, the edges of elements by body.

    ``magnified``: how many times larger displacements are drawn; a round number that shows them when None. InputError
    for a run without fields or in one dimension.
    """
    scene = Scene.of(run, moments(run.history) if times is None else times, magnified)
    flat, count = scene.frames.points.shape[1] == 2, len(scene.times)
    figure, axes = sheet([flat], count, (4.2, 3.8))
    for k, axis in enumerate(axes[0]):
        scene.draw(axis, k)
        axis.set_title(f"t = {scene.times[k]:.4g} s", fontsize=9)
    scene.painter.bar(figure, list(axes[0]), extend="max")
    return save(figure, path, _headed(title, scene))


def _headed(title: str, scene: Scene) -> str:
    return plain(title) + (f" (displacements x {scene.magnified:g})" if scene.magnified != 1.0 else "")


def film(
    run: RunFolder, path: str | Path, *, times: Sequence[float] | None = None, magnified: float | None = None,
    column: str | None = None, title: str = "", fps: int = 10,
) -> Path:
    """Write a GIF of the frames next to ``times`` [s] (None: up to 48 around the largest uplift): the bodies, as
    ``plot_deformed`` draws them, their contact pressure, in space on the contact faces beside them, and below a
    ``column`` of the history with the moment marked, and dashed the acceleration of the ground.

    InputError for another kind of file, and as ``plot_deformed``.
    """
    import matplotlib
    from matplotlib.animation import PillowWriter
    from matplotlib.figure import Figure

    path = Path(path)
    if path.suffix != ".gif":
        raise InputError(f"films are GIF files: name '{path.name}' so, or draw single moments with plot_deformed")
    scene = Scene.of(run, _around(run) if times is None else times, magnified)
    contact = Touching.of(run, scene)
    flat = [scene.frames.points.shape[1] == 2, *(face.axes is not None for face in contact.faces)]
    writer = PillowWriter(fps=fps)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(3.2 + 3.4 * len(flat), 6.0), layout="constrained")
        wide = [1.6, *[1.0] * len(contact.faces)]
        grid = figure.add_gridspec(2, len(flat), height_ratios=(3.6, 1.0), width_ratios=wide)
        axes = [figure.add_subplot(grid[0, i], projection=None if plane else "3d") for i, plane in enumerate(flat)]
        marker = _trace(figure.add_subplot(grid[1, :]), run, column or leading(run.history), scene.times)
        scene.painter.bar(figure, axes[0], extend="max", shrink=0.85)
        if len(contact.nodes):
            contact.painter.bar(figure, axes[-1], shrink=0.85)
        with writer.saving(figure, str(path), dpi=95):
            for k, t in enumerate(scene.times):
                for axis in axes:
                    axis.clear()
                contact.draw(axes, scene.draw(axes[0], k), k)
                marker.set_xdata([t, t])
                figure.suptitle(_headed(f"{title}, t = {t:.4g} s".removeprefix(", "), scene), fontsize=10)
                if k == 0:
                    figure.draw_without_rendering()
                    figure.set_layout_engine("none")  # the same places in every frame, laid out once
                writer.grab_frame()
    return path


@dataclass(frozen=True)
class Touching:
    """Hold the contact of a film: pressures (k, m) [Pa] at its times, the node (m,) of each condition, where from there
    it is drawn in the plane ``inwards`` (m, d) [m], and in space the faces of the ``points`` (m, 3)."""

    pressure: Array
    nodes: Indices
    inwards: Array
    faces: Sequence[Face]
    points: Array

    @classmethod
    def of(cls, run: RunFolder, scene: Scene) -> "Touching":
        """Read it; of a run that did not record it there is none."""
        contact, history, d = run.contact, run.history, scene.frames.points.shape[1]
        if contact is None or "pressure" not in history:
            none = np.zeros((0, d))
            return cls(np.zeros((len(scene.times), 0)), np.zeros(0, dtype=np.int64), none, [], none)
        sides, nodes = scene.frames.facing(contact)
        rows = [int(np.argmin(np.abs(history["t"] - t))) for t in scene.times]
        inwards = -INWARDS * _size(scene.frames) * contact.normals
        faces = faces_of(contact, sides) if d == 3 else []
        return cls(history["pressure"][rows], nodes, inwards, faces, contact.points)

    @cached_property
    def painter(self) -> Painter:
        """Return the colours of the pressures."""
        return Painter.of_pressure(self.pressure)

    def draw(self, axes: Sequence[Any], moved: Array, k: int) -> None:
        """Draw the pressure at the time number k: on bodies in the plane, whose nodes are ``moved``, or each face on
        an axis beside them."""
        if moved.shape[1] == 2:
            self.painter.dots(axes[0], moved[self.nodes] + self.inwards, self.pressure[k])
        for axis, face in zip(axes[1:], self.faces, strict=True):
            self.painter.draw(axis, face, self.points, self.pressure[k])
            axis.set_title(face.name, fontsize=9)


def _around(run: RunFolder) -> Sequence[float]:
    """The times of the frames next to the one in which most happens."""
    t = read_frames(run).t
    first = int(np.argmin(np.abs(t - moments(run.history)[1]))) - FILM_FRAMES // 2
    first = max(min(first, len(t) - FILM_FRAMES), 0)
    return list(t[first : first + FILM_FRAMES])


def _trace(axis: Any, run: RunFolder, column: str, times: Array) -> Any:
    """Draw a column of the history and, dashed, the ground's acceleration during the film; return the moment's line."""
    history = run.history
    if column not in run.columns or np.ndim(history.get(column, 0)) != 1:
        raise InputError(f"the run has no column '{column}': see columns.json in its folder")
    values, unit = scaled(history[column], run.columns[column][0])
    axis.plot(history["t"], values, color="black", lw=1.0)
    axis.set(xlabel="time [s]", ylabel=f"{column} [{unit}]", xlim=(times[0], times[-1]))
    if shaken(history):
        behind = axis.twinx()
        for ground in shaken(history):
            behind.plot(history["t"], history[f"a_g_{ground}"], color="0.6", lw=0.9, ls="--")
        behind.set_ylabel("$a_g$ [m/s²]", color="0.4")
    return axis.axvline(times[0], color="tab:red", lw=1.2)
