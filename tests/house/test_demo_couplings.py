"""The demo of couplings: every number beside the one that is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from demo_runs import demo
from pictures import is_drawn


@pytest.mark.serial  # ranks: tests/run has callbacks and steppers on them
@pytest.mark.promise("guide/couplings.md", "the demo has it to 1e-13", bound="1e-9")
@pytest.mark.promise("guide/couplings.md", "as the whole bar does to 1e-15", bound="1e-12")
def test_couplings(comm: Any, shared_tmp: Path) -> None:
    """Steady heat and two programs as one to round-off, damage to first order in the step: its
    bound stands a factor 3 away."""
    numbers = demo("couplings").main(quick=True, out=shared_tmp)
    assert is_drawn(shared_tmp / "couplings.png")
    assert len(numbers) == 7
    for name, (computed, exact) in numbers.items():
        relative = BOUNDS[name.partition(":")[0]]
        assert computed == pytest.approx(exact, rel=relative, abs=1e-12), name


BOUNDS = {"heat": 1e-9, "damage": 0.011, "pipe": 1e-12}
