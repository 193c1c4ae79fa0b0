"""Draw incremental dynamic analyses as intensity over demand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.algebra import Array
from .histories import canvas, plain, scale

_FRACTILES = (("16 %", "tab:blue", "--"), ("50 %", "black", "-"), ("84 %", "tab:red", "--"))


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
