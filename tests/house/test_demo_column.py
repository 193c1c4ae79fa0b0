"""The demo of a column that falls over, on few cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from demo_runs import demo
from pictures import is_drawn


@pytest.mark.serial
def test_the_column_falls_over(comm: Any, shared_tmp: Path) -> None:
    """Beside the rigid block until that lies."""
    numbers = demo("column").main(quick=True, out=shared_tmp, progress=False)
    assert numbers["certificate"] <= 1e-9
    assert numbers["energy defect"] <= 1e-9
    if comm.rank == 0:
        assert numbers["tilt beside the rigid one"] < 0.2
        assert numbers["lies at"] == pytest.approx(numbers["rigid block lies at"], rel=0.05)
        assert is_drawn(shared_tmp / "column.png")
