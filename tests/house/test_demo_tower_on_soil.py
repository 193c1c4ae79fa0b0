"""The demo of soil boundaries: gravity, release, an upgoing wave; a tower that lifts off."""

from __future__ import annotations

import json

import pytest
from demo_runs import demo
from pictures import is_drawn


@pytest.mark.serial
@pytest.mark.slow
def test_the_tower_on_soil_demo(comm, shared_tmp, capsys):
    """Amplified by the soil, lifted off, certified; the base moves neither like the outcrop nor
    like half of it."""
    numbers = demo("tower_on_soil").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    assert numbers["worst"] <= 1e-9
    assert 1.6 < numbers["base"] < 2.9 and 3.5 < numbers["surface"] < 6.0
    assert numbers["uplift"] > 0.5 and 0.0 < numbers["slip"] < 0.01
    told = json.loads((shared_tmp / "summary.json").read_text())["boundaries"]
    assert len(told) == 3 and all("upgoing motion" in line for line in told)
    assert is_drawn(shared_tmp / "motions.png")
    assert comm.rank or "outcrop 3.00 (upgoing wave 1.50)" in capsys.readouterr().out
