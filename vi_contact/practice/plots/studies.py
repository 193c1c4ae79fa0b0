"""Draw incremental dynamic analyses as intensity over demand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.units import STANDARD_GRAVITY
from .histories import canvas, plain, save, scale

_FRACTILES = (("16 %", "tab:blue", "--"), ("50 %", "black", "-"), ("84 %", "tab:red", "--"))


@dataclass(frozen=True)
class DemandPanel:
    """Describe one demand in its SI unit.

    It has curves record -> (intensities, demands); fractiles (n, 3) of 16, 50 and 84 % at the
    levels (n,); and intensities of runs that failed, marked at the right edge.
    """

    label: str
    unit: str
    curves: Mapping[str, tuple[Array, Array]]
    levels: Array
    fractiles: Array
    failed: Sequence[float] = ()


@check_arguments
def plot_ida(
    demands: Sequence[DemandPanel], path: str | Path, *, intensity: str, unit: str
) -> Path:
    """Draw a panel for every demand: a grey curve for each record, and the fractiles.

    Accelerations are in g.
    """
    figure, ((*axes,),) = canvas(1, len(demands), (1.0 + 4.4 * len(demands), 4.6), sharey=True)
    factor, unit = _in_g(unit)
    for axis, panel in zip(axes, demands, strict=True):
        _draw(axis, panel, factor)
    axes[0].set_ylabel(f"{intensity} [{unit}]")
    axes[0].set_ylim(bottom=0.0)
    handles, labels = axes[0].get_legend_handles_labels()
    # keeps room for the legend, which the layout of matplotlib 3.6 does not
    figure.suptitle(" ", fontsize=20)
    columns = min(len(labels), 3 * len(demands))
    figure.legend(handles, labels, loc="upper center", ncol=columns, fontsize=8, frameon=False)
    return save(figure, path)


@check_arguments
def plot_fragility(
    curves: Mapping[str, tuple[Callable[[Array], Array], Array]],
    path: str | Path,
    *,
    intensity: str,
    unit: str,
) -> Path:
    """Draw the probability that each limit is passed.

    It is (3, n) lower bound, curve, upper bound at intensities (n,). The brackets (records, 2) that
    it is fitted to are drawn one above the other.
    """
    figure, ((axis,),) = canvas(1, 1, (6.4, 4.4))
    factor, unit = _in_g(unit)
    every = np.concatenate([brackets for _, brackets in curves.values()])
    x = np.linspace(0.0, 1.2 * np.max(every, where=np.isfinite(every), initial=0.0), 300)[1:]
    for number, (name, (curve, brackets)) in enumerate(curves.items()):
        colour, (low, value, high) = f"C{number}", curve(x)
        axis.plot(factor * x, value, color=colour, label=plain(name))
        axis.fill_between(factor * x, low, high, color=colour, alpha=0.15, lw=0.0)
        first, last = brackets[np.lexsort(brackets.T)].T
        shares = (np.arange(len(first)) + 0.5) / len(first)
        axis.hlines(
            shares,
            factor * first,
            factor * np.minimum(last, x[-1]),
            color=colour,
            lw=0.8,
            alpha=0.6,
        )
    axis.set(
        xlabel=f"{intensity} [{unit}]",
        ylabel="probability that the limit is passed [-]",
        ylim=(0.0, 1.0),
        xlim=(0.0, factor * x[-1]),
        title="Fit, its 95 % band, and where each record first passes",
    )
    axis.legend(fontsize=8, frameon=False, loc="lower right")
    return save(figure, path)


def _in_g(unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which an intensity is drawn: accelerations in g."""
    return (1.0 / STANDARD_GRAVITY, "g") if unit == "m/s²" else (1.0, unit)


def _draw(axis: Any, panel: DemandPanel, level: float) -> None:
    size = max(float(np.max(np.abs(demand), initial=0.0)) for _, demand in panel.curves.values())
    factor, unit = scale(size, panel.unit)
    axis.set_xlabel(f"{panel.label} [{unit}]")
    few = len(panel.curves) <= 5
    marks = "osv^D"
    for number, (record, (intensity, demand)) in enumerate(panel.curves.items()):
        label = plain(record) if few else "a record" if number == 0 else None
        mark = marks[number] if few else None
        axis.plot(
            factor * demand, level * intensity, marker=mark, color="0.65", lw=0.9, ms=4, label=label
        )
    if len(panel.levels) > 1:
        for values, (name, colour, style) in zip(panel.fractiles.T, _FRACTILES, strict=True):
            axis.plot(
                factor * values, level * panel.levels, color=colour, ls=style, lw=1.6, label=name
            )
    if len(panel.failed):
        axis.plot(
            np.ones(len(panel.failed)),
            level * np.array(panel.failed),
            "x",
            color="tab:red",
            ms=7,
            clip_on=False,
            transform=axis.get_yaxis_transform(),
            label="run failed",
        )
