"""benchmarks/yielding.py with small sizes: its bounds, and the rows that it writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")
KEYS = (
    "linear_steps_mean",
    "linear_steps_max",
    "share_stress",
    "share_assembly",
    "share_factor",
    "bytes_per_point",
    "certificate",
    "energy_defect",
)


@pytest.mark.slow
@pytest.mark.serial
def test_bounds_of_bodies_that_yield(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Certificates and defects of 1e-9, 25 linear steps in the plane at most in the mean, and 3
    where nothing yields."""
    folder = ROOT / "benchmarks"
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    benchmark = loaded(folder / "yielding.py")
    file = tmp_path / "numbers.json"
    assert benchmark.main(["--size", "8", "--steps", "16", "--json", str(file)]) == 0
    numbers = json.loads(file.read_text())
    for case in ("metal", "soil", "cone", "elastic", "space"):
        assert numbers[f"{case}_certificate"] <= 1e-9
        assert numbers[f"{case}_energy_defect"] <= 1e-9
        assert 0.0 < numbers[f"{case}_share_stress"] < 1.0
        assert numbers[f"{case}_bytes_per_point"] <= 4000.0
    for case in ("metal", "soil", "cone"):
        assert numbers[f"{case}_linear_steps_mean"] <= 25.0
        assert numbers[f"{case}_yielding_points"] > 0.1
    assert numbers["elastic_linear_steps_mean"] <= 3.0
    assert all(numbers[key] == numbers[f"soil_{key}"] for key in KEYS)
