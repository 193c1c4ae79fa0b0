"""The demos of an arch and of an array of bricks, with few stones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from demo_runs import demo
from pictures import is_drawn


@pytest.mark.serial
@pytest.mark.parametrize("name", ["arch", "bricks"])
def test_stones_are_shaken(name: str, comm: Any, shared_tmp: Path) -> None:
    """Every step is certified and the ledger closes; joints close and open; pictures are drawn."""
    numbers = demo(name).main(quick=True, out=shared_tmp, progress=False)
    assert numbers["certificate"] <= 1e-9
    assert numbers["energy defect"] <= 1e-9
    if name == "arch":
        assert numbers["certificate at rest"] <= 1e-9
        assert 0.0 < numbers["fewest closed points"] <= numbers["closed points at rest"]
        assert numbers["closed points at rest"] < numbers["contact points"]
    else:
        assert 0.0 < numbers["most points closed"] < numbers["contact points"]
    if comm.rank == 0:
        assert is_drawn(shared_tmp / f"{name}.png")
        assert is_drawn(shared_tmp / "energy.png")
