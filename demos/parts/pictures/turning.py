"""Draw a column that falls over: its places, its tilt beside the rigid block's, and the energy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.practice.plots.faces import add_polygons
from vi_contact.practice.plots.histories import History, canvas, save

PLACES = 7  # of the column in the picture
MARGIN = 0.15  # m, around it
LYING = 0.01  # rad, by which the last place may not lie yet


def plot_fall(folder: Path, history: History, tilt: Array, rigid: Any, path: Path) -> Path:
    """Draw places of the column over one another, tilts and energies; return the path.

    Args:
        folder: of the run, with fields.
        history: of the run.
        tilt: (rows,) clockwise [rad].
        rigid: the rigid block, theta(t) until it lies, as SciPy's solution.
        path: of the picture.
    """
    frames = read_frames(folder)
    look = {"height_ratios": (2.2, 1.0, 1.0)}
    figure, axes = canvas(3, 1, (9.0, 11.0), gridspec_kw=look)
    places, turns, energy = axes[:, 0]

    # frames at equal turns of the column, dark as it falls
    at_frames = np.interp(frames.t, history["t"], tilt)
    wanted = np.linspace(0.0, at_frames.max() - LYING, PLACES)
    low = np.zeros(2)
    high = np.zeros(2)
    for angle in wanted:
        row = int(np.argmax(at_frames >= angle))
        _, u, _ = frames.at(float(frames.t[row]))
        points = frames.points + u
        shade = f"{0.9 - 0.4 * angle / wanted[-1]:.3f}"
        add_polygons(places, points[frames.cells], facecolor=shade, edgecolor="0.2", linewidth=0.4)
        low = np.minimum(low, points.min(axis=0))
        high = np.maximum(high, points.max(axis=0))
    places.axhline(0.0, color="tab:brown", lw=1.5)
    places.set(xlim=(low[0] - MARGIN, high[0] + MARGIN), ylim=(-MARGIN, high[1] + MARGIN))
    places.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")

    turns.plot(history["t"], tilt, color="black", lw=1.2, label="finite elements")
    turns.plot(rigid.t, rigid.y[0], color="tab:red", lw=1.2, ls="--", label="rigid block")
    turns.set(ylabel="tilt [rad]", xlabel="t [s]")
    turns.legend(fontsize=8, loc="lower right")

    for name, label in (
        ("loss_impact", "lost in impacts"),
        ("loss_contact", "lost in contact"),
        ("loss_friction", "lost in friction"),
        ("energy_kinetic", "kinetic"),
    ):
        energy.plot(history["t"], 1e-3 * history[name], lw=1.2, label=label)
    energy.set(ylabel="energy [kJ/m]", xlabel="t [s]")
    energy.legend(fontsize=8, loc="upper left")
    return save(figure, path)
