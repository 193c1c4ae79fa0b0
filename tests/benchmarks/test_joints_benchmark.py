"""benchmarks/joints.py with a small size: its bounds, and the rows that it writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")


@pytest.mark.slow
@pytest.mark.serial
def test_bounds_of_joints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are certified with their strength, the ledger closes, and passes are few. The time over
    Coulomb's law, 1.7 to 1.9 where it was measured, is no bound of a test on a busy machine."""
    folder = ROOT / "benchmarks"
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    benchmark = loaded(folder / "joints.py")
    monkeypatch.setattr(benchmark, "RUNS", 1)
    file = tmp_path / "numbers.json"
    assert benchmark.main(["--size", "8", "--dt", "8e-3", "--json", str(file)]) == 0
    numbers = json.loads(file.read_text())
    assert numbers["certificate"] <= 1e-9 and numbers["law"] <= 1e-9
    assert numbers["energy_defect"] <= 1e-9
    assert numbers["passes_mean"] <= 4.0
    assert numbers["lost"] >= 0.3 and numbers["over_coulomb"] > 0.0
