"""The report in headless Chromium: curves are drawn, tables are sorted, and neither texts nor
foreign scripts run."""

from __future__ import annotations

import json
import re
import subprocess
from html import unescape
from pathlib import Path

import pytest
from report_packages import browser, report_packages
from test_web_page import hostile

from vi_contact.studies.report import report

pytestmark = pytest.mark.serial
report_packages()
CHROMIUM = browser()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = hostile(tmp_path_factory.mktemp("page") / "run")
    _, (path, *_) = report(folder, out=folder / "page.html")
    return path


def opened(page: Path) -> str:
    """The document after its scripts have run."""
    done = subprocess.run(
        [
            CHROMIUM,
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
