"""benchmarks/turning.py with small sizes: its bounds, and the rows that it writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")


@pytest.mark.slow
@pytest.mark.serial
def test_bounds_of_bodies_that_turn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Energy and momenta to round-off, and passes that stay few."""
    folder = ROOT / "benchmarks"
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    benchmark = loaded(folder / "turning.py")
    file = tmp_path / "numbers.json"
    assert benchmark.main(["--size", "4", "--turns", "1", "--json", str(file)]) == 0
    numbers = json.loads(file.read_text())
    for case in ("spin", "rock"):
        assert numbers[f"{case}_certificate"] <= 1e-9
        assert numbers[f"{case}_energy_defect"] <= 1e-10
        assert numbers[f"{case}_linear_steps_mean"] <= 20
    assert numbers["spin_momentum_defect"] <= 1e-10
