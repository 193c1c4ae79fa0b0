"""benchmarks/nonlinear.py with small sizes: its bounds, and the rows that it writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")


@pytest.mark.slow
@pytest.mark.serial
def test_bounds_of_bodies_that_are_not_linear(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Certificates and defects of 1e-9, and a loss of the scheme that is small."""
    folder = ROOT / "benchmarks"
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    benchmark = loaded(folder / "nonlinear.py")
    file = tmp_path / "numbers.json"
    assert benchmark.main(["--size", "6", "--steps", "80", "--json", str(file)]) == 0
    numbers = json.loads(file.read_text())
    for case in ("chain", "block", "barrel"):
        assert numbers[f"{case}_certificate"] <= 1e-9
        assert numbers[f"{case}_linear_steps_max"] <= 20
        assert numbers[f"{case}_tangents_per_step"] <= 3.0
    for case in ("chain", "block"):
        assert numbers[f"{case}_energy_defect"] <= 1e-9
        assert 0.0 < numbers[f"{case}_loss_algorithmic"] <= 0.05
        assert numbers[f"{case}_steps_in_contact"] > 10
    assert numbers["barrel_difference"] <= 1e-6
