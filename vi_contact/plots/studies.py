"""Draw what the studies compute: rod and beam as Figs. 8.1 to 8.9 of Ahn (2012), the impact of a particle on a boundary
layer as Fig. 1 of the paper on b-geometry (ENOC 2017), incremental dynamic analyses as intensity over demand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..beam.algorithm import BeamRun
from ..boundary_layer.particle import ParticleImpact
from ..core.algebra import Array
from .histories import canvas, panels, plain, save, scale

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple")
_QUANTITIES = ("(A) rotation [-]", "(B) angular speed [1/s]", "(C) displacement [m]", "(D) velocity [m/s]")
_FRACTILES = (("16 %", "tab:blue", "--"), ("50 %", "black", "-"), ("84 %", "tab:red", "--"))


def plot_beam_energies(runs: Mapping[str, BeamRun], path: str | Path, *, title: str) -> Path:
    """Draw energies of several runs over time, above; losses by friction, below (Fig. 8.1). Dashed: no losses."""
    figure, (top, bottom) = panels(2, (9.0, 7.0), height_ratios=(3, 2))
    for label, run in runs.items():
        (line,) = top.plot(run.history["t"], run.energy, lw=1.1, label=label)
        bottom.plot(run.history["t"], run.history["loss_friction"], lw=1.1, color=line.get_color(), label=label)
    start = max(run.energy[0] for run in runs.values())
    top.axhline(start, color="tab:red", ls="--", lw=1.0, label="no viscosity, no friction")
    top.set(ylabel="energy [J]", ylim=(0.0, 1.15 * start), title=title)
    bottom.set(ylabel="lost to friction [J]")
    top.legend(fontsize=8, loc="center right")
    return save(figure, path)


def plot_tips(runs: Mapping[str, BeamRun], path: str | Path, *, title: str) -> Path:
    """Draw the displacement of the tip against time, a panel per run (Figs. 8.2, 8.3)."""
    figure, axes = panels(len(runs), (9.0, 2.4 * len(runs) + 1.0))
    for axis, (label, run) in zip(axes, runs.items(), strict=True):
        axis.plot(run.history["t"], run.history["u_tip"], color="black", lw=1.1)
        axis.set_ylabel("tip [m]")
        axis.set_title(label, fontsize=9, loc="left")
    return save(figure, path, title)


def plot_shapes(
    run: BeamRun, path: str | Path, *, span: tuple[float, float], title: str, count: int = 7, near: float = 0.2
) -> Path:
    """Draw rotation, angular speed, displacement and velocity along the beam at ``count`` times of a span [s] (Figs.
    8.4 to 8.9): the last part ``near`` of the beam above, the whole below. The run needs snapshots in the span."""
    from matplotlib import colormaps

    figure, axes = canvas(2, 4, (13.0, 6.5))
    inside = [snapshot for snapshot in run.snapshots if span[0] - 1e-9 <= snapshot.t <= span[1] + 1e-9]
    chosen = np.unique(np.rint(np.linspace(0, len(inside) - 1, count)).astype(int))
    colours = colormaps["viridis"](np.linspace(0.0, 0.92, len(chosen)))
    close = run.x >= (1.0 - near) * run.x[-1]
    for row, label in enumerate(_QUANTITIES):
        for index, colour in zip(chosen, colours, strict=True):
            snapshot = inside[index]
            name = f"t = {snapshot.t:.3g} s"
            axes[0, row].plot(run.x[close], snapshot.values[row][close], color=colour, lw=1.0)
            axes[1, row].plot(run.x, snapshot.values[row], color=colour, lw=1.0, label=name)
        axes[0, row].set_title(label, fontsize=10)
        axes[1, row].set_xlabel("x [m]")
    axes[0, 0].set_ylabel("near the tip")
    axes[1, 0].set_ylabel("whole beam")
    axes[0, 3].legend(*axes[1, 3].get_legend_handles_labels(), bbox_to_anchor=(1.02, 1.0), loc="upper left", fontsize=8)
    return save(figure, path, title)


def plot_particle(impacts: Mapping[str, Sequence[tuple[str, ParticleImpact]]], path: str | Path) -> Path:
    """Draw Fig. 1: distance and velocity against t/t_f, a row of panels for each group; group -> (label, impact)."""
    figure, axes = canvas(len(impacts), 2, (10.0, 3.3 * len(impacts) + 0.3))
    for (place, speed), (title, group) in zip(axes, impacts.items(), strict=True):
        for (label, impact), colour in zip(group, COLOURS, strict=False):
            part = np.linspace(0.0, 1.0, 301)
            x, v = impact.position(part * impact.duration), impact.velocity(part * impact.duration)
            place.plot(part, x / impact.layer.a, color=colour, lw=1.2, label=label)
            speed.plot(part, v / impact.speed, color=colour, lw=1.2, label=label)
        place.set(xlabel="t / t_f [-]", ylabel="x / a [-]", title=title)
        speed.set(xlabel="t / t_f [-]", ylabel="velocity / V [-]", title=title)
        speed.axhline(0.0, color="0.5", lw=0.8)
        place.legend(fontsize=8)
    return save(figure, path)


@dataclass(frozen=True)
class DemandPanel:
    """Describe one demand in its SI unit: curves record -> (intensities, demands); fractiles (n, 3) of 16, 50 and 84 %
    at the levels (n,); intensities of runs that failed, marked at the right edge."""

    label: str
    unit: str
    curves: Mapping[str, tuple[Array, Array]]
    levels: Array
    fractiles: Array
    failed: Sequence[float] = ()


def plot_ida(demands: Sequence[DemandPanel], path: str | Path, *, intensity: str) -> Path:
    """Draw a panel for every demand, side by side: a grey curve for each record, and the fractiles."""
    figure, ((*axes,),) = canvas(1, len(demands), (1.0 + 4.4 * len(demands), 4.6), sharey=True)
    for axis, panel in zip(axes, demands, strict=True):
        _draw(axis, panel)
    axes[0].set_ylabel(intensity)
    axes[0].set_ylim(bottom=0.0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.suptitle(" ", fontsize=20)  # keeps room for the legend, which the layout of matplotlib 3.6 does not
    columns = min(len(labels), 3 * len(demands))
    figure.legend(handles, labels, loc="upper center", ncol=columns, fontsize=8, frameon=False)
    figure.savefig(path, dpi=130)
    return Path(path)


def _draw(axis: Any, panel: DemandPanel) -> None:
    size = max(float(np.max(np.abs(demand), initial=0.0)) for _, demand in panel.curves.values())
    factor, unit = scale(size, panel.unit)
    axis.set_xlabel(f"{panel.label} [{unit}]")
    few = len(panel.curves) <= 5
    marks = "osv^D"
    for number, (record, (intensity, demand)) in enumerate(panel.curves.items()):
        label = plain(record) if few else "a record" if number == 0 else None
        mark = marks[number] if few else None
        axis.plot(factor * demand, intensity, marker=mark, color="0.65", lw=0.9, ms=4, label=label)
    if len(panel.levels) > 1:
        for values, (name, colour, style) in zip(panel.fractiles.T, _FRACTILES, strict=True):
            axis.plot(factor * values, panel.levels, color=colour, ls=style, lw=1.6, label=name)
    if len(panel.failed):
        axis.plot([1.0] * len(panel.failed), panel.failed, "x", color="tab:red", ms=7, clip_on=False,
                  transform=axis.get_yaxis_transform(), label="run failed")
