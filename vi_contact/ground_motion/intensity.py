"""Intensity measures of a record: peaks, Arias intensity, significant duration."""

from __future__ import annotations

import math

import numpy as np

from ..algebra import Array
from .processing import integrated
from .record import STANDARD_GRAVITY, Record


def pga(record: Record) -> float:
    """Peak ground acceleration, the largest |a| of the samples [m/s²]."""
    return float(np.max(np.abs(record.acceleration)))


def pga_time(record: Record) -> float:
    """Time of the first sample that reaches the peak ground acceleration [s]."""
    return float(np.argmax(np.abs(record.acceleration))) * record.dt


def pgv(record: Record) -> float:
    """Peak ground velocity, the largest |v| at the samples of the integrated record [m/s]."""
    return float(np.max(np.abs(integrated(record)[0])))


def pgd(record: Record) -> float:
    """Peak ground displacement, the largest |u| at the samples of the twice integrated record, drift included [m]."""
    return float(np.max(np.abs(integrated(record)[1])))


def arias(record: Record) -> float:
    """Arias intensity pi / (2 g) times the integral of a² over the record, by the trapezoidal rule [m/s]."""
    return float(_husid(record)[-1])


def d5_95(record: Record) -> float:
    """Significant duration: time between 5 % and 95 % of the Arias intensity [s], zero for a record that is all zero.

    Both instants are interpolated linearly in the Husid curve, the Arias intensity accumulated up to t.
    """
    husid = _husid(record)
    if husid[-1] == 0.0:
        return 0.0
    start, end = np.interp((0.05 * husid[-1], 0.95 * husid[-1]), husid, record.times)
    return float(end - start)


def _husid(record: Record) -> Array:
    """Arias intensity accumulated up to each sample, shape (n,) [m/s]."""
    square = record.acceleration**2
    steps = 0.5 * record.dt * (square[:-1] + square[1:])
    return math.pi / (2.0 * STANDARD_GRAVITY) * np.concatenate(([0.0], np.cumsum(steps)))
