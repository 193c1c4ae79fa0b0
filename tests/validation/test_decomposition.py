"""A step with contact is the sum of two structures without it (V8.11; boundary method, eqs. 34 to
36), and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from demos.parts.pictures.wall import plot_data, plot_decomposition
from demos.parts.problems.decomposition import split
from demos.parts.problems.wall import CASES, Wall, build


@pytest.mark.serial
@pytest.mark.promise("start/first_wall.md", "is the answer of the step to round-off")
def test_loads_and_reactions_add_up_to_the_step(comm: Any, shared_tmp: Path) -> None:
    """Step 30 of case b presses most: u = u_1 + u_2 at every node; only u_2 knows reactions, and
    u_1 goes too far."""
    wall = Wall()
    model = build(wall, comm, base_inertia="catalogue")
    problem = model.problem("b")
    steps = vc.march(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(phi=0.5),
        solver=vc.Condensed(),
        dt=model.time_step(),
        steps=30,
    )
    *_, (state, report) = steps
    found = split(problem, report)
    if comm.rank:
        assert found is None
        return
    assert found is not None and found.defect < 1e-13 and len(found.points) == 9 * 13
    size = np.abs(found.loaded).max()
    assert np.abs(found.u - found.loaded - found.pressed).max() < 1e-13 * size
    side = (found.points[:, 0] == wall.width) & (found.points[:, 1] > 1.0)
    assert found.loaded[side, 0].min() > 0.0 and np.abs(found.u[side, 0]).max() < 1e-12 * size
    assert found.forces[:, 0].max() < 0.0  # all points press, towards the wall
    plot_data(wall, {case: CASES[case] for case in "ab"}, shared_tmp / "data.png")
    plot_decomposition(found, wall, shared_tmp / "decomposition.png")
    assert (
        min((shared_tmp / name).stat().st_size for name in ("data.png", "decomposition.png"))
        > 20_000
    )
