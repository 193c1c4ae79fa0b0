"""Benchmarks change nothing of the package when they are imported, only when they run.

One of them silenced all warnings when another imported it.
"""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial
FOLDER = ROOT / "benchmarks"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_an_import_does_not_silence_warnings(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The level of the package's log is the one before."""
    monkeypatch.syspath_prepend(str(FOLDER))
    logger = logging.getLogger("vi_contact")
    logger.setLevel(logging.INFO)
    loaded(path)
    assert logger.level == logging.INFO
