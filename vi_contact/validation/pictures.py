"""Draw what entries find: a canvas, and found over wanted in logarithmic axes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..practice.plots.histories import canvas, save

__all__ = ["canvas", "draw_over_wanted", "save"]


def draw_over_wanted(
    axis: Any, wanted: Sequence[float], found: Sequence[float], relative: float, floor: float
) -> None:
    """Draw found over wanted in logarithmic axes, with the band of the single values.

    Args:
        axis: of matplotlib.
        wanted: (n,) values of the source; those below a tenth of the floor are drawn there.
        found: (n,) computed, in the same unit.
        relative: half width of the band, over the value.
        floor: half width of the band of small values, in the unit of the values.
    """
    least = 0.1 * floor
    x = np.maximum(np.asarray(wanted, dtype=float), least)
    y = np.maximum(np.asarray(found, dtype=float), least)
    line = np.geomspace(least, 2.0 * max(x.max(), y.max()), 300)
    half = np.maximum(relative * line, floor)
    axis.fill_between(
        line, np.maximum(line - half, least), line + half, color="0.85", label="band of one value"
    )
    axis.plot(line, line, color="0.5", lw=0.8)
    axis.plot(x, y, "o", ms=3.5, fillstyle="none", color="tab:blue")
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_aspect("equal")
    for side in (axis.xaxis, axis.yaxis):
        side.set_major_formatter("{x:g}")
