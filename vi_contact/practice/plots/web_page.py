"""Write sections about a run as one HTML file.

The page loads nothing and runs no script but its own two.

The template's engine escapes texts of files; ``report.js`` escapes those in curves once more, for
Plotly reads some HTML in them.
"""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.errors import InputError, ViContactError
from ...core.files import describe_os_error, write_output
from ...core.own_files import read_bytes
from .charts import Chart
from .histories import STYLE, choose_look, require_matplotlib
from .maps import Drawing
from .sections import Section

FOLDER = Path(__file__).parent / "web"
POINTS = 160_000  # of all curves together: 20 bytes each
FEWEST = 400  # of a curve
MOST = 12_000  # of a curve
SHOWN = 4  # curves of a chart; the others when their names are clicked
ENERGIES = 10  # likewise of the chart of energies: all of them
# Dashes and markers of ``Look`` -> what Plotly calls them.
DASHES = {"solid": "solid", "dashed": "dash", "dashdot": "dashdot", "dotted": "dot"}
SYMBOLS = {
    "": "",
    "o": "circle-open",
    "s": "square-open",
    "^": "triangle-up-open",
    "x": "x-thin-open",
    "D": "diamond-open",
    "v": "triangle-down-open",
    "+": "cross-thin-open",
}
MISSING = (
    'a report for browsers needs jinja2 and plotly: give pip install "vi-contact[report]", or bash '
    "install/report.sh in a clone, or name the report .pdf"
)


def can_write() -> bool:
    """Return whether the packages are here that web pages need."""
    from importlib.util import find_spec

    return all(find_spec(name) is not None for name in ("jinja2", "plotly"))


def write_web_page(
    path: Path, title: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section], foot: str
) -> Path:
    """Write sections as a page for browsers, with curves to zoom and tables to sort.

    Histories are thinned; largest and smallest values stay.

    Args:
        path: the file.
        title: stands first.
        facts: (name, value) of what the report says next.
        sections: the rest.
        foot: text at the foot of the page.

    Returns:
        the path.

    Raises:
        InputError: jinja2 or plotly is not installed.
        ViContactError: the file cannot be written.
    """
    if not can_write():
        raise InputError(MISSING)
    from jinja2 import Environment, FileSystemLoader
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    engine = Environment(
        loader=FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )

    # All curves share the points of a page.
    charts = [chart for section in sections for chart in section.charts]
    curves = [line for chart in charts for line in chart.lines]
    most = int(np.clip(POINTS / max(len(curves), 1), FEWEST, MOST))
    note = ""
    if any(len(line.x) > most for line in curves):
        note = (
            f"Curves have at most {most} points, in which extremes are kept; history.csv has all."
        )

    # The page runs these scripts alone: it names them by their hashes.
    plotly = get_plotlyjs().replace("\r\n", "\n")
    own_script = (FOLDER / "report.js").read_text(encoding="utf-8")
    scripts = [
        {"text": Markup(script), "hash": _hash_script(script)} for script in (plotly, own_script)
    ]
    text = engine.get_template("report.html").render(
        title=title,
        facts=facts,
        sections=_encode_sections(sections),
        foot=foot,
        charts=[_encode_chart(chart, most) for chart in charts],
        style=Markup((FOLDER / "report.css").read_text(encoding="utf-8")),
        scripts=scripts,
        thinned=note,
    )
    try:
        write_output(path, text.encode())
    except OSError as error:
        raise ViContactError(describe_os_error(error)) from error
    return path


def _encode_sections(sections: Sequence[Section]) -> list[dict[str, Any]]:
    """Return what the template fills in: sections, numbers of their charts, and pictures."""
    encoded = []
    first = 0  # number of the first chart of the section
    for section in sections:
        images = [*map(_draw_png, section.drawings), *map(read_bytes, section.pictures)]
        after = first + len(section.charts)
        encoded.append(
            {
                "own": section,
                "charts": range(first, after),
                "pictures": [
                    f"data:image/png;base64,{b64encode(image).decode()}" for image in images
                ],
            }
        )
        first = after
    return encoded


def _hash_script(script: str) -> str:
    """Return the hash of a script as a policy of security has it."""
    return f"sha256-{b64encode(sha256(script.encode()).digest()).decode()}"


def find_extremes(values: Array, most: int) -> Indices:
    """Find at most ``most`` rows (k,) in order.

    They are the smallest and the largest of equal parts; of few rows they are all.
    """
    if len(values) <= most:
        return np.arange(len(values))
    starts = np.linspace(0, len(values), most // 2, endpoint=False).astype(int)
    numbers = np.where(np.isnan(values), np.nanmean(values), values)
    parts = np.split(numbers, starts[1:])
    rows = [
        start + np.array([part.argmin(), part.argmax()])
        for start, part in zip(starts, parts, strict=True)
    ]
    return np.unique(np.concatenate(rows))


def _encode_chart(chart: Chart, most: int) -> Mapping[str, Any]:
    """Return what the script draws, with at most so many points of each line."""
    lines = []
    places = chart.places
    for line in chart.lines:
        rows = find_extremes(line.y, most)
        look = choose_look(places[line.name])
        lines.append(
            {
                "name": line.name,
                "x": _round_numbers(line.x[rows], 7),
                "y": _round_numbers(line.y[rows], 5),
                "pale": line.pale,
                "colour": look.colour,
                "dash": DASHES[look.dash],
                "symbol": SYMBOLS[look.marker],
                "dots": line.style == ".",
            }
        )
    return {
        "title": chart.title,
        "x": chart.x,
        "y": chart.y,
        "log_x": chart.log_x,
        "log_y": chart.log_y,
        "bound": chart.bound,
        "lines": lines,
        "shown": ENERGIES if chart.title == "energy" else SHOWN,
    }


def _round_numbers(values: Iterable[float], digits: int) -> list[float | None]:
    """Return numbers with so many digits; None for what is none, as JSON has it."""
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values]


def _draw_png(drawing: Drawing) -> bytes:
    """Return the PNG of a drawing."""
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    image = BytesIO()
    with matplotlib.rc_context(STYLE | {"text.parse_math": False}):
        figure = Figure(figsize=(9.0, 4.2), layout="constrained")
        drawing(figure.add_subplot())
        figure.savefig(image, format="png", dpi=110, bbox_inches="tight")
    return image.getvalue()
