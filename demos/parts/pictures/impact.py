"""Draw one figure of a ball that strikes a plane, beside the quasi-static theory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.exact import HertzImpact
from vi_contact.plots.histories import canvas, save


@dataclass(frozen=True)
class ImpactCurves:
    """Hold times [s] from the first touch on.

    With them come force [N] and approach [m] of the whole ball; contact pressures [Pa] and their
    distances from the axis [m] at the largest force.
    """

    t: Array
    force: Array
    approach: Array
    distance: Array
    pressure: Array


def plot_impact(
    runs: Mapping[str, ImpactCurves],
    exact: HertzImpact,
    course: Callable[[Array], tuple[Array, Array]],
    path: str | Path,
) -> Path:
    """Draw force and approach over time, pressure over the distance from the axis.

    The theory is in grey behind them.

    course: t -> (approach, force) of the theory, also before and after the contact.
    """
    figure, ((force, approach, pressure),) = canvas(1, 3, (13.0, 4.2))
    a = exact.deepest.contact_radius
    t = np.linspace(-0.03, 1.2, 1000) * exact.duration
    r = np.linspace(0.0, 1.3, 1000) * a
    free = np.where(t < 0.0, exact.speed * t, exact.speed * (exact.duration - t))
    way, push = course(t)
    way = np.where((t < 0.0) | (t > exact.duration), free, way)
    for axis, x, y in (
        (force, 1e6 * t, push),
        (approach, 1e6 * t, 1e6 * way),
        (pressure, 1e3 * r, 1e-9 * exact.deepest.pressure(r)),
    ):
        axis.plot(x, y, color="0.75", lw=4.0, label="Hertz, quasi-static")
    for (name, run), style in zip(runs.items(), ("tab:orange", "black", "tab:blue"), strict=False):
        force.plot(1e6 * run.t, run.force, color=style, lw=1.0, label=name)
        approach.plot(1e6 * run.t, 1e6 * run.approach, color=style, lw=1.0, label=name)
        pressure.plot(1e3 * run.distance, 1e-9 * run.pressure, ".", color=style, ms=5.0, label=name)
    force.set(xlabel="time since the first touch [µs]", ylabel="contact force [N]")
    approach.set(xlabel="time since the first touch [µs]", ylabel="approach of the centre [µm]")
    pressure.set(
        xlabel="distance from the axis [mm]",
        ylabel="pressure at the largest force [GPa]",
        xlim=(0.0, 1.3e3 * a),
    )
    pressure.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 0.1))
    return save(figure, path)
