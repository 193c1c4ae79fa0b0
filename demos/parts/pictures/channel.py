"""Draw what the demo of the buried channel shows beside its run.

That is the layout, moments, and runs beside a reference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from demos.parts.pictures.channel_interface import LEGEND, RUNS, unit_of
from demos.parts.pictures.channel_mesh import (
    AROUND,
    CONCRETE,
    CONTACT,
    SOIL,
    Bodies,
    Colours,
    bedrock,
    draw_bodies,
    filled,
    plane,
    read_bodies,
)
from vi_contact.plots.histories import History, canvas, panels, save


def plot_layout(
    folder: str | Path,
    points: Mapping[str, Sequence[float]],
    path: str | Path,
    *,
    title: str,
    soil: str,
    concrete: str,
    ends: str,
) -> Path:
    """Draw Fig. 6: the mesh of a run with bodies, numbered points, bedrock and ends of the layer.

    ``soil``, ``concrete``, ``ends``: what is written about the materials and the ends of the layer.
    """
    bodies = read_bodies(folder)
    figure, axis = plane((11.0, 4.9))
    cells = bodies.frames.points[bodies.frames.cells]
    low = bodies.low
    high = bodies.high
    width, depth = bodies.frames.points.max(axis=0)
    filled(axis, cells[~bodies.cells], SOIL)
    filled(axis, cells[bodies.cells], CONCRETE)
    axis.plot(
        [low[0], low[0], high[0], high[0]],
        [high[1], low[1], low[1], high[1]],
        color=CONTACT,
        lw=2.0,
        label="contact",
    )
    bedrock(axis, bodies)
    for end, outside in ((0.0, -0.18), (width, 0.18)):
        up = np.unique(bodies.frames.points[np.isclose(bodies.frames.points[:, 0], end), 1])
        axis.plot(np.full_like(up, end + outside), up, "o", ms=4, mfc="white", mec="black", mew=0.8)
    _number(axis, bodies, points)
    middle = 0.5 * (low[0] + high[0])
    box = {"fc": "white", "ec": "0.5", "boxstyle": "round,pad=0.6"}
    for across, up, text, more in (
        (0.5 * low[0], 0.5 * depth, soil, {"fontsize": 9, "bbox": box}),
        (0.5 * (high[0] + width), 0.5 * depth, ends, {"fontsize": 9, "bbox": box}),
        (middle, low[1] + 0.6 * bodies.height, concrete, {"fontsize": 8}),
        (middle, -0.11 * depth, "motion of the bedrock $a_g(t)$", {"fontsize": 9}),
    ):
        axis.text(across, up, text, ha="center", va="center", **more)
    ends_of_arrow = [
        (middle + side * 0.8 * (high[0] - low[0]), -0.16 * depth) for side in (-1.0, 1.0)
    ]
    axis.annotate("", *ends_of_arrow, arrowprops={"arrowstyle": "<->", "lw": 1.5})
    axis.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    axis.set(
        xlim=(-0.7, width + 0.7),
        ylim=(-0.2 * depth, 1.04 * depth),
        title=title,
        xlabel="x [m]",
        ylabel="y [m]",
    )
    return save(figure, path)


def _number(axis: Any, bodies: Bodies, points: Mapping[str, Sequence[float]]) -> None:
    """Points of the outline with their labels outside of it."""
    for label, (across, up) in points.items():
        sideways = float(across >= bodies.high[0]) - float(across <= bodies.low[0])
        outward = np.array([sideways, -1.0 if up <= bodies.low[1] else 0.0])
        axis.plot(across, up, "o", ms=3.5, color="black", zorder=4)
        axis.annotate(
            label,
            (across, up),
            xytext=9.0 * outward,
            textcoords="offset points",
            fontsize=9,
            zorder=4,
            weight="bold",
            ha="center",
            va="center",
            bbox={"fc": "white", "ec": "none", "pad": 0.6, "alpha": 0.8},
        )


def plot_moments(
    folders: Mapping[str, str | Path],
    times: Sequence[float],
    path: str | Path,
    *,
    title: str,
    magnified: float,
) -> Path:
    """Draw a row per run (name -> folder), a column per time [s].

    There are the bodies around the channel, their displacements less the channel's mean drawn
    ``magnified`` times; contact points coloured by their pressure, open ones white.
    """
    runs = {name: read_bodies(folder) for name, folder in folders.items()}
    colours = Colours.of(
        np.concatenate([run.tractions.at(t)[0] for run in runs.values() for t in times])
    )
    size = (3.7 * len(times) + 1.3, 2.75 * len(runs) + 0.7)
    figure, axes = canvas(len(runs), len(times), size, lattice=False, sharex=True, sharey=True)
    for row, (name, run) in zip(axes, runs.items(), strict=True):
        for axis, t in zip(row, times, strict=True):
            shown = draw_bodies(axis, run, t, magnified=magnified, colours=colours, follow=True)
            axis.set_title(f"{name}, t = {shown:.4g} s", fontsize=9)
    reach = AROUND * run.height
    axes[0, 0].set(
        xlim=(run.low[0] - reach, run.high[0] + reach),
        ylim=(run.low[1] - reach, run.high[1] + 0.2 * reach),
    )
    colours.bar(figure, axes)
    figure.supxlabel("x [m]", fontsize=10)
    figure.supylabel("y [m]", fontsize=10)
    figure.suptitle(f"{title} (displacements x {magnified:g})")
    return save(figure, path)


def plot_beside(
    runs: Mapping[str, History],
    reference: str,
    path: str | Path,
    *,
    title: str,
    points: Sequence[str] = ("1", "19"),
) -> Path:
    """Draw Fig. 9: u_x and u_y of the channel's points in several runs.

    The one named ``reference`` is grey and thick.
    """
    columns = [
        (f"u_{axis}_{label}", f"$u_{axis}$, point {label}") for label in points for axis in "xy"
    ]
    figure, axes = panels(len(columns), (9.0, 2.1 * len(columns) + 1.0))
    for axis, (column, label) in zip(axes, columns, strict=True):
        metres, unit = unit_of(max(float(np.abs(run[column]).max()) for run in runs.values()))
        bare = runs[reference]
        axis.plot(bare["t"], bare[column] / metres, color="0.7", lw=2.2, label=reference)
        for colour, name in zip(RUNS, (name for name in runs if name != reference), strict=False):
            axis.plot(
                runs[name]["t"], runs[name][column] / metres, color=colour, lw=0.9, label=name
            )
        axis.set_ylabel(f"{label} [{unit}]")
    axes[0].set_xlim(bare["t"][0], bare["t"][-1])
    axes[0].legend(ncol=len(runs), **LEGEND)
    figure.suptitle(title)
    return save(figure, path)
