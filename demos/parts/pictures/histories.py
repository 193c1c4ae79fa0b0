"""Draw recorded histories a picture each.

They are motion, displacements, energies, certificates and the pressure on a line.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.surfaces import ContactSurface
from vi_contact.practice.plots.histories import (
    LEDGER,
    History,
    escape_dollars,
    length_unit,
    list_shaken_axes,
    panels,
    save,
    scale,
)
from vi_contact.practice.plots.maps import arc_position, draw_cells

SOIL = "_soil"  # after the label of a point: that of the soil which touches it


def draw_histories(
    history: History,
    contact: ContactSurface | None,
    out: Path,
    *,
    title: str,
    unilateral: Sequence[str] | None = None,
    reference: History | None = None,
) -> list[Path]:
    """Draw the pictures of recorded histories, each where there is something to draw.

    ``reference`` is in grey.
    """
    drawn = []
    if list_shaken_axes(history):
        drawn.append(plot_excitation(history, out / "excitation.png"))
    for axis in "xyz":
        labels = [
            name.removeprefix(f"u_{axis}_")
            for name in history
            if name.startswith(f"u_{axis}_") and not name.endswith(SOIL)
        ]
        if any(np.any(history[f"u_{axis}_{label}"]) for label in labels):
            drawn.append(
                plot_points(
                    history,
                    labels,
                    out / f"displacements_{axis}.png",
                    title=escape_dollars(title),
                    component=axis,
                    unilateral=unilateral if axis == "x" else None,
                    reference=reference,
                )
            )
    if "energy_defect" in history:
        drawn.append(plot_energy(history, out / "energy.png"))
    drawn.append(plot_certificate(history, out / "certificate.png"))
    if (
        contact is not None
        and "pressure" in history
        and contact.points.shape[0]
        and contact.points.shape[1] == 2
    ):
        position, label = arc_position(contact.points, contact.normals)
        drawn.append(
            plot_contact(history, out / "contact.png", position=position, axis_label=label)
        )
    return drawn


def plot_points(
    history: History,
    labels: Sequence[str],
    path: str | Path,
    *,
    title: str,
    component: str = "x",
    unilateral: Sequence[str] | None = (),
    reference: History | None = None,
) -> Path:
    """Draw the displacement against time.

    There is a panel for each point, as in Figs. 4 and 5 of the boundary method.

    unilateral: labels of contact points on a support at rest, drawn with their bound at zero; None
    for points of bodies that touch each other. reference: another run, drawn in grey.
    """
    names = [f"u_{component}_{label}" for label in labels]
    size = max(float(np.max(np.abs(history[name]), initial=0.0)) for name in names)
    metres, unit = length_unit(size)
    figure, axes = panels(len(names), (9.0, 1.5 * len(names) + 1.2), sharey=True)
    for axis, name, label in zip(axes, names, labels, strict=True):
        if reference is not None:
            axis.plot(
                reference["t"], reference[name] / metres, color="0.65", lw=0.8, label="no contact"
            )
        axis.plot(history["t"], history[name] / metres, color="black", lw=0.9, label="with contact")
        kind = "" if unilateral is None else " (free point)"
        if unilateral is not None and label in unilateral:
            kind = " (contact point)"
            axis.axhline(0.0, color="tab:red", lw=0.8, ls="--")
        axis.set_ylabel(f"$u_{component}$ [{unit}]")
        axis.set_title(f"point {escape_dollars(label)}{kind}", fontsize=9, loc="left")
    if reference is not None:
        axes[0].legend(
            fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False
        )
    return save(figure, path, title)


def plot_excitation(
    history: History, path: str | Path, *, title: str = "Ground acceleration"
) -> Path:
    """Draw the ground acceleration components that the run used (Fig. 3)."""
    figure, (axis,) = panels(1, (9.0, 3.0))
    for component in list_shaken_axes(history):
        axis.plot(history["t"], history[f"a_g_{component}"], lw=0.9, label=f"$a_{{g,{component}}}$")
    if axis.lines:
        axis.legend()
    axis.set(ylabel="acceleration [m/s²]", title=title)
    return save(figure, path)


def plot_energy(history: History, path: str | Path, *, title: str = "Energy ledger") -> Path:
    """Draw the ledger's terms, and its defect relative to the largest of them."""
    figure, (top, bottom) = panels(2, (9.0, 6.0), height_ratios=(3, 1))
    size, unit = draw_ledger(top, history)
    top.set(ylabel=f"energy, cumulative work [{unit}]", title=title)
    log_axis(bottom, history["t"], np.abs(history["energy_defect"]) / (size or 1.0))
    bottom.axhline(1e-10, color="tab:red", ls="--", lw=0.8)
    bottom.set(ylabel="relative defect [-]")
    return save(figure, path)


def plot_certificate(history: History, path: str | Path, *, tolerance: float = 1e-9) -> Path:
    """Draw the certificate of every step and the iterations of the solver."""
    figure, (top, bottom) = panels(2, (9.0, 5.0))
    t = history["t"][1:]
    log_axis(top, t, history["certificate"][1:])
    top.axhline(tolerance, color="tab:red", ls="--", lw=0.8, label=f"tolerance {tolerance:g}")
    top.legend(fontsize=8)
    top.set(ylabel="worst residual [-]", title="Certificate of every step")
    bottom.step(t, history["iterations"][1:], where="mid", lw=0.8, color="black")
    bottom.yaxis.get_major_locator().set_params(integer=True)
    bottom.set(ylabel="iterations [-]")
    return save(figure, path)


def plot_contact(
    history: History, path: str | Path, *, position: Array, axis_label: str = "position [m]"
) -> Path:
    """Draw a map of contact pressure over position and time, and the uplift ratio.

    ``position``: (m,) of the points.

    Open points are white; held points that pull are blue.
    """
    figure, (top, bottom) = panels(2, (9.0, 6.0), height_ratios=(3, 1))
    pressure = np.reshape(history["pressure"], (len(history["t"]), -1))
    image, unit, pulling = draw_cells(top, history["t"], position, pressure, "Pa", "magma_r")
    meaning = "negative: pull" if pulling else "white: open"
    figure.colorbar(image, ax=top, label=f"contact pressure [{unit}] ({meaning})")
    top.set(ylabel=axis_label, title="Contact pressure")
    bottom.plot(history["t"], history["contact_uplift"], color="black", lw=0.9)
    bottom.set(ylabel="uplift ratio [-]", ylim=(-0.05, 1.05))
    return save(figure, path)


def draw_ledger(axis: Any, history: History) -> tuple[float, str]:
    """Draw the ledger's terms; return the largest [J], and the unit of the axis."""
    present = [entry for entry in LEDGER if entry[0] in history and np.any(history[entry[0]])]
    size = max((float(np.max(np.abs(history[name]))) for name, *_ in present), default=0.0)
    factor, unit = scale(size, "J")
    for name, label, colour, style in present:
        axis.plot(history["t"], history[name] * factor, color=colour, ls=style, lw=1.0, label=label)
    if present:
        axis.legend(fontsize=8, ncol=2)
    return size, unit


def log_axis(axis: Any, t: Array, values: Array) -> None:
    """Draw semilogarithmic points; exact zeros are drawn at the bottom, at 1e-18."""
    axis.semilogy(t, np.maximum(values, 1e-18), ".", ms=2, color="black")
