"""The demo of a wall whose fill yields in a quake: it slides away from its fill, and stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from demo_runs import demo

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")
pytest.importorskip("PIL")


@pytest.mark.serial
def test_shaken_fill(tmp_path: Path) -> None:
    """A strong pulse: the ledger is closed, yielding takes energy, the base has slid away from the
    fill, and the moment is larger than at rest."""
    module = demo("shaken_fill")
    solution = module.main(["--quick", "--out", str(tmp_path)])
    history = solution.history
    assert solution.facts["worst_certificate"] <= 1e-9
    assert solution.facts["energy_defect"] <= 1e-9
    assert history["loss_plastic"][-1] > 0.0
    pushed = module.find_pushed(history)
    assert pushed[-1] > 2e-3
    assert np.max(history["M_stem"]) > 1.5 * history["M_stem"][0]
    assert (tmp_path / "shaken_fill.gif").stat().st_size > 0
