"""Draw one figure that sets time schemes side by side with the exact solution of a bouncing bar."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import History, canvas, save

COLUMNS = (
    "displacement of the foot [m]",
    "contact force / section [Pa]",
    "energy / exact energy [-]",
)


def plot_bounces(
    histories: Mapping[str, History], exact: Any, section: float, path: str | Path
) -> Path:
    """Draw a row per scheme: foot, force, energy; ``exact`` (of vi_contact.exact) in grey behind.

    histories: name -> history with u_?_foot, contact_resultant, energy_kinetic and energy_strain of
    a bar of that section; all of the same times. Forces beyond three times the exact one leave the
    panel and are written in it.
    """
    t = next(iter(histories.values()))["t"]
    fine = np.linspace(t[0], t[-1], 4000)
    curves = (exact.displacement(0.0, fine), exact.force(fine), np.ones_like(fine))
    figure, axes = canvas(len(histories), 3, (13.0, 1.55 * len(histories) + 1.0), sharex=True)
    for row, (name, history) in zip(axes, histories.items(), strict=True):
        for axis, curve, values in zip(
            row, curves, _values(history, exact.energy * section, section), strict=True
        ):
            axis.plot(fine, curve, color="0.72", lw=2.5, label="exact")
            axis.plot(t, values, color="black", lw=0.8, label="computed")
        row[0].set_title(name, fontsize=9, loc="left")
        _limit_force(row[1], curves[1], history["contact_resultant"] / section)
        _limit_energy(row[2])
    for axis, label in zip(axes[0], COLUMNS, strict=True):
        axis.annotate(
            label, (0.5, 1.25), xycoords="axes fraction", ha="center", fontsize=10, weight="bold"
        )
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    axes[0, 2].legend(fontsize=8, loc="lower right")
    return save(figure, path)


def _values(history: History, energy: float, section: float) -> tuple[Array, Array, Array]:
    foot = next(history[name] for name in ("u_y_foot", "u_x_foot") if name in history)
    total = (history["energy_kinetic"] + history["energy_strain"]) / energy
    return foot, history["contact_resultant"] / section, total


def _limit_force(axis: Any, exact: Array, force: Array) -> None:
    top = 3.0 * float(exact.max())
    axis.set_ylim(-0.1 * top, top)
    if force.max() > top:
        axis.text(
            0.01,
            0.9,
            f"up to {force.max() / exact.max():.0f} times the exact force",
            fontsize=8,
            transform=axis.transAxes,
            va="top",
            color="tab:red",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5},
        )


def _limit_energy(axis: Any) -> None:
    """From zero to a little above one, or as high as it goes."""
    highest = max(float(np.max(line.get_ydata())) for line in axis.lines)
    axis.set_ylim(0.0, max(1.3, 1.05 * highest))
