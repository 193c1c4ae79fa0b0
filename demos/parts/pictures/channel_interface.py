"""Draw the buried channel from recorded histories.

It is drawn as Figs. 7 to 9 of the boundary method, and along its outline.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array, Mask
from vi_contact.core.errors import InputError
from vi_contact.practice.plots.histories import (
    History,
    canvas,
    cell_edges,
    list_shaken_axes,
    panels,
    save,
    scale,
)
from vi_contact.practice.plots.maps import thin_rows

SHOWN = {  # panels of plot_openings: point -> outward normal of the channel there
    "tops of the walls": {"19": (-1.0, 0.0), "13": (1.0, 0.0)},
    "middles of the walls": {"16": (-1.0, 0.0), "10": (1.0, 0.0)},
    "feet of the walls": {"1": (-1.0, 0.0), "7": (1.0, 0.0)},
    "under the slab": {"1": (0.0, -1.0), "4": (0.0, -1.0), "7": (0.0, -1.0)},
}
RUNS = ("black", "tab:red", "tab:green", "tab:purple")
CLIPPED = 98.0  # per cent of the closed points whose pressure the colours of a map tell apart
LEGEND: dict[str, Any] = {
    "fontsize": 8,
    "loc": "lower right",
    "bbox_to_anchor": (1.0, 0.98),
    "frameon": False,
}


@dataclass(frozen=True)
class Outline:
    """Describe where the contact conditions are on the channel.

    They are ``arc`` (m,) [m] along its outline, down the left wall, along the base, up the right
    wall; ``sides``: name -> mask (m,). Corners have a condition on both sides.
    """

    arc: Array
    sides: Mapping[str, Mask]

    @classmethod
    def of(cls, points: Array, normals: Array) -> "Outline":
        """Make the outline from contact ``points`` (m, 2) [m] with outward ``normals`` (m, 2)."""
        low, high = points.min(axis=0), points.max(axis=0)
        left = normals[:, 0] < -0.5
        right = normals[:, 0] > 0.5
        height = high[1] - low[1]
        right_wall = height + high[0] - low[0] + points[:, 1] - low[1]
        arc = np.select(
            [left, right], [high[1] - points[:, 1], right_wall], height + points[:, 0] - low[0]
        )
        return cls(arc, {"left wall": left, "base": ~(left | right), "right wall": right})

    def along(self) -> list[tuple[str, Array]]:
        """Return (name, its conditions in the order of the arc) of the sides.

        The sides follow each other along the arc.
        """
        order = np.argsort(self.arc)
        return [(name, order[mask[order]]) for name, mask in self.sides.items()]

    def places(self) -> Array:
        """Return the arc lengths (m,) [m].

        A corner's two conditions are a micrometre apart in the order of sides.
        """
        return self.arc + 1e-6 * np.argmax(list(self.sides.values()), axis=0)

    def corners(self) -> list[float]:
        """Return the arc lengths at which one side ends and the next one starts [m]."""
        return [float(self.arc[one].max()) for _, one in self.along()[:-1]]


def unit_of(size: float) -> tuple[float, str]:
    """Return (metres per unit, name).

    They are millimetres from 0.1 mm on, as engineers draw soil and concrete.
    """
    if size >= 1.0:
        return 1.0, "m"
    return (1e-3, "mm") if size >= 1e-4 or size == 0.0 else (1e-6, "µm")


def opening(history: History, label: str, normal: Sequence[float]) -> Array:
    """Return (u_soil - u_channel)·n (rows,) [m] at a point.

    The probes <label> and <label>_soil record it.

    ``normal``: outward normal of the channel; never negative in unilateral contact.
    """
    names = [f"u_{axis}_{label}" for axis in "xy"]
    missing = [name for one in names for name in (one, f"{one}_soil") if name not in history]
    if missing:
        raise InputError(
            f"the history has no column '{missing[0]}': record point {label} on channel and soil"
        )
    return np.asarray(
        sum(
            n * (history[f"{one}_soil"] - history[one])
            for n, one in zip(normal, names, strict=True)
        )
    )


def plot_openings(history: History, path: str | Path, *, title: str) -> Path:
    """Draw Fig. 7, bedrock and openings.

    It has the acceleration of the bedrock, and openings between channel and soil. Left is blue and
    right is red.
    """
    found = {
        name: {label: opening(history, label, normal) for label, normal in points.items()}
        for name, points in SHOWN.items()
    }
    metres, unit = unit_of(
        max(float(np.abs(one).max()) for rows in found.values() for one in rows.values())
    )
    figure, axes = panels(len(found) + 1, (9.0, 9.6))
    for component in list_shaken_axes(history):
        colour = "black" if component == "x" else "0.6"
        axes[0].plot(
            history["t"],
            history[f"a_g_{component}"],
            color=colour,
            lw=0.9,
            label=f"$a_{{g,{component}}}$",
        )
    axes[0].set_ylabel("acceleration [m/s²]")
    axes[0].set_title("bedrock", fontsize=9, loc="left")
    for axis, (name, rows) in zip(axes[1:], found.items(), strict=True):
        colours = ("tab:blue", "black", "tab:red") if len(rows) == 3 else ("tab:blue", "tab:red")
        for colour, (label, values) in zip(colours, rows.items(), strict=True):
            axis.plot(history["t"], values / metres, color=colour, lw=0.9, label=f"point {label}")
        axis.set_ylabel(f"opening [{unit}]")
        axis.set_title(name, fontsize=9, loc="left")
    axes[0].set_xlim(history["t"][0], history["t"][-1])
    for axis in axes:
        axis.axhline(0.0, color="0.3", lw=0.6)
        if len(axis.lines) > 1:
            axis.legend(ncol=3, **LEGEND)
    return save(figure, path, title)


def plot_rocking(
    history: History, path: str | Path, *, title: str, corners: Sequence[str] = ("1", "7")
) -> Path:
    """Draw Fig. 8: u_y of the bottom corners with their static settlement.

    It shows what of it is rocking and what is common.
    """
    left, right = (np.asarray(history[f"u_y_{label}"]) for label in corners)
    t = history["t"]
    metres, unit = unit_of(float(max(np.abs(left).max(), np.abs(right).max())))
    figure, (top, bottom) = panels(2, (9.0, 5.6), height_ratios=(3, 2))
    for label, values, colour in zip(corners, (left, right), ("tab:blue", "tab:red"), strict=True):
        top.plot(t, values / metres, color=colour, lw=0.9, label=f"point {label}")
    top.axhline(
        left[0] / metres, color="black", ls="--", lw=0.8, label="static, before the shaking"
    )
    top.set_ylabel(f"$u_y$ [{unit}]")
    bottom.plot(
        t,
        0.5 * (right - left) / metres,
        color="black",
        lw=0.9,
        label="rocking, half the difference",
    )
    common = 0.5 * (left + right)
    bottom.plot(
        t,
        (common - common[0]) / metres,
        color="tab:green",
        lw=1.2,
        label="common, mean less static",
    )
    bottom.set_ylabel(f"parts of $u_y$ [{unit}]")
    top.set_xlim(t[0], t[-1])
    for axis in (top, bottom):
        axis.legend(ncol=3, **LEGEND)
    return save(figure, path, title)


def plot_interface(
    runs: Mapping[str, History], outline: Outline, path: str | Path, *, title: str
) -> Path:
    """Draw a map over time and arc length, a panel per run.

    There is pressure where it is closed (in a root scale), and opening where it is open.
    """
    import matplotlib
    from matplotlib.colors import Normalize, PowerNorm

    parts = np.concatenate([conditions for _, conditions in outline.along()])
    arc = outline.arc[parts]
    maps = {name: _reduced(run, parts) for name, run in runs.items()}
    closed = np.concatenate([pressure[pressure > 0.0] for _, pressure, _ in maps.values()])
    most = float(np.percentile(closed, CLIPPED)) if len(closed) else 1.0
    factor, unit = scale(most, "Pa")
    widest = max(float(gap.max()) for *_, gap in maps.values())
    metres, length = unit_of(widest)
    drawn = {
        f"opening [{length}], where open": (
            "Blues",
            Normalize(0.0, widest / metres or 1.0),
            "neither",
        ),
        f"pressure [{unit}], where closed": ("YlOrRd", PowerNorm(0.5, 0.0, factor * most), "max"),
    }
    figure, axes = panels(len(maps), (10.0, 2.9 * len(maps) + 1.0))
    for axis, (name, (t, pressure, gap)) in zip(axes, maps.items(), strict=True):
        axis.grid(False)
        edges = cell_edges(t), np.clip(cell_edges(arc), arc.min(), arc.max())
        values = (
            np.where(gap > 0.0, gap / metres, np.nan),
            np.where(gap > 0.0, np.nan, pressure * factor),
        )
        images = [
            axis.pcolormesh(
                *edges, one.T, cmap=matplotlib.colormaps[colours], norm=norm, rasterized=True
            )
            for one, (colours, norm, _) in zip(values, drawn.values(), strict=True)
        ]
        for corner in outline.corners():
            axis.axhline(corner, color="black", lw=0.8)
        for side, part in outline.along():
            middle = 0.5 * float(outline.arc[part].min() + outline.arc[part].max())
            axis.text(
                0.004,
                middle,
                side,
                rotation=90,
                fontsize=8,
                va="center",
                transform=axis.get_yaxis_transform(),
            )
        axis.set(xlim=(t[0], t[-1]), ylim=(arc.max(), arc.min()), ylabel="arc length [m]")
        axis.set_title(name, fontsize=10, loc="left")
    for image, (label, (*_, extend)) in zip(images, drawn.items(), strict=True):
        figure.colorbar(
            image, ax=axes, label=label, pad=0.01, fraction=0.04, aspect=35, extend=extend
        )
    return save(figure, path, title)


def _reduced(run: History, parts: Any) -> tuple[Array, Array, Array]:
    """Return (t, pressure, gap) of the conditions ``parts``.

    Of a long run it takes the peaks of neighbouring steps.
    """
    rows = len(run["t"])
    pressure, gap = (np.reshape(run[name], (rows, -1))[:, parts] for name in ("pressure", "gap"))
    gap = np.where(np.reshape(run["active"], (rows, -1))[:, parts] > 0.0, 0.0, gap)
    t, pressure = thin_rows(run["t"], pressure)
    return t, pressure, thin_rows(run["t"], gap)[1]


def plot_envelope(
    runs: Mapping[str, History], outline: Outline, path: str | Path, *, title: str
) -> Path:
    """Draw along the arc what was largest.

    There are largest pressure and static pressure (dotted), largest opening, and share of time
    open.
    """
    keys = ("pressure", "gap", "active")
    rows = {
        name: [np.reshape(run[key], (len(run["t"]), -1)) for key in keys]
        for name, run in runs.items()
    }
    factor, unit = scale(max(float(pressure.max()) for pressure, *_ in rows.values()), "Pa")
    metres, length = unit_of(max(float(gap.max()) for _, gap, _ in rows.values()))
    figure, axes = canvas(3, 1, (9.0, 8.0), sharex=True)
    axes = axes[:, 0]
    for colour, (name, (pressure, gap, active)) in zip(RUNS, rows.items(), strict=False):
        shares = np.mean(active[1:] == 0.0, axis=0)
        for side, (_, one) in enumerate(outline.along()):
            label = name if side == 0 else None
            style: dict[str, Any] = {"color": colour, "lw": 1.1, "marker": ".", "ms": 4}
            axes[0].plot(outline.arc[one], factor * pressure.max(axis=0)[one], label=label, **style)
            axes[0].plot(outline.arc[one], factor * pressure[0, one], color=colour, lw=0.9, ls=":")
            axes[1].plot(outline.arc[one], gap.max(axis=0)[one] / metres, **style)
            axes[2].plot(outline.arc[one], shares[one], **style)
    axes[0].plot([], [], color="0.3", lw=0.9, ls=":", label="static, before the shaking")
    axes[0].legend(fontsize=8)
    axes[0].set_ylabel(f"largest pressure [{unit}]")
    axes[1].set_ylabel(f"largest opening [{length}]")
    axes[2].set(ylabel="share of time open [-]", ylim=(-0.03, 1.03), xlabel="arc length [m]")
    for axis in axes:
        for corner in outline.corners():
            axis.axvline(corner, color="black", lw=0.8)
    for name, one in outline.along():
        axes[0].text(
            float(np.mean(outline.arc[one])),
            1.01,
            name,
            ha="center",
            va="bottom",
            fontsize=9,
            transform=axes[0].get_xaxis_transform(),
        )
    return save(figure, path, title)
