"""Draw histories of several runs beside each other."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vi_contact.plots.histories import History, panels, save, scale


def plot_runs(
    runs: Mapping[str, History],
    quantities: Sequence[tuple[str, str, str]],
    path: str | Path,
    *,
    title: str,
) -> Path:
    """Draw the same quantities of several runs, a panel per quantity.

    quantities: (column, label, SI unit).
    """
    figure, axes = panels(len(quantities), (9.0, 2.1 * len(quantities) + 1.2))
    for axis, (column, label, unit) in zip(axes, quantities, strict=True):
        size = max(float(np.max(np.abs(run[column]), initial=0.0)) for run in runs.values())
        factor, prefixed = scale(size, unit)
        for name, run in runs.items():
            axis.plot(run["t"], run[column] * factor, lw=0.9, label=name)
        axis.set_ylabel(f"{label} [{prefixed}]")
    axes[0].margins(y=0.25)  # room for the legend
    axes[0].legend(fontsize=8, ncol=len(runs), loc="lower right")
    axes[0].set_title(title)
    return save(figure, path)
