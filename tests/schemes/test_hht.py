"""HHT: range, spectrum at infinity, order, and what it does with mass at the contact (V9.2)."""

from __future__ import annotations

import numpy as np
import pytest
from amplification import amplification
from bar import energy, period_three, run, thrown
from oscillator import observed_order

from vi_contact.core.errors import InputError
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.schemes.hht import HHT
from vi_contact.schemes.newmark import Newmark

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("alpha", [-0.34, 0.01, 0.1, np.nan])
def test_unstable_members_are_refused(alpha: float) -> None:
    with pytest.raises(InputError, match="from -1/3 to 0"):
        HHT(alpha)


@pytest.mark.parametrize("alpha", [0.0, -0.05, -0.1, -1 / 3])
def test_order_and_spectrum(alpha: float) -> None:
    """Order 2; no frequency grows; (1 + alpha)/(1 - alpha) at infinite frequency."""
    assert observed_order(HHT(alpha), steps=100) == pytest.approx(2.0, abs=0.1)
    for frequency in np.logspace(-2, 4, 7):
        for damping in (0.0, 0.1):
            assert (
                np.abs(np.linalg.eigvals(amplification(HHT(alpha), frequency, damping))).max()
                <= 1.0 + 2e-6
            )
    at_infinity = np.abs(np.linalg.eigvals(amplification(HHT(alpha), 1e7))).max()
    assert at_infinity == pytest.approx((1.0 + alpha) / (1.0 - alpha), abs=1e-3)


def test_alpha_zero_is_newmark() -> None:
    """With contact, step by step; the ledger's means differ."""
    problem = thrown(20, mass=Redistributed())
    runs = (run(problem, scheme, dt=1 / 60, steps=100) for scheme in (HHT(0.0), Newmark()))
    for one, two in zip(*runs, strict=True):
        assert np.array_equal(one.new.u, two.new.u) and np.array_equal(one.new.r_n, two.new.r_n)


@pytest.mark.slow
def test_V92_mass_at_the_contact() -> None:
    """V1.3, four bounces at Courant number one: no gain on consistent mass; two with a dt that
    resolves the highest frequency (Courant number 0.1): the energy multiplies. On redistributed
    mass no gain in four bounces at one, nor in one bounce at 0.1 (V9.4)."""
    for mass, elements, courant, t_end, low, high in (
        (ConsistentMass(), 100, 1.0, 12, 0.94, 0.96),
        (Redistributed(), 100, 1.0, 12, 0.95, 0.965),
        (ConsistentMass(), 25, 0.1, 6, 2.0, 30.0),
        (Redistributed(), 50, 0.1, 3, 0.977, 0.983),
    ):
        problem = period_three(elements, mass=mass)
        dt = courant / problem.equations.rows
        *_, last = run(problem, HHT(-0.1), dt=dt, steps=round(t_end / dt))
        assert low < energy(problem, last.new) / 0.125 < high
