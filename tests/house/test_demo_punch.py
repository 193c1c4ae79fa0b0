"""The demo of a footing that punches: Prandtl's load, and a film of his mechanism."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from demo_runs import demo

pytest.importorskip("dolfinx")
pytest.importorskip("PIL")


@pytest.mark.serial
def test_punch(tmp_path: Path) -> None:
    """On cells of half a half width: the load rises, ends within a sixth of (2 + pi) c, and hardly
    grows any more; soil flows below the strip and not at the sides, and rises beside it."""
    module = demo("punch")
    loads, snapshots = module.main(["--quick", "--out", str(tmp_path)])
    assert np.all(np.diff(loads) > 0.0)
    assert loads[-1] == pytest.approx(module.EXACT, rel=1.0 / 6.0)
    assert loads[-1] - loads[-2] < 0.01 * loads[-1]
    last = snapshots[-1]
    middles = last.polygons.mean(axis=1)
    far = np.abs(middles[:, 0] - 0.5 * module.SIZE[0]) > 4.0 * module.HALF
    assert last.strain[far].max() < 0.05 * last.strain.max()
    top = np.isclose(last.polygons[..., 1], module.SIZE[1])
    beside = top & (np.abs(last.polygons[..., 0] - 0.5 * module.SIZE[0]) > 1.6 * module.HALF)
    assert last.shift[beside][:, 1].max() > 0.1 * module.DEEPEST
    assert (tmp_path / "punch.gif").stat().st_size > 0
