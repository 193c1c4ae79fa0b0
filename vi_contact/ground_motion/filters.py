"""Taper, Butterworth filter, removal of the mean. Every function returns a new Record and notes what it did."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..core.checks import counted
from ..core.errors import InputError
from .record import Record


def without_mean(record: Record, *, until: float | None = None) -> Record:
    """The record minus its mean, or minus the mean of the samples at t <= until [s], the quiet before the shaking.

    Raises InputError when until is not within the record.
    """
    end = record.duration if until is None else until
    if not 0.0 <= end <= record.duration:
        raise InputError(f"without_mean: until is {until!r} s; give a time within the record's {record.duration:g} s")
    count = int(end / record.dt * (1.0 + 1e-12)) + 1
    mean = float(np.mean(record.acceleration[:count]))
    where = "" if until is None else f" of the first {until:g} s"
    return replace(record, acceleration=record.acceleration - mean,
                   notes=(*record.notes, f"mean{where} removed: {mean:.6g} m/s2"))


def tapered(record: Record, *, fraction: float = 0.05, start: bool = True, end: bool = True) -> Record:
    """Both ends (or one) brought to zero by half a cosine over `fraction` of the record's duration.

    w(t) = (1 - cos(pi t / (fraction T))) / 2 at the start, mirrored at the end; 1 between.
    Raises InputError unless 0 < fraction <= 0.5.
    """
    if not 0.0 < fraction <= 0.5:
        raise InputError(f"tapered: fraction is {fraction!r}; give more than 0 and at most 0.5 of the duration")
    ramp = np.minimum(record.times / (fraction * record.duration), 1.0)
    window = 0.5 * (1.0 - np.cos(math.pi * ramp))
    weights = (window if start else 1.0) * (window[::-1] if end else 1.0)
    ends = " and ".join(name for name, used in (("start", start), ("end", end)) if used)
    return replace(record, acceleration=record.acceleration * weights,
                   notes=(*record.notes, f"cosine taper over {100 * fraction:g} % at {ends or 'no end'}"))


def filtered(record: Record, *, low: float | None = None, high: float | None = None, order: int = 4,
             causal: bool = False) -> Record:
    """Butterworth high-pass above `low` [Hz], low-pass below `high` [Hz], or band-pass between them.

    One pass has the gain |H|² = 1 / (1 + (f/high)^(2 order)) and likewise (low/f) of the high-pass, each applied by
    itself, so a band-pass has `order` on both flanks; the bilinear transform replaces f by tan(pi f dt). causal: one
    pass forward, which delays. Otherwise (default) forward and backward: no phase shift and the gain |H|², -6 dB at the
    corners. The record is taken as zero outside; it keeps its length, so what a zero-phase filter sends out before the
    start and after the end is cut off: use `padded` before where that matters.
    Raises InputError for corners that are not 0 < low < high < Nyquist frequency, or an order outside 1 to 10.
    """
    nyquist = 0.5 / record.dt
    corners = [corner for corner in (low, high) if corner is not None]
    if not corners or not all(0.0 < corner < nyquist for corner in corners) or sorted(set(corners)) != corners:
        raise InputError(f"filtered: corners low={low!r} and high={high!r} Hz; give one or both, rising, between 0 and "
                         f"the Nyquist frequency {nyquist:g} Hz")
    if order not in range(1, 11):
        raise InputError(f"filtered: order is {order!r}; give a whole number from 1 to 10")
    from scipy.signal import butter, sosfilt  # late: it takes longer to import than the rest of the package

    stages = [butter(order, corner, kind, fs=1.0 / record.dt, output="sos")
              for corner, kind in ((low, "highpass"), (high, "lowpass")) if corner is not None]
    sections = np.concatenate(stages)
    if causal:
        samples = sosfilt(sections, record.acceleration)
    else:
        tail = np.zeros(_ringing(record, min(corners)))
        forward = sosfilt(sections, np.concatenate([tail, record.acceleration, tail]))
        samples = sosfilt(sections, forward[::-1])[::-1][tail.size:tail.size + record.acceleration.size]
    band = " to ".join(f"{corner:g}" for corner in corners)
    kind = "band-pass" if len(corners) == 2 else "high-pass" if low is not None else "low-pass"
    return replace(record, acceleration=samples,
                   notes=(*record.notes, f"Butterworth {kind} {band} Hz, order {order}, "
                          f"{'causal' if causal else 'zero phase (two passes)'}"))


def _ringing(record: Record, corner: float) -> int:
    """Samples in which the slowest filter has died away: six periods of its lowest corner."""
    asked = 6.0 / (corner * record.dt)
    counted("filtered", f"a corner of {corner:g} Hz", 3.0 * asked + record.acceleration.size)
    return math.ceil(asked)
