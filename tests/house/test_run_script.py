"""tests/run.sh: one line and one status for all its runs, whatever becomes of them."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
TESTS = Path(__file__).resolve().parents[1]
INSTALL = str(TESTS / "house" / "test_install.py")
CASES = {
    "passes": ([INSTALL, "-k", "interpreter"], "1", "1 passed, 0 failed, 0 skipped", 0),
    "twice": (["-n0", INSTALL, "-k", "interpreter"], "1 1", "2 passed, 0 failed, 0 skipped", 0),
    "is killed": (["-n0", "killed.py"], "1", "0 passed, 1 failed, 0 skipped", 1),
    "is too slow": (["-n0", "slow.py"], "1", "0 passed, 1 failed, 0 skipped", 1),
}


@pytest.mark.parametrize("name", CASES)
def test_last_line(tmp_path: Path, name: str) -> None:
    """Counts are summed; a run that ends before it could count is one failure."""
    (tmp_path / "killed.py").write_text(
        "import os\n\ndef test_it():\n    os.kill(os.getpid(), 9)\n"
    )
    (tmp_path / "slow.py").write_text("import time\n\ndef test_it():\n    time.sleep(3600)\n")
    arguments, ranks, line, status = CASES[name]
    more = {"VI_CONTACT_RANKS": ranks} | (
        {"VI_CONTACT_TIMEOUT": "2"} if name == "is too slow" else {}
    )
    arguments = [
        str(tmp_path / word) if word in ("killed.py", "slow.py") else word for word in arguments
    ]
    clean = {key: value for key, value in os.environ.items() if not key.startswith("VI_CONTACT_")}
    command = ["bash", str(TESTS / "run.sh"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=clean | more)
    assert done.stdout.splitlines()[-1] == line and done.returncode == status, (
        done.stdout + done.stderr
    )
    assert ("VI_CONTACT_TIMEOUT are over" in done.stderr) == (name == "is too slow")
