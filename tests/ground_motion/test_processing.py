"""Processing: closed forms, inverses, steps that change nothing when repeated, and a note for
each."""

import math

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import (
    Processing,
    Record,
    arias,
    baseline_corrected,
    filtered,
    integrated,
    padded,
    pga,
    psa,
    resampled,
    scaled_to_arias,
    scaled_to_psa,
    tapered,
    trimmed,
    without_mean,
)

pytestmark = pytest.mark.serial


def shaking(n=1001, dt=0.01, seed=1):
    """Coloured noise in an envelope, quiet at both ends."""
    noise = np.cumsum(np.random.default_rng(seed).normal(size=n)) * 0.05
    times = dt * np.arange(n)
    return Record(
        acceleration=noise * np.sin(np.pi * times / times[-1]) ** 2, dt=dt, notes=("made here",)
    )


def sine(frequency, *, dt=0.005, duration=60.0):
    """A sine in a smooth envelope, of unit height over the middle half."""
    times = dt * np.arange(round(duration / dt) + 1)
    rise = np.clip(4.0 * np.minimum(times, duration - times) / duration, 0.0, 1.0)
    return Record(
        acceleration=np.sin(2.0 * np.pi * frequency * times) * np.sin(0.5 * np.pi * rise) ** 2,
        dt=dt,
    )


def middle(record):
    n = record.acceleration.size
    return record.acceleration[3 * n // 8 : 5 * n // 8]


def test_mean_is_removed_once():
    record = without_mean(shaking())
    assert abs(np.mean(record.acceleration)) < 1e-15 * pga(shaking()) * 1001
    assert np.allclose(without_mean(record).acceleration, record.acceleration, rtol=0.0, atol=1e-15)
    assert record.notes[0] == "made here" and record.notes[1].startswith("mean removed: ")


def test_mean_of_the_quiet_before_the_shaking():
    record = Record(acceleration=[0.5, 0.5, 0.5, 4.0, -2.0, 0.5], dt=0.1)
    quiet = without_mean(record, until=0.2)
    assert np.array_equal(quiet.acceleration, [0.0, 0.0, 0.0, 3.5, -2.5, 0.0])
    assert quiet.notes == ("mean of the first 0.2 s removed: 0.5 m/s2",)


def test_cosine_taper_in_closed_form():
    """A constant 1 of 10 s, tapered over 20 %: (1 - cos(pi t/2)) / 2 for 2 s, 1, and its mirror
    image."""
    record = tapered(Record(acceleration=np.ones(101), dt=0.1), fraction=0.2)
    times = record.times
    exact = np.where(times < 2.0, 0.5 * (1.0 - np.cos(0.5 * np.pi * times)), 1.0)
    exact = exact * exact[::-1]
    assert np.allclose(record.acceleration, exact, rtol=0.0, atol=1e-14)
    assert record.acceleration[0] == record.acceleration[-1] == 0.0 and np.all(
        record.acceleration[20:81] == 1.0
    )
    assert record.notes == ("cosine taper over 20 % at start and end",)


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("low, high", [(1.0, None), (None, 4.0), (1.0, 4.0)])
@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 4.0, 8.0])
def test_filter_gain_is_that_of_butterworth(order, low, high, frequency):
    """Zero phase: |H|² = 1 / (1 + (low/f)^2n) · 1 / (1 + (f/high)^2n), f standing for tan(pi f
    dt)."""
    record = sine(frequency)
    warped = {f: math.tan(math.pi * f * record.dt) for f in (low, high, frequency) if f is not None}
    gain = 1.0
    if low is not None:
        gain /= 1.0 + (warped[low] / warped[frequency]) ** (2 * order)
    if high is not None:
        gain /= 1.0 + (warped[frequency] / warped[high]) ** (2 * order)
    result = filtered(record, low=low, high=high, order=order)
    assert np.max(np.abs(middle(result) - gain * middle(record))) < 2e-3
    once = filtered(record, low=low, high=high, order=order, causal=True)
    rms = [np.sqrt(np.mean(middle(r) ** 2)) for r in (once, record)]
    assert rms[0] == pytest.approx(math.sqrt(gain) * rms[1], abs=3e-3)


def test_zero_phase_filter_commutes_with_time_reversal_and_the_causal_one_waits():
    record = shaking()
    mirrored = Record(acceleration=record.acceleration[::-1], dt=record.dt)
    forward = filtered(record, low=0.2, high=20.0).acceleration
    assert np.allclose(
        filtered(mirrored, low=0.2, high=20.0).acceleration[::-1],
        forward,
        rtol=0.0,
        atol=1e-9 * pga(record),
    )
    late = Record(acceleration=np.where(np.arange(1001) < 500, 0.0, 1.0), dt=0.01)
    assert np.all(filtered(late, high=5.0, causal=True).acceleration[:500] == 0.0)
    assert abs(filtered(late, high=5.0).acceleration[499]) > 0.1


def test_filter_is_noted():
    assert filtered(shaking(), low=0.1, high=25.0).notes[-1] == (
        "Butterworth band-pass 0.1 to 25 Hz, order 4, zero phase (two passes)"
    )
    assert filtered(shaking(), high=25.0, order=2, causal=True).notes[-1] == (
        "Butterworth low-pass 25 Hz, order 2, causal"
    )


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize("displacement", [False, True])
def test_baseline_ends_at_rest_and_repeats_without_effect(degree, displacement):
    record = shaking()
    velocity, place = integrated(record)
    result = baseline_corrected(record, degree=degree, displacement=displacement)
    v, u = integrated(result)
    assert abs(v[-1]) < 1e-12 * np.max(np.abs(velocity)) and abs(u[-1]) < 1e-12 * np.max(
        np.abs(place)
    )
    again = baseline_corrected(result, degree=degree, displacement=displacement)
    assert np.allclose(again.acceleration, result.acceleration, rtol=0.0, atol=1e-11 * pga(record))


def test_baseline_takes_out_what_was_put_in():
    """A drift that is itself a polynomial of the degree is removed to round-off; a pure one leaves
    zero."""
    record = baseline_corrected(shaking())
    x = record.times / record.duration
    drift = 0.3 - 1.1 * x + 0.7 * x**2
    spoiled = Record(acceleration=record.acceleration + drift, dt=record.dt)
    cleaned = baseline_corrected(spoiled)
    assert np.allclose(cleaned.acceleration, record.acceleration, rtol=0.0, atol=1e-12)
    pure = baseline_corrected(Record(acceleration=drift, dt=record.dt))
    assert pga(pure) < 1e-13
    assert pure.notes == (
        "baseline: polynomial of degree 2 fitted to the velocity, v = u = 0 at the end",
    )


def test_baseline_is_the_least_squares_fit():
    """No other parabola that ends at rest leaves a smaller velocity: the rest is orthogonal to the
    free direction."""
    record = shaking()
    result = baseline_corrected(record)
    x = record.times / record.duration
    # the only parabola with v(1) = u(1) = 0 in these integrals, found from 1, x and x²
    parts = [integrated(Record(acceleration=x**k, dt=record.dt)) for k in range(3)]
    ends = np.array([[part[k][-1] for part in parts] for k in (0, 1)])
    c = np.cross(ends[0], ends[1])
    free = sum(c[k] * parts[k][0] for k in range(3))
    left = integrated(result)[0]
    assert abs(free @ left) < 1e-10 * np.linalg.norm(free) * np.linalg.norm(left)


def test_trimming_undoes_padding():
    record = shaking()
    longer = padded(record, 2.0, 3.005)
    assert longer.acceleration.size == 1001 + 200 + 301 and np.all(longer.acceleration[:200] == 0.0)
    back = trimmed(longer, 2.0, 12.0)
    assert np.array_equal(back.acceleration, record.acceleration)
    assert back.notes[1:] == ("zeros added: 2 s before, 3.01 s after", "trimmed to 2 ... 12 s")


def test_trimming_keeps_the_samples_inside():
    record = Record(acceleration=np.arange(11.0), dt=0.1)
    assert np.array_equal(trimmed(record, 0.25, 0.7).acceleration, [3.0, 4.0, 5.0, 6.0, 7.0])
    assert np.array_equal(trimmed(record).acceleration, record.acceleration)


def test_scaling_to_arias_and_to_a_spectral_value():
    record = shaking()
    assert arias(scaled_to_arias(record, 0.7)) == pytest.approx(0.7, rel=1e-13)
    assert psa(scaled_to_psa(record, 3.0, 0.8), 0.8) == pytest.approx(3.0, rel=1e-13)
    assert np.allclose(
        scaled_to_arias(scaled_to_arias(record, 5.0), arias(record)).acceleration,
        record.acceleration,
    )


def test_processing_runs_in_its_order_and_notes_it():
    steps = Processing(
        trim=(0.5, 9.5),
        pad=(1.0, 1.0),
        mean=True,
        taper=0.05,
        low=0.1,
        high=20.0,
        resample=0.005,
        baseline=2,
        pga=2.0,
    )
    record = steps(shaking())
    quiet = tapered(without_mean(padded(trimmed(shaking(), 0.5, 9.5), 1.0, 1.0)), fraction=0.05)
    by_hand = baseline_corrected(resampled(filtered(quiet, low=0.1, high=20.0), 0.005))
    assert pga(record) == pytest.approx(2.0, rel=1e-14) and record.dt == 0.005
    assert np.allclose(
        record.acceleration, 2.0 / pga(by_hand) * by_hand.acceleration, rtol=0.0, atol=1e-13
    )
    words = [note.split(" ")[0] for note in record.notes]
    assert words == [
        "made",
        "trimmed",
        "zeros",
        "mean",
        "cosine",
        "Butterworth",
        "resampled",
        "baseline:",
        "scaled",
    ]
    a = record.acceleration
    # of a sum of so many terms
    round_off = a.size * np.finfo(float).eps * np.abs(a).sum() * record.dt
    assert abs(integrated(record)[1][-1]) < round_off
    assert Processing()(shaking()).notes == ("made here",)


@pytest.mark.parametrize(
    "act, word",
    [
        (lambda r: tapered(r, fraction=0.0), "fraction"),
        (lambda r: tapered(r, fraction=0.6), "fraction"),
        (lambda r: filtered(r), "corners"),
        (lambda r: filtered(r, low=5.0, high=1.0), "rising"),
        (lambda r: filtered(r, high=50.0), "Nyquist frequency 50 Hz"),
        (lambda r: filtered(r, low=math.nan), "corners"),
        (lambda r: filtered(r, low=1.0, order=0), "order"),
        (lambda r: baseline_corrected(r, degree=0), "degree"),
        (lambda r: baseline_corrected(r, degree=7), "degree"),
        (lambda r: trimmed(r, 2.0, 1.0), "start=2.0"),
        (lambda r: trimmed(r, 0.0, 11.0), "10 s"),
        (lambda r: trimmed(r, 0.001, 0.002), "two samples"),
        (lambda r: padded(r, -1.0), "positive"),
        (lambda r: without_mean(r, until=20.0), "within"),
        (lambda r: scaled_to_arias(r, 0.0), "target"),
        (lambda r: scaled_to_psa(r, math.inf, 1.0), "target"),
        (
            lambda r: scaled_to_arias(Record(acceleration=np.zeros(5), dt=0.1), 1.0),
            "every sample is zero",
        ),
        (lambda r: Processing(scale=2.0, pga=1.0), "scale and pga"),
    ],
)
def test_bad_processing_is_refused_in_one_sentence(act, word):
    with pytest.raises(InputError, match=word):
        act(shaking())
