"""Bars without gravity: V1.1 with two sets of data, V1.3."""

import numpy as np
import pytest
from exact_checks import derivative_defect, energies, wave_defect
from exact_columns import reflected

from vi_contact.core.errors import InputError
from vi_contact.exact import PeriodicBar, ThrownBar

pytestmark = pytest.mark.serial
STEEL = ThrownBar(length=0.2, E=2e11, rho=8000.0, height=2e-3, speed=100.0)  # Code_Aster SDNV100
RANDOM = np.random.default_rng(0)


def test_thrown_bar_numbers():
    """V1.1 as printed."""
    bar = ThrownBar()
    assert (bar.wave_speed, bar.crossing) == (30.0, pytest.approx(1 / 3, rel=1e-15))
    assert (bar.contact_start, bar.contact_end) == (0.5, pytest.approx(7 / 6, rel=1e-15))
    assert (bar.pressure, bar.energy) == (300.0, 500.0)
    x = np.linspace(0.0, 10.0, 11)
    assert (bar.velocity(x, 0.4) == -10.0).all() and (bar.velocity(x, 1.2) == 10.0).all()
    assert (bar.strain(x, 1.2) == 0.0).all()
    assert np.allclose(bar.displacement(x, 1.2), -5.0 + 10.0 * (1.2 - 7 / 6), rtol=1e-14)
    assert bar.force([0.49, 0.51, 1.16, 1.17]).tolist() == [0.0, 300.0, 300.0, 0.0]
    assert bar.contacts(1.0).tolist() == [[0.5, 1.0]] and bar.contacts(0.5).shape == (0, 2)


def test_thrown_steel_bar_numbers():
    """V1.1, the published second data set."""
    assert STEEL.wave_speed == pytest.approx(5000.0)
    assert (STEEL.contact_start, STEEL.contact_end) == (pytest.approx(2e-5), pytest.approx(1e-4))
    # the top: -4 mm since touch-down
    assert STEEL.displacement([0.0, 0.2], 6e-5) == pytest.approx([-2e-3, -6e-3])
    assert STEEL.energy == pytest.approx(8e6) and STEEL.pressure == pytest.approx(4e9)
    assert STEEL.velocity(0.2, [1e-5, 9e-5]) == pytest.approx([-100.0, 100.0])


def test_thrown_bar_is_a_free_bar_under_its_contact_force():
    """V1.1: the closed form is the sum of the waves that the constant pressure sends up."""
    x, t = 10.0 * RANDOM.random(500), 2.0 * RANDOM.random(500)
    bar = ThrownBar()
    waves = reflected(lambda s: 10.0 * np.clip(s, 0.0, 2 / 3), x / 30.0, t - 0.5, crossing=1 / 3)
    assert bar.displacement(x, t) == pytest.approx(waves - 10.0 * t, abs=1e-13)


@pytest.mark.parametrize(
    ("bar", "length", "E", "rho", "until"),
    [
        (ThrownBar(), 10.0, 900.0, 1.0, 2.0),
        (STEEL, 0.2, 2e11, 8000.0, 2e-4),
        (PeriodicBar(), 1.0, 1.0, 1.0, 7.0),
    ],
)
def test_bar_obeys_its_equations(bar, length, E, rho, until):
    """V1.1, V1.3: wave equation, derivatives, force = -E strain at the foot, complementarity,
    energy."""
    c = (E / rho) ** 0.5
    x, t = length * (0.1 + 0.8 * RANDOM.random(2000)), until * (0.1 + 0.8 * RANDOM.random(2000))
    top = np.abs(bar.displacement(x, t)).max()
    assert wave_defect(bar.displacement, length=length, c=c, until=until) < 1e-14 * top
    h = 1e-3 * length
    fast = np.abs(bar.velocity(x, t)).max()
    assert derivative_defect(bar.displacement, bar.velocity, x=x, t=t, h=(0.0, h / c)) < 1e-9 * fast
    assert derivative_defect(bar.displacement, bar.strain, x=x, t=t, h=(h, 0.0)) < 1e-9 * fast / c
    gap = bar.displacement(0.0, t) + getattr(bar, "height", 0.0)
    p = bar.force(t)
    assert p == pytest.approx(-E * bar.strain(0.0, t), abs=1e-13 * p.max())
    assert (
        gap.min() > -1e-14 * top
        and (p * gap).max() < 1e-14 * top * p.max()
        and (gap <= 1e-14 * top).sum() > 100
    )
    energy = energies(
        bar.displacement, bar.velocity, bar.strain, length=length, E=E, rho=rho, t=t[:50]
    )
    assert energy == pytest.approx(bar.energy, rel=2e-4)  # a front inside a cell


def test_impulse_is_the_change_of_momentum():
    """V1.1: 2 rho length v0."""
    for bar in (ThrownBar(), STEEL):
        impulse = bar.pressure * (bar.contact_end - bar.contact_start)
        assert impulse == pytest.approx(2.0 * bar.rho * bar.length * bar.speed, rel=1e-14)


def test_periodic_bar_numbers():
    """V1.3: foot, force and period."""
    bar = PeriodicBar()
    t = np.array([0.25, 0.75, 1.25, 1.75, 2.25, 2.75])
    assert bar.displacement(0.0, t).tolist() == [0.375, 0.125, 0.0, 0.0, 0.125, 0.375]
    assert bar.force(t).tolist() == [0.0, 0.0, 0.5, 0.5, 0.0, 0.0]
    x = np.linspace(0.0, 1.0, 9)[:, np.newaxis]
    assert (bar.displacement(x, t + bar.period) == bar.displacement(x, t)).all()
    assert bar.displacement(x, 0.0).ravel().tolist() == (0.5 - 0.5 * x).ravel().tolist()
    assert (bar.displacement(1.0, np.linspace(0.0, 3.0, 100)) == 0.0).all()
    assert bar.contacts(4.5).tolist() == [[1.0, 2.0], [4.0, 4.5]]


def test_wrong_data_are_refused():
    with pytest.raises(
        InputError, match="ThrownBar: speed is -1.0; give a finite number above zero"
    ):
        ThrownBar(speed=-1.0)
    with pytest.raises(InputError, match="height is nan; give zero or a positive"):
        ThrownBar(height=float("nan"))
