"""Write sections about a run as one HTML file.

It loads nothing and runs no script but its own two.

Texts of files are escaped by the template's engine, those in curves once more, for Plotly reads
some HTML in them.
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
from .histories import STYLE, require_matplotlib
from .maps import Drawing
from .sections import Section

FOLDER = Path(__file__).parent / "web"
POINTS = 160_000  # of all curves together: 20 bytes each
FEWEST, MOST = 400, 12_000  # of a curve
SHOWN = 4  # curves of a chart; the others when their names are clicked
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
    """Write a page.

    It has the title, (name, value) of facts, the sections with curves to zoom and tables to sort,
    and a foot.

    Histories are thinned; largest and smallest values stay. InputError without jinja2 or plotly.
    """
    if not can_write():
        raise InputError(MISSING)
    from jinja2 import Environment, FileSystemLoader
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    engine = Environment(
        loader=FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    charts = [chart for section in sections for chart in section.charts]
    most = int(np.clip(POINTS / max(sum(len(one.lines) for one in charts), 1), FEWEST, MOST))
    thin = any(len(line.x) > most for one in charts for line in one.lines)
    scripts = [
        get_plotlyjs().replace("\r\n", "\n"),
        (FOLDER / "report.js").read_text(encoding="utf-8"),
    ]
    shown, count = [], 0
    for one in sections:
        images = [*map(_drawn, one.drawings), *map(read_bytes, one.pictures)]
        shown.append(
            {
                "own": one,
                "charts": range(count, count := count + len(one.charts)),
                "pictures": [
                    f"data:image/png;base64,{b64encode(image).decode()}" for image in images
                ],
            }
        )
    text = engine.get_template("report.html").render(
        title=title,
        facts=facts,
        sections=shown,
        foot=foot,
        charts=[_chart(one, most) for one in charts],
        style=Markup((FOLDER / "report.css").read_text(encoding="utf-8")),
        scripts=[
            {
                "text": Markup(script),
                "hash": f"sha256-{b64encode(sha256(script.encode()).digest()).decode()}",
            }
            for script in scripts
        ],
        thinned=(
            f"Curves have at most {most} points, in which extremes are kept; history.csv has all."
        )
        if thin
        else "",
    )
    try:
        write_output(path, text.encode())
    except OSError as error:
        raise ViContactError(describe_os_error(error)) from error
    return path


def extremes(values: Array, most: int) -> Indices:
    """Return at most ``most`` rows (k,) in order.

    They are the smallest and the largest of equal parts; of few rows they are all.
    """
    if len(values) <= most:
        return np.arange(len(values))
    starts = np.linspace(0, len(values), most // 2, endpoint=False).astype(int)
    parts = np.split(np.where(np.isnan(values), np.nanmean(values), values), starts[1:])
    rows = [
        start + np.array([part.argmin(), part.argmax()])
        for start, part in zip(starts, parts, strict=True)
    ]
    return np.unique(np.concatenate(rows))


def _chart(chart: Chart, most: int) -> Mapping[str, Any]:
    """Return what the script draws."""
    lines = []
    for line in chart.lines:
        rows = extremes(line.y, most)
        lines.append(
            {
                "name": line.name,
                "x": _numbers(line.x[rows], 7),
                "y": _numbers(line.y[rows], 5),
                "pale": line.pale,
                "dash": line.style == ":",
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
        "shown": 10 if chart.title == "energy" else SHOWN,
    }


def _numbers(values: Iterable[float], digits: int) -> list[float | None]:
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values]


def _drawn(drawing: Drawing) -> bytes:
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
