"""The report as one HTML file: nothing is loaded, every text is escaped, extremes stay, it is
small; in a browser curves are drawn, tables are sorted, and no foreign scripts run."""

from __future__ import annotations

import json
import re
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_packages import browser, report_packages
from written_runs import write_run

from vi_contact.practice.plots.sections import sections_of
from vi_contact.practice.plots.web_page import find_extremes, write_web_page
from vi_contact.practice.studies.report import report
from vi_contact.run.files.reading import RunFolder

pytestmark = pytest.mark.serial
report_packages()
EVIL = "<script>document.documentElement.dataset.evil = 1</script>"
BREAK = (
    '</script><img src=x onerror="document.documentElement.dataset.evil = 2">\'"&amp;{{ 7 * 7 '
    "}} Ünï"
)


def charts(page: str) -> list[dict[str, Any]]:
    (found,) = re.findall(
        r'<script type="application/json" id="charts">(.*?)</script>', page, re.DOTALL
    )
    return json.loads(found)


def without_scripts(page: str) -> str:
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def hostile(folder: Path) -> Path:
    """A run whose every text is an attack: title, names of columns, meanings, units, facts, groups,
    materials."""
    wave = np.sin(0.1 * np.arange(400.0))
    columns = {
        f"u_x_{EVIL}": (f"m{BREAK}", BREAK, wave),
        f"u_x_{BREAK}": (f"m{BREAK}", EVIL, 2.0 * wave),
        "a_x_top": ("m/s2", BREAK, wave),
        f"N_{EVIL}": ("N", EVIL, 1.0 + wave),
        "a_g_x": ("m/s2", EVIL, wave),
    }
    model = {
        "title": EVIL,
        "dimension": 2,
        "warnings": [EVIL],
        "bodies": [{EVIL: BREAK, "material": {BREAK: EVIL}}],
        "supports": [{"kind": EVIL, "groups": [EVIL, BREAK], "components": []}],
        "contact": [{"name": BREAK, "places": [[0.0, 0.0]]}],
        "outline": [{"group": EVIL, "lines": [[0.0, 0.0, 1.0, 1.0]]}],
    }
    case = f"title = {json.dumps(EVIL + BREAK)}\n"
    return write_run(
        folder, columns, dt=0.01, case=case, model=model, facts={"scheme": EVIL, "solver": BREAK}
    )


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = hostile(tmp_path_factory.mktemp("page") / "run")
    return next(one for one in report(folder)[1] if one.suffix == ".html")


def test_every_text_is_escaped_and_nothing_is_loaded(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    # data, plotly's, the page's own: plotly's own text may speak of scripts
    assert (
        text.count("<script") - text.count("<script src")
        == 3 + re.sub(r"(?s)^.*id=\"charts\">", "", text).count("<script") - 2
    )
    visible = without_scripts(text)
    assert "<script" not in visible and 'onerror="' not in visible
    assert not re.search(r"<img src=(?!\"data:image/png)", visible)
    assert (
        EVIL in unescape(visible)
        and BREAK in unescape(visible)
        and "{{ 7 * 7 }}" in visible
        and "49" not in (re.findall(r"<title>(.*)</title>", visible)[0])
    )
    for name, value in re.findall(r" (src|href|action|data|poster|srcset)=\"([^\"]*)\"", visible):
        assert value.startswith(("data:image/png;base64,", "#s")), (name, value)
    assert not re.search(r"<(link|iframe|object|embed|form|base)\b|@import|url\(", visible)
    policy = re.findall(r"Content-Security-Policy\" content=\"([^\"]*)\"", visible)[0]
    assert policy.startswith("default-src 'none'; ") and "unsafe-eval" not in policy
    assert re.search(r"script-src ('sha256-[^']*' ?){2};", policy)
    names = {line["name"] for chart in charts(text) for line in chart["lines"]}
    assert f"u_x_{EVIL}" in names and f"u_x_{BREAK}" in names  # the script escapes them


def test_thirty_seconds_are_small_and_extremes_stay(tmp_path: Path) -> None:
    """30 s at 1 ms with 60 columns: below 10 MB, and every curve has the largest and smallest value
    of its column, in millimetres."""
    random, count = np.random.default_rng(1), 30_001
    columns = {
        f"u_{axis}_p{k}": ("m", "displacement", random.standard_normal(count))
        for axis in "xy"
        for k in range(20)
    }
    columns |= {
        f"a_x_p{k}": ("m/s2", "acceleration", random.standard_normal(count)) for k in range(20)
    }
    columns |= {
        "a_g_x": ("m/s2", "ground", random.standard_normal(count)),
        "t": ("s", "", 1e-3 * np.arange(count)),
    }
    history = {name: values for name, (*_, values) in columns.items()} | {
        "certificate": np.full(count, 1e-14)
    }
    run = RunFolder(tmp_path, history, {name: one[:2] for name, one in columns.items()}, {}, None)
    path = write_web_page(tmp_path / "page.html", "Thirty seconds", [], sections_of(run, {}), "")
    assert 4e6 < path.stat().st_size < 10e6
    shown = {
        line["name"]: line
        for chart in charts(path.read_text(encoding="utf-8"))
        for line in chart["lines"]
        if chart["title"].startswith("displacement along")
    }
    assert len(shown) == 40
    for name, line in shown.items():
        assert len(line["x"]) <= 12_000
        for end in (np.min, np.max):
            assert end(line["y"]) == pytest.approx(1e3 * end(history[name]), rel=1e-4)
        assert np.all(np.diff(line["x"]) > 0.0)


def test_extremes() -> None:
    values = np.sin(np.arange(1000.0))
    values[[137, 561]] = 5.0, -7.0
    values[300:320] = np.nan
    rows = find_extremes(values, 50)
    assert len(rows) <= 50 and {137, 561} <= set(rows) and np.all(np.diff(rows) > 0)
    assert np.array_equal(find_extremes(values, 1000), np.arange(1000))


def test_checks_and_doubtful_peaks(page: Path) -> None:
    """Rows of raw accelerations are marked; without --refine the page says that nobody looked at
    discretisation."""
    text = without_scripts(page.read_text(encoding="utf-8"))
    rows = re.findall(r"<tr class=\"doubtful\">\s*<td>([^<]*)</td>", text)
    assert rows == ["a_x_top"]
    assert "The discretisation error was not measured" in text


# In headless Chromium
# --------------------------------------------------------------------------------------------------


def opened(page: Path) -> str:
    """The document after its scripts have run."""
    chromium = browser()
    done = subprocess.run(
        [
            chromium,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--virtual-time-budget=20000",
            f"--user-data-dir={page.parent / 'profile'}",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def test_curves_are_drawn_and_no_text_of_a_file_runs(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    injected = page.with_name("injected.html")
    injected.write_text(
        text.replace("</body>", "<script>document.documentElement.dataset.evil = 3</script></body>")
    )
    document = opened(injected)
    (root,) = re.findall(r"<html[^>]*>", document)
    assert "data-evil" not in root
    drawn = int(re.findall(r'data-drawn="(\d+)"', root)[0])
    assert (
        drawn
        == text.count('class="chart"')
        == len(re.findall(r'class="chart js-plotly-plot"', document))
        > 4
    )
    assert document.count('class="trace scatter') >= drawn
    # seen in the legend as it is written
    assert "&lt;script&gt;document.documentElement" in document


def test_tables_are_sorted(page: Path) -> None:
    """By a number, falling and rising; by a name. Without the policy, so that the test may
    click."""
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read_text(encoding="utf-8"))
    click = """<script>
const table = [...document.querySelectorAll("table.sortable")].at(-1), found = [];
for (const column of [3, 3, 0, 0]) {
  table.querySelectorAll("th button")[column].click();
  found.push([...table.tBodies[0].rows].map((row) => row.cells[column].textContent));
}
document.body.dataset.sorted = JSON.stringify(found);
</script></body>"""
    clicked = page.with_name("clicked.html")
    clicked.write_text(text.replace("</body>", click), encoding="utf-8")
    (told,) = re.findall(r'<body[^>]* data-sorted="([^"]*)"', opened(clicked))
    *numbers, falls, rises = json.loads(unescape(told))
    falling, rising = ([float(one) for one in column] for column in numbers)
    assert (
        len(falling) > 4 and falling == sorted(falling, reverse=True) and rising == sorted(rising)
    )
    assert falls == rises[::-1] and sorted(rises) == sorted(falls) and rises != falls
