"""The demo of Newmark's block: contact beside the equation, and the wall's k_y by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from demo_runs import demo

pytest.importorskip("dolfinx")

from demos.parts.problems.newmark import (
    BASE,
    HEIGHT,
    ON_BASE,
    PHI,
    WEIGHT,
    find_resistance,
    slide,
)


def test_the_equation_by_hand() -> None:
    """A rectangular pulse a for t1: ½ a t1² (a/r - 1) in the end, on both sides or on one; nothing
    below the resistance, and nothing backwards of a block that slides to one side."""
    times = np.linspace(0.0, 4.0, 401)
    pulse = SimpleNamespace(acceleration=lambda t: 3.0 if t < 1.0 else 0.0)
    back = SimpleNamespace(acceleration=lambda t: -3.0 if t < 1.0 else 0.0)
    for one_sided in (False, True):
        found = slide(pulse, times, 2.0, one_sided=one_sided)
        assert found[-1] == pytest.approx(0.5 * 3.0 * (3.0 / 2.0 - 1.0), rel=2e-3)
        assert not slide(pulse, times, 3.5, one_sided=one_sided).any()
    assert slide(back, times, 2.0)[-1] == pytest.approx(-0.75, rel=2e-3)
    assert not slide(back, times, 2.0, one_sided=True).any()


def test_the_wall_slides_where_its_forces_balance() -> None:
    """At k_y the worst of all plane wedges behind the heel, each in equilibrium with its inertia
    and with friction on both its sides, pushes as much as the base of wall and fill can bear.
    Wedges between 1e-4 radians of slope miss the worst by the square of that."""
    k = find_resistance()
    slope = np.arange(PHI, 0.5 * np.pi, 1e-4)
    wedge = 0.5 * WEIGHT * HEIGHT**2 / np.tan(slope)
    push = wedge * (np.sin(slope - PHI) + k * np.cos(slope - PHI)) / np.cos(slope - 2.0 * PHI)
    thrust = push.max()
    borne = BASE * (ON_BASE + thrust * np.sin(PHI))
    assert k * ON_BASE + thrust * np.cos(PHI) == pytest.approx(borne, rel=1e-7)


@pytest.mark.serial
def test_newmark(tmp_path: Path) -> None:
    """The block beside the equation at all times, over the largest slip: 1.1 % at 0.3, where it
    trembles most, and 0.1 % at 0.6."""
    slips = demo("newmark").main(["--quick", "--out", str(tmp_path)])
    for ratio, bound in ((0.3, 0.035), (0.6, 0.004)):
        _, found, exact = slips["block", ratio]
        assert np.abs(found - exact).max() <= bound * np.abs(exact).max()
        assert exact[-1] > 0.01
    assert (tmp_path / "slips.png").stat().st_size > 0
