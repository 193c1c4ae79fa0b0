"""The demo of the buried channel: key numbers of V4.2 in its first 40 steps, and every file it
promises."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

ROOT = Path(__file__).resolve().parents[2]
FIGURES = (
    "layout",
    "excitation",
    "openings",
    "rocking",
    "beside",
    "interface",
    "envelope",
    "states",
    "moments",
)


@pytest.mark.slow
@pytest.mark.serial
def test_the_channel_demo(comm: Any, shared_tmp: Path) -> None:
    """V4.2: openings alternate, the corners rock, unilateral exceeds bilateral; both routes agree;
    all files."""
    module = demo("channel")
    numbers = module.main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    sliding, coulomb, bilateral = module.RUNS
    for name in module.RUNS:
        assert 0.0 < numbers[f"{name}: certificate"] <= 1e-9
        assert 0.0 < numbers[f"{name}: cross-check"] <= 1e-9
        assert numbers[f"{name}: energy defect"] <= 1e-10
        summary = json.loads(
            (module.folder(shared_tmp, name) / "summary.json").read_text(encoding="utf-8")
        )
        assert summary["status"] == "finished" and summary["ranks"] == comm.size
        assert (summary["unknowns"], summary["contact_points"], summary["steps"]) == (1528, 23, 40)
    for name in (sliding, coulomb):
        assert min(numbers[f"{name}: opening left"], numbers[f"{name}: opening right"]) > 4e-4
        assert numbers[f"{name}: both tops open"] < 0.05
        assert numbers[f"{name}: correlation of 1 and 7"] < -0.5  # rocking
    assert (
        numbers[f"{bilateral}: opening left"] <= 1e-15
        and numbers[f"{bilateral}: both tops open"] == 0.0
    )
    assert numbers[f"{bilateral}: correlation of 1 and 7"] == pytest.approx(-1.0, abs=1e-9)
    spans = [
        np.subtract(
            numbers[f"{name}: u_y of point 1, max"], numbers[f"{name}: u_y of point 1, min"]
        )
        for name in (sliding, bilateral)
    ]
    assert spans[0] > 1.5 * spans[1]
    assert numbers[f"{sliding}: settlement"] == pytest.approx(-5.8655e-4, abs=1e-8)
    if comm.rank == 0:
        for figure in FIGURES:
            assert is_drawn(shared_tmp / f"{figure}.png")
        assert 20_000 < (shared_tmp / "channel.gif").stat().st_size < 2_000_000
