"""Eurocode 8 spectra by table and formula; Kanai-Tajimi motions: variance, spectrum, stationarity,
repeatability."""

import math

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import EC8Spectrum, Envelope, KanaiTajimi, pga, synthetic

pytestmark = pytest.mark.serial


def test_ec8_type_1_ground_b():
    """seismic.md 1.5: ag = 0.2 g."""
    spectrum = EC8Spectrum.on_ground("B", ag=0.2)
    values = spectrum.acceleration([0.0, 0.1, 0.3, 1.0, 2.0, 3.0])
    assert np.allclose(values, [0.240, 0.480, 0.600, 0.300, 0.150, 0.2 / 3.0], rtol=1e-12, atol=0.0)


TABLES = {  # EN 1998-1:2004, tables 3.2 and 3.3
    1: {
        "A": (1.0, 0.15, 0.4, 2.0),
        "B": (1.2, 0.15, 0.5, 2.0),
        "C": (1.15, 0.2, 0.6, 2.0),
        "D": (1.35, 0.2, 0.8, 2.0),
        "E": (1.4, 0.15, 0.5, 2.0),
    },
    2: {
        "A": (1.0, 0.05, 0.25, 1.2),
        "B": (1.35, 0.05, 0.25, 1.2),
        "C": (1.5, 0.1, 0.25, 1.2),
        "D": (1.8, 0.1, 0.3, 1.2),
        "E": (1.6, 0.05, 0.25, 1.2),
    },
}


@pytest.mark.parametrize("kind", [1, 2])
@pytest.mark.parametrize("ground", "ABCDE")
@pytest.mark.parametrize("damping", [0.02, 0.05, 0.1])
def test_ec8_branches_of_every_ground(kind, ground, damping):
    """S a_g at 0, the plateau 2.5 eta between T_B and T_C, then falling with T and beyond T_D with
    T²."""
    s, tb, tc, td = TABLES[kind][ground]
    spectrum = EC8Spectrum.on_ground(ground, ag=3.0, kind=kind, damping=damping)
    eta = math.sqrt(10.0 / (5.0 + 100.0 * damping))
    top = 3.0 * s * 2.5 * eta
    assert spectrum.eta == eta
    periods = [0.0, 0.5 * tb, tb, 0.5 * (tb + tc), tc, 0.5 * (tc + td), td, 2.0 * td]
    late = [2.0 * top * tc / (tc + td), top * tc / td, top * tc / td / 4.0]
    exact = [3.0 * s, 0.5 * (3.0 * s + top), top, top, top, *late]
    assert np.allclose(spectrum.acceleration(periods), exact, rtol=1e-13, atol=0.0)
    assert np.allclose(
        spectrum.displacement(periods), np.array(exact) * (np.array(periods) / (2.0 * np.pi)) ** 2
    )


def test_ec8_eta_has_a_floor_and_the_vertical_spectrum_its_own_numbers():
    assert EC8Spectrum.on_ground("A", ag=1.0, damping=0.4).eta == 0.55
    first, second = (EC8Spectrum.vertical(ag=2.0, kind=kind) for kind in (1, 2))
    assert np.allclose(
        first.acceleration([0.0, 0.1, 0.5, 2.0]), [1.8, 5.4, 5.4 * 0.15 / 0.5, 5.4 * 0.15 / 4.0]
    )
    assert np.allclose(second.acceleration([0.0, 0.1, 0.5]), [0.9, 2.7, 2.7 * 0.15 / 0.5])


@pytest.mark.parametrize(
    "act, word",
    [
        (lambda: EC8Spectrum.on_ground("F", ag=1.0), "'F'"),
        (lambda: EC8Spectrum.on_ground("A", ag=1.0, kind=3), "type 3"),
        (lambda: EC8Spectrum.vertical(ag=1.0, kind=3), "type 3"),
        (lambda: EC8Spectrum(1.0, 1.0, 0.5, 0.4, 2.0), "tb <= tc"),
        (lambda: EC8Spectrum.on_ground("A", ag=1.0, damping=5.0), "0.05 for 5 %"),
        (lambda: EC8Spectrum.on_ground("A", ag=1.0).acceleration([-1.0]), "negative"),
        (lambda: Envelope(5.0, 1.0, 0.1), "rise <= end"),
        (lambda: synthetic(KanaiTajimi(1.0), 1.0, 2.0, seed=1), "dt"),
    ],
)
def test_bad_spectra_are_refused_in_one_sentence(act, word):
    with pytest.raises(InputError, match=word):
        act()


def test_kanai_tajimi_density_at_marked_frequencies():
    """S(0) = S0 without the high-pass and 0 with it; S(omega_g) = S0 (1 + 4 zeta²) / (4 zeta²)."""
    soft = KanaiTajimi(0.02, omega_f=0.0)
    assert soft.density(0.0) == 0.02 and KanaiTajimi(0.02).density(0.0) == 0.0
    assert soft.density(15.6) == pytest.approx(0.02 * (1.0 + 4.0 * 0.36) / (4.0 * 0.36), rel=1e-13)
    assert KanaiTajimi(0.02).density(1.5) == pytest.approx(
        soft.density(1.5) / (4.0 * 0.36), rel=1e-13
    )


@pytest.mark.long
def test_kanai_tajimi_variance():
    """pi S0 omega_g (1 + 4 zeta²) / (2 zeta): the integral, and the mean square of a long
    motion."""
    spectrum = KanaiTajimi(0.02, omega_f=0.0)
    exact = math.pi * 0.02 * 15.6 * (1.0 + 4.0 * 0.36) / 1.2
    omega = np.linspace(0.0, 4e4, 4_000_001)
    tail = 2.0 * spectrum.s0 * 4.0 * 0.36 * 15.6**2 / 4e4  # beyond, S = S0 4 zeta² wg² / w²
    assert 2.0 * np.sum(spectrum.density(omega)) * 0.01 - 0.01 * 0.02 + tail == pytest.approx(
        exact, rel=1e-4
    )
    record = synthetic(spectrum, 600.0, 0.002, seed=7)
    # what lies above the Nyquist frequency
    above = 2.0 * spectrum.s0 * 4.0 * 0.36 * 15.6**2 / (math.pi / 0.002)
    assert np.mean(record.acceleration**2) == pytest.approx(exact - above, rel=0.05)


MOTIONS = np.array(
    [synthetic(KanaiTajimi(0.02), 20.0, 0.02, seed=seed).acceleration for seed in range(400)]
)


def variance(spectrum, dt, size):
    """2 sum S dw over the frequencies in use: the variance over all seeds at every instant."""
    omega = 2.0 * np.pi / (size * dt) * np.arange(1, size // 2)
    return 2.0 * np.sum(spectrum.density(omega)) * omega[0]


def test_motions_are_stationary():
    """400 seeds: at every instant the mean is 0 and the variance the same, within four standard
    errors of each."""
    exact = variance(KanaiTajimi(0.02), 0.02, 2048 * 2)
    assert variance(KanaiTajimi(0.02), 0.02, 2048) == pytest.approx(exact, rel=2e-3)
    ensemble = np.mean(MOTIONS**2, axis=0) / exact
    assert np.max(np.abs(np.mean(MOTIONS, axis=0))) < 4.5 * math.sqrt(exact / 400.0)
    assert np.max(np.abs(ensemble - 1.0)) < 4.5 * math.sqrt(2.0 / 400.0)
    thirds = [np.mean(part) for part in np.array_split(ensemble, 3)]
    assert np.allclose(thirds, 1.0, atol=0.02)


def test_motions_have_the_spectrum():
    """The mean periodogram of the seeds follows S; averaged over bands of 20 frequencies, within 8
    %."""
    n = MOTIONS.shape[1]
    window = np.sin(np.pi * np.arange(n) / n) ** 2  # keeps the low frequencies out of the high ones
    lines = np.mean(np.abs(np.fft.rfft(MOTIONS * window, axis=1)) ** 2, axis=0)
    density = lines * 0.02 / (2.0 * np.pi * np.sum(window**2))
    omega = 2.0 * np.pi * np.fft.rfftfreq(n, 0.02)
    bands = [np.arange(k, k + 20) for k in range(10, 450, 20)]
    ratios = [
        np.mean(density[band]) / np.mean(KanaiTajimi(0.02).density(omega[band])) for band in bands
    ]
    assert np.max(np.abs(np.array(ratios) - 1.0)) < 0.08
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.01)


def test_the_same_seed_gives_the_same_motion_and_another_seed_another():
    first, again, other = (
        synthetic(KanaiTajimi(0.02), 10.0, 0.01, seed=seed) for seed in (3, 3, 4)
    )
    assert np.array_equal(first.acceleration, again.acceleration)
    assert abs(np.corrcoef(first.acceleration, other.acceleration)[0, 1]) < 0.5
    assert first.acceleration.size == 1001 and first.notes[1] == "seed 3, envelope None"
    assert first.acceleration[0] == pytest.approx(SEED_3[0], rel=1e-9)
    assert pga(first) == pytest.approx(SEED_3[1], rel=1e-9)


SEED_3 = (-1.8543763535271647, 4.399074895676005)
"""First sample and peak [m/s2]: a change of the generator or of its use shows here."""


def test_envelope_shapes_the_motion():
    """(t/2)², 1 from 2 to 5 s, exp(-0.4 (t - 5)): the enveloped motion is the other times these."""
    envelope = Envelope(2.0, 5.0, 0.4)
    times = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 7.5])
    assert np.allclose(envelope(times), [0.0, 0.25, 1.0, 1.0, 1.0, math.exp(-1.0)], rtol=1e-14)
    plain, shaped = (
        synthetic(KanaiTajimi(0.02), 10.0, 0.01, seed=3, envelope=e) for e in (None, envelope)
    )
    assert np.allclose(shaped.acceleration, plain.acceleration * envelope(plain.times), rtol=1e-14)
    assert np.all(Envelope(0.0, 1.0, 0.0)(times) == 1.0)
