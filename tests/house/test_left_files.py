"""The suite fails where a test leaves files in the working directory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
TESTS = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("kept", [False, True], ids=["in tmp_path", "left"])
def test_a_file_that_is_left_is_told(tmp_path: Path, kept: bool) -> None:
    """A run without its out would leave such a folder."""
    folder = "pathlib.Path('results')" if kept else "tmp_path"
    (tmp_path / "test_it.py").write_text(
        f"import pathlib\n\ndef test_it(tmp_path):\n    ({folder} / 'run').mkdir(parents=True)\n"
    )
    paths = [str(TESTS), str(TESTS / "support"), os.environ.get("PYTHONPATH", "")]
    command = [sys.executable, "-m", "pytest", "-p", "conftest", "-p", "no:cacheprovider", "-q"]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
    )
    assert done.returncode == (1 if kept else 0), done.stdout + done.stderr
    told = f"left {tmp_path / 'results'}: let them write into tmp_path" in done.stdout
    assert told == kept, done.stdout
