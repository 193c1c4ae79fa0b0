"""Draw recorded histories and save them as PNG on rank 0.

matplotlib is imported late, and its state is left alone: neither the user's backend nor his settings change.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.algebra import Array

History = Mapping[str, Array]
_UNITS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))
STYLE = {"axes.grid": True, "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False}


def canvas(rows: int, columns: int, size: tuple[float, float], lattice: bool = True, **more: Any) -> tuple[Any, Any]:
    """Make (figure, its axes (rows, columns)); ``lattice``: whether grid lines are drawn behind the curves."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE | {"axes.grid": lattice}):
        figure = Figure(figsize=size, layout="constrained")
        return figure, figure.subplots(rows, columns, squeeze=False, **more)


def panels(rows: int, size: tuple[float, float], **more: Any) -> tuple[Any, Any]:
    """Make (figure, array of axes above each other with one time axis)."""
    figure, axes = canvas(rows, 1, size, sharex=True, **more)
    axes[-1, 0].set_xlabel("time [s]")
    return figure, axes[:, 0]


def plain_numbers(axis: Any) -> None:
    """Mark 1, 2 and 5 of every decade of a logarithmic axis in plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def plain(text: str) -> str:
    """Return a text of a file or a user as it is to be drawn: a dollar begins no formula."""
    return text.replace("$", r"\$")


def length_unit(size: float) -> tuple[float, str]:
    """Return (metres per unit, name) so that a length of this size has one to three digits before the point."""
    for metres, name in _UNITS:
        if size >= metres:
            return metres, name
    return _UNITS[-1] if size > 0.0 else _UNITS[0]


def scaled(values: Array, unit: str) -> tuple[Array, str]:
    """Return the values over the power of 1000 that fits their size, and the unit with its prefix; "-" has none."""
    size = 0.0 if unit == "-" else float(np.nanmax(np.abs(values), initial=0.0))
    for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")):
        if size >= factor:
            return values / factor, prefix + unit
    return values, unit


def scale(size: float, unit: str) -> tuple[float, str]:
    """Return (factor, unit with its prefix) for values up to this size that are drawn together."""
    shown, prefixed = scaled(np.array([size]), unit)
    return float(shown[0]) / size if size else 1.0, prefixed


def shaken(history: History) -> list[str]:
    """Return the axes along which the ground was accelerated."""
    return [axis for axis in "xyz" if np.any(history.get(f"a_g_{axis}", 0.0))]


def save(figure: Any, path: str | Path, title: str | None = None) -> Path:
    """Save the picture, with a title above all panels if there is one."""
    if title is not None:
        figure.suptitle(title)
    figure.align_ylabels()
    figure.savefig(path, dpi=130)
    return Path(path)


def plot_points(
    history: History, labels: Sequence[str], path: str | Path, *, title: str, component: str = "x",
    unilateral: Sequence[str] | None = (), reference: History | None = None,
) -> Path:
    """Draw the displacement against time, a panel for each point, as Figs. 4 and 5 of the boundary method.

    unilateral: labels of contact points on a support at rest, drawn with their bound at zero; None for points of bodies
    that touch each other. reference: another run, drawn in grey.
    """
    names = [f"u_{component}_{label}" for label in labels]
    size = max(float(np.max(np.abs(history[name]), initial=0.0)) for name in names)
    metres, unit = length_unit(size)
    figure, axes = panels(len(names), (9.0, 1.5 * len(names) + 1.2), sharey=True)
    for axis, name, label in zip(axes, names, labels, strict=True):
        if reference is not None:
            axis.plot(reference["t"], reference[name] / metres, color="0.65", lw=0.8, label="no contact")
        axis.plot(history["t"], history[name] / metres, color="black", lw=0.9, label="with contact")
        kind = "" if unilateral is None else " (free point)"
        if unilateral is not None and label in unilateral:
            kind = " (contact point)"
            axis.axhline(0.0, color="tab:red", lw=0.8, ls="--")
        axis.set_ylabel(f"$u_{component}$ [{unit}]")
        axis.set_title(f"point {plain(label)}{kind}", fontsize=9, loc="left")
    if reference is not None:
        axes[0].legend(fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return save(figure, path, title)


def plot_excitation(history: History, path: str | Path, *, title: str = "Ground acceleration") -> Path:
    """Draw the ground acceleration components that the run used (Fig. 3)."""
    figure, (axis,) = panels(1, (9.0, 3.0))
    for component in shaken(history):
        axis.plot(history["t"], history[f"a_g_{component}"], lw=0.9, label=f"$a_{{g,{component}}}$")
    if axis.lines:
        axis.legend()
    axis.set(ylabel="acceleration [m/s²]", title=title)
    return save(figure, path)


LEDGER = (
    ("work_input", "input work", "black", "-"),
    ("energy_kinetic", "kinetic", "tab:blue", "-"),
    ("energy_strain", "strain", "tab:orange", "-"),
    ("loss_damping", "damping", "tab:purple", "-"),
    ("loss_contact", "contact work", "tab:red", "-"),
    ("loss_friction", "friction", "tab:cyan", "-"),
    ("loss_impact", "impact loss", "tab:green", "-"),
    ("loss_algorithmic", "algorithmic", "tab:brown", ":"),
)


def plot_energy(history: History, path: str | Path, *, title: str = "Energy ledger") -> Path:
    """Draw the ledger's terms, and its defect relative to the largest of them."""
    figure, (top, bottom) = panels(2, (9.0, 6.0), height_ratios=(3, 1))
    size, unit = draw_ledger(top, history)
    top.set(ylabel=f"energy, cumulative work [{unit}]", title=title)
    log_axis(bottom, history["t"], np.abs(history["energy_defect"]) / (size or 1.0))
    bottom.axhline(1e-10, color="tab:red", ls="--", lw=0.8)
    bottom.set(ylabel="relative defect [-]")
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


def log_axis(axis: Any, t: Array, values: Array) -> None:
    """Draw semilogarithmic points; exact zeros are drawn at the bottom, at 1e-18."""
    axis.semilogy(t, np.maximum(values, 1e-18), ".", ms=2, color="black")


def cell_edges(centres: Array) -> Array:
    """Return the borders of cells around their centres; a single cell is as wide as its distance from zero, or one."""
    if len(centres) == 1:
        half = 0.5 * (abs(float(centres[0])) or 1.0)
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[:-1] + centres[1:])
    return np.concatenate([[2.0 * centres[0] - middle[0]], middle, [2.0 * centres[-1] - middle[-1]]])
