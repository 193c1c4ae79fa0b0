"""Draw the crack in the base of a dam: over place and time, with its water."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.practice.plots.histories import canvas, save

STYLES = {"kept": "-", "follows": "--", "none": ":"}


def plot_openings(run: Mapping[str, Any], path: str | Path) -> Path:
    """Draw opening and water pressure along the base over time.

    run: x (m,) [m], t (k,) [s], opening [m] and water [Pa] (k, m).
    """
    figure, axes = canvas(1, 2, (12.0, 4.6), sharey=True)
    opened, pressed = np.ravel(axes)
    parts = (
        (opened, np.ma.masked_less_equal(1e3 * run["opening"], 0.0), "opening [mm]"),
        (pressed, run["water"] / 1e3, "water pressure [kPa]"),
    )
    for axis, shown, label in parts:
        axis.grid(False)
        drawn = axis.pcolormesh(
            run["x"], run["t"], shown, cmap="viridis_r", shading="nearest", vmin=0.0
        )
        figure.colorbar(drawn, ax=axis, label=label)
        axis.set_xlabel("from the heel [m]")
    opened.set_ylabel("time [s]")
    return save(figure, path)


def plot_histories(runs: Mapping[str, Mapping[str, Any]], path: str | Path) -> Path:
    """Draw length of the crack, uplift and energy of fracture over time, of each rule.

    runs: name of the rule -> t [s], crack [m], uplift [N/m] and fracture [J/m], each (k,).
    """
    figure, axes = canvas(3, 1, (10.0, 7.0), sharex=True)
    crack, uplift, fracture = np.ravel(axes)
    for name, run in runs.items():
        style = STYLES[name]
        crack.plot(run["t"], run["crack"], style, label=name)
        uplift.plot(run["t"], run["uplift"] / 1e6, style, label=name)
        fracture.plot(run["t"], run["fracture"], style, label=name)
    crack.set_ylabel("crack [m]")
    crack.legend(loc="upper left", fontsize=8)
    uplift.set_ylabel("uplift [MN/m]")
    fracture.set(ylabel="energy of fracture [J/m]", xlabel="time [s]")
    return save(figure, path)
