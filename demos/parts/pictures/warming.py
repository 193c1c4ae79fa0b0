"""Draw a wall that is warmed until it presses on a ceiling.

Draw too the waves in a bar that is warmed at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import canvas, save


def plot_warming(
    wall: Sequence[tuple[float, float]],
    pressure: Callable[[float], float],
    bar: tuple[Array, Array, Array],
    path: str | Path,
) -> Path:
    """Draw pressures (warming [K], Pa) of the wall.

    They stand beside the closed form; over time there are the pushes of a bar.

    bar: time over the crossing of a wave, push of the support and push of the wall over E A alpha
    dT.
    """
    figure, axes = canvas(1, 2, (11.0, 4.2))
    slow, quick = axes[0]
    fine = np.linspace(0.0, 1.05 * wall[-1][0], 400)
    slow.plot(fine, [1e-6 * pressure(dT) for dT in fine], color="0.6", lw=3.0, label="closed form")
    slow.plot([dT for dT, _ in wall], [1e-6 * one for _, one in wall], "ko", label="computed")
    slow.set(
        xlabel="warming [K]",
        ylabel="pressure on the ceiling [MPa]",
        title="A wall below a ceiling, warmed slowly",
    )
    slow.legend(fontsize=9)
    t, support, push = bar
    steps = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 2.9])
    for name, values, exact, thin, thick in (
        ("support", support, (1, 1, -1, -1, 1, 1), "tab:blue", "navy"),
        ("wall", push, (0, 0, 1, 1, 0, 0), "orange", "darkred"),
    ):
        quick.plot(t, values, color=thin, lw=0.6, label=f"push of the {name}, computed")
        quick.plot(steps, exact, color=thick, lw=2.0, ls="--", label="exact")
    quick.set(
        xlabel="time over the crossing of a wave L/c [-]",
        ylabel="push over E A alpha dT [-]",
        ylim=(-1.6, 2.6),
        title="A bar between support and wall, warmed at once",
    )
    quick.legend(fontsize=9, ncols=2, loc="upper right")
    return save(figure, path)
