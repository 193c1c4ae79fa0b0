"""The demo of a site column: elastic, equivalent-linear and yielding sand under one motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

pytest.importorskip("dolfinx")


@pytest.mark.serial
def test_site_column(tmp_path: Path) -> None:
    """Certified; soil that yields shakes less at the surface than elastic soil, strains more, and
    strains as equivalent-linear waves say within a factor of two."""
    found = demo("site_column").main(["--quick", "--out", str(tmp_path)])
    elastic, waves, yielding = found.values()
    for one in (elastic, yielding):
        assert one.facts["worst_certificate"] <= 1e-9
        assert one.facts["energy_defect"] <= 1e-9
    peak = {name: np.abs(one.surface.acceleration).max() for name, one in found.items()}
    assert peak["Iwan in time"] < peak["elastic"]
    assert yielding.strain.max() > elastic.strain.max()
    assert 0.5 < yielding.strain.max() / waves.strain.max() < 2.0

    # the strain of the nodes is that of the point of integration half-way down
    assert np.abs(yielding.loop[0]).max() == pytest.approx(yielding.strain[4], rel=1e-9)
    assert is_drawn(tmp_path / "site_column.png")
