"""Draw a rupture over space and time, and cycles of sticking and slipping."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.practice.plots.histories import canvas, save

LEAST = 1e-2  # [m/s]: slower slip is white
SHOWN = 0.5  # [s] between two profiles of slip


def plot_rupture(
    run: Mapping[str, Any],
    arrivals: Mapping[float, float],
    speeds: tuple[float, float],
    nucleus: float,
    path: str | Path,
) -> Path:
    """Draw slip rates over place and time beside profiles of slip.

    run: x (m,) [m], t (k,) [s], rate [m/s] and slip [m] (k, m). arrivals: distance [m] -> time [s]
    of another program. speeds [m/s] of lines that start at the edge of the nucleus [m].
    """
    figure, axes = canvas(1, 2, (13.0, 5.2))
    diagram, profiles = np.ravel(axes)
    x = run["x"] / 1e3
    rate = np.ma.masked_less(run["rate"], LEAST)
    diagram.grid(False)
    drawn = diagram.pcolormesh(x, run["t"], rate, cmap="viridis_r", shading="nearest", vmin=0.0)
    figure.colorbar(drawn, ax=diagram, label="slip rate [m/s]")
    for speed, style, name in zip(speeds, ("--", ":"), ("S", "P"), strict=True):
        far = np.array([nucleus, 10e3])
        for sign in (1.0, -1.0):
            label = f"{name} wave, {speed:g} m/s" if sign > 0.0 else None
            line = (far - nucleus) / speed
            diagram.plot(sign * far / 1e3, line, style, color="0.25", lw=1.0, label=label)
    places = np.array(list(arrivals)) / 1e3
    times = list(arrivals.values())
    diagram.plot(places, times, "o", mfc="none", mec="crimson", label="arrival, other program")
    diagram.plot(-places, times, "o", mfc="none", mec="crimson")
    diagram.set(xlim=(-11.0, 11.0), ylim=(0.0, run["t"][-1]))
    diagram.set(xlabel="along the fault [km]", ylabel="time [s]")
    diagram.legend(loc="lower right", fontsize=8)
    for time in np.arange(SHOWN, run["t"][-1] + SHOWN, SHOWN):
        row = int(np.argmin(np.abs(run["t"] - time)))
        profiles.plot(x, run["slip"][row], color="black", lw=0.9)
    profiles.set(xlim=(-11.0, 11.0), ylim=(0.0, None))
    profiles.set(xlabel="along the fault [km]", ylabel=f"slip, every {SHOWN:g} s [m]")
    return save(figure, path)


def plot_cycles(block: Mapping[str, Any], path: str | Path) -> Path:
    """Draw shear over pressure, slip rate and length of steps over time.

    block: t [s], shear [-], speed [m/s], dt [s], each (k,).
    """
    figure, axes = canvas(3, 1, (11.0, 6.6), sharex=True)
    shear, speed, step = np.ravel(axes)
    shear.plot(block["t"], block["shear"], color="black", lw=1.0)
    shear.set_ylabel("shear / pressure")
    speed.semilogy(block["t"], block["speed"], color="black", lw=1.0)
    speed.set_ylabel("slip rate [m/s]")
    step.semilogy(block["t"], block["dt"], color="black", lw=1.0, drawstyle="steps-post")
    step.set(ylabel="step [s]", xlabel="time [s]", xlim=(0.0, block["t"][-1]))
    return save(figure, path)
