"""Draw the wall of the boundary method.

There are its data and numbered points (Fig. 2), a step as two structures (Fig. 1), and the deformed
wall at two instants, which is the first picture of the documentation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from demos.parts.pictures.tractions import read_tractions
from demos.parts.problems.decomposition import Decomposition
from demos.parts.problems.wall import Wall
from vi_contact.practice.plots.deformed import find_nearest, read_frames
from vi_contact.practice.plots.histories import canvas, save, scale

GROUND, WALL, CONTACT = "0.87", "#e8dfc8", "#c0392b"
PRESSURE = "tab:blue"
LEANS = 0.05  # of the height of the wall: the largest displacement of the two instants
ARROW = 0.35  # of the width of the wall: the arrow of the largest pressure
LONGEST = (
    0.16  # of the height of the wall: the largest displacement, and the longest arrow of a reaction
)
DEPTH = 0.09  # of the height: how much of the ground is drawn


def plot_data(wall: Wall, cases: Mapping[str, Sequence[int]], path: str | Path) -> Path:
    """Draw the wall with its forty boundary points, the ground.

    The points of each case that may touch it are drawn too.
    """
    figure, axes = canvas(1, len(cases), (4.9 * len(cases), 6.6), lattice=False, sharey=True)
    across, up = wall.width / 8.0, wall.height / 12.0
    for axis, (case, touching) in zip(axes[0], cases.items(), strict=True):
        _ground(axis, wall)
        axis.fill(
            [0.0, wall.width, wall.width, 0.0],
            [0.0, 0.0, wall.height, wall.height],
            fc=WALL,
            ec="black",
            lw=1.2,
        )
        for k in range(1, 12):
            axis.plot([0.0, wall.width], [k * up, k * up], color="0.75", lw=0.4)
            if k < 8:
                axis.plot([k * across, k * across], [0.0, wall.height], color="0.75", lw=0.4)
        for number in range(1, 41):
            _point(axis, wall, number, number in touching)
        axis.plot(
            [], [], "o", ms=6, color=CONTACT, label=f"{len(touching)} points of unilateral contact"
        )
        axis.plot([], [], "s", ms=4, color="black", label="base, held")
        axis.legend(
            fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncol=2, frameon=False
        )
        axis.set(
            title=f"case {case}",
            xlabel="x [m]",
            xlim=(-1.0, wall.width + 1.4),
            ylim=(-1.0, wall.height + 1.5),
            aspect="equal",
        )
        _dimension(
            axis, (0.0, wall.height + 1.0), (wall.width, wall.height + 1.0), f"{wall.width:g} m"
        )
    _dimension(axes[0, 0], (2.2 * across, 0.0), (2.2 * across, wall.height), f"{wall.height:g} m")
    told = wall.material
    text = (
        f"E = {told.E / 1e9:g} GPa\nν = {told.nu:g}\nd = {wall.thickness:.2f} m\nρ = {told.rho:g} "
        "kg/m³\n"
        "plane stress"
    )
    for axis in axes[0]:
        axis.text(
            0.58 * wall.width,
            0.5 * wall.height,
            text,
            va="center",
            ha="center",
            fontsize=9,
            bbox={"fc": "white", "ec": "0.6", "boxstyle": "round,pad=0.5"},
        )
    axes[0, 0].set_ylabel("y [m]")
    return save(figure, path, "The wall, its numbered points and data")


def _point(axis: Any, wall: Wall, number: int, touching: bool) -> None:
    """Draw a boundary point, with its number outside of the wall."""
    x, y = wall.point(number)
    base = number >= 32  # the corner 32 stands on the base too
    axis.plot(
        x,
        y,
        "s" if base else "o",
        ms=6 if touching else 3.5,
        color=CONTACT if touching else "black",
        zorder=4,
    )
    outward = np.array(
        [float(x == wall.width) - float(x == 0.0), float(y == wall.height) - float(y == 0.0)]
    )
    axis.annotate(
        str(number),
        (x, y),
        xytext=10.0 * outward,
        textcoords="offset points",
        fontsize=8,
        zorder=5,
        ha="center",
        va="center",
        weight="bold" if touching else "normal",
        color=CONTACT if touching else "black",
        bbox={"fc": "white", "ec": "none", "pad": 0.8, "alpha": 0.8},
    )


def _ground(axis: Any, wall: Wall) -> None:
    """Draw the ground below and beside the wall, hatched."""
    deep = DEPTH * wall.height
    axis.fill(
        [-deep, wall.width + 1.5 * deep, wall.width + 1.5 * deep, wall.width, wall.width, -deep],
        [-deep, -deep, wall.height, wall.height, 0.0, 0.0],
        fc=GROUND,
        ec="0.6",
        hatch="////",
        lw=0.0,
        zorder=0,
    )


def _dimension(axis: Any, start: tuple[float, float], end: tuple[float, float], text: str) -> None:
    axis.annotate("", start, end, arrowprops={"arrowstyle": "<->", "lw": 0.9})
    axis.text(
        0.5 * (start[0] + end[0]),
        0.5 * (start[1] + end[1]),
        text,
        fontsize=9,
        ha="center",
        va="center",
        bbox={"fc": "white", "ec": "none", "pad": 1.5},
    )


def plot_decomposition(found: Decomposition, wall: Wall, path: str | Path) -> Path:
    """Draw a step.

    There are the unilateral structure, that of the loads without reactions, and that of the
    reactions alone.
    """
    parts = (
        ("unilateral structure\n$u = \\tilde u_1 + \\tilde u_2$", found.u, True),
        ("loads without reactions, (34)\n$\\tilde u_1 = G(\\bar l)$", found.loaded, False),
        ("reactions alone, (35)\n$\\tilde u_2 = G(\\mu_N)$", found.pressed, True),
    )
    most = max(float(np.abs(u).max()) for _, u, _ in parts)
    push = float(np.linalg.norm(found.forces, axis=1).max())
    magnified = float(f"{LONGEST * wall.height / most:.1g}")
    figure, axes = canvas(1, 3, (12.0, 5.6), lattice=False, sharey=True)
    for axis, sign, (title, u, reactions) in zip(axes[0], ("", "=", "+"), parts, strict=True):
        _ground(axis, wall) if sign == "" else axis.axvline(
            wall.width, color="0.5", lw=1.0, ls="--"
        )
        moved = (found.points + magnified * u).reshape(13, 9, 2)
        for line in (*moved, *moved.swapaxes(0, 1)):
            axis.plot(*line.T, color="tab:blue", lw=0.8)
        axis.fill(
            [0.0, wall.width, wall.width, 0.0],
            [0.0, 0.0, wall.height, wall.height],
            fc="none",
            ec="0.5",
            ls=":",
        )
        axis.plot([0.0, wall.width], [0.0, 0.0], color="black", lw=2.5)
        for place, force in zip(found.contact, found.forces, strict=True) if reactions else ():
            if np.linalg.norm(force) > 1e-9 * push:
                head = (
                    place + magnified * u[np.argmin(np.linalg.norm(found.points - place, axis=1))]
                )
                arrow = {"arrowstyle": "->", "color": CONTACT, "lw": 1.5}
                axis.annotate("", head, head - 2.0 * force / push, arrowprops=arrow)
        factor, unit = scale(float(np.abs(u).max()), "m")
        axis.set(
            title=title,
            xlabel="x [m]",
            aspect="equal",
            xlim=(-1.9, wall.width + 3.0),
            ylim=(-1.0, wall.height + 1.2),
        )
        axis.text(
            0.5 * wall.width,
            -0.55,
            f"largest displacement {np.abs(u).max() * factor:.3g} {unit}",
            fontsize=8,
            ha="center",
            va="center",
            bbox={"fc": "white", "ec": "none", "pad": 1.5},
        )
        axis.text(-0.06, 1.06, sign, transform=axis.transAxes, fontsize=20, ha="center")
    axes[0, 0].set_ylabel("y [m]")
    factor, unit = scale(push, "N")
    return save(
        figure,
        path,
        f"A step at t = {found.t:.4f} s: displacements x {magnified:g}, reactions up to "
        f"{push * factor:.3g} {unit}",
    )


def plot_frames(folder: str | Path, wall: Wall, times: Sequence[float], path: str | Path) -> float:
    """Draw the wall of a run at times [s] that have a frame.

    There are displacements, stresses and pressures of the ground.

    Return how many times larger than they are the displacements are drawn, the same in all panels.
    """
    from matplotlib.collections import PolyCollection

    frames, tractions = read_frames(folder), read_tractions(folder)
    shots = [frames.at(t) for t in times]
    magnified = float(
        f"{LEANS * wall.height / max(float(np.abs(u).max()) for _, u, _ in shots):.1g}"
    )
    pressures = [tractions.normal[find_nearest(tractions.t, [t])[0]] for t, _, _ in shots]
    push = max(float(p.max()) for p in pressures)
    most = max(float(stress.max()) for *_, stress in shots)
    (factor, unit), (force, force_unit) = scale(most, "Pa"), scale(push, "Pa")
    figure, axes = canvas(1, len(times), (4.3 * len(times) + 1.2, 6.6), lattice=False, sharey=True)
    for axis, (t, u, stress), pressure in zip(axes[0], shots, pressures, strict=True):
        _ground(axis, wall)
        moved = frames.points + magnified * u
        cells = PolyCollection(list(moved[frames.cells]), cmap="YlOrRd", ec="0.35", lw=0.4)
        cells.set(array=factor * stress, clim=(0.0, factor * most))
        axis.add_collection(cells)
        axis.fill(
            [0.0, wall.width, wall.width, 0.0],
            [0.0, 0.0, wall.height, wall.height],
            fc="none",
            ec="black",
            ls=":",
        )
        axis.plot([0.0, wall.width], [0.0, 0.0], color="black", lw=3.5)
        for (x, y), one in zip(tractions.points, pressure, strict=True):
            if one > 0.0:
                long = ARROW * wall.width * one / push
                axis.annotate(
                    "",
                    (x - long, y),
                    (x, y),
                    arrowprops={
                        "arrowstyle": "-|>",
                        "color": PRESSURE,
                        "lw": 1.6,
                        "shrinkA": 0.0,
                        "shrinkB": 0.0,
                    },
                )
        state = (
            "the ground presses the wall"
            if pressure.any()
            else "the wall leans away: the gap is open"
        )
        axis.set(
            title=f"t = {t:.3f} s\n{state}",
            xlabel="x [m]",
            aspect="equal",
            xlim=(-1.0, wall.width + 1.6),
            ylim=(-DEPTH * wall.height, wall.height + 0.6),
        )
        axis.text(
            wall.width + 0.8,
            0.5 * wall.height,
            "ground",
            rotation=90.0,
            ha="center",
            va="center",
            fontsize=10,
            bbox={"fc": "white", "ec": "none", "pad": 2.0},
        )
    axes[0, 0].set_ylabel("y [m]")
    first = axes[0, 0]
    last = axes[0, -1]
    first.plot([], [], color="black", ls=":", label="wall at rest")
    first.plot([], [], color="black", lw=3.5, label="base, held")
    last.plot(
        [],
        [],
        color=PRESSURE,
        marker=r"$\leftarrow$",
        ms=20,
        ls="none",
        label=f"pressure of the ground, up to {force * push:.0f} {force_unit}",
    )
    for axis in (first, last):
        axis.legend(
            fontsize=10, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncol=2, frameon=False
        )
    figure.colorbar(cells, ax=axes, label=f"von Mises stress [{unit}]", shrink=0.8)
    save(
        figure,
        path,
        f"A shaken wall beside the ground: displacements are drawn {magnified:g} times larger",
    )
    return magnified
