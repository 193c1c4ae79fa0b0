"""Response and Fourier spectra and intensity measures against closed forms, other programs' numbers
and limits."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from shared_records import EL_CENTRO, shared

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import (
    STANDARD_GRAVITY,
    Record,
    arias,
    baseline_corrected,
    cav,
    d5_95,
    fourier_spectrum,
    housner_intensity,
    husid,
    mean_period,
    pga,
    pgd,
    pgv,
    predominant_period,
    psa,
    read_record,
    response_spectrum,
    rms,
    significant_duration,
)
from vi_contact.practice.ground_motion.spectra import _compute_factors, _move

pytestmark = pytest.mark.serial

LOW = 1.0 - math.cos(math.pi / 64.0) + 1e-9
"""A peak is at most this much low, relatively (64 looks a period), and never high."""


def close(value, exact):
    """Not above the exact peak, and not lower than the looks allow."""
    return np.all(value <= exact * (1.0 + 1e-9)) and np.all(value >= exact * (1.0 - LOW))


def shaking(n=2001, dt=0.01, seed=2):
    noise = np.random.default_rng(seed).normal(size=n)
    times = dt * np.arange(n)
    smooth = np.convolve(noise, np.ones(5) / 5.0, "same")
    return Record(acceleration=smooth * np.sin(np.pi * times / times[-1]) ** 2, dt=dt)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.7])
@pytest.mark.parametrize("omega", [1e-4, 0.05, 3.0, 14.9, 15.1, 300.0])
def test_one_step_is_the_matrix_exponential(zeta, omega):
    """u, v, a and its slope as one linear system: exp of its matrix is the exact step, to
    round-off."""
    h = 0.02
    system = np.zeros((4, 4))
    system[0, 1] = system[2, 3] = 1.0
    system[1] = [-(omega**2), -2.0 * zeta * omega, -1.0, 0.0]
    exact = expm(h * system)[:2]
    u, v, a0, a1 = 0.3, -2.0, 1.7, -0.4
    factors = _compute_factors(h, h, np.array([omega]), zeta)
    wanted = exact @ [u, v, a0, (a1 - a0) / h]
    size = np.array([abs(u) + h * abs(v), abs(v) + h * omega**2 * abs(u)])
    assert np.all(np.abs(_move(factors, u, v, a0, a1)[:, 0] - wanted) < 1e-13 * size)


@pytest.mark.long
@pytest.mark.parametrize("dt", [0.5, 0.1, 0.01])
def test_rectangular_pulse_has_its_shock_spectrum(dt):
    """Undamped: SD = 2 a/omega² for t0 >= T/2, else 2 a/omega² sin(pi t0/T), reached after the
    pulse has ended."""
    record = Record(acceleration=np.full(round(1.0 / dt) + 1, -1.5), dt=dt)
    periods = np.array([0.1, 0.5, 1.0, 1.9, 2.5, 4.0, 20.0])
    omega = 2.0 * np.pi / periods
    shape = np.where(periods <= 2.0, 1.0, np.sin(np.pi / periods))
    spectrum = response_spectrum(record, periods, damping=0.0)
    assert close(spectrum.displacement, 3.0 / omega**2 * shape)
    assert close(spectrum.acceleration, 3.0 * shape) and close(spectrum.psa, 3.0 * shape)
    assert close(spectrum.psv, 3.0 / omega * shape)


@pytest.mark.parametrize("zeta", [0.02, 0.05, 0.3])
def test_step_overshoots_as_in_the_textbook(zeta):
    """a = 1 from t = 0 on: max |u| = (1 + exp(-zeta pi / sqrt(1 - zeta²))) / omega²."""
    record = Record(acceleration=np.ones(11), dt=2.0)
    periods = np.array([0.5, 1.0, 3.0])
    exact = (periods / (2.0 * np.pi)) ** 2 * (
        1.0 + math.exp(-zeta * math.pi / math.sqrt(1.0 - zeta**2))
    )
    assert close(response_spectrum(record, periods, damping=zeta).displacement, exact)


@pytest.mark.parametrize("steps", [1, 2, 7, 50])
def test_ramp_then_silence(steps):
    """a = t for 1 s: afterwards u swings with hypot(x - sin x, 1 - cos x) / omega³, x = omega,
    whatever the step."""
    record = Record(acceleration=np.arange(steps + 1.0) / steps, dt=1.0 / steps)
    omega = 2.0 * np.pi / np.array([0.3, 1.0, 2.3, 9.0])
    exact = np.hypot(omega - np.sin(omega), 1.0 - np.cos(omega)) / omega**3
    assert close(response_spectrum(record, 2.0 * np.pi / omega, damping=0.0).displacement, exact)


@pytest.mark.parametrize("per_period", [10, 20, 50])
@pytest.mark.parametrize("zeta", [0.0, 0.05])
def test_harmonic_at_resonance(per_period, zeta):
    """Ten cycles of sin(omega t): n pi, or (1 - exp(-2 pi n zeta)) / (2 zeta), times the part of
    the sine that straight lines between its samples keep, sinc²(pi h/T)."""
    record = Record(
        acceleration=np.sin(2.0 * np.pi * np.arange(10 * per_period + 1) / per_period),
        dt=1.0 / per_period,
    )
    kept = np.sinc(1.0 / per_period) ** 2
    exact = kept * (
        10.0 * np.pi if zeta == 0.0 else (1.0 - math.exp(-20.0 * math.pi * zeta)) / (2.0 * zeta)
    )
    assert response_spectrum(record, np.array([1.0]), damping=zeta).psa[0] == pytest.approx(
        exact, rel=4e-3
    )


@pytest.mark.long
def test_limits_of_the_period():
    """T to 0: the oscillator rides on the ground, PSA = SA = PGA; T to infinity: it stays behind,
    SD = PGD."""
    record = shaking()
    short = response_spectrum(record, np.array([1e-3]))
    # change of slope: the oscillator rings by
    corner = np.max(np.abs(np.diff(record.acceleration, n=2))) / record.dt
    # no more than this over omega
    assert abs(short.psa[0] - pga(record)) < corner * 1e-3 / (2.0 * np.pi)
    assert abs(short.acceleration[0] - pga(record)) < corner * 1e-3 / (2.0 * np.pi)
    still = baseline_corrected(record)
    long = response_spectrum(still, np.array([1e5]), damping=0.0)
    # pgd is that of samples
    assert pgd(still) * (1.0 - 1e-6) <= long.displacement[0] <= pgd(still) * (1.0 + 1e-4)
    assert pgv(still) * (1.0 - 1e-6) <= long.velocity[0] <= pgv(still) * (1.0 + 1e-2)


def test_a_finer_grid_with_the_same_straight_lines_changes_nothing():
    record = shaking(n=301)
    samples = np.interp(np.arange(1201) / 4.0, np.arange(301), record.acceleration)
    fine = Record(acceleration=samples, dt=record.dt / 4.0)
    periods = np.geomspace(0.02, 5.0, 30)
    first, second = response_spectrum(record, periods), response_spectrum(fine, periods)
    # v bends by this between looks dt / 4 apart
    bend = np.max(np.abs(np.diff(record.acceleration))) / record.dt
    bent = bend * (record.dt / 4.0) ** 2 / 8.0
    for name, extra in (("displacement", 0.0), ("acceleration", 0.0), ("velocity", bent)):
        assert np.allclose(getattr(first, name), getattr(second, name), rtol=LOW, atol=extra), name


def test_spectra_are_linear_and_blind_to_the_sign():
    record, periods = shaking(n=301), np.geomspace(0.05, 5.0, 10)
    twice = Record(acceleration=-2.0 * record.acceleration, dt=record.dt)
    assert np.allclose(
        response_spectrum(twice, periods).psa,
        2.0 * response_spectrum(record, periods).psa,
        rtol=1e-13,
    )


def test_el_centro_as_in_two_books():
    """PSA [g] at 5 % by another program; Chopra's peak displacements [in] at 2 %, 0 % and 5 %
    (Peknold's record)."""
    record = read_record(shared(EL_CENTRO))
    values = response_spectrum(record, np.array([0.1, 0.2, 0.5, 1.0, 3.0]))
    assert np.allclose(
        values.psa[:4] / STANDARD_GRAVITY, [0.649, 0.820, 0.919, 0.455], rtol=0.0, atol=6e-4
    )
    assert np.allclose(values.displacement[3:], [0.1130, 0.2747], rtol=0.0, atol=6e-5)
    two = response_spectrum(record, np.array([0.5, 1.0, 2.0]), damping=0.02).displacement / 0.0254
    assert np.allclose(two, [2.67, 5.97, 7.47], rtol=0.01, atol=0.0)
    assert np.allclose(two, [2.69, 5.97, 7.47], rtol=0.0, atol=6e-3)
    for zeta, inches in ((0.0, 9.91), (0.05, 5.37)):
        displacement = response_spectrum(record, np.array([2.0]), damping=zeta).displacement[0]
        assert displacement / 0.0254 == pytest.approx(inches, rel=1e-3)


def test_eqsig_finds_the_same():
    eqsig = pytest.importorskip("eqsig")
    record = shaking()
    other = eqsig.AccSignal(record.acceleration, record.dt)
    periods = np.geomspace(10.0 * record.dt, 5.0, 40)
    other.generate_response_spectrum(response_times=periods, xi=0.05)
    assert np.allclose(
        response_spectrum(record, periods).displacement, other.s_d, rtol=5e-3, atol=0.0
    )
    assert arias(record) == pytest.approx(eqsig.im.calc_arias_intensity(other)[-1], rel=2e-3)
    assert d5_95(record) == pytest.approx(eqsig.im.calc_sig_dur(other), abs=2.0 * record.dt)
    assert cav(record) == pytest.approx(eqsig.im.calc_cav(other)[-1], rel=0.05)


def test_fourier_of_a_gaussian_pulse():
    """a = exp(-pi (t-t0)²/tau²): |A| = tau exp(-pi f² tau²), to round-off for a well sampled
    pulse."""
    times = 0.02 * np.arange(1024)
    tau = 0.5
    pulse = Record(acceleration=np.exp(-np.pi * ((times - 10.0) / tau) ** 2), dt=0.02)
    frequencies, amplitudes = fourier_spectrum(pulse)
    assert frequencies[-1] == 25.0 and frequencies[1] == pytest.approx(1.0 / (1024 * 0.02))
    assert np.allclose(
        amplitudes, tau * np.exp(-np.pi * (frequencies * tau) ** 2), rtol=0.0, atol=1e-14
    )


@pytest.mark.parametrize("n", [500, 501])
def test_fourier_keeps_the_energy(n):
    record = shaking(n=n)
    frequencies, amplitudes = fourier_spectrum(record)
    twice = np.full(frequencies.size, 2.0)
    twice[0] = 1.0
    if n % 2 == 0:
        twice[-1] = 1.0
    energy = record.dt * np.sum(record.acceleration**2)
    assert frequencies[1] * np.sum(twice * amplitudes**2) == pytest.approx(energy, rel=1e-12)


def test_cumulative_absolute_velocity_counts_both_signs():
    """Straight lines 1, -1, -3, 0 every second: triangles 1/4 + 1/4, then 2, then 3/2."""
    assert cav(Record(acceleration=[1.0, -1.0, -3.0, 0.0], dt=1.0)) == pytest.approx(
        0.5 + 2.0 + 1.5, rel=1e-14
    )
    assert cav(Record(acceleration=np.zeros(3), dt=1.0)) == 0.0


def test_durations_and_rms_of_a_constant_acceleration():
    """a = -2 for 10 s: Husid's curve is a straight line, so 5-75 % lasts 7 s; root mean square
    2."""
    record = Record(acceleration=np.full(101, -2.0), dt=0.1)
    assert significant_duration(record, 0.05, 0.75) == pytest.approx(7.0, rel=1e-12)
    assert d5_95(record) == significant_duration(record, 0.05, 0.95) and rms(
        record
    ) == pytest.approx(2.0, rel=1e-13)
    assert np.allclose(
        husid(record), arias(record) * np.linspace(0.0, 1.0, 101), rtol=1e-12, atol=1e-14
    )


def test_housner_intensity_of_a_step():
    """Undamped PSV = a T/pi from 0.1 to 2.5 s: its integral is a (2.5² - 0.1²) / (2 pi)."""
    value = housner_intensity(Record(acceleration=np.full(101, 0.3), dt=0.1), damping=0.0)
    assert close(value, 0.3 * (2.5**2 - 0.1**2) / (2.0 * np.pi))


def test_periods_of_a_sine_and_of_two():
    times = 0.01 * np.arange(2000)
    one = Record(acceleration=np.sin(2.0 * np.pi * 2.0 * times), dt=0.01)
    two = Record(
        acceleration=np.sin(2.0 * np.pi * 2.0 * times) + np.sin(2.0 * np.pi * 5.0 * times), dt=0.01
    )
    assert mean_period(one) == pytest.approx(0.5, rel=1e-10)
    assert mean_period(two) == pytest.approx(0.5 * (0.5 + 0.2), rel=1e-10)
    assert predominant_period(one) == pytest.approx(0.5, rel=0.016)
    assert psa(one, 0.5) == response_spectrum(one, np.array([0.5])).psa[0]


@pytest.mark.parametrize(
    "act, word",
    [
        (lambda r: response_spectrum(r, np.array([0.0, 1.0])), "positive"),
        (lambda r: response_spectrum(r, np.array([])), "periods"),
        (lambda r: response_spectrum(r, [[1.0]]), "row"),
        (lambda r: response_spectrum(r, np.array([math.nan])), "positive"),
        (lambda r: response_spectrum(r, np.array([1.0]), damping=1.0), "damping is 1.0"),
        (lambda r: response_spectrum(r, np.array([1.0]), damping=-0.1), "damping"),
        (lambda r: significant_duration(r, 0.9, 0.1), "fractions"),
        (lambda r: mean_period(Record(acceleration=np.zeros(9), dt=0.1)), "0.25 to 20 Hz"),
        (
            lambda r: predominant_period(Record(acceleration=np.ones(9), dt=2.0)),
            "resolves no period",
        ),
    ],
)
def test_bad_requests_are_refused_in_one_sentence(act, word):
    with pytest.raises(InputError, match=word):
        act(shaking(n=50))
