"""Find the tools of install/site.sh, which also run the pages and the notebooks."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def site_tools() -> Path:
    """Return the Python that has them; skip the module that calls this where they are missing or
    old."""
    wanted = ROOT / "install" / "site-requirements.txt"
    installed = ROOT / ".venv" / "site" / "installed"
    if not installed.is_file() or installed.read_bytes() != wanted.read_bytes():
        pytest.skip(
            "the tools of the site are missing: bash install/site.sh brings them",
            allow_module_level=True,
        )
    return installed.parent / "bin" / "python"
