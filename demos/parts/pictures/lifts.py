"""Draw what the demo of a wall in lifts measures: moments as the fill rises, and pressures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.practice.plots.histories import canvas, save

DASHES = {"active, Coulomb": "--", "active, Rankine": "-.", "at rest": ":"}
LOOKS = {  # name of a wall -> marker, colour
    "one elastic lift": ("x", "#8c5a2b"),
    "one lift": ("s", "#e69f00"),
    "three lifts": ("o", "#1f5fa8"),
    "six lifts": ("^", "#1b6e3c"),
}


def plot_lifts(
    walls: Sequence[Any], path: Path, by_hand: Mapping[str, float], weight: float
) -> Path:
    """Draw moments at the foot over the height of the fill, and pressures in the end.

    Args:
        walls: what is measured of each.
        path: the picture.
        by_hand: name -> coefficient K of pressures K gamma z.
        weight: gamma of the fill [N/m³].
    """
    figure, ((left, right),) = canvas(1, 2, (9.0, 4.2))
    top = max(float(wall.heights[-1]) for wall in walls)
    h = np.linspace(0.0, top, 100)
    for name, K in by_hand.items():
        left.plot(h, K * weight * h**3 / 6e3, DASHES[name], color="0.4", lw=1.0, label=name)
        right.plot(K * weight * (top - h) / 1e3, h, DASHES[name], color="0.4", lw=1.0, label=name)
    for wall in walls:
        marker, colour = LOOKS[wall.name]
        look = {"marker": marker, "color": colour, "label": wall.name, "ms": 4.5}
        left.plot(wall.heights, 1e-3 * wall.moments, lw=0.7, **look)
        order = np.argsort(wall.points)
        right.plot(1e-3 * wall.pressures[order], wall.points[order], lw=0.7, **look)
    left.set_xlabel("fill above the foot [m]")
    left.set_ylabel("moment at the foot of the stem [kNm/m]")
    right.set_xlabel("pressure on the stem [kPa]")
    right.set_ylabel("height above the foot [m]")
    right.set_xlim(0.0, 1.05 * max(by_hand.values()) * weight * top / 1e3)
    left.legend(fontsize=8, frameon=False)
    return save(figure, path)


def plot_slips(slips: Mapping[tuple[str, float], Any], path: Path) -> Path:
    """Draw histories of slip beside those of Newmark's block, a panel for each body.

    Args:
        slips: (name, k_y/k_max) -> times [s], slips found and of Newmark's block [m].
        path: the picture.
    """
    names = list(dict.fromkeys(name for name, _ in slips))
    figure, (axes,) = canvas(1, len(names), (4.6 * len(names), 3.8))
    for axis, name in zip(axes, names, strict=True):
        ratios = [ratio for own, ratio in slips if own == name]
        for ratio, colour in zip(ratios, ("#c8201e", "#1f5fa8"), strict=False):
            t, found, exact = slips[name, ratio]
            label = f"$k_y/k_{{max}}$ = {ratio:g}"
            axis.plot(t, 1e3 * found, color=colour, lw=1.4, label=f"{name}, {label}")
            axis.plot(t, 1e3 * exact, "--", color=colour, lw=1.0, label=f"Newmark, {label}")
        axis.set_xlabel("time [s]")
        axis.set_ylabel("slip [mm]")
        axis.legend(fontsize=8, frameon=False, ncol=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return save(figure, path)
