"""Draw boundary element answers, with those of finite elements beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import canvas, save, scale

ARROW = 0.3  # length of the longest arrow of a row over the size of its bodies


@dataclass(frozen=True)
class Shot:
    """Hold bodies at one time, as they are drawn.

    There are ``outlines``, closed curves (n, 2), ``inside`` points (m, 2), contact tractions
    ``arrows`` (c, 2) [Pa] on points ``feet`` (c, 2), a rigid support below the height ``support``
    [m].
    """

    title: str
    outlines: tuple[Array, ...]
    inside: Array
    feet: Array
    arrows: Array
    support: float | None = None


@dataclass(frozen=True)
class Curve:
    """Describe values over an abscissa: a line, or markers only."""

    label: str
    x: Array
    y: Array
    colour: str = "black"
    marked: bool = False


SHEAR = "shear on the body, along +x"  # the sign of all pictures of contact tractions


@dataclass(frozen=True)
class Panel:
    """Hold curves of one quantity with its unit; x: label of the abscissa."""

    title: str
    quantity: str
    unit: str
    curves: tuple[Curve, ...]
    x: str = "time [s]"


def plot_boundary_snapshots(
    rows: Mapping[str, Sequence[Shot]], path: str | Path, *, title: str
) -> Path:
    """Draw a row per example, a column per time.

    There are deformed outlines, points inside, and contact tractions (in the row's scale).
    """
    columns = max(len(shots) for shots in rows.values())
    figure, axes = canvas(
        len(rows), columns, (2.6 * columns + 0.6, 2.5 * len(rows) + 0.6), lattice=False
    )
    for row, (name, shots) in zip(axes, rows.items(), strict=True):
        points = np.concatenate([outline for shot in shots for outline in shot.outlines])
        low, high = points.min(axis=0), points.max(axis=0)
        size = float((high - low).max())
        longest = max(
            (float(np.hypot(*shot.arrows.T).max(initial=0.0)) for shot in shots), default=0.0
        )
        for axis, shot in zip(row, shots, strict=True):
            _draw(axis, shot, longest / (ARROW * size), size)
            axis.set(xlim=(low[0] - 0.1 * size, high[0] + 0.1 * size))
            axis.set(
                ylim=(low[1] - (0.1 if shot.support is None else 0.35) * size, high[1] + 0.1 * size)
            )
            axis.set_title(f"{name}\n{shot.title}", fontsize=8)
            axis.tick_params(labelsize=7)
    figure.supxlabel("x [m]", fontsize=10)
    figure.supylabel("y [m]", fontsize=10)
    figure.suptitle(title)
    return save(figure, path)


def _draw(axis: Any, shot: Shot, scale: float, size: float) -> None:
    axis.set_aspect("equal")
    for outline in shot.outlines:
        axis.fill(*outline.T, facecolor="0.92", edgecolor="black", lw=0.9)
    axis.plot(*shot.inside.T, ".", ms=2.0, color="0.45")
    if shot.support is not None:
        axis.axhline(shot.support, color="black", lw=1.0)
        axis.axhspan(shot.support - 0.05 * size, shot.support, color="0.8", lw=0.0, zorder=0)
    if scale > 0.0 and len(shot.feet):
        axis.quiver(
            *shot.feet.T,
            *shot.arrows.T,
            angles="xy",
            scale_units="xy",
            scale=scale,
            pivot="tip",
            width=0.006,
            color="tab:blue",
            zorder=3,
        )


def plot_panels(rows: Sequence[Sequence[Panel]], path: str | Path, *, title: str) -> Path:
    """Draw panels in rows and columns, each with its own scale and one legend for its curves."""
    columns = max(len(row) for row in rows)
    figure, axes = canvas(len(rows), columns, (3.7 * columns + 0.4, 2.7 * len(rows) + 0.6))
    for line, panels in zip(axes, rows, strict=True):
        for axis, panel in zip(line, panels, strict=True):
            _panel(axis, panel)
    figure.suptitle(title)
    return save(figure, path)


def _panel(axis: Any, panel: Panel) -> None:
    factor, unit = scale(
        max(float(np.abs(curve.y).max(initial=0.0)) for curve in panel.curves), panel.unit
    )
    for curve in panel.curves:
        style = {"ls": "", "marker": ".", "ms": 3.5} if curve.marked else {"lw": 1.1}
        axis.plot(curve.x, factor * curve.y, color=curve.colour, label=curve.label or None, **style)
    axis.set_title(panel.title, fontsize=9)
    axis.set_xlabel(panel.x, fontsize=8)
    axis.set_ylabel(f"{panel.quantity} [{unit}]", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.legend(fontsize=6.5)
