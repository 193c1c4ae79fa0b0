"""benchmarks/obstacle.py: its numbers, and where PETSc's own SNESVI goes wrong with its
defaults."""

from __future__ import annotations

import json
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("dolfinx")

# what PETSc does alone; test_inequality.py has our routes on ranks
pytestmark = [pytest.mark.slow, pytest.mark.serial]
ROOT = Path(__file__).resolve().parents[2]
KEYS = {
    "unknowns",
    "ranks",
    "route",
    "cpu_seconds",
    "iterations",
    "certificate",
    "active",
    "ratio",
    "difference",
    "plain_cpu_seconds",
    "plain_iterations",
    "plain_reason",
    "snesvi_by_default",
}


def test_units_and_warm_starts(
    comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both agree at size one. Small units give SNESVI another answer, and from the solution it does
    not converge."""
    spec = spec_from_file_location("benchmark_obstacle", ROOT / "benchmarks" / "obstacle.py")
    assert spec is not None and spec.loader is not None
    benchmark = module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    assert (
        benchmark.main(["--cells", "24", "--small", "32", "--json", str(shared_tmp / "found.json")])
        == 0
    )
    comm.Barrier()
    found = json.loads((shared_tmp / "found.json").read_text())
    assert set(found) == KEYS
    assert found["unknowns"] == 625 and found["route"] == "TaoTron" and found["certificate"] <= 1e-9
    assert found["difference"] < 1e-8 and found["active"] > 40 and found["ratio"] > 0.0
    rows = {row["case"]: row for row in found["snesvi_by_default"]}
    assert max(row["vi_certificate"] for row in rows.values()) <= 1e-9
    assert (
        max(row["vi_iterations"] for row in rows.values()) < 30
        and rows["from the solution"]["vi_iterations"] == 0
    )
    assert rows["from nothing"]["error"] < 1e-7
    assert rows["u of size 1e-9"]["error"] > 0.05
    assert rows["from the solution"]["reason"].startswith("DIVERGED")
    assert comm.rank or "SNESVI by default" in capsys.readouterr().out
