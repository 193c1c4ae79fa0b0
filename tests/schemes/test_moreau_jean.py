"""Moreau-Jean: impulses on velocities, restitution, energy (V9.3), drift of the gap, table 1.7."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import bar, before_impact, bouncing, energy, period_three, run, thrown
from chain import chain_problem
from energy_checks import course
from oscillator import FAR, amplification, observed_order
from scheme_checks import check_positive_homogeneity, check_restart_from_bare_states

from vi_contact.core.errors import InputError
from vi_contact.core.ledger import energy_balance
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.recorders import Contact
from vi_contact.run.time_steps import HalvedAtImpact
from vi_contact.schemes.moreau_jean import MoreauJean

pytestmark = pytest.mark.serial
MASS: dict[str, Any] = {"mass": ConsistentMass()}
INELASTIC, ELASTIC = MoreauJean(), MoreauJean(e=1.0)
LITERAL = MoreauJean(allow_energy_gain=True)
DISSIPATIVE = [
    INELASTIC,
    ELASTIC,
    MoreauJean(e=0.5),
    MoreauJean(0.6),
    MoreauJean(2.0 / 3.0, 0.5),
    MoreauJean(1.0),
]
# 25 elements: (bar, steps in a second at Courant number one, steps for a fall and an impact,
# energy)
BARS = {
    "V1.1": (thrown, 75, 113, 500.0),
    "V1.2": (bouncing, 75, 160, 500.0),
    "V1.3": (period_three, 25, 75, 0.125),
}


def chain(n: int = 6, **more: Any) -> ContactProblem:
    """The chain with its own mass matrix, asked for by name."""
    return replace(chain_problem(n, **more), mass=ConsistentMass())


def rattling(seed: int) -> ContactProblem:
    """A free chain between two walls: impacts at both ends, points that bounce, press and separate
    again."""
    rng = np.random.default_rng(seed)
    gaps = 0.01 * rng.random(2)
    motion = {"v0": rng.normal(size=6), "constant": 20.0 * rng.normal()}
    return chain(gap=gaps[0], left_gap=gaps[1], consistent=True, floating=True, **motion)


@pytest.mark.parametrize("e", [-0.1, 1.1, np.nan])
def test_restitution_is_from_zero_to_one(e):
    with pytest.raises(InputError, match="MoreauJean: e is .*give a restitution"):
        MoreauJean(e=e)


@pytest.mark.parametrize("theta", [0.49, 1.01, np.nan])
def test_unstable_weights_are_refused(theta):
    with pytest.raises(InputError, match="less is unstable"):
        MoreauJean(theta, allow_energy_gain=True)


@pytest.mark.parametrize(("theta", "e"), [(0.6, 1.0), (0.51, 1.0), (0.67, 0.5), (1.0, 0.1)])
def test_V93_weights_that_create_energy_are_refused(theta, e):
    """V9.3: dissipative only for ½ <= theta <= 1/(1 + e)."""
    with pytest.raises(
        InputError, match=r"creates energy in impacts: give theta from 0.5 to 1/\(1 \+ e\)"
    ):
        MoreauJean(theta, e)
    assert MoreauJean(theta, e, allow_energy_gain=True).theta == theta
    assert MoreauJean(1.0 / (1.0 + e), e).e == e


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        (thrown(mass=Redistributed()), "MoreauJean needs mass at the contact nodes"),
        (thrown(impact=Inelastic(), **MASS), "has its own restitution coefficient"),
        (chain(gap=0.01), "do not fit elastic supports"),
        (chain(gap=0.01), "bilateral points"),
    ],
)
def test_what_cannot_work_is_refused(problem, words):
    surface = problem.surface
    if "supports" in words:
        problem = replace(problem, surface=surface.on_springs(1e4))
    if "bilateral" in words:
        problem = replace(problem, surface=surface.bilateral_everywhere())
    with pytest.raises(InputError, match=words):
        INELASTIC.check(problem)


@pytest.mark.parametrize(("theta", "order"), [(0.5, 2.0), (0.6, 1.0), (1.0, 1.0)])
def test_order_and_stability_without_contact(theta, order):
    """Second order at theta = ½, else first, with damping, constant load and base motion; stable at
    every frequency."""
    scheme = MoreauJean(theta)
    assert observed_order(scheme, steps=400 if theta == 1.0 else 200) == pytest.approx(
        order, abs=0.06
    )
    for frequency in np.logspace(-2, 4, 7):
        for damping in (0.0, 0.3):
            radius = np.abs(
                np.linalg.eigvals(amplification(scheme, frequency=frequency, damping=damping))
            )
            assert radius.max() <= 1.0 + 1e-9
            if theta == 0.5 and damping == 0.0:
                np.testing.assert_allclose(radius, 1.0, atol=1e-9)


def pressures(scheme: Any, courant: float) -> tuple[np.ndarray, np.ndarray, float, float]:
    """V1.1 on 100 elements: (t, p, E_end/E0, smallest gap)."""
    problem, dt = thrown(**MASS), courant / 300.0
    reports = list(run(problem, scheme, dt=dt, steps=round(1.5 / dt)))
    t, p, gap = np.array([(r.new.t, r.new.r_n[0], 5.0 - r.new.u[0]) for r in reports]).T
    return t, p, energy(problem, reports[-1].new) / 500.0, float(gap.min())


@pytest.mark.parametrize(("courant", "oscillation"), [(0.5, 0.001), (1.0, 0.002), (2.0, 0.003)])
def test_V11_pressure_does_not_oscillate_without_restitution(courant, oscillation):
    """Table 1.7, e = 0: error of the contact pressure, E_end/E0 = 0.9942, the mean force of the
    step is 300; the gap closes late, by ½ dt v0 = 1.67e-2 at Courant number one."""
    t, p, share, gap = pressures(INELASTIC, courant)
    assert np.abs(p[(t > 0.6) & (t < 1.067)] / 300.0 - 1.0).max() == pytest.approx(
        oscillation, abs=6e-4
    )
    assert gap == pytest.approx(-0.5 * courant / 300.0 * 10.0, rel=1e-6)
    assert p.sum() * courant / 300.0 == pytest.approx(200.0, rel=0.015)  # impulse 2 rho L v0
    if courant == 1.0:
        assert share == pytest.approx(0.9942, abs=5e-5)


@pytest.mark.parametrize(("courant", "oscillation"), [(0.5, 1.15), (1.0, 1.01), (2.0, 1.04)])
def test_V11_restitution_of_nodes_chatters(courant, oscillation):
    """Table 1.7, e = 1: the contact node hammers, the energy stays as it is."""
    t, p, share, _ = pressures(ELASTIC, courant)
    assert np.abs(p[(t > 0.6) & (t < 1.067)] / 300.0 - 1.0).max() == pytest.approx(
        oscillation, abs=0.005
    )
    assert share == pytest.approx(1.0, abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "share", "periods"), [(LITERAL, 0.940, 5), (ELASTIC, 1.000, 1)])
def test_V12_energy_after_five_periods(scheme, share, periods):
    """Table 1.7: E/E0 after five periods of the bouncing bar at Courant number one, with Newton's
    law to the letter; that nothing is lost with e = 1 is seen after one."""
    problem = bouncing(**MASS)
    *_, last = run(problem, scheme, dt=1 / 300, steps=1600 * periods)
    assert energy(problem, last.new) / 500.0 + 1.0 == pytest.approx(share, abs=5e-4)


@pytest.mark.slow
def test_V12_energy_falls_monotonically_over_five_periods():
    """1.7 (iii): the default is dissipative in every step, at the price of 0.937 instead of 0.940
    in the end."""
    found = course(bouncing(**MASS), INELASTIC, dt=1 / 300, steps=8000)
    assert found.rise <= 1e-11 * 500.0 and abs(found.defect) <= 1e-10 * found.largest
    assert found.last / 500.0 + 1.0 == pytest.approx(0.940, abs=4e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "courant", "scheme"),
    [
        ("V1.1", 1.0, INELASTIC),
        ("V1.1", 0.5, MoreauJean(2.0 / 3.0, 0.5)),
        ("V1.2", 1.0, ELASTIC),
        ("V1.2", 0.5, INELASTIC),
        ("V1.3", 1.0, MoreauJean(2.0 / 3.0, 0.5)),
        ("V1.3", 0.1, ELASTIC),
        ("V1.3", 0.1, INELASTIC),
    ],
)
def test_V93_energy_never_rises_on_bars(name, courant, scheme):
    """V9.3, V9.7: no step gains 1e-11 E0 under constant load, every ledger closes."""
    body, rate, steps, E0 = BARS[name]
    found = course(body(25, **MASS), scheme, dt=courant / rate, steps=round(steps / courant))
    assert found.rise <= 1e-11 * E0
    assert abs(found.defect) <= 1e-10 * found.largest
    assert min(found.contact, found.algorithmic) >= -1e-12 * E0


@pytest.mark.slow
@pytest.mark.parametrize("scheme", DISSIPATIVE)
def test_V93_energy_never_rises_where_points_separate(scheme):
    """V9.3: points that separate within a drifted gap and are caught again create no energy
    either."""
    caught = 0
    for seed in (2, 3):
        problem = rattling(seed)
        last = E0 = energy(problem, initial_state(problem))
        for report in run(problem, scheme, dt=5e-3, steps=200):
            rise, last = energy(problem, report.new) - last, energy(problem, report.new)
            taken = energy_balance(
                problem, report.old, before_impact(report), report.balance
            ).contact
            assert rise <= 1e-11 * E0 and taken >= -1e-12 * E0
            separating = problem.surface.normal_values(report.old.v) < 0.0
            caught += int(np.sum(separating & (report.new.r_n > 0.0)))
    assert caught > 0 or scheme in (ELASTIC, MoreauJean(1.0))


def test_V93_newtons_law_on_separating_points_gains_energy():
    """Why they have a bound of their own: with the literal law the same runs gain, with e = ½ a
    thousandth at once."""
    for e, least in ((0.0, 4e-6), (0.5, 1e-4)):
        found = course(rattling(2), MoreauJean(0.5, e, allow_energy_gain=True), dt=5e-3, steps=200)
        assert found.rise > least * found.first and found.contact < -least * found.first


def test_V93_negative_test():
    """V9.3: theta = 0.6, e = 1 gains energy in impacts: more than 0.5 % of all there is in a single
    step of V1.1."""
    found = course(
        thrown(**MASS), MoreauJean(0.6, 1.0, allow_energy_gain=True), dt=1 / 300, steps=450
    )
    assert found.rise > 5e-3 * 500.0 and found.contact < -5e-3 * 500.0
    assert abs(found.defect) <= 1e-10 * found.largest


@pytest.mark.parametrize("scheme", DISSIPATIVE)
def test_V93_identity(scheme):
    """V9.3: E1 - E0 = -v_θ·BᵀP - (θ - ½)(|Δv|²_M + |Δu|²_K), and P B v_θ = ((1 - θ) - θ e) P B v0
    for an approach."""
    problem, dt, impacts = rattling(1), 5e-3, 0
    surface, system, theta = problem.surface, problem.equations, scheme.theta
    E0 = energy(problem, initial_state(problem))
    for report in run(problem, scheme, dt=dt, steps=200):
        old, new = report.old, report.new
        impulse, v_n = dt * new.r_n, surface.normal_values(old.v)
        mean = (1.0 - theta) * old.v + theta * new.v
        np.testing.assert_allclose(new.u, old.u + dt * mean, atol=1e-15)
        du, dv = new.u - old.u, new.v - old.v
        work = impulse * surface.normal_values(mean)
        loss = work.sum() + (theta - 0.5) * 2.0 * (
            system.kinetic_energy(dv) + system.strain_energy(du)
        )
        assert energy(problem, new) - energy(problem, old) == pytest.approx(-loss, abs=1e-12 * E0)
        approach = (v_n > 0.0) & (impulse > 0.0)
        np.testing.assert_allclose(
            surface.normal_values(new.v)[approach], -scheme.e * v_n[approach], atol=1e-15
        )
        newton = (1.0 - theta - theta * scheme.e) * impulse * v_n
        np.testing.assert_allclose(work[approach], newton[approach], atol=1e-12 * E0)
        impacts += int(approach.sum())
    assert impacts >= 4


@pytest.mark.parametrize("scheme", [INELASTIC, ELASTIC, MoreauJean(0.6, 0.5)])
@pytest.mark.parametrize("name", BARS)
def test_V97_ledger_with_damping_and_base_motion(name, scheme):
    """V9.7: with both, the ledger closes to 1e-10 of the largest energy; contact and algorithm only
    take."""
    body, rate, steps, E0 = BARS[name]
    shake = Harmonic(amplitude=5.0, frequency=3.0, direction=(1.0,))
    for damping in (0.0, 1e-3) if name == "V1.1" else (1e-3,):
        found = course(
            body(25, damping=damping, excitation=shake, **MASS), scheme, dt=1 / rate, steps=steps
        )
        assert abs(found.defect) <= 1e-10 * found.largest
        assert min(found.contact, found.algorithmic) >= -1e-12 * E0


@pytest.mark.parametrize("scheme", [INELASTIC, ELASTIC])
def test_V98_contact_impulse_is_the_change_of_momentum(scheme):
    """V9.8: over a complete impact of a free bar, to 1e-12 of its momentum."""
    problem, dt = bar(20, gap=0.02, gravity=10.0, v0=lambda x: -1.0 - 0.1 * x, **MASS), 0.01
    rigid = problem.equations.M @ problem.equations.influence[:, 0]
    weight = rigid @ problem.equations.influence[:, 0] * 10.0
    start, impulse, touched = initial_state(problem), 0.0, 0
    for report in run(problem, scheme, dt=dt, steps=130):
        impulse += dt * (report.new.r_n[0] - weight)
        touched += int(report.new.active[0])
    assert touched > 10 and not report.new.active[0]
    assert rigid @ (report.new.v - start.v) == pytest.approx(
        impulse, abs=1e-12 * np.abs(rigid @ start.v)
    )


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_single_mass_rebounds_with_its_restitution(e):
    """A free mass at a wall: v+ = -e v-, mean reaction m (1 + e) v-/dt, at any theta that is
    allowed."""
    for theta in {0.5, 1.0 / (1.0 + e)}:
        problem = chain(1, gap=0.1, mass=2.0, floating=True, v0=np.array([3.0]))
        reports = list(run(problem, MoreauJean(theta, e), dt=0.01, steps=10))
        hits = [report for report in reports if report.new.active[0]]
        assert len(hits) == 1 and hits[0].new.v[0] == pytest.approx(-e * 3.0, abs=1e-14)
        assert hits[0].new.r_n[0] == pytest.approx(2.0 * (1.0 + e) * 3.0 / 0.01, rel=1e-13)
        assert reports[-1].new.v[0] == pytest.approx(-e * 3.0, abs=1e-14)


@pytest.mark.parametrize("gap", [0.1, 0.11, 0.12, 0.129])
def test_gap_closes_late_by_less_than_a_step_of_the_approach(gap):
    """Drift: between 0 and dt v, here dt v = 0.03; it stays while the mass rests, and the recorder
    shows it."""
    problem = chain(1, gap=gap, mass=2.0, floating=True, v0=np.array([3.0]))
    recorder = Contact()
    recorder.start(problem, initial_state(problem))
    *_, last = run(problem, INELASTIC, dt=0.01, steps=20)
    assert -0.03 < recorder.row(last)["contact_min_gap"] < 1e-15
    assert last.old.u[0] == last.new.u[0] and last.new.v[0] == 0.0


def test_halved_steps_take_the_drift_with_them():
    """HalvedAtImpact: three halvings of the closing step leave an eighth of the penetration of
    V1.1."""
    problem, smallest = thrown(**MASS), 0.0
    for report in run(problem, INELASTIC, dt=HalvedAtImpact(1 / 300, halvings=3), steps=160):
        smallest = min(smallest, 5.0 - report.new.u[0])
    assert smallest == pytest.approx(-0.5 / 8.0 / 300.0 * 10.0, rel=1e-6)


def test_a_restart_needs_nothing_but_displacement_and_velocity():
    check_restart_from_bare_states(INELASTIC)


def test_positive_homogeneity():
    check_positive_homogeneity(INELASTIC)


def test_a_weight_at_rest_stays_at_rest():
    """Closed gap, no velocity: the reaction is the weight in every step, and nothing drifts."""
    problem = chain(1, gap=0.0, mass=2.0, floating=True, constant=20.0)
    for scheme in (INELASTIC, ELASTIC, MoreauJean(0.7)):
        for report in run(problem, scheme, dt=0.01, steps=20):
            assert report.new.r_n[0] == pytest.approx(20.0, rel=1e-13) and report.new.active[0]
            assert report.new.u[0] == 0.0 and report.new.v[0] == 0.0


def test_held_points_stay_and_open_points_are_free():
    """Bilateral points keep their place, pulled or pushed; with a wall out of reach nothing happens
    at all."""
    problem = chain(
        gap=0.0, v0=np.linspace(0.0, 1.0, 6) * np.array([1, 1, 1, 1, 1, 0]), consistent=True
    )
    held = replace(problem, surface=problem.surface.bilateral_everywhere())
    signs = set()
    for report in run(held, INELASTIC, dt=5e-3, steps=100):
        assert report.new.u[-1] == 0.0
        signs.add(np.sign(report.new.r_n[0]))
    assert signs == {-1.0, 1.0}
    for report in run(chain(gap=FAR, v0=np.ones(6)), INELASTIC, dt=5e-3, steps=20):
        assert (
            np.isinf(report.step.bound).all()
            and not report.new.active.any()
            and not report.new.r_n.any()
        )
