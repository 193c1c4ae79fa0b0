"""S4.1: checks of a run against formulas: coefficients against published ones and against other
ways to them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.engineering.checks import AtRest, CoulombWedge, Rankine
from vi_contact.practice.engineering.checks.earth_pressure_static import wedge

pytestmark = pytest.mark.serial
DEGREE = math.pi / 180.0
WALL = {"height": 5.0, "rho": 2000.0, "gravity": 10.0}  # rho g H²/2 = 250 kN/m
RUN = {"N_wall": np.array([9e4, 2e5, 1e5]), "height_wall": np.array([1.6, 2.0, 1.7])}


def worst_wedge(
    phi: float, delta: float, slope: float, batter: float, psi: float, load: float = 0.0
) -> float:
    """The largest thrust of a triangle of soil on wall, ground and a plane at any angle, over rho g
    H²/2: equilibrium of weight (turned by psi, divided by its cosine), reaction of the plane at
    phi, and thrust at delta. load: on a horizontal metre, over rho g H/2; the triangle's ground is
    as wide as the law of sines has it."""
    angles = np.linspace(slope + 1e-4, 0.5 * np.pi + batter - 1e-4, 400001)
    area = (
        np.cos(batter - slope)
        * np.cos(angles - batter)
        / (np.cos(batter) ** 2 * np.sin(angles - slope))
    )
    area += (
        load * np.cos(slope) * np.cos(angles - batter) / (np.cos(batter) * np.sin(angles - slope))
    )
    thrust = np.sin(angles - phi + psi) / np.cos(angles - phi - delta - batter) / np.cos(psi) * area
    return float(thrust[(angles > phi - psi) & (np.cos(angles - phi - delta - batter) > 0.0)].max())


@pytest.mark.parametrize(
    "angles",
    [
        (30.0, 0.0, 0.0, 0.0, 0.0),
        (30.0, 15.0, 0.0, 0.0, 0.0),
        (35.0, 20.0, 10.0, 5.0, 0.0),
        (33.0, 11.0, 5.0, -8.0, 0.0),
        (30.0, 15.0, 0.0, 0.0, 11.3),
        (35.0, 17.5, 8.0, 6.0, 9.0),
        (40.0, 20.0, -5.0, 10.0, 15.0),
    ],
)
@pytest.mark.promise("guide/checks.md", "agrees to 1e-8 with a search over all planes")
def test_worst_wedge(angles: tuple[float, ...]) -> None:
    """K is the maximum over all planes of the equilibrium of one wedge, to round-off of the
    search."""
    phi, delta, slope, batter, psi = (DEGREE * one for one in angles)
    assert wedge(phi, delta, slope, batter, psi=psi) == pytest.approx(
        worst_wedge(phi, delta, slope, batter, psi), rel=1e-8
    )


def test_textbook_coefficients() -> None:
    """K_A, K_P of level ground behind a vertical wall in textbooks (Das, Bowles: 0.3014, 0.2973;
    6.105), Rankine's 1/3 and 3; on a slope his are Coulomb's with delta = slope (0.3495 for 30° and
    10°)."""

    def coulomb(phi: float, delta: float, *, passive: bool = False) -> float:
        return wedge(phi * DEGREE, delta * DEGREE, 0.0, 0.0, passive=passive)

    assert [coulomb(30.0, 15.0), coulomb(30.0, 20.0)] == pytest.approx([0.3014, 0.2973], abs=5e-5)
    assert coulomb(30.0, 20.0, passive=True) == pytest.approx(6.105, abs=5e-4)
    thrusts = [
        Rankine(**WALL, phi=30.0 * DEGREE, passive=one).compare(RUN).expected
        for one in (False, True)
    ]
    assert thrusts == pytest.approx([250e3 / 3.0, 750e3], rel=1e-14)
    slope = {"phi": 30.0 * DEGREE, "slope": 10.0 * DEGREE}
    rankine, other = Rankine(**WALL, **slope), CoulombWedge(**WALL, **slope, delta=10.0 * DEGREE)
    assert rankine.compare(RUN).expected == pytest.approx(other.compare(RUN).expected, rel=1e-14)
    assert rankine.compare(RUN).expected / 250e3 / math.cos(10.0 * DEGREE) == pytest.approx(
        0.3495, abs=1e-4
    )


def test_rest_and_surcharge() -> None:
    """K0 = nu/(1-nu); the surcharge acts at H/2; found is the first row, per metre of width."""
    at_rest = AtRest(**WALL, nu=0.3).compare(RUN)
    assert at_rest.expected == pytest.approx(250e3 * 3.0 / 7.0, rel=1e-14) and at_rest.found == 9e4
    assert (
        at_rest.ratio == at_rest.found / at_rest.expected
        and at_rest.unit == "N/m"
        and not at_rest.applies
    )
    assert (
        at_rest.inputs["nu"] == (0.3, "-")
        and AtRest(**WALL, nu=0.3, width=2.0).compare(RUN).found == 4.5e4
    )
    sand = AtRest(**WALL, nu=0.5 / 1.5).compare(RUN)  # of K0 = 1 - sin 30°
    assert sand.expected == pytest.approx(125e3, rel=1e-14)
    loaded = AtRest(**WALL, nu=0.3, surcharge=2e4)
    assert loaded.compare(RUN).expected == pytest.approx(350e3 * 3.0 / 7.0, rel=1e-14)
    high = AtRest(**WALL, nu=0.3, surcharge=2e4, of="height").compare(RUN)
    assert (high.expected, high.found, high.unit) == (
        pytest.approx(5.0 * (250 / 3 + 50) / 350, rel=1e-14),
        1.6,
        "m",
    )


def test_surcharge_on_a_slope_behind_a_batter() -> None:
    """q on a horizontal metre: the thrust is that of the search over all planes with weight and
    load; 253 925 N of another search for phi 35, delta 15, slope 20, batter 20 degrees, H = 5 m, 50
    kPa."""
    soil = {"height": 5.0, "rho": 1900.0, "surcharge": 5e4}
    own = 0.5 * 1900.0 * 9.80665 * 25.0
    for phi, delta, slope, batter in (
        (35.0, 15.0, 20.0, 20.0),
        (33.0, 11.0, 5.0, -8.0),
        (35.0, 0.0, 20.0, -20.0),
    ):
        angles = [DEGREE * one for one in (phi, delta, slope, batter)]
        found = CoulombWedge(
            **soil, **dict(zip(("phi", "delta", "slope", "batter"), angles, strict=True))
        ).compare(RUN)
        searched = (
            own
            * worst_wedge(*angles, 0.0, 5e4 / (0.5 * 1900.0 * 9.80665 * 5.0))
            * math.cos(angles[1])
        )
        assert found.expected == pytest.approx(searched, rel=1e-8)
        assert delta != 15.0 or found.expected == pytest.approx(253925.0, rel=1e-5)


def test_passive_is_told() -> None:
    """In name and inputs, and where its ground does not stand or its wedge is not at rest."""
    told = {one: CoulombWedge(**WALL, phi=0.5, passive=one).compare(RUN) for one in (False, True)}
    assert [told[one].name for one in (False, True)] == ["CoulombWedge", "CoulombWedge, passive"]
    assert told[True].inputs == told[False].inputs | {"passive": (1.0, "-")}
    for slope, words in (
        (0.6, "the ground is steeper than phi"),
        (-0.6, "phi + slope - psi is below zero, psi = 0"),
    ):
        steep = CoulombWedge(**WALL, phi=0.5, slope=slope, passive=True).compare(RUN)
        assert words in steep.applies and math.isnan(steep.expected)


def test_outside_its_range_no_number_is_claimed() -> None:
    steep = Rankine(**WALL, phi=0.5, slope=0.6).compare(RUN)
    assert (
        math.isnan(steep.expected)
        and "steeper than the friction angle" in steep.applies
        and steep.found == 9e4
    )
    for delta, passive, words in ((0.6, False, "above 0.5:"), (0.3, True, "above 0.25:")):
        rough = CoulombWedge(**WALL, phi=0.5, delta=delta, passive=passive).compare(RUN)
        assert math.isnan(rough.expected) and math.isnan(rough.ratio) and words in rough.applies
    assert (
        "below zero, psi = 0: no wedge is at rest"
        in CoulombWedge(**WALL, phi=0.5, slope=0.6).compare(RUN).applies
    )
    unknown = AtRest(**WALL, nu=0.3, part="stem").compare(RUN)
    assert unknown.unit == "N/m" and unknown.inputs["nu"] == (0.3, "-")
    assert unknown.applies == "the run has no column N_stem: record it" and math.isnan(
        unknown.found
    )


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"phi": 30.0}, "phi is 30.0; give one from 0 to 1.57 radians; 30 degrees"),
        ({"phi": 0.5, "height": -1.0}, "height is -1.0; give a finite number above zero in m"),
        ({"phi": 0.5, "of": "torque"}, "unknown CoulombWedge: of 'torque'"),
        (
            {"phi": 0.5, "surcharge": -1.0},
            "surcharge is -1.0; give zero or a positive finite number in Pa",
        ),
    ],
)
def test_wrong_fields(wrong: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        CoulombWedge(**(WALL | wrong))
