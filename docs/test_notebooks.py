"""Run the notebooks in Jupyter, by nbmake.

The last cell of each checks the numbers of its page.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOKS = [
    page for page in sorted((ROOT / "docs" / "notebooks").glob("*.md")) if page.stem != "index"
]


@pytest.mark.parametrize("page", NOTEBOOKS, ids=lambda page: page.stem)
def test_a_notebook_runs(page: Path, tmp_path: Path) -> None:
    """Run it in the folder of a clone, without anything installed."""
    for name in ("vi_contact", "demos", "meshes"):
        (tmp_path / name).symlink_to(ROOT / name)
    book = tmp_path / "docs" / "notebooks" / f"{page.stem}.ipynb"
    book.parent.mkdir(parents=True)
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    environment |= {"JUPYTER_PREFER_ENV_PATH": "1", "PYTHONIOENCODING": "utf-8"}
    for words in (
        ["jupytext", "--quiet", "--to", "ipynb", "--output", str(book), str(page)],
        ["pytest", "-q", "--nbmake", "--nbmake-timeout=600", "-p", "no:cacheprovider", str(book)],
    ):
        done = subprocess.run(
            [sys.executable, "-m", *words],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            encoding="utf-8",
            timeout=600,
            check=False,
        )
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
