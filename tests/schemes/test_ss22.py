"""SS22: the midpoint rule at (½, ½), Newmark's spectrum in general, order and range (V4.1)."""

from __future__ import annotations

import numpy as np
import pytest
from bar import bouncing, energy, run, thrown
from chain import chain_problem
from oscillator import SHAKEN, amplification, dense, observed_order, oscillators

from vi_contact.core.errors import InputError
from vi_contact.laws.impact import Inelastic
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
WEIGHTS = [(0.5, 0.5), (0.5, 0.8), (0.6, 0.6), (0.7, 1.1), (1.0, 1.0)]


@pytest.mark.parametrize(
    "weights", [(0.4, 0.5), (0.5, 0.49), (0.6, 0.5), (0.5, np.inf), (np.nan, 1.0)]
)
def test_weights_outside_the_stable_range_are_refused(weights):
    with pytest.raises(InputError, match="unconditionally stable range"):
        SS22(*weights)


@pytest.mark.parametrize("weights", WEIGHTS)
def test_V41_spectrum_is_that_of_newmark(weights):
    """V4.1: eigenvalues of the amplification = roots of gamma(z) + 2 xi w dt a(z) + (w dt)² b(z) of
    Newmark(theta2/2, theta1), to 1e-10."""
    theta1, theta2 = weights
    newmark = LinearMultistep.newmark(theta2 / 2.0, theta1)
    a, b, gamma = (np.array(c) for c in (newmark.a, newmark.b, newmark.gamma))
    for frequency in (0.3, 1.0, 2.5, 20.0):
        for xi in (0.0, 0.05, 0.4):
            found = amplification(SS22(theta1, theta2), frequency=frequency, damping=xi)
            roots = np.roots(gamma + 2.0 * xi * frequency * a + frequency**2 * b)
            assert np.trace(found) == pytest.approx(roots.sum().real, abs=1e-10)
            assert np.linalg.det(found) == pytest.approx(roots.prod().real, abs=1e-10)
            assert np.abs(roots).max() <= 1.0 + 1e-10


@pytest.mark.long
@pytest.mark.parametrize("impact", [None, Inelastic()])
def test_V41_half_half_is_the_midpoint_rule_with_contact(impact):
    """V4.1: SS22(½, ½) and Zienkiewicz-Wood-Taylor(½), every step to 1e-10, with damping, base
    motion and contact."""
    problem = chain_problem(5, gap=0.02, damping=1e-3, excitation=SHAKEN, impact=impact)
    changes = 0
    for report in run(problem, ZienkiewiczWoodTaylor(), dt=0.01, steps=150):
        other = next(run(problem, SS22(), dt=0.01, steps=1, state=report.old))
        assert np.abs(other.new.u - report.new.u).max() <= 1e-10 * np.abs(report.new.u).max()
        assert np.abs(other.new.v - report.new.v).max() <= 1e-10 * np.abs(report.new.v).max()
        assert abs(other.new.r_n[0] - report.new.r_n[0]) <= 1e-10 * max(report.new.r_n[0], 1.0)
        assert other.new.active == report.new.active
        changes += int(report.new.active[0] != report.old.active[0])
    assert changes > 2


def test_V41_the_printed_formulas():
    """V4.1: alpha = (M + theta1 dt C + ½ theta2 dt² K)⁻¹ (f - C v - K (u + theta1 dt v)), u1 = u +
    dt v + ½dt² alpha, v1 = v + dt alpha; the load at t + theta1 dt."""
    theta1, theta2, dt = 0.6, 0.9, 0.05
    problem = oscillators(4, damping=0.01, constant=3.0, excitation=SHAKEN)
    M, C, K = dense(problem)
    u, v = problem.equations.u0, problem.equations.v0
    for report in run(problem, SS22(theta1, theta2), dt=dt, steps=50):
        f = problem.equations.load(report.old.t + theta1 * dt)
        alpha = np.linalg.solve(
            M + theta1 * dt * C + 0.5 * theta2 * dt**2 * K, f - C @ v - K @ (u + theta1 * dt * v)
        )
        u, v = u + dt * v + 0.5 * dt**2 * alpha, v + dt * alpha
        np.testing.assert_allclose(report.new.u, u, atol=1e-10 * np.abs(u).max())
        np.testing.assert_allclose(report.new.v, v, atol=1e-10 * np.abs(v).max())


@pytest.mark.parametrize(
    ("theta1", "theta2", "order"), [(0.5, 0.5, 2), (0.5, 0.8, 2), (0.6, 0.7, 1), (1.0, 1.0, 1)]
)
def test_order(theta1, theta2, order):
    """Second order at theta1 = ½, whatever theta2; first otherwise."""
    assert observed_order(SS22(theta1, theta2), steps=200 if order > 1 else 400) == pytest.approx(
        order, abs=0.06
    )


@pytest.mark.parametrize("body", [thrown, bouncing], ids=["V1.1", "V1.2"])
def test_V91_contact_never_creates_energy_at_half(body):
    problem, last = body(50), None
    for report in run(problem, SS22(), dt=1 / 150, steps=800):
        last = energy(problem, report.old) if last is None else last
        now = energy(problem, report.new)
        assert now <= last + 1e-12 * 500.0
        last = now
