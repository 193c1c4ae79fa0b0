"""Draw incremental dynamic analyses as intensity over demand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.units import STANDARD_GRAVITY
from .histories import (
    canvas,
    draw_curve,
    escape_dollars,
    put_legend_above,
    put_legend_on_top,
    save,
    scale,
)

MARKS = "osv^D"  # of records that are named
_FRACTILES = (("16 %", "tab:blue", ":"), ("50 %", "black", "-"), ("84 %", "tab:red", "--"))


@dataclass(frozen=True)
class DemandPanel:
    """Describe one demand in its SI unit.

    Attributes:
        label: name of the demand.
        unit: SI, of the demands.
        curves: record -> (intensities, demands) of its runs.
        levels: (n,) intensities of the fractiles.
        fractiles: (n, 3) demands of 16, 50 and 84 % of the records at the levels.
        failed: intensities of runs that failed, which are marked at the right edge.
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

    Args:
        demands: at least one.
        path: the picture; its ending says the format.
        intensity: name of the intensity measure.
        unit: its SI unit.

    Returns:
        the path.
    """
    figure, ((*axes,),) = canvas(1, len(demands), (1.0 + 4.4 * len(demands), 4.6), sharey=True)
    factor, shown_unit = _choose_intensity_unit(unit)
    for axis, panel in zip(axes, demands, strict=True):
        _draw_panel(axis, panel, factor)
    axes[0].set_ylabel(f"{intensity} [{shown_unit}]")
    axes[0].set_ylim(bottom=0.0)
    put_legend_on_top(figure, *axes[0].get_legend_handles_labels())
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

    The brackets that a curve is fitted to are drawn one above the other.

    Args:
        curves: name of a limit -> (function, brackets). The function returns (3, n) lower bound,
            curve and upper bound at intensities (n,). The brackets (records, 2) are the intensities
            between which each record first passes the limit.
        path: the picture; its ending says the format.
        intensity: name of the intensity measure.
        unit: its SI unit; accelerations are drawn in g.

    Returns:
        the path.
    """
    figure, ((axis,),) = canvas(1, 1, (6.4, 4.4))
    factor, shown_unit = _choose_intensity_unit(unit)
    bounds = np.concatenate([brackets for _, brackets in curves.values()])
    x = np.linspace(0.0, 1.2 * np.max(bounds, where=np.isfinite(bounds), initial=0.0), 300)[1:]
    for number, (name, (curve, brackets)) in enumerate(curves.items()):
        low, value, high = curve(x)
        line = draw_curve(axis, factor * x, value, number, label=escape_dollars(name))
        colour = line.get_color()
        axis.fill_between(factor * x, low, high, color=colour, alpha=0.15, lw=0.0)

        # Brackets from the lowest record to the highest, each at its share of all records.
        first, last = brackets[np.lexsort(brackets.T)].T
        shares = (np.arange(len(first)) + 0.5) / len(first)
        axis.hlines(
            shares,
            factor * first,
            factor * np.minimum(last, x[-1]),
            color=colour,
            linestyles=line.get_linestyle(),
            lw=0.8,
            alpha=0.6,
        )
    axis.set(
        xlabel=f"{intensity} [{shown_unit}]",
        ylabel="probability that the limit is passed [-]",
        ylim=(0.0, 1.0),
        xlim=(0.0, factor * x[-1]),
    )
    legend = put_legend_above(axis, 8.0)
    axis.set_title("Fit, its 95 % band, and where each record first passes", pad=legend + 4.0)
    return save(figure, path)


def _choose_intensity_unit(unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which an intensity is drawn: accelerations in g."""
    return (1.0 / STANDARD_GRAVITY, "g") if unit == "m/s²" else (1.0, unit)


def _draw_panel(axis: Any, panel: DemandPanel, intensity_factor: float) -> None:
    """Draw a demand over the intensity, which is multiplied by a factor."""
    size = max(float(np.max(np.abs(demand), initial=0.0)) for _, demand in panel.curves.values())
    factor, unit = scale(size, panel.unit)
    axis.set_xlabel(f"{panel.label} [{unit}]")

    # Few records are named, each with a mark of its own; of many all are one grey line.
    few = len(panel.curves) <= len(MARKS)
    for number, (record, (intensity, demand)) in enumerate(panel.curves.items()):
        look: dict[str, Any] = {"marker": None, "label": None}
        if few:
            look = {"marker": MARKS[number], "label": escape_dollars(record)}
        elif number == 0:
            look["label"] = "a record"
        axis.plot(factor * demand, intensity_factor * intensity, color="0.65", lw=0.9, ms=4, **look)

    if len(panel.levels) > 1:
        levels = intensity_factor * panel.levels
        for values, (name, colour, style) in zip(panel.fractiles.T, _FRACTILES, strict=True):
            axis.plot(factor * values, levels, color=colour, ls=style, lw=1.6, label=name)
    if len(panel.failed):
        axis.plot(
            np.ones(len(panel.failed)),
            intensity_factor * np.array(panel.failed),
            "x",
            color="tab:red",
            ms=7,
            clip_on=False,
            transform=axis.get_yaxis_transform(),
            label="run failed",
        )
