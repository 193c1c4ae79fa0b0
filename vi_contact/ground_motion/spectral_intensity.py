"""Measures read from spectra: Housner intensity, predominant and mean period."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from .record import Record
from .spectra import fourier_spectrum, response_spectrum

HOUSNER_PERIODS = np.linspace(0.1, 2.5, 241)
"""Periods [s] of the trapezoidal rule in `housner_intensity`."""

PREDOMINANT_PERIODS = np.geomspace(0.02, 10.0, 400)
"""Periods [s] among which `predominant_period` looks, 1.6 % apart."""


def psa(record: Record, period: float, *, damping: float = 0.05) -> float:
    """Pseudo-acceleration at one period [m/s²]."""
    return float(response_spectrum(record, np.array([period]), damping=damping).psa[0])


def housner_intensity(record: Record, *, damping: float = 0.05) -> float:
    """Housner's spectrum intensity: integral of the pseudo-velocity over T from 0.1 to 2.5 s [m]."""
    psv = response_spectrum(record, HOUSNER_PERIODS, damping=damping).psv
    return float(np.sum(0.5 * (psv[:-1] + psv[1:]) * np.diff(HOUSNER_PERIODS)))


def predominant_period(record: Record, *, damping: float = 0.05) -> float:
    """Period of the largest pseudo-acceleration from 0.02 (or ten steps of the record) to 10 s [s]."""
    periods = PREDOMINANT_PERIODS[PREDOMINANT_PERIODS / record.dt >= 10.0]
    if not periods.size:
        raise InputError(f"predominant_period: a step of {record.dt:g} s resolves no period; use a finer record")
    return float(periods[np.argmax(response_spectrum(record, periods, damping=damping).psa)])


def mean_period(record: Record) -> float:
    """Mean period of Rathje, Abrahamson and Bray (1998) [s]: sum(C²/f) / sum(C²), 0.25 <= f <= 20 Hz.

    C are the Fourier amplitudes. Raises InputError when nothing lies in that band.
    """
    frequencies, amplitudes = fourier_spectrum(record)
    inside = (frequencies >= 0.25) & (frequencies <= 20.0)
    power = amplitudes[inside] ** 2
    if not np.any(power > 0.0):
        raise InputError("mean_period: the record holds nothing from 0.25 to 20 Hz; use a longer or finer one")
    return float(np.sum(power / frequencies[inside]) / np.sum(power))
