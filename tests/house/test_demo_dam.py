"""The demo of a dam that cracks, for a short time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn


def test_the_dam_cracks_under_three_rules_of_water(comm: Any, shared_tmp: Path) -> None:
    """Uplift is head times half the base at rest and where it is kept; water that follows opens
    more, and water that is not in what opens less; the ledger is closed."""
    module = demo("dam")
    numbers = module.main(quick=True, out=shared_tmp)
    at_rest = 0.5 * 1000.0 * 9.80665 * module.LEVEL * module.BASE
    for rule in module.RULES:
        assert numbers[f"{rule}: certificate"] <= 1e-9
        assert numbers[f"{rule}: defect of the ledger"] <= 1e-10
        assert numbers[f"{rule}: uplift at rest"] == pytest.approx(at_rest, rel=1e-9)
    for end in ("least", "largest"):
        assert numbers[f"kept: {end} uplift"] == pytest.approx(at_rest, rel=1e-9)
    assert numbers["follows: largest uplift"] > 1.2 * at_rest
    assert numbers["none: least uplift"] < 0.8 * at_rest
    cracks = [numbers[f"{rule}: longest crack"] for rule in ("none", "kept", "follows")]
    assert np.all(np.diff(cracks) > 0.0) and cracks[-1] < module.BASE
    if comm.rank == 0:
        assert is_drawn(shared_tmp / "openings.png")
        assert is_drawn(shared_tmp / "histories.png")
