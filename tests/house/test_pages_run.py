"""The snippets and commands of the pages run and print what the pages say, by docs/conftest.py.

``bash docs/build.sh`` runs those of the gallery, which take minutes.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from site_tools import ROOT, site_tools

pytestmark = [pytest.mark.serial, pytest.mark.slow]
PYTHON = site_tools()
PAGES = [
    page
    for folder in ("start", "guide", "theory", "reference")
    for page in sorted((ROOT / "docs" / folder).glob("*.md"))
    if "\n```" in page.read_text(encoding="utf-8")
]
NONE_HERE = 5  # status of pytest: no tests, blocks of other languages only


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_a_page_runs(page: Path) -> None:
    pytest.importorskip("dolfinx")
    environment = {name: text for name, text in os.environ.items() if "XDIST" not in name}
    done = subprocess.run(
        [str(PYTHON), "-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider", str(page)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert done.returncode in (0, NONE_HERE), done.stdout[-3000:] + done.stderr[-1000:]
