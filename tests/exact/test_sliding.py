"""Newmark's sliding block: V3.2."""

import math

import numpy as np
import pytest
from newmark_block import SlidingBlock

from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
G = 9.81
BLOCK = SlidingBlock(mu=0.2)


def test_rectangular_pulse():
    """V3.2 as printed, and 0.4905 m of the seismic notes; closed form and marched history agree."""
    assert BLOCK.slip(0.5 * G, 0.2) == pytest.approx(0.147150, rel=1e-12)
    assert BLOCK.slip(-0.4 * G, 0.5) == pytest.approx(0.4905, rel=1e-12)
    u, v = BLOCK.history([0.0, 0.2, 0.2, 0.4, 0.7], [0.5 * G, 0.5 * G, 0.0, 0.0, 0.0])
    assert u[-1] == pytest.approx(-0.147150, rel=1e-12) and v[-1] == 0.0
    assert v[1:4] == pytest.approx(
        [-0.3 * G * 0.2, -0.3 * G * 0.2, 0.2 * G * 0.4 - 0.1 * G], rel=1e-12
    )


def test_weak_pulse_moves_nothing():
    """V3.2 with A <= mu."""
    assert BLOCK.slip(0.2 * G, 3.0) == 0.0
    u, v = BLOCK.history([0.0, 1.0, 2.0], [0.0, 0.19 * G, -0.2 * G])
    assert not u.any() and not v.any()


def harmonic(steps):
    """u at t = 1/2, 1, ... 4 for a = 3 sin 2 pi t, mu g = 1.5, sampled `steps` times per half
    second."""
    t = np.linspace(0.0, 4.0, 8 * steps + 1)
    return SlidingBlock(mu=0.15, gravity=10.0).history(t, 3.0 * np.sin(2.0 * math.pi * t))[0][
        steps::steps
    ]


def test_harmonic_base():
    """V3.2: seven digits from closed pieces (sines joined at roots), which the printed ones meet
    within 3e-6.

    Printed: -0.080077, -0.017956, -0.080767, -0.018030, then -0.080774/-0.018030.
    """
    exact = [
        -0.0800774,
        -0.0179538,
        -0.0807655,
        -0.0180277,
        -0.0807734,
        -0.0180285,
        -0.0807735,
        -0.0180286,
    ]
    printed = [
        -0.080077,
        -0.017956,
        -0.080767,
        -0.018030,
        -0.080774,
        -0.018030,
        -0.080774,
        -0.018030,
    ]
    coarse, fine = harmonic(500), harmonic(5000)
    assert fine == pytest.approx(exact, abs=1e-7) and exact == pytest.approx(printed, abs=3e-6)
    error = np.abs(coarse - fine)
    assert error.max() < 3e-6  # samples of a sine: second order
    assert np.abs(harmonic(1000) - fine).max() < 0.3 * error.max()


def test_ramp_onto_the_threshold():
    """A ramp a = j t starts sliding at t0 = mu g/j; then u = -j (t - t0)³/6."""
    u, v = BLOCK.history([0.0, 4.0], [0.0, 4.0])
    t0 = 0.2 * G
    assert (u[-1], v[-1]) == pytest.approx(
        (-((4.0 - t0) ** 3) / 6.0, -((4.0 - t0) ** 2) / 2.0), rel=1e-12
    )


def test_refinement_changes_nothing():
    """Exact for piecewise linear acceleration: points added in between change nothing, nor without
    friction."""
    random = np.random.default_rng(3)
    t, a = np.arange(60) * 0.1, 8.0 * random.standard_normal(60)
    dense = np.sort(np.concatenate([t, 5.9 * random.random(500)]))
    for block in (BLOCK, SlidingBlock(mu=0.0)):
        u, v = block.history(t, a)
        fine_u, fine_v = block.history(dense, np.interp(dense, t, a))
        at = np.searchsorted(dense, t)
        assert fine_u[at] == pytest.approx(u, abs=1e-12 * np.abs(u).max())
        assert fine_v[at] == pytest.approx(v, abs=1e-12 * np.abs(v).max())
    # the free one
    assert v == pytest.approx(-np.append(0.0, np.cumsum(0.05 * (a[1:] + a[:-1]))), abs=1e-12)
    mirror = BLOCK.history(t, -a)[0]
    assert (mirror == -BLOCK.history(t, a)[0]).all()


def test_wrong_data_are_refused():
    with pytest.raises(InputError, match="mu is -0.1"):
        SlidingBlock(mu=-0.1)
    for times, values, words in (
        ([0.0, 1.0], [0.0], "has shape"),
        ([1.0, 0.0], [0.0, 0.0], "give them in order"),
        ([0.0, 1.0], [0.0, math.nan], "is nan at"),
    ):
        with pytest.raises(InputError, match=words):
            BLOCK.history(times, values)
