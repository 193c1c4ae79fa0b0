"""Records: the value, scaling, resampling, integration, intensity measures; the table of the
development records."""

import hashlib
import math

import numpy as np
import pytest
from shared_records import EL_CENTRO, LOMA, shared

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import (
    STANDARD_GRAVITY,
    Record,
    arias,
    d5_95,
    integrated,
    pga,
    pga_time,
    pgd,
    pgv,
    read_record,
    record_info,
    resampled,
    scaled,
    scaled_to_pga,
)

pytestmark = pytest.mark.serial

# Development records; they are not part of the project, so the tests on them are skipped where they
# are absent.

# file, samples, dt, PGA [m/s²] and its time, PGV, PGD, Arias, D5-95, final displacement; with half
# a last digit each
TABLE = [
    (
        EL_CENTRO,
        1559,
        0.02,
        (0.3188 * 9.80665, 5e-4),
        2.020,
        (0.361, 5e-4),
        (0.213, 5e-4),
        (1.80, 5e-3),
        (23.8, 5e-2),
        -0.025,
    ),
    (
        LOMA + "a.smc",
        6001,
        0.005,
        (1.044, 5e-4),
        10.17,
        (0.081, 5e-4),
        (0.031, 5e-4),
        (0.096, 5e-4),
        (10.7, 5e-2),
        None,
    ),
    (
        LOMA + "b.smc",
        6002,
        0.005,
        (0.4835, 5e-5),
        10.345,
        (0.069, 5e-4),
        None,
        (0.025, 5e-4),
        (17.3, 5e-2),
        -0.063,
    ),
    (
        LOMA + "c.smc",
        6004,
        0.005,
        (0.7044, 5e-5),
        10.385,
        (0.113, 5e-4),
        None,
        (0.063, 5e-4),
        (9.7, 5e-2),
        -0.225,
    ),
]


@pytest.mark.parametrize(
    "name, n, dt, peak, at, velocity, displacement, intensity, duration, final",
    TABLE,
    ids=[row[0][-9:] for row in TABLE],
)
def test_development_records(
    name, n, dt, peak, at, velocity, displacement, intensity, duration, final
):
    """The table of SOURCES.md, each number to the digits printed there."""
    record = read_record(shared(name))
    assert record.acceleration.size == n and record.dt == dt
    assert abs(pga(record) - peak[0]) <= peak[1] and math.isclose(
        pga_time(record), at, rel_tol=1e-12
    )
    for measure, printed in (
        (pgv, velocity),
        (pgd, displacement),
        (arias, intensity),
        (d5_95, duration),
    ):
        assert printed is None or abs(measure(record) - printed[0]) <= printed[1]
    assert final is None or abs(integrated(record)[1][-1] - final) <= 5e-4
    assert record.sha256 == hashlib.sha256(shared(name).read_bytes()).hexdigest()


def test_development_record_agrees_with_the_peak_in_its_own_header():
    """Reals 29 and 30 of 0111a.smc: 104.4078 cm/s² at 10.17 s, its samples have five digits
    (104.41)."""
    record = read_record(shared(LOMA + "a.smc"))
    assert abs(pga(record) - 1.044078) < 5e-5 and pga(record) == 0.01 * 104.41
    assert record.notes[0] == "component: azimuth 360 degrees clockwise from north"
    assert read_record(shared(LOMA + "b.smc")).notes[0] == "component: vertical, up"


def test_record_info_of_el_centro():
    text = record_info(read_record(shared(EL_CENTRO)))
    for line in (
        "format              PEER AT2",
        "samples             1559",
        "dt                  0.02 s",
        "duration            31.16 s",
        "PGA                 3.127 m/s2 = 0.3188 g at t = 2.02 s",
        "PGV                 0.3614 m/s",
        "Arias intensity     1.801 m/s",
        "D5-95               23.84 s",
        "final velocity      5.884e-05 m/s",
        "final displacement  -0.02458 m",
        "sha256              e096f0458ae7565ac8e9fac80eda018e4715a357ea4c14504ce1cfa6556c53a6",
    ):
        assert line in text.splitlines()


@pytest.mark.long
def test_record_info_lists_every_quantity(tmp_path):
    path = tmp_path / "motion.txt"
    path.write_text("# my record\n0.0 0.0\n0.1 1.0\n0.2 -2.0\n0.3 1.0\n0.4 0.0\n")
    lines = record_info(read_record(path, "gal")).splitlines()
    rows = {line[:20].strip(): line[20:] for line in lines}
    assert rows["file"] == str(path) and rows["title"] == "my record"
    assert (
        rows["units"] == "gal (1 gal = 0.01 m/s2)"
        and rows["samples"] == "5"
        and rows["duration"] == "0.4 s"
    )
    assert rows["PGA"] == "0.02 m/s2 = 0.002039 g at t = 0.2 s"
    assert [line[:20].strip() for line in lines] == [
        "file",
        "format",
        "title",
        "station",
        "component",
        "units",
        "samples",
        "dt",
        "duration",
        "PGA",
        "PGV",
        "PGD",
        "Arias intensity",
        "D5-95",
        "CAV",
        "RMS",
        "Housner intensity",
        "predominant period",
        "mean period",
        "final velocity",
        "final displacement",
        "sha256",
        "note",
    ]
    assert "samples             3" in record_info(read_record(path, "gal", resample_dt=0.2))


def test_record_first_sample_is_at_zero_and_the_last_at_n_minus_one():
    record = Record(acceleration=[1.0, 2.0, 3.0], dt=0.5)
    assert np.array_equal(record.times, [0.0, 0.5, 1.0]) and record.duration == 1.0


def test_record_is_a_read_only_copy():
    samples = np.array([1.0, 2.0])
    record = Record(acceleration=samples, dt=0.5)
    samples[0] = 9.0
    assert record.acceleration[0] == 1.0
    with pytest.raises(ValueError):
        record.acceleration[0] = 5.0


@pytest.mark.parametrize(
    "samples, dt, word",
    [
        ([1.0, math.nan], 0.1, "acceleration is nan at"),
        ([1.0], 0.1, "two"),
        ([[1.0, 2.0]], 0.1, "shape"),
        ([1.0, 2.0], 0.0, "time step"),
        ([1.0, 2.0], math.nan, "time step"),
        ([1.0, 2.0], "0.1", "time step"),
    ],
)
def test_bad_record_is_refused(samples, dt, word):
    with pytest.raises(InputError, match=word):
        Record(acceleration=samples, dt=dt)


def test_integration_is_exact_for_straight_lines():
    """a = 6 t: v = 3 t², u = t³, at every sample and for any step."""
    times = 0.25 * np.arange(9)
    velocity, displacement = integrated(Record(acceleration=6.0 * times, dt=0.25))
    assert np.array_equal(velocity, 3.0 * times**2)
    assert np.allclose(displacement, times**3, rtol=1e-14, atol=0.0)


def test_intensity_measures_of_a_constant_acceleration():
    """a = 2 for 10 s: Arias = pi 2² 10 / (2 g), D5-95 = 9 s, PGV = 20 m/s, PGD = 100 m."""
    record = Record(acceleration=np.full(101, -2.0), dt=0.1)
    assert pga(record) == 2.0 and pga_time(record) == 0.0
    assert math.isclose(arias(record), math.pi * 40.0 / (2.0 * STANDARD_GRAVITY), rel_tol=1e-13)
    assert math.isclose(d5_95(record), 9.0, rel_tol=1e-13)
    assert math.isclose(pgv(record), 20.0, rel_tol=1e-13) and math.isclose(
        pgd(record), 100.0, rel_tol=1e-13
    )


def test_silence_has_no_significant_duration():
    assert d5_95(Record(acceleration=np.zeros(5), dt=0.1)) == 0.0


def test_scaling_by_factor_and_to_a_peak():
    record = Record(acceleration=[1.0, -4.0, 2.0], dt=0.1, notes=("station",))
    assert np.array_equal(scaled(record, factor=-0.5).acceleration, [-0.5, 2.0, -1.0])
    assert np.array_equal(scaled_to_pga(record, 2.0).acceleration, [0.5, -2.0, 1.0])
    assert scaled(record, factor=2.0).notes == ("station", "scaled by 2")
    assert np.array_equal(record.acceleration, [1.0, -4.0, 2.0])


@pytest.mark.parametrize(
    "act, word",
    [
        (lambda r: scaled(r, factor=math.nan), "factor"),
        (lambda r: scaled_to_pga(r, 0.0), "pga"),
        (lambda r: scaled_to_pga(r, math.nan), "pga"),
        (lambda r: scaled_to_pga(scaled(r, factor=0.0), 1.0), "every sample is zero"),
        (lambda r: resampled(r, 0.0), "above zero in s"),
        (lambda r: resampled(r, math.pi / 300), "whole numbers"),
        (lambda r: resampled(r, 1e-7), "choose a step such as 2e-05 s"),
        (lambda r: resampled(r, 1.0), "shorter step"),
    ],
)
def test_bad_processing_is_refused(act, word):
    with pytest.raises(InputError, match=word):
        act(Record(acceleration=[1.0, -4.0, 2.0], dt=0.02))


def wave_packet(frequency, dt):
    """A sine of the given frequency in a Gaussian envelope, zero at both ends of 20 s."""
    times = dt * np.arange(round(20.0 / dt) + 1)
    return Record(
        acceleration=np.sin(2 * np.pi * frequency * times) * np.exp(-(((times - 10.0) / 2.0) ** 2)),
        dt=dt,
    )


@pytest.mark.parametrize("old, new", [(0.02, 0.005), (0.005, 0.02), (0.01, 0.0075)])
def test_resampling_keeps_what_both_steps_resolve(old, new):
    """3 Hz lies far below all Nyquist frequencies: the resampled packet is the packet sampled
    directly."""
    record, exact = resampled(wave_packet(3.0, old), new), wave_packet(3.0, new)
    n = record.acceleration.size
    assert n == int(20.0 / new * (1.0 + 1e-12)) + 1 and record.dt == new
    assert np.max(np.abs(record.acceleration - exact.acceleration[:n])) < 2e-3


def test_decimation_does_not_alias():
    """40 Hz sampled every 0.02 s would fold back to 10 Hz at full height; the filter removes it."""
    record = wave_packet(40.0, 0.005)
    assert np.max(np.abs(record.acceleration[::4])) > 0.9
    assert pga(resampled(record, 0.02)) < 2e-3


def test_resampling_to_the_same_step_changes_nothing():
    record = wave_packet(3.0, 0.02)
    assert np.allclose(
        resampled(record, 0.02).acceleration, record.acceleration, rtol=1e-15, atol=0.0
    )


@pytest.mark.parametrize("wrong", [np.ones(4) * 1j, ["1", "2"], [None, 1.0], [True, False]])
def test_samples_are_real_numbers(wrong):
    with pytest.raises(InputError, match="Record: acceleration is .*; give real numbers of shape"):
        Record(acceleration=wrong, dt=0.01)
