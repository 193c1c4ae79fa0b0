"""Draw a rocking block: free rocking beside the rigid limit, and what ground pulses do to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import History, panels, save


def plot_rocking(
    history: History,
    path: str | Path,
    *,
    angle: float,
    exact: Array,
    energy: Array,
    impacts: Array,
    title: str,
) -> Path:
    """Draw rotation, corner reactions and mechanical energy of a released block against time.

    history: with the columns of the recorders ``Rocking`` and ``Energy``. angle: unit of the
    rotation [rad], the angle of overturning. exact: rotation of the rigid limit at history["t"]
    [rad]. energy: of the rigid limit at release and after each impact [J], shape (n + 1,), the
    weight's potential included; impacts: their times [s], shape (n,).
    """
    t = history["t"]
    figure, (top, middle, bottom) = panels(3, (9.0, 8.0))
    top.plot(t, history["theta"] / angle, color="black", lw=1.2, label="finite elements")
    top.plot(t, exact / angle, color="tab:red", lw=1.2, ls="--", label="rigid block")
    top.set(ylabel="rotation / overturning angle [-]", title=title)
    top.legend(fontsize=8, loc="upper right")
    for name, colour in (("left", "tab:blue"), ("right", "tab:orange")):
        middle.plot(
            t[1:],
            1e-3 * history[f"r_{name}"][1:],
            ".",
            ms=1.5,
            color=colour,
            label=f"{name} corner",
        )
    weight = float(np.median(history["r_left"][1:] + history["r_right"][1:]))
    middle.set(ylabel="reaction [kN]", ylim=(-0.1e-3 * weight, 2.5e-3 * weight))
    middle.legend(
        fontsize=8,
        loc="upper right",
        markerscale=6,
        title="peaks of impacts cut off",
        title_fontsize=8,
    )
    left = energy[0] + history["energy_kinetic"] + history["energy_strain"] - history["work_input"]
    left = left - history["energy_kinetic"][0] - history["energy_strain"][0]
    bottom.plot(
        t, left, color="black", lw=1.2, label="finite elements: kinetic + strain + potential"
    )
    bottom.step(
        np.concatenate([[0.0], impacts, t[-1:]]),
        np.append(energy, energy[-1]),
        where="post",
        color="tab:red",
        lw=1.2,
        ls="--",
        label="rigid block: energy times e² at every impact",
    )
    bottom.set(ylabel="energy above rest [J]", ylim=(0.0, None))
    bottom.legend(fontsize=8, loc="upper right")
    return save(figure, path)


def plot_pulses(
    onset: Mapping[str, History],
    overturning: Mapping[str, History],
    path: str | Path,
    *,
    angle: float,
    unit: float,
) -> Path:
    """Draw slow pulses around the onset of rocking above.

    Rectangular ones around overturning are below; label -> history.

    Each pair: base acceleration over ``unit``, g b/h [m/s²]; what the block does. angle: of
    overturning [rad].
    """
    figure, axes = panels(4, (9.0, 9.0), height_ratios=(1, 2, 1, 2))
    for axis, runs in ((axes[0], onset), (axes[2], overturning)):
        for label, history in runs.items():
            axis.plot(history["t"], history["a_g_x"] / unit, lw=1.2, label=label)
        axis.axhline(1.0, color="0.5", ls=":", lw=1.0)
        axis.set(ylabel="$a_g\\,/\\,(g\\,b/h)$")
    axes[0].set_title("Slow pulses: does the block lift?")
    axes[2].set_title("Rectangular pulses: does it overturn?")
    for label, history in onset.items():
        axes[1].plot(history["t"], 1e3 * np.max(history["gap"], axis=1), lw=1.2, label=label)
    axes[1].set(ylabel="largest gap of a corner [mm]")
    for label, history in overturning.items():
        axes[3].plot(history["t"], np.abs(history["theta"]) / angle, lw=1.2, label=label)
    axes[3].axhline(1.0, color="tab:red", ls="--", lw=0.8)
    axes[3].set(ylabel="|rotation| / overturning angle [-]", ylim=(-0.05, 1.5))
    for axis in (axes[1], axes[3]):
        axis.legend(fontsize=8, loc="upper left")
    return save(figure, path)
