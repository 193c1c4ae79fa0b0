"""Every excitation against its formula, and the contract they share."""

import math

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.laws.excitation import FullSine, HalfSine, Harmonic, Rectangular, Ricker, Tabulated
from vi_contact.practice.ground_motion import Record
from vi_contact.practice.ground_motion.excitation import GroundMotion

pytestmark = pytest.mark.serial

RECORD = Record(acceleration=np.array([1.0, 3.0, -1.0, 2.0]), dt=0.02)
ALL = [
    Harmonic(amplitude=3.0, frequency=2.0),
    Ricker(amplitude=2.0, frequency=4.0),
    HalfSine(amplitude=2.0, duration=0.5),
    FullSine(amplitude=2.0, duration=0.5),
    Rectangular(amplitude=2.0, duration=0.2),
    Tabulated(times=(0.0, 1.0), values=(1.0, 3.0)),
    GroundMotion(RECORD),
]


def integral(excitation, n=4000):
    """Velocity at the end, midpoint rule."""
    dt = excitation.duration / n
    return dt * sum(excitation.acceleration((k + 0.5) * dt) for k in range(n))


@pytest.mark.parametrize("excitation", ALL, ids=lambda e: type(e).__name__)
def test_contract(excitation):
    """A float, a vector along the direction, and silence after a finite duration."""
    for t in (0.0, 0.013, 0.1):
        a = excitation.acceleration(t)
        assert type(a) is float
        assert np.array_equal(excitation(t), [a, 0.0])
    assert excitation.direction == (1.0, 0.0)
    if math.isfinite(excitation.duration):
        assert abs(excitation.acceleration(excitation.duration + 1e-9)) < 1e-7
    with pytest.raises(AttributeError):
        excitation.direction = (0.0, 1.0)


def test_harmonic_of_figure_3():
    """a_g = 3 sin(4 pi t) (seed 000 Fig. 3, amplitude and frequency of design.md section 4)."""
    excitation = Harmonic(amplitude=3.0, frequency=2.0)
    assert excitation.acceleration(0.0) == 0.0 and excitation.acceleration(0.125) == 3.0
    assert excitation.duration == math.inf
    assert Harmonic(3.0, 2.0, phase=math.pi / 2).acceleration(0.0) == 3.0


def test_ricker_peak_zeros_and_default_delay():
    excitation = Ricker(amplitude=2.0, frequency=4.0)
    assert excitation.peak_time == 0.375 and excitation.duration == 0.75
    assert excitation.acceleration(0.375) == 2.0
    zero = 1.0 / (math.pi * 4.0 * math.sqrt(2.0))
    assert abs(excitation.acceleration(0.375 + zero)) < 1e-14
    trough = math.sqrt(1.5) / (math.pi * 4.0)
    assert math.isclose(
        excitation.acceleration(0.375 - trough), -4.0 * math.exp(-1.5), rel_tol=1e-13
    )
    assert abs(excitation.acceleration(0.0)) < 1e-8 * 2.0
    assert abs(integral(excitation)) < 1e-8
    assert Ricker(2.0, 4.0, delay=1.0).acceleration(1.0) == 2.0


def test_pulses_leave_the_velocities_of_their_formulas():
    assert math.isclose(integral(HalfSine(2.0, 0.5)), 2.0 * 2.0 * 0.5 / math.pi, rel_tol=1e-6)
    assert abs(integral(FullSine(2.0, 0.5))) < 1e-12
    assert math.isclose(integral(Rectangular(2.0, 0.2)), 0.4, rel_tol=1e-12)
    assert HalfSine(2.0, 0.5).acceleration(0.25) == FullSine(2.0, 0.5).acceleration(0.125) == 2.0


@pytest.mark.parametrize("pulse", [HalfSine, FullSine, Rectangular])
def test_pulses_are_zero_outside_and_open_at_the_end(pulse):
    assert pulse(2.0, 0.2).acceleration(-1e-12) == pulse(2.0, 0.2).acceleration(0.2) == 0.0


def test_rectangular_pulse_value_at_its_start_is_the_plateau():
    assert Rectangular(2.0, 0.2).acceleration(0.0) == 2.0


def test_tabulated_is_piecewise_linear_and_zero_outside():
    excitation = Tabulated(
        times=[1.0, 2.0, 4.0], values=np.array([1.0, 3.0, -1.0]), direction=[0.0, 2.0]
    )
    for t, a in [
        (0.999, 0.0),
        (1.0, 1.0),
        (1.5, 2.0),
        (2.0, 3.0),
        (3.0, 1.0),
        (4.0, -1.0),
        (4.001, 0.0),
    ]:
        assert excitation.acceleration(t) == a
    assert excitation.duration == 4.0
    assert np.array_equal(excitation(1.5), [0.0, 4.0])
    assert excitation == Tabulated((1.0, 2.0, 4.0), (1.0, 3.0, -1.0), (0.0, 2.0))


def test_ground_motion_is_piecewise_linear_between_samples_at_k_dt():
    excitation = GroundMotion(RECORD, direction=(0.0, 0.0, 1.0), scale=2.0)
    times, values = (
        (-1e-9, 0.0, 0.01, 0.02, 0.03, 0.05, 0.06, 0.0601),
        (0.0, 2.0, 4.0, 6.0, 2.0, 1.0, 4.0, 0.0),
    )
    for t, a in zip(times, values, strict=True):
        assert abs(excitation.acceleration(t) - a) < 1e-13
    assert excitation.duration == 3 * 0.02
    assert excitation(0.06).shape == (3,)


def test_ground_motion_and_tabulated_agree():
    rng = np.random.default_rng(1)
    record = Record(acceleration=rng.normal(size=300), dt=0.005)
    table, motion = Tabulated(record.times, record.acceleration), GroundMotion(record)
    for t in rng.uniform(0.0, record.duration, 200):
        assert math.isclose(
            table.acceleration(t), motion.acceleration(t), rel_tol=1e-9, abs_tol=1e-12
        )


@pytest.mark.parametrize(
    "build, word",
    [
        (lambda: Harmonic(math.nan, 2.0), "amplitude"),
        (lambda: Harmonic(1.0, 0.0), "frequency"),
        (lambda: Harmonic(1.0, -2.0), "frequency"),
        (lambda: Harmonic(1.0, 2.0, phase=math.inf), "phase"),
        (lambda: Harmonic(1.0, 2.0, direction=(0.0, 0.0)), "direction"),
        (lambda: Harmonic(1.0, 2.0, direction=()), "direction"),
        (lambda: Harmonic(1.0, 2.0, direction=(math.nan, 0.0)), r"direction\[0\]"),
        (lambda: Harmonic(1.0, 2.0, direction="x"), "direction"),
        (lambda: Tabulated((0.0, 1.0), (1.0, math.nan)), r"values\[1\]"),
        (lambda: Tabulated((0.0, 1.0), (1.0,)), "one value"),
        (lambda: Tabulated((0.0,), (1.0,)), "at least two"),
        (lambda: Tabulated((0.0, 1.0, 1.0), (1.0, 2.0, 3.0)), "increasing"),
        (lambda: GroundMotion("elcentro.at2"), "read_record"),
    ],
)
def test_bad_input_is_named(build, word):
    with pytest.raises(InputError, match=word):
        build()
