"""Zienkiewicz-Wood-Taylor: midpoint and Kane's rule at phi = ½, order, stability, energy with
contact (V4.1, V9.1)."""

from __future__ import annotations

import numpy as np
import pytest
from bar import bar, before_impact, bouncing, energy, period_three, run, thrown
from chain import chain_problem
from kane import kane
from oscillator import SHAKEN, amplification, exact, last_state, observed_order, oscillators

from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
HALF = ZienkiewiczWoodTaylor()


@pytest.mark.parametrize("phi", [0.49, 1.01, -1.0, np.nan])
def test_unstable_weights_are_refused(phi):
    with pytest.raises(InputError, match="give a weight from 0.5 to 1"):
        ZienkiewiczWoodTaylor(phi)


@pytest.mark.parametrize("phi", [0.5, 0.6, 1.0])
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_unconditionally_stable(phi, damping):
    """Spectral radius <= 1 at every frequency; exactly 1 at phi = ½ without damping (no algorithmic
    damping)."""
    scheme = ZienkiewiczWoodTaylor(phi)
    for frequency in np.logspace(-2, 4, 7):
        radius = np.abs(
            np.linalg.eigvals(amplification(scheme, frequency=frequency, damping=damping))
        )
        assert radius.max() <= 1.0 + 1e-9
        if phi == 0.5 and damping == 0.0:
            np.testing.assert_allclose(radius, 1.0, atol=1e-9)


@pytest.mark.parametrize(("phi", "order"), [(0.5, 2.0), (0.6, 1.0), (1.0, 1.0)])
def test_order(phi, order):
    """Second order at phi = ½, else first, with damping, constant load and base motion."""
    assert observed_order(
        ZienkiewiczWoodTaylor(phi), steps=200 if order > 1 else 400
    ) == pytest.approx(order, abs=0.06)


@pytest.mark.long
def test_exact_motion_is_what_it_converges_to():
    problem = oscillators(damping=0.02, constant=4.0, excitation=SHAKEN)
    state = last_state(problem, HALF, dt=2e-4, steps=5000)
    u, v = exact(problem, 1.0, SHAKEN)
    np.testing.assert_allclose(state.u, u, atol=2e-7 * np.abs(u).max())
    np.testing.assert_allclose(state.v, v, atol=2e-6 * np.abs(v).max())


def test_V41_half_is_kanes_implicit_contact_rule():
    """1.7 (ii): g(n+1) >= 0 at phi = ½ is Kane's implicit-contact Newmark, to 1e-10, step by step,
    open and closed."""
    problem, dt, closed = (
        chain_problem(6, gap=0.01, consistent=True, v0=np.ones(6), constant=20.0),
        5e-3,
        0,
    )
    for report in run(problem, HALF, dt=dt, steps=300):
        u, v, r = kane(problem, report.old.u, report.old.v, dt)
        assert np.abs(report.new.u - u).max() <= 1e-10 * np.abs(u).max()
        assert np.abs(report.new.v - v).max() <= 1e-10 * np.abs(v).max()
        assert abs(report.new.r_n[0] - r) <= 1e-10 * max(r, 20.0)
        closed += r > 0.0
    assert 50 < closed < 250


@pytest.mark.parametrize(
    ("problem", "dt", "steps", "E0", "zero"),
    [
        pytest.param(thrown, 1 / 300, 450, 500.0, 0.0, id="V1.1"),
        pytest.param(bouncing, 1 / 300, 1600, 500.0, 500.0, id="V1.2"),
        pytest.param(period_three, 1 / 200, 1200, 0.125, 0.0, id="V1.3"),
    ],
)
def test_V91_contact_never_creates_energy(problem, dt, steps, E0, zero):
    """V9.1: E is non-increasing through contact and release, to 1e-12 E0; each closure loses r_n
    gap_old, no more."""
    body = problem()
    surface, last = body.surface, energy(body, initial_state(body)) + zero
    assert last == pytest.approx(E0, rel=1e-12)
    closures = 0.0
    for report in run(body, HALF, dt=dt, steps=steps):
        now = energy(body, report.new) + zero
        assert now <= last + 1e-12 * E0
        loss = float(report.new.r_n @ (surface.gap0 - surface.normal_values(report.old.u)))
        assert now - last == pytest.approx(-loss, abs=1e-12 * E0)
        closures += loss
        last = now
    assert 1e-4 < closures / E0 < 0.05


def window(scheme, courant: float) -> tuple[float, float]:
    """V1.1: (max |p - 300|/300 in 0.6 < t < 1.067, E(1.5)/E0) on 100 elements."""
    problem, dt = thrown(), courant / 300.0
    worst = 0.0
    for report in run(problem, scheme, dt=dt, steps=round(1.5 / dt)):
        if 0.6 < report.new.t < 1.067:
            worst = max(worst, abs(report.new.r_n[0] - 300.0) / 300.0)
    return worst, energy(problem, report.new) / 500.0


@pytest.mark.parametrize(("courant", "oscillation"), [(0.5, 0.50), (1.0, 0.58), (2.0, 0.30)])
def test_V11_published_behaviour_of_the_midpoint_rule(courant, oscillation):
    """Table 1.7, row midpoint: pressure oscillation 0.50, 0.58, 0.30 and E_end/E0 = 0.9987 at
    Courant number one."""
    worst, share = window(HALF, courant)
    assert worst == pytest.approx(oscillation, abs=0.005)
    if courant == 1.0:
        assert share == pytest.approx(0.9987, abs=5e-5)


def test_V11_contact_time_pressure_and_rebound():
    """V1.1: touch-down 0.5, release 7/6, mean pressure 300 in between, rebound 10 m/s, stress
    free."""
    problem, dt = thrown(), 1 / 300
    reports = list(run(problem, HALF, dt=dt, steps=450))
    closed = np.array([report.new.t for report in reports if report.new.active[0]])
    pressure = np.array([report.new.r_n[0] for report in reports])
    t = np.array([report.new.t for report in reports])
    assert abs(closed[0] - 0.5) <= 2 * dt and abs(closed[-1] - 7 / 6) <= 2 * dt
    assert pressure[(t > 0.6) & (t < 1.067)].mean() == pytest.approx(300.0, rel=0.01)
    assert dt * pressure.sum() == pytest.approx(200.0, rel=0.01)  # impulse 2 rho L v0
    momentum = problem.equations.M @ problem.equations.influence[:, 0] @ reports[-1].new.v
    assert momentum / 10.0 == pytest.approx(10.0, rel=0.02)


def bouncing_foot(t: float) -> float:
    """V1.2: exact foot position, first period."""
    c, g, v0, tau, t1 = 30.0, 10.0, 10.0, 1 / 3, 1.0
    t2, t3 = t1 + 2 * tau, t1 + 2 * tau + 2.0
    t4 = t3 + 2 * tau
    assert c * tau == 10.0
    if t < t1:
        return 5.0 - g * t**2 / 2
    if t2 < t < t3:
        r = t - t2
        q = r % (2 * tau)
        return v0 * r - g * r**2 / 2 + g * q * (q - 2 * tau)
    return max(v0 * (t - t4) - g * (t - t4) ** 2 / 2, 0.0) if t > t4 else 0.0


@pytest.mark.long
def test_V12_foot_position_and_energy_after_five_periods():
    """V1.2, Courant number one: rms of the foot about 0.01 h0 in the first period; E/E0 = 0.949
    after five."""
    assert [round(bouncing_foot(t), 6) for t in (2.0, 8 / 3, 29 / 6)] == [1.666667, 3.888889, 3.75]
    problem, square = bouncing(), 0.0
    for report in run(problem, HALF, dt=1 / 300, steps=8000):
        if report.new.k <= 1600:
            square += (5.0 - report.new.u[0] - bouncing_foot(report.new.t)) ** 2 / 1600
    assert np.sqrt(square) / 5.0 < 0.015
    assert energy(problem, report.new) / 500.0 + 1.0 == pytest.approx(0.949, abs=5e-4)


@pytest.mark.long
@pytest.mark.promise("guide/schemes.md", "the observed order is 0.4 to 0.95")
def test_V13_foot_converges_with_the_published_rate():
    """V1.3, dt = h/2, 0 <= t <= 12: velocity jumps leave u(0, t) a rate between 0.4 and 0.95."""
    errors = []
    for n in (25, 50, 100):
        square = 0.0
        for report in run(period_three(n), HALF, dt=0.5 / n, steps=24 * n):
            s, phase = report.new.t % 1.0, int(report.new.t % 3.0)
            square += (-report.new.u[0] - ((1 - s) / 2, 0.0, s / 2)[phase]) ** 2 / (24 * n)
        errors.append(np.sqrt(square))
    assert errors[-1] < 0.01
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((rates > 0.4) & (rates < 0.95))


def test_V98_contact_impulse_is_the_change_of_momentum():
    """V9.8: for the free bar, rho-weighted sum of velocities changes by the contact impulse and its
    weight, 1e-12."""
    problem, dt = bar(20, gap=0.02, gravity=10.0, v0=lambda x: -1.0 - 0.1 * x), 0.01
    rigid = problem.equations.M @ problem.equations.influence[:, 0]
    weight = rigid @ problem.equations.influence[:, 0] * 10.0
    for report in run(problem, HALF, dt=dt, steps=200):
        change = rigid @ (before_impact(report).v - report.old.v)
        assert change == pytest.approx(dt * (report.new.r_n[0] - weight), abs=1e-12 * dt * 1e3)
