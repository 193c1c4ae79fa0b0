"""The demo of a wall in lifts: the moment at the foot of the stem is that of active soil."""

from __future__ import annotations

from pathlib import Path

import pytest
from demo_runs import demo

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")


@pytest.mark.serial
def test_lifts(tmp_path: Path) -> None:
    """Three lifts: between Coulomb's active moment, less a tenth for a wall that has moved little,
    and Rankine's of a smooth wall, for every height of fill; half of that at rest."""
    module = demo("lifts")
    (wall,) = module.main(["--quick", "--out", str(tmp_path)])
    by_hand = module.find_by_hand()
    moments = module.WEIGHT * wall.heights**3 / 6.0
    assert wall.certificate <= 1e-9
    last = wall.moments[-1] / moments[-1]
    assert 0.9 * by_hand["active, Coulomb"] < last < by_hand["active, Rankine"]
    assert last < 0.65 * by_hand["at rest"]
    assert (tmp_path / "moments.png").stat().st_size > 0
