"""The demo of initial strains: every number beside its closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from demo_runs import demo
from pictures import is_drawn


def test_warming(comm: Any, shared_tmp: Path) -> None:
    """Statics to round-off by both routes; waves in a bar of 50 cells within 0.4 %, their impulse
    within 1.5 %: bounds stand a factor 3 away."""
    numbers = demo("warming").main(quick=True, out=shared_tmp)
    comm.Barrier()  # rank 0 draws
    assert len(numbers) == 17 and is_drawn(shared_tmp / "warming.png")
    push = numbers["push of the support before T [N]"][1]
    for name, (computed, exact) in numbers.items():
        waves = 0.045 if "impulse" in name else 0.013 if "T" in name and "[N]" in name else 1e-9
        size = 1e-3 if "[m]" in name else push
        assert computed == pytest.approx(exact, rel=waves, abs=1e-10 * size), name
