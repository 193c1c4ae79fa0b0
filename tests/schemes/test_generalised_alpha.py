"""Generalised-alpha: range, spectrum, order, the printed equations, and contact on both masses
(V8.5 orders, V9.2)."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from amplification import amplification
from bar import energy, period_three, run
from oscillator import SHAKEN, dense, observed_order, oscillators

from vi_contact.core.errors import InputError
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.schemes.generalised_alpha import GeneralisedAlpha
from vi_contact.schemes.hht import HHT
from vi_contact.schemes.newmark import Newmark

pytestmark = pytest.mark.serial
RADII = (0.0, 0.3, 0.5, 0.8, 1.0)
of = GeneralisedAlpha.spectral_radius


@pytest.mark.parametrize(
    "weights",
    [
        (0.4, 0.3, 1.0, 1.0),  # alpha_m > alpha_f
        (0.2, 0.6, 1.0, 1.0),  # alpha_f > ½
        (0.0, 0.0, 0.25, 0.6),  # beta < gamma/2
        (0.0, 0.0, 0.25, 0.4),  # gamma < ½
        (0.1, 0.4, 0.5, 0.7),  # gamma < ½ - alpha_m + alpha_f
        (0.0, 0.0, np.inf, 0.5),
        (np.nan, 0.0, 0.5, 0.5),
    ],
)
def test_unstable_weights_are_refused(weights: Any) -> None:
    with pytest.raises(InputError, match="not unconditionally stable.*give alpha_m <= alpha_f"):
        GeneralisedAlpha(*weights)


@pytest.mark.parametrize("rho", [-0.1, 1.1, np.nan])
def test_radii_outside_the_range_are_refused(rho: float) -> None:
    with pytest.raises(InputError, match="from 0 to 1"):
        of(rho)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.5])
@pytest.mark.parametrize(
    "scheme",
    [
        *(of(rho) for rho in RADII),
        GeneralisedAlpha(0.5, 0.5, 0.25, 0.5),
        GeneralisedAlpha(-0.2, 0.5, 0.6, 1.2),
        GeneralisedAlpha(0.0, 0.5, 0.5, 1.0),
        GeneralisedAlpha(0.0, 0.0, 0.5, 1.0),
    ],
    ids=repr,
)
def test_unconditionally_stable(scheme: GeneralisedAlpha, damping: float) -> None:
    """No frequency grows, up to the edge of the accepted range."""
    for frequency in np.logspace(-2, 4, 7):
        radius = np.abs(np.linalg.eigvals(amplification(scheme, frequency, damping))).max()
        assert radius <= 1.0 + 2e-6  # double roots of modulus one lose half the digits


@pytest.mark.parametrize("rho", RADII)
def test_spectral_radius_at_infinite_frequency(rho: float) -> None:
    """Chung and Hulbert: all three roots become -rho_inf; no member of order 2 with it damps low
    frequencies less."""
    found = amplification(of(rho), 1e6)
    assert np.trace(found) == pytest.approx(-3.0 * rho, abs=1e-6)
    assert np.linalg.det(found) == pytest.approx(-(rho**3), abs=1e-6)
    low = np.abs(np.linalg.eigvals(amplification(of(rho), 0.2))).max()
    assert low == pytest.approx(1.0, abs=1e-12) if rho == 1.0 else 0.998 < low < 1.0


def test_members() -> None:
    """rho_inf = 1 has alpha_m = alpha_f = ½; rho_inf = ½ is HHT(-1/3); rho_inf = 0 has alpha_m =
    -1, alpha_f = 0."""
    assert of(1.0) == GeneralisedAlpha(0.5, 0.5, 0.25, 0.5)
    assert of(0.0) == GeneralisedAlpha(-1.0, 0.0, 1.0, 1.5)
    ours, theirs = of(0.5).weights, HHT(-1 / 3).weights
    assert np.allclose([*vars(ours).values()], [*vars(theirs).values()], rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("rho", RADII)
def test_second_order(rho: float) -> None:
    """In (u, v), with damping, constant load and base motion."""
    assert observed_order(of(rho), steps=100 if rho else 200) == pytest.approx(2.0, abs=0.1)


def test_first_order_with_more_damping() -> None:
    assert observed_order(GeneralisedAlpha(0.0, 0.2, 0.6, 0.9)) == pytest.approx(1.0, abs=0.1)


def test_the_printed_equations() -> None:
    """Against dense algebra: acceleration from the weighted equation of motion, damping and
    weighted loads included."""
    problem, dt = oscillators(4, damping=0.02, constant=3.0, excitation=SHAKEN), 0.03
    M, C, K = dense(problem)
    f, u, v = problem.equations.load, problem.equations.u0, problem.equations.v0
    a = np.linalg.solve(M, f(0.0) - C @ v - K @ u)
    w = of(0.6).weights
    for report in run(problem, of(0.6), dt=dt, steps=100):
        u_free = u + dt * v + dt**2 * (0.5 - w.beta) * a
        v_free = v + dt * (1.0 - w.gamma) * a
        late, early = 1.0 - w.alpha_f, w.alpha_f
        force = late * (f(report.new.t) - C @ v_free - K @ u_free) + early * (
            f(report.old.t) - C @ v - K @ u
        )
        A = (1.0 - w.alpha_m) * M + late * (w.gamma * dt * C + w.beta * dt**2 * K)
        a = np.linalg.solve(A, force - w.alpha_m * (M @ a))
        u, v = u_free + w.beta * dt**2 * a, v_free + w.gamma * dt * a
        np.testing.assert_allclose(report.new.u, u, atol=1e-10 * np.abs(u).max())
        np.testing.assert_allclose(report.new.v, v, atol=1e-10 * np.abs(v).max())


def test_zero_alphas_are_newmark() -> None:
    """Same numbers with contact."""
    ours, theirs = GeneralisedAlpha(0.0, 0.0, 0.3, 0.55), Newmark(0.3, 0.55)
    pairs = zip(
        run(period_three(20, mass=Redistributed()), ours, dt=0.05, steps=80),
        run(period_three(20, mass=Redistributed()), theirs, dt=0.05, steps=80),
        strict=True,
    )
    assert all(
        np.array_equal(one.new.u, two.new.u) and np.array_equal(one.new.r_n, two.new.r_n)
        for one, two in pairs
    )


@cache
def four_bounces(scheme: Any, mass: Any, courant: float) -> float:
    """E/E0 of V1.3 at t = 12, 100 elements."""
    problem = period_three(100, mass=mass)
    *_, last = run(problem, scheme, dt=courant / 100, steps=round(1200 / courant))
    return energy(problem, last.new) / 0.125


@pytest.mark.parametrize(
    ("rho", "courant", "ends"), [(0.8, 1.0, 0.980), (0.8, 0.5, 0.988), (0.0, 1.0, 0.887)]
)
def test_V92_no_energy_from_contact_without_mass(rho: float, courant: float, ends: float) -> None:
    """V1.3 after four bounces on redistributed mass; 0.99 is what the relaxed start leaves."""
    assert four_bounces(of(rho), Redistributed(), courant) == pytest.approx(ends, abs=2e-3)


@pytest.mark.long
@pytest.mark.parametrize(("rho", "ends"), [(0.5, 0.966), (0.0, 0.933)])
def test_V92_with_mass_the_damping_must_see_the_highest_frequency(rho: float, ends: float) -> None:
    """V1.3 at Courant number ½ on consistent mass: with strong damping of high frequencies no gain;
    with rho_inf = 0.8 there is one, several times the energy."""
    assert four_bounces(of(rho), ConsistentMass(), 0.5) == pytest.approx(ends, abs=2e-3)
    assert four_bounces(of(0.8), ConsistentMass(), 0.5) > 2.0
