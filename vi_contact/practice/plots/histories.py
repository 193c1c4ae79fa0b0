"""Draw recorded histories and save them as PNG on rank 0.

matplotlib is imported late, and its state is left alone: neither the user's backend nor his
settings change.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
# Curves of the energy ledger: column, label, colour, line. Each differs by its dashes too.
LEDGER = (
    ("work_input", "input work", "#1a1a1a", "-"),
    ("energy_kinetic", "kinetic", "#2b6cb0", "--"),
    ("energy_strain", "strain", "#c8401e", (0, (7, 1))),
    ("loss_damping", "damping", "#6a3d9a", "-."),
    ("loss_contact", "contact work", "#e69f00", (0, (1, 1))),
    ("loss_friction", "friction", "#17a2b8", (0, (4, 1, 1, 1, 1, 1))),
    ("loss_impact", "impact loss", "#2a7d2a", (0, (2, 2))),
    ("loss_algorithmic", "algorithmic", "#8c6d5f", ":"),
    ("loss_plastic", "yielding", "#d1495b", (0, (5, 2, 1, 2))),
)


@dataclass(frozen=True)
class Look:
    """Hold how a curve is told from others in colour and in grey.

    Attributes:
        colour: of the line.
        dash: "solid", "dashed", "dashdot" or "dotted".
        marker: at some of its points, as of matplotlib; none when empty.
    """

    colour: str
    dash: str
    marker: str


# Of the curves of an axis in their order: dash and marker together are another one's nowhere.
LOOKS = (
    Look("#1a1a1a", "solid", ""),
    Look("#c8401e", "dashed", ""),
    Look("#2b6cb0", "solid", "o"),
    Look("#e69f00", "dashdot", ""),
    Look("#6a3d9a", "solid", "s"),
    Look("#17a2b8", "dashed", "^"),
    Look("#8c6d5f", "solid", "x"),
    Look("#2a7d2a", "dashdot", "D"),
    Look("#d65fb0", "dotted", "v"),
    Look("#7f7f7f", "dotted", "+"),
)
MARKERS = 8  # of a curve: more would hide it
# Of a legend, over the size of its letters: mean width of a letter, of the line before a text with
# what is around both, and height of a row.
LETTER = 0.62
HANDLE = 4.6
ROW = 1.5


def choose_look(place: int) -> Look:
    """Return the look of the curve number ``place`` of an axis; looks recur after ten."""
    return LOOKS[place % len(LOOKS)]


def draw_curve(axis: Any, x: Array, y: Array, place: int, **more: Any) -> Any:
    """Draw the curve number ``place`` of an axis with its look; return matplotlib's line.

    ``more`` are arguments of matplotlib's ``plot``, which come before the look.
    """
    look = choose_look(place)
    # Markers of neighbours are not at the same points.
    every = max(len(x) // MARKERS, 1)
    first = (every * place // len(LOOKS)) % every
    drawn: dict[str, Any] = {"color": look.colour, "ls": look.dash, "lw": 0.9}
    if look.marker:
        drawn |= {"marker": look.marker, "markevery": (first, every), "ms": 3.5, "mew": 0.8}
        drawn |= {"mfc": "white"}
    (line,) = axis.plot(x, y, **(drawn | more))
    return line


def put_legend_above(axis: Any, size: float = 7.0) -> float:
    """Put the legend of an axis between its title and its curves, in as many rows as it needs.

    Without a layout engine the axis is made lower by as much; else the engine makes room.

    Args:
        axis: matplotlib's.
        size: of the letters [points].

    Returns:
        the height of the legend [points], above which a title has to stand; zero where nothing has
        a name.
    """
    handles, labels = axis.get_legend_handles_labels()
    if not labels:
        return 0.0
    figure = axis.figure
    points = 72.0 / figure.dpi
    box = axis.get_window_extent()
    width = max(box.width * points, 20.0 * size)

    labels, columns = arrange_names(labels, width, size)
    rows = -(-len(labels) // columns)  # rounded up
    height = ROW * size * rows + 2.0
    axis.legend(
        handles,
        labels,
        fontsize=size,
        ncol=columns,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        frameon=False,
        handlelength=2.8,
        handletextpad=0.5,
        columnspacing=1.0,
        labelspacing=0.25,
        borderpad=0.1,
        borderaxespad=0.2,
    )
    if figure.get_layout_engine() is None:
        place = axis.get_position()
        lower = height / (points * figure.bbox.height)
        axis.set_position([place.x0, place.y0, place.width, max(place.height - lower, 0.01)])
    return height


def arrange_names(names: Sequence[str], width: float, size: float) -> tuple[list[str], int]:
    """Return the names of a legend, cut where one is wider than its room, and its columns.

    Args:
        names: at least one.
        width: of the room [points].
        size: of the letters [points].
    """
    letters = max(int(width / (LETTER * size) - HANDLE / LETTER), 2)
    shown = [cut(name, letters) for name in names]
    widest = size * (LETTER * max(map(len, shown)) + HANDLE)
    return shown, max(1, min(len(shown), int(width / widest)))


def put_legend_on_top(figure: Any, handles: Sequence[Any], names: Sequence[str]) -> None:
    """Put a legend above all axes of a figure with a layout engine, as wide as the figure at most.

    Args:
        figure: matplotlib's, without a title.
        handles: of the curves.
        names: of the curves.
    """
    if not names:
        return
    size = 8.0
    shown, columns = arrange_names(names, 72.0 * float(figure.get_figwidth()) - 20.0, size)
    rows = -(-len(shown) // columns)  # rounded up
    figure.set_figheight(figure.get_figheight() + (rows - 1) * ROW * size / 72.0)
    # keeps room for the legend, which the layout of matplotlib 3.6 does not
    figure.suptitle("\n".join([" "] * (rows + 1)), fontsize=size, linespacing=ROW)
    figure.legend(
        handles,
        shown,
        loc="upper center",
        ncol=columns,
        fontsize=size,
        frameon=False,
        handlelength=2.8,
        columnspacing=1.0,
    )


def fit_title(axis: Any, title: str) -> str:
    """Return a title cut to the width of its axis, or it would run over its neighbour's."""
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties

    size = FontProperties(size=rcParams["axes.titlesize"]).get_size_in_points()
    width = axis.get_window_extent().width * 72.0 / axis.figure.dpi
    return cut(title, int(width / (LETTER * size)))


def cut(text: str, letters: int) -> str:
    """Return a text of at most so many letters, the last of which tells that it was cut."""
    return text if len(text) <= letters else text[: letters - 1] + "…"


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
    # One row has nothing to align, and the label of an axis of equal scales would be cut off.
    # Colour bars are axes without a place in the grid, before matplotlib 3.7 without the question.
    placed = [axes for axes in figure.axes if hasattr(axes, "get_subplotspec")]
    places = [axes.get_subplotspec() for axes in placed]
    if len({place.rowspan.start for place in places if place is not None}) > 1:
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
