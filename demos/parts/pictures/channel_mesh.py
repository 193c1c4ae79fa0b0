"""Draw the buried channel's mesh.

There are Fig. 6 of the boundary method, the deformed bodies with their contact, and a film.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from demos.parts.pictures.tractions import Tractions, read_tractions
from vi_contact.core.algebra import Array, Indices, Mask
from vi_contact.core.errors import InputError
from vi_contact.plots.deformed import StoredFrames, read_frames
from vi_contact.plots.histories import History, canvas, scale

SOIL, CONCRETE, CONTACT = "#efe3c8", "#9aa3ab", "tab:red"
MAP = "YlOrRd"  # colours of pressures
INWARDS = (
    0.04  # of the channel's height: how far inside the channel the points are that show its contact
)
AROUND = 0.8  # heights of the channel that are shown beside and below it


@dataclass(frozen=True)
class Bodies:
    """Hold the frames of a run and what belongs to the channel.

    There are the mask of ``cells`` (c,), its node of every contact condition ``nodes`` (m,), and
    where from there a condition is drawn ``inwards`` (m, 2) [m]: at corners those of both sides
    apart, each towards the middle of its side. ``low``, ``high`` (2,): corners of the channel's
    outline [m].
    """

    frames: StoredFrames
    tractions: Tractions
    cells: Mask
    nodes: Indices
    inwards: Array
    low: Array
    high: Array

    @property
    def height(self) -> float:
        """Return the height of the channel [m]."""
        return float(self.high[1] - self.low[1])


def read_bodies(folder: str | Path) -> Bodies:
    """Read the folder of a run of the channel with fields and the recorder Contact().

    InputError for another folder.
    """
    frames, tractions = read_frames(folder), read_tractions(folder)
    low, high = tractions.points.min(axis=0), tractions.points.max(axis=0)
    centres = frames.points[frames.cells].mean(axis=1)
    cells = np.all((low < centres) & (centres < high), axis=1)
    own = np.unique(frames.cells[cells])
    nearest = [
        np.argmin(np.sum((frames.points[own] - point) ** 2, axis=1)) for point in tractions.points
    ]
    nodes = own[np.array(nearest, dtype=np.int64)]
    _, where, counts = np.unique(nodes, return_inverse=True, return_counts=True)
    base = tractions.normals[:, 1] < -0.5
    along = np.where(base[:, None], [1.0, 0.0], [0.0, 1.0]) * np.sign(
        0.5 * (low + high) - tractions.points
    )
    inwards = np.where((counts[where] > 1)[:, None], 2.0 * along, 0.0) - tractions.normals
    return Bodies(
        frames, tractions, cells, nodes, INWARDS * (high[1] - low[1]) * inwards, low, high
    )


@dataclass(frozen=True)
class Colours:
    """Hold the colours of contact pressures.

    Pressure times ``factor`` is in ``unit``; ``norm`` is a root scale.
    """

    factor: float
    unit: str
    norm: Any

    @classmethod
    def of(cls, pressures: Array) -> Colours:
        """Make the colours for all pressures [Pa] that are drawn."""
        from matplotlib.colors import PowerNorm

        most = float(pressures.max(initial=0.0)) or 1.0
        factor, unit = scale(most, "Pa")
        return cls(factor, unit, PowerNorm(0.5, 0.0, factor * most))

    def bar(self, figure: Any, axes: Any, shrink: float = 1.0) -> None:
        """Draw the colour bar beside axes."""
        from matplotlib.cm import ScalarMappable

        label = f"contact pressure [{self.unit}], open points white"
        figure.colorbar(
            ScalarMappable(self.norm, MAP),
            ax=axes,
            label=label,
            fraction=0.04,
            aspect=35,
            pad=0.01,
            shrink=shrink,
        )


def draw_bodies(
    axis: Any, bodies: Bodies, t: float, *, magnified: float, colours: Colours, follow: bool = False
) -> float:
    """Draw the frame next to t; return its time [s].

    ``follow``: displacements less the mean of the channel's.
    """
    frames, tractions = bodies.frames, bodies.tractions
    shown, u, _ = frames.at(t)
    own = np.unique(frames.cells[bodies.cells])
    moved = frames.points + magnified * (u - u[own].mean(axis=0) if follow else u)
    filled(axis, moved[frames.cells[~bodies.cells]], SOIL, lw=0.3)
    filled(axis, moved[frames.cells[bodies.cells]], CONCRETE)
    pressure, _ = tractions.at(shown)
    places = moved[bodies.nodes] + bodies.inwards
    dots: dict[str, Any] = {
        "s": 26,
        "edgecolors": "black",
        "linewidths": 0.5,
        "norm": colours.norm,
        "cmap": MAP,
    }
    closed = pressure > 0.0
    axis.scatter(*places[~closed].T, s=26, c="white", edgecolors="black", linewidths=0.5, zorder=4)
    axis.scatter(*places[closed].T, c=colours.factor * pressure[closed], zorder=5, **dots)
    return shown


def animate(
    folder: str | Path,
    path: str | Path,
    *,
    title: str,
    history: History,
    openings: Mapping[str, Array],
    times: Sequence[float],
    magnified: float,
    fps: int = 10,
) -> Path:
    """Write a GIF of the frames at ``times`` [s].

    There are bodies, displaced relative to the bedrock, and contact; below there are the bedrock's
    acceleration and ``openings`` (name -> values (rows,) [m] of ``history``) with the moment
    marked.

    InputError for another kind of file.
    """
    from matplotlib.animation import PillowWriter

    path = Path(path)
    if path.suffix != ".gif":
        raise InputError(
            f"'{path.name}' is not a .gif: give such a name, or draw moments with plot_moments"
        )
    bodies = read_bodies(folder)
    colours = Colours.of(np.concatenate([bodies.tractions.at(t)[0] for t in times]))
    reach = 2.0 * AROUND * bodies.height
    figure, (top, bottom) = plane((6.6, 6.0), heights=(3.6, 1.0))
    colours.bar(figure, top, shrink=0.85)
    marker = _traces(bottom, history, openings, (times[0], times[-1]))
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the same places in every frame, laid out once
    writer = PillowWriter(fps=fps)
    with writer.saving(figure, str(path), dpi=95):
        for t in times:
            top.clear()
            shown = draw_bodies(top, bodies, t, magnified=magnified, colours=colours)
            bedrock(top, bodies)
            top.set(
                xlim=(bodies.low[0] - reach, bodies.high[0] + reach),
                xlabel="x [m]",
                ylabel="y [m]",
                ylim=(-0.15 * reach, bodies.high[1] + 0.15 * reach),
            )
            top.set_title(
                f"{title}, t = {shown:.3f} s (displacements x {magnified:g})", fontsize=10
            )
            marker.set_xdata([shown, shown])
            writer.grab_frame()
    return path


def _traces(
    axis: Any, history: History, openings: Mapping[str, Array], span: tuple[float, float]
) -> Any:
    """Draw openings and, dashed, the acceleration during the animation.

    It returns the line that marks a moment.
    """
    for colour, (name, values) in zip(
        ("tab:blue", "tab:red", "black"), openings.items(), strict=False
    ):
        axis.plot(history["t"], 1e3 * values, color=colour, lw=1.0, label=name)
    axis.set(xlabel="time [s]", ylabel="opening [mm]", xlim=span)
    behind = axis.twinx()
    behind.plot(history["t"], history["a_g_x"], color="0.6", lw=0.9, ls="--")
    behind.set_ylabel("$a_g$ [m/s²]", color="0.4")
    axis.legend(fontsize=7, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 0.97), frameon=False)
    return axis.axvline(span[0], color="black", lw=1.2)


def plane(size: tuple[float, float], heights: Sequence[float] = (1.0,)) -> tuple[Any, Any]:
    """Return (figure, axes above each other); the first axis has one scale for both directions."""
    figure, axes = canvas(len(heights), 1, size, lattice=False, height_ratios=heights)
    axes[0, 0].set_aspect("equal")
    return figure, axes[:, 0] if len(heights) > 1 else axes[0, 0]


def filled(axis: Any, cells: Array, colour: str, lw: float = 0.4) -> None:
    """Draw cells in a colour."""
    from matplotlib.collections import PolyCollection

    axis.add_collection(
        PolyCollection(list(cells), facecolor=colour, edgecolor="0.45", linewidth=lw)
    )
    axis.set_aspect("equal")


def bedrock(axis: Any, bodies: Bodies) -> None:
    """Draw the bedrock's line, hatched below."""
    width, depth = bodies.frames.points.max(axis=0)
    axis.axhline(0.0, color="black", lw=1.5, zorder=3)
    axis.fill_between(
        [-1.0, width + 1.0],
        -0.05 * depth,
        0.0,
        facecolor="none",
        edgecolor="0.4",
        hatch="////",
        lw=0.0,
    )
