"""The demo of a fault, on few cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from demo_runs import demo
from pictures import is_drawn


@pytest.mark.serial  # ranks: joints run on them in tests/fem
def test_the_fault_ruptures_and_the_block_sticks_and_slips(comm: Any, shared_tmp: Path) -> None:
    """Elements of 500 m bring the rupture to 3 km somewhat early, as order h does; the block slips
    with the period of the other program but for its first cycles."""
    numbers = demo("fault").main(quick=True, out=shared_tmp)
    assert numbers["rupture: certificate"] <= 1e-9 and numbers["block: certificate"] <= 1e-9
    assert numbers["arrival at 3 km"] == pytest.approx(0.902, rel=0.25)
    assert numbers["block: slips"] == 2.0
    assert numbers["block: last period"] == pytest.approx(0.62649, rel=0.3)
    assert numbers["block: longest step over shortest"] >= 64.0
    assert is_drawn(shared_tmp / "rupture.png")
    assert is_drawn(shared_tmp / "cycles.png")
