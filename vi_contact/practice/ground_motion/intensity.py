"""Measure how strong a record is: peaks, Arias intensity, durations, and what spectra say."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from .processing import integrated
from .record import UNITS, Record
from .spectra import fourier_spectrum, response_spectrum


@check_arguments
def pga(record: Record) -> float:
    """Return the peak ground acceleration, the largest |a| of the samples [m/s²]."""
    return float(np.max(np.abs(record.acceleration)))


@check_arguments
def pga_time(record: Record) -> float:
    """Return the time of the first sample that reaches the peak ground acceleration [s]."""
    return float(np.argmax(np.abs(record.acceleration))) * record.dt


@check_arguments
def pgv(record: Record) -> float:
    """Return the peak ground velocity.

    It is the largest |v| at the samples of the integrated record [m/s].
    """
    velocity, _ = integrated(record)
    return float(np.max(np.abs(velocity)))


@check_arguments
def pgd(record: Record) -> float:
    """Return the peak ground displacement.

    It is the largest |u| of the twice integrated samples, their drift included [m].
    """
    _, displacement = integrated(record)
    return float(np.max(np.abs(displacement)))


@check_arguments
def arias(record: Record) -> float:
    """Return the Arias intensity of the record.

    It is pi / (2 g) times the integral of a² over the record, by the trapezoidal rule [m/s].
    """
    return float(husid(record)[-1])


@check_arguments
def d5_95(record: Record) -> float:
    """Return the time between 5 % and 95 % of the Arias intensity [s].

    It is zero for a record that is all zero.

    Both instants are interpolated linearly in the Husid curve, the Arias intensity accumulated up
    to t.
    """
    return significant_duration(record, 0.05, 0.95)


@check_arguments
def husid(record: Record) -> Array:
    """Return the Arias intensity accumulated up to each sample, shape (n,) [m/s]."""
    square = record.acceleration**2
    steps = 0.5 * record.dt * (square[:-1] + square[1:])
    return math.pi / (2.0 * STANDARD_GRAVITY) * np.concatenate(([0.0], np.cumsum(steps)))


@check_arguments
def significant_duration(record: Record, start: float, end: float) -> float:
    """Return the time between two fractions of the Arias intensity [s].

    It is zero for a record that is all zero.

    Args:
        record: the motion.
        start: the first fraction, from 0.
        end: the second fraction, above the first and up to 1.
    """
    if not 0.0 <= start < end <= 1.0:
        raise InputError(
            f"significant_duration: {start!r} to {end!r}; give fractions with 0 <= start < end <= 1"
        )
    curve = husid(record)
    if curve[-1] == 0.0:
        return 0.0
    first, last = np.interp((start * curve[-1], end * curve[-1]), curve, record.times)
    return float(last - first)


@check_arguments
def cav(record: Record) -> float:
    """Return the cumulative absolute velocity, the integral of |a| [m/s].

    It is exact for straight lines between samples.
    """
    a = np.abs(record.acceleration[:-1])
    b = np.abs(record.acceleration[1:])
    # Between two samples |a| is a trapezium, or two triangles where the sign changes.
    change = record.acceleration[:-1] * record.acceleration[1:] < 0.0
    total = np.where(change, a + b, 1.0)
    return float(np.sum(0.5 * record.dt * np.where(change, (a**2 + b**2) / total, a + b)))


@check_arguments
def rms(record: Record) -> float:
    """Return the root of the mean of a² over the record, by the trapezoidal rule [m/s²]."""
    return math.sqrt(2.0 * STANDARD_GRAVITY / math.pi * arias(record) / record.duration)


# periods [s] of the trapezoidal rule in `housner_intensity`
HOUSNER_PERIODS = np.linspace(0.1, 2.5, 241)
# periods [s] among which `predominant_period` looks, 1.6 % apart
PREDOMINANT_PERIODS = np.geomspace(0.02, 10.0, 400)


@check_arguments
def psa(record: Record, period: float, *, damping: float = 0.05) -> float:
    """Return the pseudo-acceleration at one period [m/s²].

    Args:
        record: the motion.
        period: of the oscillator [s].
        damping: its ratio.
    """
    spectrum = response_spectrum(record, np.array([period]), damping=damping)
    return float(spectrum.psa[0])


@check_arguments
def housner_intensity(record: Record, *, damping: float = 0.05) -> float:
    """Return Housner's spectrum intensity.

    It is the integral of the pseudo-velocity over T from 0.1 to 2.5 s [m].
    """
    psv = response_spectrum(record, HOUSNER_PERIODS, damping=damping).psv
    return float(np.sum(0.5 * (psv[:-1] + psv[1:]) * np.diff(HOUSNER_PERIODS)))


@check_arguments
def predominant_period(record: Record, *, damping: float = 0.05) -> float:
    """Return the period of the largest pseudo-acceleration, from 0.02 to 10 s [s].

    Periods below ten steps of the record are left out.
    """
    periods = PREDOMINANT_PERIODS[PREDOMINANT_PERIODS / record.dt >= 10.0]
    if not periods.size:
        raise InputError(
            f"predominant_period: a step of {record.dt:g} s resolves no period; use a smaller step"
        )
    spectrum = response_spectrum(record, periods, damping=damping)
    return float(periods[np.argmax(spectrum.psa)])


@check_arguments
def mean_period(record: Record) -> float:
    """Return the mean period of Rathje, Abrahamson and Bray (1998) [s].

    It is sum(C²/f) / sum(C²) over 0.25 <= f <= 20 Hz, where C are the Fourier amplitudes.

    Raises:
        InputError: a record without motion in that band.
    """
    frequencies, amplitudes = fourier_spectrum(record)
    inside = (frequencies >= 0.25) & (frequencies <= 20.0)
    power = amplitudes[inside] ** 2
    if not np.any(power > 0.0):
        raise InputError(
            "mean_period: the record has no motion from 0.25 to 20 Hz; use a longer or finer one"
        )
    return float(np.sum(power / frequencies[inside]) / np.sum(power))


@check_arguments
def record_info(record: Record) -> str:
    """Return the table of a record.

    It says where the record comes from, its peaks and intensities, what is left at its end, what is
    doubted, and its notes.
    """
    measures = (pga, pga_time, pgv, pgd, arias, d5_95, cav, rms, housner_intensity)
    values: dict[str, Any] = {measure.__name__: measure(record) for measure in measures}
    for period in (predominant_period, mean_period):
        all_zero = values["pga"] == 0.0
        values[period.__name__] = "(all zero)" if all_zero else _period_in_words(period, record)
    velocity, displacement = integrated(record)
    template = Path(__file__).with_name("record_info.txt").read_text(encoding="utf-8")
    table = template.format(
        **values,
        record=record,
        title=record.title or "(none)",
        station=record.station or "(not stated)",
        component=record.component or "(not stated)",
        unit=UNITS[record.units],
        velocity=velocity[-1],
        displacement=displacement[-1],
        in_g=values["pga"] / STANDARD_GRAVITY,
    )
    doubts = [f"{'doubt':<20}{doubt}" for doubt in record.doubts]
    notes = [f"{'note':<20}{note}" for note in record.notes]
    return "\n".join([table, *doubts, *notes])


def _period_in_words(period: Callable[[Record], float], record: Record) -> str:
    """Return a period [s], or in brackets why the record has none."""
    try:
        return f"{period(record):.3g} s"
    except InputError as error:  # "name: why; remedy"
        _, _, why_and_remedy = str(error).partition(": ")
        why, _, _ = why_and_remedy.partition(";")
        return f"({why})"
