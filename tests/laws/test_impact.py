"""Post-impact laws: what they take (V9.6), restitution of a single mass, the user's own law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bar import bar, energy, run, thrown
from chain import chain_problem, chain_surface, chain_system
from shaken import shaken

from vi_contact.core.errors import InputError
from vi_contact.core.protocols import Impact
from vi_contact.laws.impact import ComponentReset, Elastic, ImpulseUpdate, Inelastic, Newton
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
SCHEMES = [ZienkiewiczWoodTaylor(), SS22(0.6, 0.7), LinearMultistep.newmark()]
IMPACT = Impact(
    before=np.array([2.0, 3.0, -1.0, 5.0]),
    v_n=np.array([0.5, -0.5, 0.2, 4.0]),
    active=np.array([True, True, True, False]),
    closing=np.array([True, False, True, False]),
)


def test_targets():
    """Inelastic: every closed point stops. Newton: those that have just closed leave with e times
    their approach."""
    nan = np.nan
    np.testing.assert_array_equal(Inelastic().target(IMPACT), [0.0, 0.0, 0.0, nan])
    np.testing.assert_array_equal(Newton(0.5).target(IMPACT), [-1.0, nan, 0.0, nan])
    np.testing.assert_array_equal(Elastic().target(IMPACT), [-2.0, nan, 0.0, nan])


@pytest.mark.parametrize("e", [-0.1, 1.1, np.nan])
def test_restitution_out_of_range_is_refused(e):
    with pytest.raises(InputError, match="give a number from 0"):
        Newton(e)


def velocities(n: int = 6) -> np.ndarray:
    return np.random.default_rng(3).normal(size=n)


@pytest.mark.parametrize("target", [[0.0, 0.0], [0.0, np.nan], [0.7, -0.2]])
def test_readings_give_the_target_velocities(target):
    """B v⁺ = target, untouched where it is NaN: unknowns by the reset, contact impulses by the
    projection."""
    target, v = np.array(target), velocities()
    system, surface = chain_system(6, consistent=True), chain_surface(6, left_gap=0.0)
    chosen = ~np.isnan(target)
    for reading in (ComponentReset(), ImpulseUpdate()):
        after = reading(system, surface, v, target)
        np.testing.assert_allclose(surface.normal_values(after)[chosen], target[chosen], atol=1e-14)
        impulse = system.M @ (after - v)
        if isinstance(reading, ImpulseUpdate):
            free = np.ones(6, dtype=bool)
            free[surface.owned[chosen]] = False
            # nothing but the wall pushes
            np.testing.assert_allclose(impulse[free], 0.0, atol=1e-14)
        else:
            np.testing.assert_array_equal(
                np.delete(after, surface.owned[chosen]), np.delete(v, surface.owned[chosen])
            )


def test_V96_mass_projection_takes_the_energy_of_the_jump():
    """V9.6: for e = 0, ½v⁻ᵀMv⁻ - ½v⁺ᵀMv⁺ = ½(v⁻-v⁺)ᵀM(v⁻-v⁺) >= 0, any mass."""
    system, surface, v = (
        chain_system(6, consistent=True),
        chain_surface(6, left_gap=0.0),
        velocities(),
    )
    after = ImpulseUpdate()(system, surface, v, np.zeros(2))
    loss = system.kinetic_energy(v) - system.kinetic_energy(after)
    assert loss > 0.1 * system.kinetic_energy(v)
    assert loss == pytest.approx(system.kinetic_energy(v - after), rel=1e-13)


@pytest.mark.parametrize("e", [0.25, 1.0])
def test_V96_mass_projection_never_gains_when_it_reverses(e):
    """Target -e B v⁻: the loss is (1 - e²) times that of the inelastic collision."""
    system, surface, v = (
        chain_system(6, consistent=True),
        chain_surface(6, left_gap=0.0),
        velocities(),
    )
    project = ImpulseUpdate()
    stopped = project(system, surface, v, np.zeros(2))
    reversed_ = project(system, surface, v, -e * surface.normal_values(v))
    loss = system.kinetic_energy(v) - system.kinetic_energy(reversed_)
    assert loss == pytest.approx(
        (1.0 - e**2) * system.kinetic_energy(v - stopped), rel=1e-12, abs=1e-13
    )


def test_V96_component_reset_of_a_consistent_mass_has_either_sign():
    """V9.6: the energy change of the literal reset is -(e_iᵀMv v_i - ½M_ii v_i²), here once a loss
    and once a gain."""
    system, surface = chain_system(6, consistent=True), chain_surface(6)
    losses = []
    for neighbour in (1.0, -3.0):
        v = np.array([0.0, 0.0, 0.0, 0.0, neighbour, 1.0])
        after = ComponentReset()(system, surface, v, np.zeros(1))
        losses.append(system.kinetic_energy(v) - system.kinetic_energy(after))
        exact = (system.M @ v)[5] * v[5] - 0.5 * system.M.diagonal()[5] * v[5] ** 2
        assert losses[-1] == pytest.approx(exact, rel=1e-13)
    assert losses[0] > 0.0 > losses[1]


def test_V96_both_readings_are_the_same_for_a_lumped_mass():
    system, surface, v = chain_system(6), chain_surface(6, left_gap=0.0), velocities()
    target = np.array([0.3, np.nan])
    reset, projected = (
        reading(system, surface, v, target) for reading in (ComponentReset(), ImpulseUpdate())
    )
    np.testing.assert_allclose(projected, reset, rtol=1e-15)


def test_mass_projection_serves_one_system_after_another():
    project, surface, v = ImpulseUpdate(), chain_surface(6), velocities()
    for consistent in (True, False, True):
        system = chain_system(6, consistent=consistent)
        expected = ImpulseUpdate()(system, surface, v, np.zeros(1))
        np.testing.assert_array_equal(project(system, surface, v, np.zeros(1)), expected)


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("gap", [0.1, 0.13, 0.15, 0.1999])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_single_mass_rebounds_with_e_times_its_speed(scheme, gap, e):
    """A free mass with v = 1 m/s: exactly -e afterwards, wherever in the step the gap closes."""
    problem = chain_problem(1, gap=gap, stiffness=1e-12, mass=3.0, v0=[1.0], impact=Newton(e))
    last = list(run(problem, scheme, dt=0.1, steps=6))[-1]
    assert last.new.v[0] == pytest.approx(-e, abs=1e-11)


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
def test_inelastic_mass_stays_where_it_was_stopped(scheme):
    """Pressed on by a constant force it rests, and the wall carries that force: 7 N in every step
    afterwards."""
    problem = chain_problem(
        1, gap=0.05, stiffness=1e-9, mass=3.0, v0=[1.0], constant=7.0, impact=Inelastic()
    )
    reports = list(run(problem, scheme, dt=0.1, steps=6))
    assert reports[0].new.v[0] == 0.0
    for report in reports[1:]:
        assert report.new.u[0] == 0.05 and report.new.v[0] == 0.0
        assert report.new.r_n[0] == pytest.approx(7.0, rel=1e-9)


@pytest.mark.parametrize("reading", [ComponentReset, ImpulseUpdate])
def test_inelastic_impacts_of_the_thrown_bar_take_less_than_one_percent(reading):
    """V1.1 on 100 elements: the nodal law has no macroscopic effect (E loss <= 1 % of 500 J,
    rebound 10 m/s ± 2 %)."""
    problem = thrown(impact=Inelastic(reading()))
    last = list(run(problem, ZienkiewiczWoodTaylor(), dt=1.0 / 300.0, steps=450))[-1]
    assert 0.99 < energy(problem, last.new) / 500.0 < 1.0
    mean = problem.equations.M @ problem.equations.influence[:, 0] @ last.new.v / 10.0
    assert mean == pytest.approx(10.0, rel=0.02)


class Sticky:
    """A user's own law: closed points creep off the wall with 1 mm/s."""

    def target(self, impact: Impact) -> np.ndarray:
        return np.where(impact.active, -1e-3, np.nan)

    def apply(self, system, surface, v, target):
        return ComponentReset()(system, surface, v, target)


def test_the_users_own_law():
    problem = chain_problem(1, gap=0.05, stiffness=1e-9, v0=[1.0], impact=Sticky())
    first = next(run(problem, ZienkiewiczWoodTaylor(), dt=0.1, steps=1))
    assert first.v_minus[0] == pytest.approx(0.0, abs=1e-9)
    assert first.new.v[0] == -1e-3


def test_what_a_law_is_told():
    """Velocities before and after the step, which points are closed, and which were open before."""
    told: list[Impact] = []

    class Listening(Sticky):
        def target(self, impact):
            told.append(impact)
            return np.full(len(impact.v_n), np.nan)

    problem = shaken(Listening())
    steps = run(problem, ZienkiewiczWoodTaylor(), dt=5e-3, steps=100)
    reports = [report for report in steps if report.new.active.any()]
    assert len(told) == len(reports)
    assert 3 < sum(impact.closing[0] for impact in told) < len(told) - 3
    for impact, report in zip(told, reports, strict=True):
        assert (
            impact.before[0] == report.old.v[-1]
            and impact.v_n[0] == report.v_minus[-1] == report.new.v[-1]
        )
        assert impact.active[0] and impact.closing[0] == (not report.old.active[0])


def test_a_law_is_asked_about_solid_contacts_only():
    """Springs are massless: their points do not collide. Without any closed point the law is not
    asked at all."""

    class Never(Sticky):
        def target(self, impact):
            raise AssertionError("asked")

    hard = bar(4, gap=1.0, v0=lambda x: 0.0 * x - 1.0, impact=Never())
    assert len(list(run(hard, ZienkiewiczWoodTaylor(), dt=0.01, steps=5))) == 5
    soft = bar(4, v0=lambda x: 0.0 * x - 1.0, impact=Never())
    soft = replace(soft, surface=soft.surface.on_springs(1e3))
    reports = list(run(soft, ZienkiewiczWoodTaylor(), dt=0.01, steps=5))
    assert reports[-1].new.active.all()


def test_names_of_laws_are_the_same_in_every_run():
    """They stand in summaries and in names of tests: no address of an object."""
    assert repr(Inelastic(ImpulseUpdate())) == "Inelastic(update=ImpulseUpdate())"
