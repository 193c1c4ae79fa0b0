"""Draw rod and beam as Figs. 8.1 to 8.9 of Ahn (2012).

Contact at the tip and the limit of the regularisation are drawn too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.beam import BeamRun
from vi_contact.core.algebra import Array
from vi_contact.plots.histories import History, canvas, panels, save

_QUANTITIES = (
    "(A) rotation [-]",
    "(B) angular speed [1/s]",
    "(C) displacement [m]",
    "(D) velocity [m/s]",
)


def plot_beam_energies(runs: Mapping[str, BeamRun], path: str | Path, *, title: str) -> Path:
    """Draw energies of several runs over time, above; losses by friction, below (Fig. 8.1).

    Dashed: no losses.
    """
    figure, (top, bottom) = panels(2, (9.0, 7.0), height_ratios=(3, 2))
    for label, run in runs.items():
        (line,) = top.plot(run.history["t"], run.energy, lw=1.1, label=label)
        bottom.plot(
            run.history["t"],
            run.history["loss_friction"],
            lw=1.1,
            color=line.get_color(),
            label=label,
        )
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
    run: BeamRun,
    path: str | Path,
    *,
    span: tuple[float, float],
    title: str,
    count: int = 7,
    near: float = 0.2,
) -> Path:
    """Draw rotation, angular speed, displacement and velocity along the beam.

    They are drawn at ``count`` times of a span [s] (Figs. 8.4 to 8.9): the last part ``near`` of
    the beam above, the whole below. The run needs snapshots in the span.
    """
    from matplotlib import colormaps

    figure, axes = canvas(2, 4, (13.0, 6.5))
    inside = [
        snapshot for snapshot in run.snapshots if span[0] - 1e-9 <= snapshot.t <= span[1] + 1e-9
    ]
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
    axes[0, 3].legend(
        *axes[1, 3].get_legend_handles_labels(),
        bbox_to_anchor=(1.02, 1.0),
        loc="upper left",
        fontsize=8,
    )
    return save(figure, path, title)


def plot_rubbing(history: History, path: str | Path, *, mu: float, gap: float, title: str) -> Path:
    """Draw gap, contact force with its friction, and motion of the tip across.

    The friction is what the force allows. They are those of ``rubbing_problem``.

    history: with the columns of ``Contact`` and of a ``Probe`` labelled "tip". gap: of the rod at
    rest [m].
    """
    figure, (top, middle, bottom) = panels(3, (9.0, 8.0))
    t, force = history["t"], history["contact_resultant"]
    top.plot(t, gap - history["u_x_tip"], color="black", lw=1.1)
    top.set(ylabel="gap [m]", title=title)
    middle.fill_between(
        t, -mu * force, mu * force, color="0.85", lw=0.0, label="friction allowed, ± mu r_n"
    )
    middle.plot(
        t, -history["friction_force_y"], color="tab:red", lw=1.0, label="friction on the wall"
    )
    middle.plot(t, mu * force, color="0.5", lw=0.6)
    middle.plot(t, -mu * force, color="0.5", lw=0.6)
    middle.set(ylabel="friction force [N]")
    middle.legend(fontsize=8, loc="lower right")
    bottom.plot(t, history["u_y_tip"], color="black", lw=1.1, label="tip")
    slip = np.append(0.0, np.diff(history["u_y_tip"]))
    _shade(bottom, t, (force > 0.0) & (np.abs(slip) <= 1e-12 * np.max(np.abs(slip))), "sticking")
    bottom.set(ylabel="displacement across [m]")
    bottom.legend(fontsize=8, loc="lower left")
    return save(figure, path)


def _shade(axis: Any, t: Array, where: Array, label: str) -> None:
    """Mark the times at which something holds."""
    low, high = axis.get_ylim()
    axis.fill_between(
        t, low, high, where=where, color="tab:orange", alpha=0.25, lw=0.0, label=label
    )
    axis.set_ylim(low, high)


def plot_regularisation(
    eps: Sequence[float],
    errors: Mapping[str, Array],
    tips: Mapping[str, tuple[Array, Array]],
    path: str | Path,
) -> Path:
    """Draw the largest difference of the tip from the exact law over eps.

    It stands left; tips (t, u) of some runs stand right.
    """
    figure, ((left, right),) = canvas(1, 2, (11.0, 4.5))
    for label, values in errors.items():
        left.loglog(eps, values, "o-", ms=4, lw=1.1, label=label)
    last = min(values[-1] for values in errors.values())
    left.loglog(eps, last * np.asarray(eps) / eps[-1], color="0.6", ls=":", label="order 1")
    left.set(
        xlabel="eps [m]",
        ylabel="largest difference of the tip [m]",
        title="Regularised against exact friction",
    )
    left.legend(fontsize=8)
    for label, (t, u) in tips.items():
        right.plot(t, u, lw=1.1, label=label)
    right.set(xlabel="time [s]", ylabel="tip [m]", title="Motion of the tip")
    right.legend(fontsize=8)
    figure.savefig(path, dpi=130)
    return Path(path)
