"""What schemes with contact in the balance of forces share: the acceleration they start from, the
massless contact layer, ledger, impulses, friction, restarts (V1.1, V1.5, V9.7, V9.8)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bar import bar, before_impact, bouncing, energy, period_three, run, thrown
from chain import chain_problem
from column import column
from exact_columns import ObliqueImpact
from oscillator import SHAKEN
from shaken import changes, shaken

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.ledger import compute_energies, energy_balance
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import Report, State
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.files.checkpoint import RestartPoint, read_checkpoint, write_checkpoint
from vi_contact.run.files.identity import identify
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.consistent_data import consistent_acceleration
from vi_contact.schemes.generalised_alpha import GeneralisedAlpha
from vi_contact.schemes.hht import HHT
from vi_contact.schemes.houbolt import Houbolt
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.newmark import Newmark
from vi_contact.schemes.ss22 import SS22
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
CONSISTENT, MASSLESS = ConsistentMass(), Redistributed()
SCHEMES = [
    Newmark(),
    Newmark(0.3025, 0.6),
    HHT(),
    HHT(-1 / 3),
    GeneralisedAlpha.spectral_radius(0.8),
    GeneralisedAlpha.spectral_radius(0.0),
    Houbolt(),
    LinearMultistep.newmark(0.3025, 0.6),
]
schemes = pytest.mark.parametrize("scheme", SCHEMES, ids=repr)


def acceleration(problem: ContactProblem, u: Array, v: Array) -> tuple[Array, Array]:
    """(a, reaction) of a state at rest in time."""
    state = replace(initial_state(problem), u=u, v=v)
    return consistent_acceleration(problem, state, 0.01)


def test_acceleration_of_resting_contacts() -> None:
    """A resting bar under its weight presses with all of it and does not accelerate; a lifted one
    falls; one that a spring presses up leaves the wall."""
    resting = bar(10, gravity=10.0)
    a, reaction = acceleration(resting, np.zeros(11), np.zeros(11))
    assert a[0] == 0.0  # not the whole bar: stress has not built up, only the foot is held
    assert 0.0 < reaction[0] < 100.0 and not reaction[1:].any()
    # without stiffness the foot carries half the bar
    rigid = bar(1, E=0.0, gravity=10.0, lumped=True)
    assert acceleration(rigid, np.zeros(2), np.zeros(2))[1][0] == pytest.approx(50.0, rel=1e-13)
    lifted = bar(10, gap=1.0, gravity=10.0)
    a, reaction = acceleration(lifted, np.zeros(11), np.zeros(11))
    np.testing.assert_allclose(a, np.r_[10.0, np.full(10, -10.0)], rtol=1e-12)
    assert not reaction.any()
    pulled = bar(10, gravity=-10.0)
    assert not acceleration(pulled, np.zeros(11), np.zeros(11))[1].any()


def test_acceleration_with_springs_and_held_points() -> None:
    """Springs push with (u_n - gap0)/compliance, held points push or pull."""
    problem = bar(10, gravity=10.0)
    u = np.zeros(11)
    u[0] = 0.01  # the foot is 1 cm into its support
    springs = replace(problem, surface=problem.surface.on_springs(5e3))
    assert acceleration(springs, u, np.zeros(11))[1][0] == pytest.approx(50.0, rel=1e-13)
    assert not acceleration(springs, -u, np.zeros(11))[1].any()
    drawn = bar(10, gravity=-10.0)
    held = replace(drawn, surface=drawn.surface.bilateral_everywhere())
    for v in (np.zeros(11), np.ones(11)):  # also while a bad start still moves it
        a, reaction = acceleration(held, np.zeros(11), v)
        assert a[0] == 0.0 and reaction[0] < -1.0
    pulled = replace(springs, surface=springs.surface.bilateral_everywhere())
    assert acceleration(pulled, -u, np.zeros(11))[1][0] == pytest.approx(-50.0, rel=1e-13)


def test_acceleration_without_mass_at_the_contact() -> None:
    """Massless unknowns have none, and a reaction that balances their forces; the others move as
    without contact."""
    problem = bar(10, gravity=10.0, damping=1e-3, mass=MASSLESS)
    system = problem.equations
    u, v = np.linspace(0.0, -0.02, 11), np.linspace(1.0, -3.0, 11)
    a, reaction = acceleration(problem, u, v)
    assert system.C is not None and a[0] == 0.0 and not reaction[1:].any()
    residual = system.load(0.0) - system.C @ v - system.K @ u - reaction - system.M @ a
    assert np.abs(residual).max() <= 1e-13 * np.abs(system.K @ u).max()
    assert reaction[0] == pytest.approx(system.load(0.0)[0] - (system.K @ u)[0], rel=1e-13)


@pytest.mark.parametrize(
    ("pull", "speed", "slips"), [(0.2, 0.0, False), (2.0, 0.0, True), (0.0, 3.0, True)]
)
def test_acceleration_with_friction(pull: float, speed: float, slips: bool) -> None:
    """A resting point holds a small pull, slips under a large one, and friction brakes what slides
    already."""
    problem = column(1, v0=(speed, 0.0), friction=Coulomb(0.5), mass=CONSISTENT)
    system = problem.system
    # in the body's own frame: pulled along, pressed down
    force = np.array([pull, -1.0, pull, -1.0])
    problem = replace(problem, system=replace(system, load=replace(system.load, constant=force)))
    a, reaction = acceleration(problem, np.zeros(4), problem.equations.v0)
    r_t, r_n = reaction[0], reaction[1]
    assert r_n > 0.0 and not reaction[2:].any()
    # the body's reaction on its support, along the pull
    assert 0.0 < r_t <= 0.5 * r_n * (1.0 + 1e-12)
    assert bool(r_t >= 0.5 * r_n * (1.0 - 1e-12)) == slips
    assert bool(abs(a[0]) <= 1e-13) != slips


def ledger(problem: ContactProblem, reports: Iterable[Report]) -> tuple[float, Report]:
    """(largest defect over the largest energy, last report)."""
    defect, largest, last = 0.0, 0.0, None
    for last in reports:
        step = energy_balance(problem, last.old, before_impact(last), last.balance)
        defect = max(defect, abs(step.defect))
        largest = max(largest, compute_energies(problem.equations, last.new.u, last.new.v).total)
    assert last is not None
    return defect / largest, last


@pytest.mark.slow
@schemes
@pytest.mark.parametrize("mass", [MASSLESS, CONSISTENT], ids=["massless", "consistent"])
@pytest.mark.parametrize("given", [thrown, bouncing, period_three])
def test_ledger_closes(given: Any, mass: Any, scheme: Any) -> None:
    """V9.7: what the energy of each step becomes is known to 1e-10 of the largest energy, with mass
    or without."""
    dt = 1 / 20 * (1.0 if given is period_three else 1 / 3)
    problem = given(20, mass=mass)
    defect, last = ledger(problem, run(problem, scheme, dt=dt, steps=80))
    assert defect <= 1e-12 and last.certificate.worst <= 1e-10


@pytest.mark.slow
@schemes
@pytest.mark.parametrize(
    "impact", [None, Inelastic(), Inelastic(ImpulseUpdate())], ids=["free", "reset", "project"]
)
def test_ledger_closes_with_damping_and_base_motion(scheme: Any, impact: Any) -> None:
    """V9.7, also when impact laws change velocities and accelerations restart; on massless nodes
    the same loads."""
    reports = list(run(shaken(impact), scheme, dt=0.005, steps=150))
    assert changes(reports) > 4 and ledger(shaken(impact), reports)[0] <= 1e-12
    if impact is None:
        damped = thrown(20, damping=1e-3, mass=MASSLESS, excitation=SHAKEN)
        assert ledger(damped, run(damped, scheme, dt=1 / 60, steps=80))[0] <= 1e-12


def momentum(problem: ContactProblem, state: State) -> float:
    """Of the bar, upwards."""
    system = problem.equations
    return float(system.influence[:, 0] @ (system.M @ state.v))


@schemes
@pytest.mark.parametrize("mass", [MASSLESS, CONSISTENT], ids=["massless", "consistent"])
def test_V98_impulse_of_an_impact(mass: Any, scheme: Any) -> None:
    """V9.8: from free flight to free flight the sum of dt r_n, with the weights of the balance, is
    the change of momentum to 1e-12; for Newmark in every step."""
    problem, dt = (
        bar(20, gap=0.1, v0=lambda x: np.full_like(x, -10.0), damping=1e-4, mass=mass),
        1 / 60,
    )
    impulse, worst, reports = 0.0, 0.0, list(run(problem, scheme, dt=dt, steps=90))
    for report in reports:
        impulse += dt * float(report.balance.r_n[0])
        change = momentum(problem, report.new) - momentum(problem, report.old)
        worst = max(worst, abs(change - dt * float(report.balance.r_n[0])))
    assert not any(report.new.active.any() for report in reports[-40:])
    gained = momentum(problem, reports[-1].new) - momentum(problem, reports[0].old)
    assert gained > 190.0 and impulse == pytest.approx(gained, abs=1e-12 * gained)
    if isinstance(scheme, Newmark):
        assert worst <= 1e-12 * gained


@schemes
def test_contact_force_does_not_ring_without_mass(scheme: Any) -> None:
    """V1.1 on redistributed mass, Courant number one: from 0.1 s after the impact the force stays
    within 1 % of 300."""
    force = [
        r.new.r_n[0]
        for r in run(thrown(100, mass=MASSLESS), scheme, dt=1 / 300, steps=320)
        if r.new.t > 0.6
    ]
    assert len(force) > 100 and np.abs(np.array(force) / 300.0 - 1.0).max() <= 0.01


@schemes
def test_massless_unknowns_have_the_mean_velocity_of_the_step(scheme: Any) -> None:
    for report in run(thrown(20, mass=MASSLESS), scheme, dt=1 / 60, steps=80):
        mean = (report.new.u[0] - report.old.u[0]) * 60
        assert report.new.v[0] == pytest.approx(mean, abs=1e-12 * 10.0)
        assert all(
            array[0] == 0.0 for name, array in report.new.memory.items() if name in ("a", "a_0")
        )


@schemes
def test_gravity_stage_stays_still(scheme: Any) -> None:
    """A bar that stands on the ground in equilibrium does not move when the dynamics begin."""
    problem = bar(20, clamped=True, gravity=10.0, mass=MASSLESS)
    rest = static_equilibrium(problem, solver=Condensed())
    assert rest.r_n[0] > 1.0
    for report in run(problem, scheme, dt=0.01, steps=50, state=rest):
        assert np.abs(report.new.u - rest.u).max() <= 1e-12 * np.abs(rest.u).max()
        assert report.balance.r_n[0] == pytest.approx(rest.r_n[0], rel=1e-11)


@schemes
def test_initial_data_are_put_into_equilibrium_once(scheme: Any) -> None:
    """V1.3 starts with a stressed free end, which a massless node cannot hold: 1/N of the energy
    (V9.4)."""
    problem = period_three(50, mass=MASSLESS)
    start = scheme.start(problem, initial_state(problem), 0.01)
    assert energy(problem, start) == pytest.approx(0.125 * (1.0 - 1.0 / 50), rel=1e-12)
    assert scheme.start(problem, start, 0.01) is start
    assert np.array_equal(scheme.start(problem, start, 0.02).u, start.u)


@schemes
@pytest.mark.parametrize("mass", [MASSLESS, CONSISTENT], ids=["massless", "consistent"])
def test_restart_from_a_checkpoint(tmp_path: Path, mass: Any, scheme: Any) -> None:
    """The memory holds arrays only, and all that the scheme carries: restarts are exact to the last
    bit."""
    problem = bouncing(20, mass=mass)
    states = [report.new for report in run(problem, scheme, dt=1 / 60, steps=120)]
    assert any(state.active.any() for state in states[70:90])
    assert all(isinstance(array, np.ndarray) for array in states[80].memory.values())
    start, end = states[0].t, states[-1].t
    run_of = {"run": identify(problem, scheme, 1 / 60, start=start, end=end), "span": (start, end)}
    place = RestartPoint(states[80], states[80].t, states[80].k)
    write_checkpoint(tmp_path, problem, place, run_of=run_of)
    state = read_checkpoint(tmp_path, problem, scheme=scheme, dt=1 / 60)[0].state
    again = [report.new for report in run(problem, scheme, dt=1 / 60, steps=39, state=state)]
    assert all(
        np.array_equal(a, b) for a, b in zip(_numbers(again[-1]), _numbers(states[-1]), strict=True)
    )


def _numbers(state: State) -> Sequence[Array]:
    return [state.u, state.v, state.r_n, *(state.memory[name] for name in sorted(state.memory))]


@schemes
def test_acceleration_restarts_after_an_impact_law(scheme: Any) -> None:
    """After a velocity jump the memory is that of a start with the new velocity: the collision's
    force is spent."""
    problem, jumps = shaken(Inelastic()), 0
    for report in run(problem, scheme, dt=0.005, steps=100):
        if np.array_equal(report.new.v, report.v_minus):
            continue
        fresh = scheme.start(problem, replace(report.new, memory={}), 0.005)
        assert all(
            np.array_equal(fresh.memory[name], report.new.memory[name]) for name in fresh.memory
        )
        jumps += 1
    assert jumps > 1


@schemes
def test_memory_of_another_time_or_scheme_is_not_used(scheme: Any) -> None:
    """A single-step scheme hands on what it does not know: after it, and after another member, all
    begins anew."""
    problem = chain_problem(4, gap=1.0, constant=3.0, v0=np.ones(4))
    for other in (SS22(), GeneralisedAlpha.spectral_radius(0.6)):
        state = list(run(problem, scheme, dt=0.01, steps=5))[-1].new
        state = list(run(problem, other, dt=0.01, steps=5, state=state))[-1].new
        fresh = scheme.start(problem, replace(state, memory={}), 0.01).memory
        found = scheme.start(problem, state, 0.01).memory
        assert found.keys() == fresh.keys() and all(
            np.array_equal(found[name], fresh[name]) for name in fresh
        )


@pytest.mark.long
@schemes
def test_V15_oblique_impact_with_friction(scheme: Any) -> None:
    """V1.5 on redistributed mass: slip speed, impulses and friction work of the exact solution, and
    a closed ledger."""
    problem, dt = (
        column(100, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=MASSLESS),
        0.01 / np.sqrt(2.0),
    )
    exact = ObliqueImpact(1.0, problem_material(), 1.0, 1.0, 0.3)
    impulse, work, defect = np.zeros(2), 0.0, 0.0
    for report in run(problem, scheme, dt=dt, steps=350):
        step = energy_balance(problem, report.old, report.new, report.balance)
        assert report.balance.r_t is not None
        impulse += dt * np.array([report.balance.r_n[0], -report.balance.r_t[0, 0]])
        work, defect = work + step.friction, max(defect, abs(step.defect))
        if 0.2 < report.new.t < 1.2:
            assert (report.new.u[0] - report.old.u[0]) / dt == pytest.approx(
                exact.slip_speed, rel=2e-3
            )
    np.testing.assert_allclose(impulse, exact.impulses, rtol=0.02)
    np.testing.assert_allclose(impulse[1], -0.3 * impulse[0], rtol=1e-9)
    assert work == pytest.approx(exact.friction_work, rel=0.01)
    assert defect <= 1e-12


def problem_material() -> Any:
    """The material of tests/support/column.py."""
    return column.__kwdefaults__["material"]


@pytest.mark.long
def test_V15_friction_with_mass_at_the_contact() -> None:
    """Consistent mass and enough damping of high frequencies: the same impulses and friction
    work."""
    exact = ObliqueImpact(1.0, problem_material(), 1.0, 1.0, 0.3)
    for scheme in (HHT(-1 / 3), Houbolt()):
        problem, dt, work = (
            column(100, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=CONSISTENT),
            0.01 / np.sqrt(2),
            0.0,
        )
        for report in run(problem, scheme, dt=dt, steps=350):
            step = energy_balance(problem, report.old, report.new, report.balance)
            work += step.friction
            assert abs(step.defect) <= 1e-12
        assert work == pytest.approx(exact.friction_work, rel=0.01)


@schemes
def test_impact_laws_need_mass(scheme: Any, caplog: pytest.LogCaptureFixture) -> None:
    """Refused without mass at the contact; with mass the schemes warn once, and name themselves."""
    with pytest.raises(InputError, match="acts on the mass of contact nodes"):
        scheme.check(thrown(10, mass=MASSLESS, impact=Inelastic()))
    with caplog.at_level(logging.WARNING):
        scheme.check(thrown(10, mass=MASSLESS))
        assert not caplog.records
        problem = thrown(10, mass=CONSISTENT)
        scheme.check(problem)
        scheme.check(problem)
    assert len(caplog.records) == 1 and repr(scheme) in caplog.text
    assert isinstance(scheme.mass, Redistributed)
