"""Draw what the demo of structures shows.

There are beams, a frame and plates in contact, their errors, and two of them thrown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from demos.parts.exact.structures import DiskOnGround, LiftedBeam
from vi_contact.core.algebra import Array
from vi_contact.plots.histories import canvas, plain_numbers, save

LARGER = 10.0  # how much larger displacements of the frame are drawn


@dataclass
class Shown:
    """Hold what is drawn.

    frame: nodes (k, 2), displacements (k, 2) [m], direction of the stop and its gap [m]; beam: x,
    heights [m], closed form; disk: radii and deflections upwards [m] of its nodes, closed form and
    q a⁴/D [m]; errors: name -> (elements along a side, relative errors); thrown: name -> (t [s],
    gap [m], energy over that at the start, time of touch [s]).
    """

    frame: tuple[Array, Array, tuple[float, float], float] | None = None
    beam: tuple[Array, Array, LiftedBeam] | None = None
    disk: tuple[Array, Array, DiskOnGround, float] | None = None
    errors: dict[str, tuple[Sequence[int], Sequence[float]]] = field(default_factory=dict)
    thrown: dict[str, tuple[Array, Array, Array, float]] = field(default_factory=dict)


def plot_structures(shown: Shown, path: str | Path) -> Path:
    """Draw all six panels."""
    figure, axes = canvas(2, 3, (15.0, 8.0))
    _beam(axes[0, 0], shown)
    _frame(axes[0, 1], shown)
    _disk(axes[0, 2], shown)
    _errors(axes[1, 0], shown)
    _thrown(axes[1, 1], axes[1, 2], shown)
    return save(figure, path)


def _beam(axis: Any, shown: Shown) -> None:
    assert shown.beam is not None
    x, w, known = shown.beam
    fine = np.linspace(0.0, x[-1], 400)
    axis.axhspan(-3.0, 0.0, color="0.85", lw=0.0, label="ground")
    axis.plot(fine, 1e3 * known.shape(fine), color="0.5", lw=3.0, label="closed form")
    axis.plot(x, 1e3 * w, "k.", ms=6, label=f"{len(x) - 1} elements")
    axis.axvline(
        known.length,
        color="tab:red",
        lw=1.0,
        ls="--",
        label=f"touches at 2P/q = {known.length:g} m",
    )
    axis.set(
        xlabel="x [m]",
        ylabel="height [mm]",
        ylim=(-3.0, None),
        title="A heavy beam, pulled up at its end",
    )
    axis.legend(fontsize=8)


def _frame(axis: Any, shown: Shown) -> None:
    assert shown.frame is not None
    nodes, u, normal, gap = shown.frame
    n = np.array(normal)
    moved = nodes + LARGER * u
    along = np.array([-n[1], n[0]])
    stop = nodes[-1] + LARGER * gap * n + np.outer([-0.45, 0.45], along)
    axis.plot(*nodes.T, "o-", color="0.7", ms=4, label="without load")
    axis.plot(*moved.T, "o-", color="black", ms=4, label=f"displacements x {LARGER:g}")
    axis.plot(*stop.T, color="tab:red", lw=3.0, label=f"stop, gap {1e3 * gap:g} mm x {LARGER:g}")
    axis.set(xlabel="x [m]", ylabel="y [m]", title="A plane frame on an oblique stop")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(fontsize=8, loc="lower right")


def _disk(axis: Any, shown: Shown) -> None:
    assert shown.disk is not None
    r, w, known, scale = shown.disk
    fine = np.linspace(0.0, 1.0, 400)
    radius = float(r.max())
    ground = -1e3 * scale * known.gap
    axis.axhspan(1.15 * ground, ground, color="0.85", lw=0.0, label="ground")
    axis.plot(
        radius * fine,
        -1e3 * scale * known.deflection(fine),
        color="0.5",
        lw=3.0,
        label="closed form",
    )
    axis.plot(r, 1e3 * w, "k.", ms=2, label="nodes")
    axis.axvline(
        radius * known.b,
        color="tab:red",
        lw=1.0,
        ls="--",
        label=f"touches for r < {radius * known.b:.4f} m",
    )
    axis.set(
        xlabel="r [m]",
        ylabel="deflection [mm]",
        ylim=(1.15 * ground, None),
        title="A clamped disk on the ground",
    )
    axis.legend(fontsize=8, loc="upper left")


def _errors(axis: Any, shown: Shown) -> None:
    for (name, (counts, errors)), mark in zip(shown.errors.items(), "sod^", strict=False):
        axis.loglog(counts, errors, f"{mark}-", ms=5, lw=1.2, label=name)
    n = np.array(sorted({count for counts, _ in shown.errors.values() for count in counts}))
    axis.loglog(n, 0.4 / n**2.0, color="0.6", ls="--", lw=1.0, label="order 2")
    axis.set(
        xlabel="elements along the beam, the side or the diameter",
        ylabel="relative error",
        title="Against closed forms",
    )
    plain_numbers(axis.xaxis)
    axis.legend(fontsize=8, loc="lower left")


def _thrown(gaps: Any, energies: Any, shown: Shown) -> None:
    for (name, (t, gap, energy, touch)), colour in zip(
        shown.thrown.items(), ("tab:blue", "tab:orange"), strict=False
    ):
        point = {"beam": "tip of a cantilever", "plate": "middle of a plate"}[name]
        gaps.plot(1e3 * t, 1e3 * gap, color=colour, lw=1.4, label=point)
        gaps.axvline(1e3 * touch, color=colour, lw=1.0, ls="--", label="touches, closed form")
        energies.plot(1e3 * t, energy, color=colour, lw=1.4, label=point)
    gaps.set(xlabel="time [ms]", ylabel="gap [mm]", title="Thrown at a stop")
    energies.set(
        xlabel="time [ms]", ylabel="energy / energy at the start [-]", title="Energy never grows"
    )
    for axis in (gaps, energies):
        axis.legend(fontsize=8)
