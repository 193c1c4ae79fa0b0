"""Houbolt: its formulas, order, spectrum, and contact with mass at the contact nodes (V4.1,
V9.2)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bar import bouncing, energy, period_three, run, thrown
from oscillator import last_state, observed_order, oscillators

from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.schemes.houbolt import Houbolt
from vi_contact.schemes.linear_multistep import LinearMultistep

pytestmark = pytest.mark.serial
SCHEME = Houbolt()


def test_V41_is_the_cubic_member_of_the_family() -> None:
    """Eqs. 11a,b with the coefficients of a cubic through four levels: exact for 1, t, t², t³."""
    level = -np.arange(4.0)
    for power in range(4):
        u, v = level**power, power * 0.0 ** max(power - 1, 0)
        a = power * (power - 1) * 0.0 ** max(power - 2, 0)
        assert np.dot(SCHEME.a, u) == pytest.approx(v, abs=1e-14)
        assert np.dot(SCHEME.gamma, u) == pytest.approx(a, abs=1e-14)
    assert SCHEME.b == (1.0, 0.0, 0.0, 0.0) and SCHEME.mu == 1.0
    assert repr(SCHEME) == "Houbolt()"


def test_same_as_the_family() -> None:
    """The general class with these coefficients gives the same run."""
    general = LinearMultistep(SCHEME.a, SCHEME.b, SCHEME.gamma)
    problem = thrown(20, mass=Redistributed())
    runs = (run(problem, scheme, dt=1 / 60, steps=90) for scheme in (SCHEME, general))
    for one, two in zip(*runs, strict=True):
        assert np.array_equal(one.new.u, two.new.u) and np.array_equal(one.new.r_n, two.new.r_n)


def test_second_order() -> None:
    assert observed_order(SCHEME, steps=400) == pytest.approx(2.0, abs=0.1)


def test_unconditionally_stable_and_without_high_frequencies() -> None:
    """No frequency grows, damped or not; all three roots vanish at infinite frequency."""
    assert SCHEME.spectral_radius() <= 1.0 + 1e-9
    a, gamma = np.array(SCHEME.a), np.array(SCHEME.gamma)
    one = np.array([1.0, 0.0, 0.0, 0.0])
    for w in np.logspace(-2, 4, 25):
        for xi in (0.0, 0.05, 0.5):
            assert np.abs(np.roots(gamma + 2.0 * xi * w * a + w**2 * one)).max() <= 1.0 + 1e-9
    assert np.abs(np.roots(gamma + 1e12 * one)).max() <= 2e-4


@pytest.mark.parametrize(("steps", "loss"), [(20, 0.063), (50, 0.0061)])
def test_amplitude_loss(steps: int, loss: float) -> None:
    """6 % of the amplitude a period with 20 steps a period, 0.6 % with 50."""
    w = 2.0 * np.pi
    problem = oscillators(1, mass=1.0, stiffness=w**2, u0=[1.0], v0=[0.0])

    def size(state: Any) -> float:
        return float(np.hypot(w * state.u[0], state.v[0]))

    early, late = (
        size(last_state(problem, SCHEME, dt=1 / steps, steps=n * steps)) for n in (5, 10)
    )
    assert 1.0 - (late / early) ** 0.2 == pytest.approx(loss, rel=0.02)


@pytest.mark.parametrize(
    ("courant", "ends", "mass"),
    [
        (1.0, 0.886, ConsistentMass()),
        (1.0, 0.886, Redistributed()),
        (0.5, 0.933, Redistributed()),
    ],
    ids=["consistent", "massless", "massless, finer"],
)
def test_V92_no_energy_from_contact_on_either_mass(courant: float, ends: float, mass: Any) -> None:
    """V1.3: four bounces end with 0.89 and 0.93 of the energy, which is never exceeded."""
    problem = period_three(100, mass=mass)
    energies = [
        energy(problem, r.new) / 0.125
        for r in run(problem, SCHEME, dt=courant / 100, steps=round(1200 / courant))
    ]
    assert energies[-1] == pytest.approx(ends, abs=3e-3) and max(energies) <= 1.0 + 1e-9


@pytest.mark.long
def test_V92_falling_bar_with_a_small_step() -> None:
    """V1.2 on consistent mass at Courant number 0.1, where Newmark reaches 11 E0: energy is never
    exceeded."""
    problem = bouncing(50, mass=ConsistentMass())
    energies = [
        energy(problem, r.new) / 500.0 + 1.0 for r in run(problem, SCHEME, dt=0.1 / 150, steps=2700)
    ]
    assert energies[-1] > 0.97 and max(energies) <= 1.0 + 1e-9
