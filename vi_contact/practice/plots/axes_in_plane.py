"""Make the axis on which bodies in the plane are drawn, and hold their colours."""

from typing import Any

import numpy as np

from ...core.algebra import Array
from .histories import canvas

# Colours of bodies, light so that numbers can be read; neighbours by number differ.
STONES = ("#e8dcc8", "#d9c7a8", "#efe6d6", "#cfbf9f", "#e2d3b8")
FIXED = "#b8b8b8"  # what does not move
LONGEST = 7.0  # of the longer side of a picture [inches]


def make_axis(points: Array) -> tuple[Any, Any]:
    """Return a figure and its axis, of the shape that points (k, 2) have."""
    extent = np.ptp(points, axis=0)
    shape = np.maximum(LONGEST * extent / extent.max(), 0.3 * LONGEST)
    figure, axes = canvas(1, 1, (float(shape[0]) + 0.8, float(shape[1]) + 0.8), False)
    axis = axes[0, 0]
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axis.margins(0.03)
    return figure, axis
