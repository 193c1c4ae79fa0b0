"""The demos of bounds on a field: key numbers against what is known, and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

from demos.parts.exact.crack import critical
from demos.parts.exact.torsion import disk_torque, square_elastic
from vi_contact.exact import Membrane


def test_the_membrane_over_a_ball(comm: Any, shared_tmp: Path) -> None:
    """Radius and force are known; the contact set ends within a cell of the exact circle."""
    known = Membrane()
    assert known.radius == pytest.approx(0.6979651482, abs=1e-10) and known.factor == pytest.approx(
        0.68026, abs=5e-6
    )
    numbers = demo("obstacle").main(quick=True, out=shared_tmp)
    for cells, error, force in ((16, 0.05, 0.05), (32, 0.02, 0.015), (64, 2e-3, 1.5e-3)):
        assert numbers[f"{cells}: certificate"] <= 1e-9
        assert numbers[f"{cells}: error"] < error
        assert numbers[f"{cells}: force"] == pytest.approx(known.force, rel=force)
        assert abs(numbers[f"{cells}: radius"] - known.radius) < 4.0 / cells
    assert comm.rank or is_drawn(shared_tmp / "obstacle.png")


def test_torsion(comm: Any, shared_tmp: Path) -> None:
    """The disk: torque, stress function, plastic zone. The square: elastic, limit, and another
    method at one twist."""
    elastic, largest = square_elastic()
    assert (elastic, largest) == pytest.approx((2.24923, 1.35063), abs=5e-6)
    assert disk_torque(1.0) == pytest.approx(0.5 * np.pi) and disk_torque(1e9) == pytest.approx(
        2.0 * np.pi / 3.0
    )
    numbers = demo("torsion").main(quick=True, out=shared_tmp)
    h = 1.0 / 16.0
    for w in (0.5, 1.0, 1.5, 2.0, 3.0, 5.0):
        assert max(numbers[f"{name} {w:g}: certificate"] for name in ("disk", "square")) <= 1e-9
        assert numbers[f"disk {w:g}: torque"] == pytest.approx(float(disk_torque(w)), rel=5e-3)
        assert numbers[f"disk {w:g}: error"] < 1e-2
        if w > 1.0:
            assert numbers[f"disk {w:g}: plastic from"] == pytest.approx(1.0 / w, abs=h)
        else:
            assert numbers[f"disk {w:g}: plastic"] == 0.0
    # 0.5 < 1/1.35063: elastic
    assert numbers["square 0.5: torque"] == pytest.approx(0.5 * elastic, rel=5e-3)
    assert numbers["square 0.5: plastic"] == 0.0 < numbers["square 1: plastic"]
    assert numbers["square 5: torque"] == pytest.approx(8.0 / 3.0, rel=2e-2)
    assert numbers["relaxation"] < 1e-10
    assert comm.rank or is_drawn(shared_tmp / "torsion.png")


@pytest.mark.serial
def test_the_bar_that_cracks(comm: Any, shared_tmp: Path) -> None:
    """Homogeneous: the closed form, unloading too. Broken: elastic energy is gone, the crack costs
    Gc (1 + h / (2 l)) and damage before it does not heal."""
    strain, stress = critical(0.05)
    assert strain**2 * 0.05 == pytest.approx(1.0 / 3.0) and stress == pytest.approx(
        9.0 / 16.0 * strain
    )
    numbers = demo("crack").main(quick=True, out=shared_tmp)
    assert numbers["homogeneous: stress error"] < 1e-12
    assert max(numbers["homogeneous: certificate"], numbers["certificate"]) <= 1e-9
    assert numbers["elastic"] < 0.1 and numbers["d"] > 0.98 and abs(numbers["middle"]) < 0.02
    assert numbers["crack alone"] == pytest.approx(numbers["1 + h / (2 l)"], rel=0.1)
    assert numbers["crack alone"] < numbers["surface"] < 1.5
    assert comm.rank or is_drawn(shared_tmp / "crack.png")
