"""The midpoint rule is Zienkiewicz-Wood-Taylor(½), SS22(½, ½) and Kane's rule: (ii) of table 1.7;
V9.1."""

from __future__ import annotations

import numpy as np
import pytest
from bar import bar, before_impact, bouncing, energy, period_three, run, thrown
from column import column
from kane import kane
from oscillator import SHAKEN, observed_order
from shaken import shaken

from vi_contact.core.errors import InputError
from vi_contact.core.ledger import compute_energies, energy_balance
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
SCHEME, CONSISTENT = Midpoint(), ConsistentMass()


@pytest.mark.parametrize("other", [ZienkiewiczWoodTaylor(0.5), SS22(0.5, 0.5)], ids=repr)
def test_17_same_as_its_other_names_over_the_thrown_bar(other: object) -> None:
    """Table 1.7 (ii): V1.1 from flight through contact to flight, every step to 1e-10. It starts 5
    cm above the wall instead of 5 m, or the closing velocity would show the rounding errors of 5 m
    over dt."""
    closed = 0
    problem = bar(100, gap=0.05, v0=lambda x: np.full_like(x, -10.0), mass=CONSISTENT)
    for one, two in zip(
        run(problem, SCHEME, dt=1 / 301, steps=300),
        run(problem, other, dt=1 / 301, steps=300),
        strict=True,
    ):
        assert np.abs(one.new.u - two.new.u).max() <= 1e-10 * np.abs(two.new.u).max()
        assert np.abs(one.new.v - two.new.v).max() <= 1e-10 * np.abs(two.new.v).max()
        assert abs(one.new.r_n[0] - two.new.r_n[0]) <= 1e-10 * 300.0
        assert one.new.active == two.new.active
        closed += one.new.active[0]
    assert closed > 150


def test_17_same_as_kane_step_by_step() -> None:
    """Table 1.7 (ii): the other derivation, from the same state, to 1e-10. Kane's formulas have the
    contact last."""
    dt, closed = 5e-3, 0
    undamped = shaken(excitation=(), v0=np.ones(6), damping=0.0)
    for report in run(undamped, SCHEME, dt=dt, steps=200):
        u, v, r = kane(undamped, report.old.u, report.old.v, dt)
        assert np.abs(report.new.u - u).max() <= 1e-10 * max(np.abs(u).max(), 0.01)
        assert np.abs(report.new.v - v).max() <= 1e-10 * np.abs(v).max()
        assert abs(report.new.r_n[0] - r) <= 1e-10 * max(r, 100.0)
        closed += r > 0.0
    assert 10 < closed < 150


def test_second_order() -> None:
    assert observed_order(SCHEME) == pytest.approx(2.0, abs=0.06)


@pytest.mark.parametrize("given", [thrown, bouncing, period_three])
def test_V91_contact_never_creates_energy_and_the_ledger_closes(given: object) -> None:
    """V9.1: the change is minus r_n times the gap before the closure; V9.7 to 1e-12 of the largest
    energy."""
    dt = 0.5 / 40 * (1.0 if given is period_three else 1 / 3)
    problem, largest = given(40, mass=CONSISTENT), 0.0  # type: ignore[operator]
    gap0 = problem.surface.gap0
    for report in run(problem, SCHEME, dt=dt, steps=450):
        step = energy_balance(problem, report.old, report.new, report.balance)
        largest = max(
            largest, compute_energies(problem.equations, report.new.u, report.new.v).total
        )
        loss = float(report.new.r_n @ (gap0 - problem.surface.normal_values(report.old.u)))
        change = energy(problem, report.new) - energy(problem, report.old)
        assert abs(step.defect) <= 1e-12 * largest
        assert change == pytest.approx(-loss, abs=1e-11 * largest) and loss >= -1e-12 * largest


def test_V91_friction_takes_energy_and_the_ledger_closes() -> None:
    """V9.1: D_fric = r_t·du_t >= 0 in every step of the oblique impact (V1.5); impulses change
    momentum (V9.8)."""
    problem, dt = (
        column(50, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=CONSISTENT),
        0.02 / np.sqrt(2.0),
    )
    system, work = problem.equations, 0.0
    for report in run(problem, SCHEME, dt=dt, steps=120):
        step = energy_balance(problem, report.old, report.new, report.balance)
        assert abs(step.defect) <= 1e-12 and step.friction >= -1e-14 and step.contact >= -1e-14
        change = system.influence.T @ (system.M @ (report.new.v - report.old.v))
        r_t = report.balance.r_t
        assert r_t is not None
        np.testing.assert_allclose(
            change, -dt * np.array([r_t[0, 0], -report.balance.r_n[0]]), atol=1e-12
        )
        work += step.friction
    assert work == pytest.approx(0.345442, rel=0.01)


def test_V97_ledger_with_damping_base_motion_and_impacts() -> None:
    for problem in (
        shaken(Inelastic()),
        thrown(30, damping=1e-3, excitation=SHAKEN, mass=CONSISTENT),
    ):
        largest = 0.0
        for report in run(problem, SCHEME, dt=0.005, steps=300):
            step = energy_balance(problem, report.old, before_impact(report), report.balance)
            largest = max(
                largest, compute_energies(problem.equations, report.new.u, report.new.v).total
            )
            assert abs(step.defect) <= 1e-12 * largest


def test_needs_mass_at_the_contact() -> None:
    with pytest.raises(InputError, match="Midpoint needs mass at the contact nodes"):
        SCHEME.check(thrown(10, mass=Redistributed()))
    assert repr(SCHEME) == "Midpoint()" and isinstance(SCHEME.mass, ConsistentMass)
