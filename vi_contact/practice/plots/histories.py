"""Draw recorded histories and save them as PNG on rank 0.

matplotlib is imported late, and its state is left alone: neither the user's backend nor his
settings change.
"""

import os
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError
from ...core.files import write_output

History = Mapping[str, Array]
_LENGTH_UNITS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))
_PREFIXES = (
    (1e9, "G"),
    (1e6, "M"),
    (1e3, "k"),
    (1.0, ""),
    (1e-3, "m"),
    (1e-6, "µ"),
    (1e-9, "n"),
)
# How all pictures of this room look; matplotlib's own settings are left alone.
STYLE = {"axes.grid": True, "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False}
# Curves of the energy ledger: column, label, colour, line.
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


def canvas(
    rows: int, columns: int, size: tuple[float, float], lattice: bool = True, **more: Any
) -> tuple[Any, Any]:
    """Make (figure, its axes (rows, columns)).

    Args:
        rows: number of axes above each other.
        columns: number of axes beside each other.
        size: width and height of the figure [inches].
        lattice: whether grid lines are drawn behind the curves.
        **more: arguments of matplotlib's ``subplots``.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE | {"axes.grid": lattice}):
        figure = Figure(figsize=size, layout="constrained")
        return figure, figure.subplots(rows, columns, squeeze=False, **more)


def panels(rows: int, size: tuple[float, float], **more: Any) -> tuple[Any, Any]:
    """Make (figure, array of axes above each other with one time axis).

    ``more`` are arguments as of ``canvas``.
    """
    figure, axes = canvas(rows, 1, size, sharex=True, **more)
    axes[-1, 0].set_xlabel("time [s]")
    return figure, axes[:, 0]


def plain_numbers(axis: Any) -> None:
    """Mark 1, 2 and 5 of every decade of a logarithmic axis in plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def escape_dollars(text: str) -> str:
    """Return a text of a file or a user as it is to be drawn: a dollar begins no formula."""
    return text.replace("$", r"\$")


def length_unit(size: float) -> tuple[float, str]:
    """Return (metres per unit, name) that fits a length.

    A length of this size then has one to three digits before the point.
    """
    for metres, name in _LENGTH_UNITS:
        if size >= metres:
            return metres, name
    return _LENGTH_UNITS[-1] if size > 0.0 else _LENGTH_UNITS[0]


def scale_values(values: Array, unit: str) -> tuple[Array, str]:
    """Return the values over a power of 1000, and the unit with its prefix.

    The power is the one that fits their size; "-" has no prefix.
    """
    size = 0.0 if unit == "-" else float(np.nanmax(np.abs(values), initial=0.0))
    for factor, prefix in _PREFIXES:
        if size >= factor:
            return values / factor, prefix + unit
    return values, unit


def scale(size: float, unit: str) -> tuple[float, str]:
    """Return (factor, unit with its prefix) for values up to this size that are drawn together."""
    scaled, prefixed = scale_values(np.array([size]), unit)
    return float(scaled[0]) / size if size else 1.0, prefixed


def list_shaken_axes(history: History) -> list[str]:
    """Return the axes along which the ground was accelerated."""
    return [axis for axis in "xyz" if np.any(history.get(f"a_g_{axis}", 0.0))]


def save(figure: Any, path: str | Path, title: str | None = None) -> Path:
    """Save a picture.

    Args:
        figure: matplotlib's.
        path: its ending says the format; without one it is .png.
        title: stands above all panels.

    Returns:
        the path with its ending.

    Raises:
        InputError: matplotlib does not write this format.
        OSError: the file cannot be written; it names the file.
    """
    if title is not None:
        figure.suptitle(title)
    figure.align_ylabels()
    return write_picture(figure, path)


def write_picture(figure: Any, path: str | Path, **more: Any) -> Path:
    """Write a picture as a whole, in the format that its name ends in; OSError names the file."""
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".png")
    kind = path.suffix.lower()[1:]
    kinds = sorted(figure.canvas.get_supported_filetypes())
    if kind not in kinds:
        endings = ", .".join(kinds)
        raise InputError(
            f"'{path}' is no picture that matplotlib writes: give a name that ends in .{endings}"
        )
    write_output(path, render_image(figure, kind, **more))
    return path


def render_image(figure: Any, kind: str = "png", **more: Any) -> bytes:
    """Return a picture as the bytes of a file of this kind."""
    image = BytesIO()
    figure.savefig(image, format=kind, dpi=130, **more)
    return image.getvalue()


def require_matplotlib() -> None:
    """Raise InputError when matplotlib is there, but its settings keep it from being imported."""
    try:
        import matplotlib  # noqa: F401
    except ValueError as error:
        # of MPLBACKEND, which it checks although nothing here needs a backend
        reason = " ".join(str(error).split())[:120]
        place = (
            "the environment variable MPLBACKEND"
            if "MPLBACKEND" in os.environ
            else "the settings of matplotlib"
        )
        raise InputError(f"matplotlib cannot be imported ({reason}): correct {place}") from error


def cell_edges(centres: Array) -> Array:
    """Return the borders of cells around their centres.

    A single cell is as wide as its distance from zero, or one.
    """
    if len(centres) == 1:
        half = 0.5 * (abs(float(centres[0])) or 1.0)
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[:-1] + centres[1:])
    return np.concatenate(
        [[2.0 * centres[0] - middle[0]], middle, [2.0 * centres[-1] - middle[-1]]]
    )
