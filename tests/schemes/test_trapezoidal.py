"""The default scheme: trapezoidal rule on redistributed mass (1.7, V9.4, V9.7, V9.8)."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import bar, before_impact, bouncing, energy, period_three, run, thrown
from oscillator import last_state, observed_order, oscillators
from shaken import shaken

from vi_contact.core.ledger import energy_balance
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
DEFAULT = Trapezoidal()
MASSLESS = Redistributed()


def ledger(problem: ContactProblem, **marching: Any) -> dict[str, float]:
    """Largest defect, and sums of the losses, relative to the largest energy."""
    largest, defect, contact, algorithmic, change = 0.0, 0.0, 0.0, 0.0, 0.0
    for report in run(problem, DEFAULT, **marching):
        step = energy_balance(problem, report.old, before_impact(report), report.balance)
        system = problem.equations
        largest = max(
            largest, system.kinetic_energy(report.new.v) + system.strain_energy(report.new.u)
        )
        defect, algorithmic = max(defect, abs(step.defect)), algorithmic + abs(step.algorithmic)
        contact, change = contact + step.contact, change + step.change
    return {
        "defect": defect / largest,
        "contact": contact / largest,
        "algorithmic": algorithmic / largest,
    }


def test_second_order_without_contact() -> None:
    """With damping, constant load and base motion."""
    assert observed_order(DEFAULT) == pytest.approx(2.0, abs=0.05)


def test_without_contact_it_is_the_midpoint_rule_but_for_the_load() -> None:
    """Same (u, v) as the midpoint rule under constant loads, to round-off."""
    problem = oscillators(damping=0.01, constant=4.0)
    ours, theirs = (
        last_state(problem, s, dt=0.01, steps=200) for s in (DEFAULT, ZienkiewiczWoodTaylor())
    )
    assert np.allclose(ours.u, theirs.u, rtol=0.0, atol=1e-12 * np.abs(theirs.u).max())
    assert np.allclose(ours.v, theirs.v, rtol=0.0, atol=1e-12 * np.abs(theirs.v).max())


@pytest.mark.parametrize(
    ("given", "courant"), [(thrown, 0.5), (bouncing, 1.0), (period_three, 1.0), (period_three, 0.1)]
)
@pytest.mark.promise(
    "guide/schemes.md", "that the [ledger](../start/model.md#energy-ledger) has no"
)
def test_ledger_closes(given: Any, courant: float) -> None:
    """V9.7: defect <= 1e-10 of the largest energy in every step; V9.4: nothing is lost but contact
    work."""
    problem = given(25, mass=MASSLESS)
    wave = 1.0 if given is period_three else 30.0
    dt = courant * (1.0 if given is period_three else 10.0) / 25 / wave
    found = ledger(problem, dt=dt, steps=int(200 / courant))
    assert found["defect"] <= 1e-12
    assert found["algorithmic"] <= 1e-10
    assert abs(found["contact"]) <= 0.05


def test_ledger_closes_with_damping_base_motion_and_springs() -> None:
    """The chain of shaken.py has both; its lumped masses stay (consistent mass asked for by
    name)."""
    assert (
        ledger(replace(shaken(), mass=ConsistentMass(), impact=None), dt=0.004, steps=300)["defect"]
        <= 1e-12
    )
    damped = bar(40, gap=5.0, v0=lambda x: np.full_like(x, -10.0), damping=1e-3, mass=MASSLESS)
    assert ledger(damped, dt=0.25 / 30, steps=200)["defect"] <= 1e-12


def test_contact_work_is_the_one_of_the_trapezium() -> None:
    """V9.4: ½ (r1 g0 - r0 g1) in every step."""
    problem = thrown(40, mass=MASSLESS)
    worst, seen = 0.0, 0.0
    for report in run(problem, DEFAULT, dt=0.25 / 30, steps=200):
        g0, g1 = (
            problem.surface.gap0 - problem.surface.normal_values(s.u)
            for s in (report.old, report.new)
        )
        wanted = 0.5 * float(report.new.r_n @ g0 - report.old.r_n @ g1)
        lost = energy_balance(problem, report.old, report.new, report.balance).contact
        worst, seen = max(worst, abs(lost - wanted)), max(seen, abs(wanted))
    assert seen > 0.01 and worst <= 1e-11 * 500.0


def test_momentum() -> None:
    """V9.8: the impulse of the contact force is the change of momentum, to 1e-12, in every step."""
    problem = bouncing(60, mass=MASSLESS)
    system, dt = problem.equations, 10.0 / 60 / 30
    r = system.influence[:, 0]
    total = float(r @ (system.M @ r))
    for report in run(problem, DEFAULT, dt=dt, steps=700):
        before, after = (float(r @ (system.M @ s.v)) for s in (report.old, report.new))
        impulse = dt * (float(report.balance.r_n.sum()) - 10.0 * total)
        assert after - before == pytest.approx(impulse, abs=1e-12 * 10.0 * total)


def test_initial_data_are_put_into_equilibrium_once() -> None:
    """V1.3 starts with a stressed free end, which a massless node cannot hold: its equilibrium is
    found at the start, costs the energy of the first element (1/N), and is kept by restarts."""
    problem = period_three(50, mass=MASSLESS)
    start = DEFAULT.start(problem, initial_state(problem), 0.01)
    assert energy(problem, start) == pytest.approx(0.125 * (1.0 - 1.0 / 50), rel=1e-12)
    assert DEFAULT.start(problem, start, 0.02) is start
    system = problem.equations
    reaction = problem.surface.reaction_load(start.r_n, system.rows)
    force = system.load(start.t) - system.K @ start.u - reaction
    assert np.abs(force[system.massless]).max() <= 1e-12


def test_gravity_stage_stays_still() -> None:
    """A bar that stands on the ground in equilibrium does not move when the dynamics begin."""
    # hangs from its clamped top and touches below
    problem = bar(40, clamped=True, gravity=10.0, mass=MASSLESS)
    rest = static_equilibrium(problem, solver=Condensed())
    for report in run(problem, DEFAULT, dt=0.01, steps=50, state=rest):
        assert np.abs(report.new.u - rest.u).max() <= 1e-12 * np.abs(rest.u).max()


def test_restart_in_mid_run_is_exact() -> None:
    """The memory holds all that the scheme carries."""
    problem = thrown(30, mass=MASSLESS)
    states = [report.new for report in run(problem, DEFAULT, dt=0.01, steps=90)]
    again = [report.new for report in run(problem, DEFAULT, dt=0.01, steps=40, state=states[49])]
    assert np.array_equal(again[-1].u, states[-1].u) and np.array_equal(again[-1].v, states[-1].v)


@pytest.mark.parametrize("damping", [0.0, 1e-4, 1e-2])
def test_damping_does_not_ring_in_the_contact_layer(damping: float) -> None:
    """Stiffness-proportional damping of the massless nodes goes inwards with their mass: the force
    stays smooth, and near 300 (strong damping smears the front, but 0.1 s after the impact it is
    within 5 %)."""
    problem = thrown(50, damping=damping, mass=MASSLESS)
    force = np.array(
        [report.new.r_n[0] for report in run(problem, DEFAULT, dt=1 / 300, steps=300)]
    )[180:]
    assert np.abs(force / 300.0 - 1.0).max() <= 0.05
    assert np.abs(np.diff(force)).max() <= 1.0


def test_mass_at_the_contact_is_a_choice_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    """Consistent mass makes it Newmark(¼, ½): V1.3 gains more than tenfold energy; told once, with
    figures."""
    problem = period_three(100, mass=ConsistentMass())
    with caplog.at_level(logging.WARNING):
        last = [report.new for report in run(problem, DEFAULT, dt=0.01, steps=1200)][-1]
    assert energy(problem, last) > 10.0 * 0.125
    assert len(caplog.records) == 1 and "can gain energy whenever a contact opens" in caplog.text
