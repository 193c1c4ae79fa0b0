"""S4.8: The pressure on a wall over its height, by hand: points, states, resultants, formulas."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.practice.engineering.checks import CoulombWedge, MononobeOkabe, Rankine
from vi_contact.practice.engineering.checks.model_facts import ModelFacts
from vi_contact.practice.engineering.checks.pressure_line import make_line
from vi_contact.practice.engineering.pressure_profile import find_profiles

pytestmark = pytest.mark.serial


@dataclass(frozen=True)
class Points:
    """Contact points as a run folder has them."""

    points: Array
    normals: Array
    weights: Array
    uncovered: Any = None


# A wall whose soil is on its right, four points from the top down, then a point of its base.
WALL = Points(
    points=np.array([[2.0, 4.0], [2.0, 3.0], [2.0, 2.0], [2.0, 1.0], [0.0, 1.0]]),
    normals=np.array([[1.0, 0.0]] * 4 + [[0.0, -1.0]]),
    weights=np.array([0.5, 1.0, 1.0, 0.5, 2.0]),
    uncovered=np.array([True, False, False, False, False]),
)
STEM = np.array([True, True, True, True, False])
PRESSURE = np.array([[0.0, 10.0, 20.0, 30.0, 99.0], [5.0, 30.0, 40.0, 60.0, 99.0]])
# t = (0, 1) on the stem; what the wall does to the soil upwards
TRACTION = np.array([[0.0, 5.0, -4.0, 15.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0]])


def run(**columns: Any) -> dict[str, Any]:
    return {
        "t": np.array([0.0, 2.0]),
        "pressure": PRESSURE,
        "gap": 0.0 * PRESSURE,
        "active": PRESSURE > 0.0,
        "traction_t": TRACTION[:, :, None],
    } | columns


def test_points_states_and_resultants() -> None:
    """N = 10 + 20 + 15 = 45 N at (10 x 2 + 20 x 1)/45 m above the foot, and 30 + 40 + 30 + 2.5 N
    in the other row; the soil rubs the wall downwards with 5 - 4 + 7.5 N."""
    first, last = find_profiles(run(), WALL, STEM, name="stem", mu=0.5)
    assert first.heights.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert first.pressure.tolist() == [30.0, 20.0, 10.0, 0.0]
    assert first.states == ("slides", "sticks", "slides", "hardly covered")
    assert (first.thrust, last.thrust) == (45.0, 102.5)
    assert first.height == pytest.approx(40.0 / 45.0, rel=1e-14)
    assert first.moment == pytest.approx(40.0, rel=1e-14)
    assert first.shear.tolist() == [-15.0, 4.0, -5.0, 0.0] and first.lift == -8.5
    assert first.open_share == pytest.approx(0.5 / 3.0) and last.open_share == 0.0
    assert (first.t, first.largest, last.t, last.largest) == (0.0, False, 2.0, True)
    (smooth, _) = find_profiles(run(), WALL, STEM, name="stem")
    assert smooth.states[:3] == ("closed",) * 3


def test_times_and_the_foot() -> None:
    """The step next to a time, each once; heights from a level 1 m below the lowest point."""
    found = find_profiles(run(), WALL, STEM, name="stem", times=(1.9, "max", 0.1), foot=0.0)
    assert [one.t for one in found] == [2.0, 0.0]
    assert found[1].heights.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert found[1].moment == pytest.approx(40.0 + 45.0, rel=1e-14)
    with pytest.raises(InputError, match="lasts from 0 to 2 s, and 40 is no time of it"):
        find_profiles(run(), WALL, STEM, name="stem", times=(40,))
    with pytest.raises(InputError, match="part 'base' is level"):
        find_profiles(run(), WALL, ~STEM, name="base")


def test_lines_of_formulas() -> None:
    """K rho g z and K q: Rankine's third of 2000 x 10 x 6 = 120 kPa and of 30 kPa. The area under
    each line is its thrust, and the moment of the area that of the formula."""
    wall = {"height": 6.0, "rho": 2000.0, "gravity": 10.0, "surcharge": 3e4}
    history = {"a_g_x": np.array([0.0, -2.0])}
    heights = np.linspace(0.0, 7.0, 8)
    line = make_line(Rankine(**wall, phi=math.pi / 6.0), history, ModelFacts(), heights)
    assert line.pressure[[0, 3, -1]] == pytest.approx([50e3, 30e3, 10e3], rel=1e-14)
    assert line.heights[-1] == 6.0 and line.name == "Rankine" and not line.passive
    for check, name in (
        (CoulombWedge(**wall, phi=0.6, slope=0.1, batter=0.1), "Coulomb"),
        (MononobeOkabe(**wall, phi=0.6), "Mononobe–Okabe, kh = 0.2"),
        (CoulombWedge(**wall, phi=0.6, passive=True), "Coulomb, passive"),
    ):
        line = make_line(check, history, ModelFacts(friction={"wall": 0.2}), heights)
        assert line.name == name
        # linear between the heights: the trapezoidal rule, and Simpson's of the moments
        z = line.heights
        p = line.pressure
        middle = 0.5 * (p[1:] + p[:-1])
        centre = 0.5 * (z[1:] + z[:-1])
        area = float(np.diff(z) @ middle)
        moments = p[1:] * z[1:] + 4.0 * middle * centre + p[:-1] * z[:-1]
        turning = float(np.diff(z) @ moments) / 6.0
        assert line.thrust == pytest.approx(area, rel=1e-12)
        assert line.moment == pytest.approx(turning, rel=1e-12)
    steep = make_line(Rankine(**wall, phi=0.5, slope=0.6), history, ModelFacts(), heights)
    assert "steeper" in steep.applies and math.isnan(steep.thrust)
