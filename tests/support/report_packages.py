"""Find what only reports for browsers need: jinja2 and plotly, also where ``install/report.sh``
puts them; Chromium."""

from __future__ import annotations

import shutil
import site
from pathlib import Path

import pytest

from vi_contact.practice.plots.web_page import can_write

CHROMIUM_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
ROOT = Path(__file__).resolve().parents[2]


def report_packages() -> None:
    """Skip the module that calls this where the packages are missing."""
    for folder in (ROOT / ".venv" / "report").glob("lib/python3*/site-packages"):
        site.addsitedir(str(folder))
    if not can_write():
        pytest.skip(
            "jinja2 and plotly are missing: bash install/report.sh brings them",
            allow_module_level=True,
        )


def browser() -> str:
    """Return the command of a headless browser; skip what calls this, a module too, where there is
    none."""
    found = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    if found is None:
        pytest.skip(
            "no Chromium here: bash install/report.sh --browser brings it", allow_module_level=True
        )
    return found
