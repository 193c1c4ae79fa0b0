"""Housner's rocking block: V3.1 and the two equations of motion."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vi_contact.core.errors import InputError
from vi_contact.exact import HousnerBlock

pytestmark = pytest.mark.serial
BLOCK = HousnerBlock(width=0.4, height=2.0)
ALPHA = BLOCK.alpha


def test_numbers_of_the_example():
    """V3.1 as printed, but for the last two digits of p, printed 2.68600487."""
    assert (
        BLOCK.radius == pytest.approx(1.01980390, abs=5e-9)
        and pytest.approx(0.19739556, abs=5e-9) == ALPHA
    )
    assert BLOCK.p == pytest.approx(2.68600490, abs=5e-9)
    assert BLOCK.restitution == pytest.approx(0.94230769, abs=5e-9)
    assert BLOCK.energy_ratio == pytest.approx(0.88794379, abs=5e-9)
    assert BLOCK.onset_acceleration == pytest.approx(1.962, rel=1e-14)


def test_periods():
    """V3.1: slender."""
    phi = (0.1, 0.25, 0.5, 0.75, 0.9)
    slender = [BLOCK.period(f * ALPHA) for f in phi]
    assert slender == pytest.approx((0.695673, 1.184459, 1.961214, 3.072872, 4.457509), abs=6e-7)
    assert BLOCK.period(1e-14) == pytest.approx(4.0 / BLOCK.p * math.sqrt(2e-14 / ALPHA), rel=1e-9)


def test_impacts():
    """V3.1: times and amplitudes from alpha/2."""
    times = (0.490304, 1.342807, 2.100685, 2.783707, 3.404975, 3.973840)
    assert BLOCK.impact_times(0.5 * ALPHA, 6) == pytest.approx(times, abs=6e-7)
    amplitudes = (0.5, 0.422036, 0.360729, 0.310849, 0.269407, 0.234486, 0.204763)
    assert BLOCK.amplitudes(0.5 * ALPHA, 6) / ALPHA == pytest.approx(amplitudes, abs=6e-7)


def rocked(block, theta0, until, sine):
    """(times, theta) by numerical integration, e applied at every impact."""
    p, alpha, e = block.p, block.alpha, block.restitution
    t, y, times, angles = 0.0, np.array([theta0, 0.0]), [], []

    def impact(t, y):
        return y[0] if y[1] else 1.0

    impact.terminal = True
    while t < until:
        side = math.copysign(1.0, y[0] if t == 0.0 else y[1])

        def rate(t, y, side=side):
            away = alpha - side * y[0]
            return y[1], -side * p**2 * (math.sin(away) if sine else away)

        run = solve_ivp(rate, (t, until), y, rtol=1e-10, atol=1e-13, events=impact, max_step=0.02)
        times.append(run.t)
        angles.append(run.y[0])
        t = run.t[-1]
        y = np.array([1e-12 * math.copysign(1.0, run.y[1, -1]), e * run.y[1, -1]])
    return np.concatenate(times), np.concatenate(angles)


@pytest.mark.parametrize("phi0", [0.3, 0.8])
def test_history_solves_the_slender_equation(phi0):
    """V3.1: free_rocking against numerical integration over six seconds of impacts."""
    t, theta = rocked(BLOCK, phi0 * ALPHA, 6.0, sine=False)
    assert BLOCK.free_rocking(phi0 * ALPHA, t) == pytest.approx(theta, abs=1e-6 * ALPHA)
    t, theta = rocked(BLOCK, phi0 * ALPHA, 2.0, sine=True)
    # slender: alpha = 0.2
    assert np.abs(BLOCK.free_rocking(phi0 * ALPHA, t) - theta).max() < 0.02 * ALPHA


def test_history_ends_at_rest():
    """The impacts accumulate at a finite time."""
    end = BLOCK.impact_times(0.5 * ALPHA, 2000)[-1]
    assert BLOCK.free_rocking(0.5 * ALPHA, [end + 1e-9, 2.0 * end]).tolist() == [0.0, 0.0]
    assert BLOCK.free_rocking(0.5 * ALPHA, 0.0) == pytest.approx(0.5 * ALPHA, rel=1e-14)


def test_energy_lost_in_impacts():
    """V3.1: ½ phi'² + p²(phi - phi²/2) falls by r at every impact: from the amplitudes alone."""
    phi = BLOCK.amplitudes(0.7 * ALPHA, 20) / ALPHA
    potential = phi - 0.5 * phi**2
    assert potential[1:] / potential[:-1] == pytest.approx(
        np.full(20, BLOCK.energy_ratio), rel=1e-12
    )


def test_overturning_pulse():
    """V3.1: 0.409014 s for A = 1.5; Housner's cosh form; just shorter and just longer pulses
    integrated in time."""
    g_alpha = 9.81 * ALPHA
    assert BLOCK.overturning_time(1.5 * g_alpha) == pytest.approx(0.409014, abs=5e-7)
    for A in (1.1, 1.5, 4.0):
        t1 = BLOCK.overturning_time(A * g_alpha)
        assert math.cosh(BLOCK.p * t1) == pytest.approx(1.0 + 0.5 / (A * (A - 1.0)), rel=1e-12)
        assert [overturns(A, factor * t1) for factor in (0.99, 1.01)] == [False, True]


def overturns(A, t1):
    """Whether phi'' = p²(phi - 1 + A [t < t1]) from rest reaches 1 before it returns to 0 (slender
    block)."""

    def rate(t, y, push):
        return y[1], BLOCK.p**2 * (y[0] - 1.0 + push)

    pushed = solve_ivp(rate, (0.0, t1), (0.0, 0.0), rtol=1e-10, atol=1e-12, args=(A,)).y[:, -1]
    return bool(
        solve_ivp(rate, (0.0, 10.0), pushed, rtol=1e-10, atol=1e-12, args=(0.0,)).y[0, -1] > 1.0
    )


def test_wrong_data_are_refused():
    with pytest.raises(InputError, match="give a width below"):
        HousnerBlock(width=1.5, height=1.0)
    with pytest.raises(InputError, match="give one between 0 and alpha = 0.197396"):
        BLOCK.period(0.2)
    with pytest.raises(InputError, match="does not lift the block; give more than 1.93645"):
        BLOCK.overturning_time(1.9)
