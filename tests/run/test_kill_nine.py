"""kill -9 of one rank in full flight: nothing lost. ``tests/support/kill_nine.py`` does it twenty
times."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from kill_nine import check

pytestmark = pytest.mark.serial


@pytest.mark.long
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="needs mpirun")
def test_ranks_that_are_killed(tmp_path: Path) -> None:
    """Every row is on file or computed again, and in the end the histories are the straight run's
    to round-off."""
    pytest.importorskip("dolfinx")
    _, difference = check(tmp_path, kills=1, ranks=2)
    assert difference <= 1e-10
