"""The bar that falls and bounces, V1.2: table, modal form, equations of motion."""

import numpy as np
import pytest
from exact_checks import derivative_defect, energies, wave_defect

from vi_contact.core.errors import InputError
from vi_contact.exact import BouncingBar

pytestmark = pytest.mark.serial
BAR = BouncingBar()
T, V0, G, C, LENGTH, TAU = 16 / 3, 10.0, 10.0, 30.0, 10.0, 1 / 3
RANDOM = np.random.default_rng(0)


def test_numbers():
    """V1.2 as printed."""
    assert (BAR.fall_time, BAR.energy) == (1.0, 500.0) and BAR.period == pytest.approx(T, rel=1e-15)
    assert BAR.contacts(T) == pytest.approx(np.array([[1.0, 5 / 3], [11 / 3, 13 / 3]]), rel=1e-14)
    assert BAR.foot([2.0, 8 / 3, 29 / 6]) == pytest.approx([1.666667, 3.888889, 3.75], abs=5e-7)
    assert BAR.velocity(0.0, 2.0) == pytest.approx(6.666667, abs=5e-7)
    assert BAR.force([1.0, 5 / 3 - 1e-12, 4 / 3, 4.0]) == pytest.approx(
        [300.0, 500.0, 400.0, 400.0], rel=1e-10
    )


def test_table_of_phases():
    """V1.2: foot and pressure in the five phases, in the first period and the third."""
    t = np.linspace(0.001, T - 0.001, 997)
    phase = np.searchsorted([1.0, 5 / 3, 11 / 3, 13 / 3], t)
    r = t - np.array([0.0, 1.0, 5 / 3, 11 / 3, 13 / 3])[phase]
    q = np.mod(r, 2 * TAU)
    flight = V0 * r - G * r**2 / 2
    heights = [5.0 - G * t**2 / 2, flight + G * q * (q - 2 * TAU), flight]
    y = np.select([phase == 0, phase == 2, phase == 4], heights, 0.0)
    p = np.select(
        [phase == 1, phase == 3], [30.0 * (V0 + G * r), 30.0 * (V0 + 2 * G * TAU - G * r)], 0.0
    )
    for periods in (0, 2):
        assert BAR.foot(t + periods * T) == pytest.approx(y, abs=1e-12)
        assert BAR.force(t + periods * T) == pytest.approx(p, abs=1e-10)


def test_modal_form():
    """V1.2, seed literature (28)-(31): series of the first impact and the flight after it."""
    x = np.linspace(0.0, LENGTH, 41)[:, np.newaxis]
    n = np.arange(1, 4001)[:, np.newaxis, np.newaxis]
    t = np.linspace(0.0, 2 * TAU, 9)
    nu, lam = (n - 0.5) * np.pi / LENGTH, n * np.pi / LENGTH
    a = -2.0 * G / (C**2 * LENGTH * nu**3)
    impact = (a * np.sin(nu * x) * (1.0 - np.cos(C * nu * t))).sum(axis=0)
    impact -= V0 * np.minimum(x / C, TAU - np.abs(t - TAU))
    assert BAR.displacement(x, 1.0 + t) == pytest.approx(impact - 5.0, abs=1e-6)
    t = np.linspace(0.0, 2.0, 9)
    flight = (4.0 * G / (C**2 * lam**2) * np.cos(lam * x) * np.cos(C * lam * t)).sum(axis=0)
    flight += V0 * t - G * t**2 / 2 - 2.0 * G * LENGTH**2 / (3.0 * C**2)
    assert BAR.displacement(x, 5 / 3 + t) == pytest.approx(flight - 5.0, abs=1e-3)


def test_release_after_the_first_impact():
    """V1.2: uniform velocity v0, strain -2g(L-x)/c², stored energy 74.074, impulse 266.6667
    twice."""
    x = (np.arange(1000) + 0.5) / 100.0
    t2 = 5 / 3
    assert BAR.velocity(x, t2) == pytest.approx(np.full(1000, V0), rel=1e-12)
    assert BAR.strain(x, t2) == pytest.approx(-2.0 * G * (LENGTH - x) / C**2, abs=1e-13)
    assert 450.0 * LENGTH * (BAR.strain(x, t2) ** 2).mean() == pytest.approx(74.074, abs=1e-3)
    for start, end in BAR.contacts(T):
        t = start + (np.arange(1000) + 0.5) / 1000 * (end - start)
        assert BAR.force(t).mean() * (end - start) == pytest.approx(266.6667, abs=5e-5)


@pytest.mark.parametrize("height", [5.0, 4.1, 1.7, 0.3, 0.0])
def test_bar_obeys_its_equations(height):
    """V1.2 for integer and other ratios of the times, and for a bar put on the wall: equations,
    contact, energy."""
    bar = BouncingBar(height=height)
    until = 6.0
    x, t = LENGTH * (0.1 + 0.8 * RANDOM.random(2000)), until * (0.1 + 0.8 * RANDOM.random(2000))
    # the largest of the terms that cancel, five of them
    round_off = 16 * np.finfo(float).eps * G * until**2
    assert wave_defect(bar.displacement, length=LENGTH, c=C, until=until, force=-G) < round_off
    assert derivative_defect(bar.displacement, bar.velocity, x=x, t=t, h=(0.0, 1e-5)) < 1e-8
    assert derivative_defect(bar.displacement, bar.strain, x=x, t=t, h=(1e-4, 0.0)) < 1e-8
    p, y = bar.force(t), bar.foot(t)
    assert (
        p == pytest.approx(-900.0 * bar.strain(0.0, t), abs=1e-10)
        and abs(bar.strain(LENGTH, t)).max() < 1e-14
    )
    assert p.min() >= 0.0 and y.min() > -1e-12 and (p * y).max() < 1e-10
    energy = energies(
        bar.displacement, bar.velocity, bar.strain, length=LENGTH, E=900.0, rho=1.0, t=t[:20], g=G
    )
    scale = 500.0  # kinetic energies at the impact of the bar of V1.2
    # zero level: where it is released
    assert energy == pytest.approx(np.zeros(20), abs=2e-4 * scale)


def test_impulse_is_the_change_of_momentum():
    """V1.2 with an odd height: integral of p less weight is the momentum, at any time."""
    bar = BouncingBar(height=4.1)
    t = (np.arange(200000) + 0.5) / 200000 * 5.0
    x = (np.arange(20000) + 0.5) / 2000
    momentum = LENGTH * bar.velocity(x, 5.0).mean()
    cells = 0.02  # pressure jumps of 600 in cells of 2.5e-5 s
    assert momentum == pytest.approx(5.0 * (bar.force(t).mean() - LENGTH * G), abs=cells)


def test_a_bar_put_on_the_wall_oscillates_about_its_static_pressure():
    """Height 0: p rises to 2 rho g L after 2T and returns to 0 after 4T."""
    bar = BouncingBar(height=0.0)
    assert bar.force([TAU, 2 * TAU, 3 * TAU]) == pytest.approx([100.0, 200.0, 100.0], rel=1e-10)


def test_no_period_for_other_heights():
    with pytest.raises(InputError, match="is 2.71662, which gives no known period"):
        _ = BouncingBar(height=4.1).period
    with pytest.raises(InputError, match="gravity is 0"):
        BouncingBar(gravity=0.0)
