"""benchmarks/stones.py with small walls: its keys and certificates."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")


@pytest.mark.slow
@pytest.mark.serial
def test_numbers_of_walls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are certified, and G takes a small part of an array. Times are no bound of a test."""
    folder = ROOT / "benchmarks"
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    benchmark = loaded(folder / "stones.py")
    file = tmp_path / "numbers.json"
    assert benchmark.main(["--stones", "30", "--steps", "2", "--json", str(file)]) == 0
    numbers = json.loads(file.read_text())
    assert max(numbers["certificate"]) <= 1e-9
    (conditions,) = numbers["conditions"]
    assert numbers["bytes_per_condition"][0] < 8.0 * 4.0 * conditions
    for key in ("stones", "ms_per_step", "over_product", "share_factor", "share_gmres"):
        assert numbers[key][0] > 0.0, key
