"""Friction in the schemes with projections and impulses: exact impact (V1.5), ledger and energy
(V9.5, V9.7), stick."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bar import run
from column import column
from energy_checks import course
from rubbing import rubbing_block

from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.moreau_jean import MoreauJean

pytestmark = pytest.mark.serial
STABILISED, INELASTIC, ELASTIC = ContactStabilisedNewmark(), MoreauJean(), MoreauJean(e=1.0)


@pytest.mark.long
@pytest.mark.parametrize("scheme", [STABILISED, INELASTIC, ELASTIC])
def test_V15_oblique_impact(scheme: Any) -> None:
    """V1.5: slip speed 0.575736 during the contact, impulses (2.0, 0.6) on the base, energy 1 -
    0.345442; reactions are means of the steps, whether forces or impulses are what is solved for.
    Courant number one, 100 elements."""
    problem, dt = (
        column(100, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=ConsistentMass()),
        0.01 / np.sqrt(2.0),
    )
    steps = round(1.6 / dt)
    reports: list[Any] = []
    found = course(problem, scheme, dt=dt, steps=steps, seen=reports)
    r_n, r_t = dt * sum(r.new.r_n for r in reports), dt * sum(r.new.r_t for r in reports)
    assert r_n[0] == pytest.approx(2.0, rel=0.01) and r_t[0, 0] == pytest.approx(0.6, rel=0.01)
    base = [
        (report.new.u[0] - report.old.u[0]) / dt for report in reports if 0.2 < report.new.t < 1.2
    ]
    assert np.mean(base) == pytest.approx(0.575736, rel=0.002)
    assert found.last == pytest.approx(1.0 - 0.345442, rel=0.005)
    assert found.rise <= 1e-11 and abs(found.defect) <= 1e-10 and found.friction >= -1e-12


@pytest.mark.parametrize("law", [Coulomb(0.3), Coulomb(0.0), Tresca(0.01)])
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_V95_friction_takes_energy_in_every_step(law: Any, damping: float) -> None:
    """V9.5, V9.7, contact-stabilised: E never rises and the ledger closes, with slips B_t (u1 -
    u0)."""
    found = course(rubbing_block(law, damping=damping), STABILISED, dt=0.1, steps=90)
    assert found.rise <= 1e-11 * found.first and abs(found.defect) <= 1e-10 * found.largest
    assert found.friction >= -1e-12 * found.first
    assert found.min_gap < 1e-12  # it did touch


@pytest.mark.parametrize("law", [Coulomb(0.3), Tresca(0.01)])
@pytest.mark.parametrize("scheme", [INELASTIC, ELASTIC, MoreauJean(1.0)])
def test_V97_ledger_with_impulses_of_friction(scheme: MoreauJean, law: Any) -> None:
    """V9.7, Moreau-Jean; at theta = 1, where law and work are at the same time, friction takes
    energy in every step."""
    found = course(rubbing_block(law), scheme, dt=0.1, steps=150)
    assert abs(found.defect) <= 1e-10 * found.largest
    assert found.min_gap < 0.0 and found.last < 0.999 * found.first
    assert found.contact >= -1e-12 * found.first
    if scheme.theta == 1.0:
        assert found.friction >= -1e-12 * found.first and found.rise <= 1e-11 * found.first


def test_tresca_impulses_grow_with_the_step() -> None:
    """The threshold is a force: the sliding reactions do not depend on dt, in either scheme."""
    for scheme in (STABILISED, INELASTIC):
        for dt in (0.1, 0.01):
            *_, last = run(rubbing_block(Tresca(0.01)), scheme, dt=dt, steps=3)
            assert np.abs(last.new.r_t).max() == pytest.approx(0.01, rel=1e-12)


@pytest.mark.parametrize("scheme", [STABILISED, INELASTIC])
def test_enough_friction_sticks(scheme: Any) -> None:
    """Closed points with friction without limit: no tangential displacement in the step, or no
    velocity at its end."""
    problem, stuck = rubbing_block(Coulomb(1e3)), 0
    for report in run(problem, scheme, dt=0.1, steps=60):
        slip = report.new.u - report.old.u if scheme is STABILISED else report.new.v
        values = problem.surface.tangential_values(slip)[report.new.active]
        assert np.all(np.abs(values) <= 1e-12)
        stuck += len(values)
    assert stuck > 20
