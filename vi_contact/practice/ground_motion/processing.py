"""Scale, resample, integrate, cut, lengthen, taper and filter records, and correct their baselines.

Every function returns a new value and notes what it did. Between samples the acceleration is a
straight line.
"""

import math
from dataclasses import replace
from fractions import Fraction
from typing import Annotated

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.checks import check_count
from ...core.errors import InputError
from ...core.quantities import Finite, Positive, Unit
from .record import Record

# numerator and denominator of old dt / new dt may not exceed this; the filter grows with them
LARGEST_RATIO = 1000
HIGHEST = 6  # highest degree of a baseline: beyond it a polynomial follows the shaking itself


@check_arguments
def scaled(record: Record, *, factor: Annotated[float, Finite]) -> Record:
    """Scale every sample by `factor`; a negative one turns the motion round."""
    factor = float(factor)
    return record.changed(factor * record.acceleration, f"scaled by {factor:.6g}")


@check_arguments
def resampled(record: Record, dt: Annotated[float, Positive, Unit("s")]) -> Record:
    """Return the record at time step dt.

    It is interpolated band-limited to smaller steps, and decimated with anti-aliasing to larger
    ones, by scipy.signal.resample_poly: a zero-phase windowed-sinc filter (Kaiser, beta 5) whose
    amplitude is halved at the lower of the two Nyquist frequencies 1 / (2 dt). The record is taken
    as zero outside its samples, so a record that does not start and end near zero is bent towards
    zero over ten steps, of the longer kind, at each end. dt must be the record's step times a ratio
    of whole numbers up to 1000; `GroundMotion` interpolates for any other step. Sample 0 stays at
    t = 0; the new record ends at the last multiple of dt inside the old one.

    Raises:
        InputError: a dt that is not such a ratio, or longer than the record.
    """
    dt = float(dt)
    check_count("resampled", f"dt={dt!r} s", record.duration / dt)
    # late: it takes longer to import than the rest of the package
    from scipy.signal import resample_poly

    ratio = Fraction(record.dt / dt).limit_denominator(LARGEST_RATIO)
    exact = math.isclose(ratio.numerator * dt, ratio.denominator * record.dt, rel_tol=1e-9)
    if ratio.numerator > LARGEST_RATIO or not exact:
        whole = min(round(max(record.dt / dt, dt / record.dt)), LARGEST_RATIO)
        near = record.dt / whole if dt < record.dt else record.dt * whole
        raise InputError(
            f"resampled: {dt!r} s and the record's step {record.dt!r} s have no ratio of whole "
            f"numbers up to {LARGEST_RATIO}; choose a step such as {near!r} s"
        )
    count = (record.acceleration.size - 1) * ratio.numerator // ratio.denominator + 1
    if count < 2:
        raise InputError(
            f"resampled: a step of {dt!r} s leaves one sample of a record of {record.duration!r} "
            "s; choose a shorter step"
        )
    samples = resample_poly(record.acceleration, ratio.numerator, ratio.denominator)[:count]
    return record.changed(samples, f"resampled from {record.dt:g} s to {dt:g} s", dt=float(dt))


@check_arguments
def integrated(record: Record) -> tuple[Array, Array]:
    """Return ground velocity (n,) [m/s] and displacement (n,) [m] at the samples.

    Both are zero at t = 0. They are exact for an acceleration that is a straight line between
    samples: the trapezoidal rule for the velocity, v_{k+1} = v_k + dt (a_k + a_{k+1}) / 2, and
    u_{k+1} = u_k + dt v_k + dt² (2 a_k + a_{k+1}) / 6. Nothing is filtered and no baseline is
    corrected: what is left at the end is the drift of the record.
    """
    a = record.acceleration
    dt = record.dt
    velocity_steps = 0.5 * dt * (a[:-1] + a[1:])
    velocity = np.concatenate(([0.0], np.cumsum(velocity_steps)))
    displacement_steps = dt * velocity[:-1] + dt**2 / 6.0 * (2.0 * a[:-1] + a[1:])
    displacement = np.concatenate(([0.0], np.cumsum(displacement_steps)))
    return velocity, displacement


@check_arguments
def trimmed(record: Record, start: float = 0.0, end: float | None = None) -> Record:
    """Keep the samples at start <= t <= end; the first one kept becomes t = 0.

    Args:
        record: the motion.
        start: time of the first sample [s].
        end: time of the last sample [s]; None for that of the record.

    Raises:
        InputError: times without 0 <= start < end <= duration; fewer than two samples left.
    """
    last = record.duration if end is None else end
    slack = 1e-9 * record.dt
    if not -slack <= start < last <= record.duration + slack:
        raise InputError(
            f"trimmed: start={start!r} and end={end!r} s; give 0 <= start < end <= "
            f"{record.duration:g} s"
        )
    inside = (record.times >= start - slack) & (record.times <= last + slack)
    if np.count_nonzero(inside) < 2:
        raise InputError(
            f"trimmed: fewer than two samples lie from {start:g} to {last:g} s; give a longer piece"
        )
    times = record.times[inside]
    note = f"trimmed to {float(times[0]):g} ... {float(times[-1]):g} s"
    return record.changed(record.acceleration[inside], note)


@check_arguments
def padded(record: Record, before: float = 0.0, after: float = 0.0) -> Record:
    """Add zeros before and behind the record.

    Args:
        record: the motion.
        before: how long the zeros ahead of it last [s], rounded up to whole steps.
        after: how long the zeros behind it last [s], rounded up likewise.

    Raises:
        InputError: a length that is negative or infinite.
    """
    if not all(0.0 <= length < math.inf for length in (before, after)):
        raise InputError(
            f"padded: before={before!r} and after={after!r} s; give zero or positive lengths"
        )
    steps = [length / record.dt * (1.0 - 1e-9) for length in (before, after)]
    total = record.acceleration.size + sum(steps)
    check_count("padded", f"before={before!r} and after={after!r} s", total)
    counts = [math.ceil(number) for number in steps]
    note = f"zeros added: {counts[0] * record.dt:g} s before, {counts[1] * record.dt:g} s after"
    return record.changed(np.pad(record.acceleration, counts), note)


@check_arguments
def without_mean(record: Record, *, until: float | None = None) -> Record:
    """Subtract the mean of the record, or that of the quiet before the shaking, t <= until [s].

    Raises InputError when ``until`` is not within the record.
    """
    end = record.duration if until is None else until
    if not 0.0 <= end <= record.duration:
        raise InputError(
            f"without_mean: until is {until!r} s; give a time within the record's "
            f"{record.duration:g} s"
        )
    count = int(end / record.dt * (1.0 + 1e-12)) + 1
    mean = float(np.mean(record.acceleration[:count]))
    where = "" if until is None else f" of the first {until:g} s"
    return record.changed(record.acceleration - mean, f"mean{where} removed: {mean:.6g} m/s2")


@check_arguments
def tapered(record: Record, *, fraction: float = 0.05) -> Record:
    """Bring both ends to zero by half a cosine over `fraction` of the record's duration.

    The window is w(t) = (1 - cos(pi t / (fraction T))) / 2 at the start, mirrored at the end.
    Raises InputError unless 0 < fraction <= 0.5.
    """
    if not 0.0 < fraction <= 0.5:
        raise InputError(
            f"tapered: fraction is {fraction!r}; give more than 0 and at most 0.5 of the duration"
        )
    ramp = np.minimum(record.times / (fraction * record.duration), 1.0)
    window = 0.5 * (1.0 - np.cos(math.pi * ramp))
    note = f"cosine taper over {100 * fraction:g} % at start and end"
    return record.changed(record.acceleration * (window * window[::-1]), note)


@check_arguments
def filtered(
    record: Record,
    *,
    low: float | None = None,
    high: float | None = None,
    order: int = 4,
    causal: bool = False,
) -> Record:
    """Apply a Butterworth high-pass, a low-pass, or a band-pass, which is both.

    One pass has the gain |H|² = 1 / (1 + (f/high)^(2 order)) and likewise (low/f) of the high-pass,
    each applied by itself, so a band-pass has `order` on both flanks; the bilinear transform
    replaces f by tan(pi f dt). The record is taken as zero outside; it keeps its length, so what a
    zero-phase filter sends out before the start and after the end is cut off: use `padded` before
    where that matters.

    Args:
        record: the motion.
        low: corner of the high-pass [Hz]; None for no high-pass.
        high: corner of the low-pass [Hz]; None for no low-pass.
        order: of each filter, 1 to 10.
        causal: True for one pass forward, which delays. False for forward and backward: no phase
            shift, and the gain |H|², which is -6 dB at the corners.

    Raises:
        InputError: corners without 0 < low < high < Nyquist frequency; an order outside 1 to 10.
    """
    nyquist = 0.5 / record.dt
    corners = [corner for corner in (low, high) if corner is not None]
    in_range = all(0.0 < corner < nyquist for corner in corners)
    rising = sorted(set(corners)) == corners
    if not (corners and in_range and rising):
        raise InputError(
            f"filtered: corners low={low!r} and high={high!r} Hz; give one or both, rising, "
            f"between 0 and the Nyquist frequency {nyquist:g} Hz"
        )
    if order not in range(1, 11):
        raise InputError(f"filtered: order is {order!r}; give a whole number from 1 to 10")
    # late: it takes longer to import than the rest of the package
    from scipy.signal import butter, sosfilt

    stages = []
    for corner, kind in ((low, "highpass"), (high, "lowpass")):
        if corner is not None:
            stages.append(butter(order, corner, kind, fs=1.0 / record.dt, output="sos"))
    sections = np.concatenate(stages)
    if causal:
        samples = sosfilt(sections, record.acceleration)
    else:
        # Zeros on both sides, for as many samples as the slowest filter takes to die away: six of
        # its periods. Then forward, and backward in time.
        lowest = min(corners)
        ringing = 6.0 / (lowest * record.dt)
        size = record.acceleration.size
        check_count("filtered", f"a corner of {lowest:g} Hz", 3.0 * ringing + size)
        tail = np.zeros(math.ceil(ringing))
        forward = sosfilt(sections, np.concatenate([tail, record.acceleration, tail]))
        both_ways = sosfilt(sections, forward[::-1])[::-1]
        samples = both_ways[tail.size : tail.size + size]
    band = " to ".join(f"{corner:g}" for corner in corners)
    kinds = [
        name for name, corner in (("high-pass", low), ("low-pass", high)) if corner is not None
    ]
    kind = "band-pass" if len(kinds) == 2 else kinds[0]
    passes = "causal" if causal else "zero phase (two passes)"
    return record.changed(samples, f"Butterworth {kind} {band} Hz, order {order}, {passes}")


@check_arguments
def baseline_corrected(record: Record, *, degree: int = 2, displacement: bool = False) -> Record:
    """Return the record minus p(t) = sum c_k (t/T)^k, k = 0..degree, T its duration.

    The coefficients c minimise the sum of squares of the motion left over, subject to v(T) = u(T) =
    0; v and u are those of `integrated`, so both end at zero to round-off. A second correction
    changes nothing, and a record that is itself such a polynomial becomes zero.

    Args:
        record: the motion.
        degree: of the polynomial, from 1 to 6 and below the number of samples.
        displacement: whether the displacement is minimised in the place of the velocity.

    Raises:
        InputError: another degree.
    """
    if degree not in range(1, min(HIGHEST, record.acceleration.size - 1) + 1):
        raise InputError(
            f"baseline_corrected: degree is {degree!r}; give a whole number from 1 to {HIGHEST}, "
            "below the number of samples"
        )
    # The integrated motion of each power and of the record: (v or u, power, sample).
    powers = (record.times / record.duration)[:, None] ** np.arange(degree + 1)
    motions = [integrated(replace(record, acceleration=column)) for column in powers.T]
    velocities = np.array([v for v, _ in motions])
    displacements = np.array([u for _, u in motions])
    velocity_of_record, displacement_of_record = integrated(record)
    basis = displacements.T if displacement else velocities.T
    target = displacement_of_record if displacement else velocity_of_record

    # One polynomial that brings both to rest at the end.
    scale = np.array([[record.duration], [record.duration**2]])
    ends = np.array([velocities[:, -1], displacements[:, -1]]) / scale
    drift = np.array([[velocity_of_record[-1]], [displacement_of_record[-1]]]) / scale
    at_rest, *_ = np.linalg.lstsq(ends, drift, rcond=None)
    coefficients = at_rest[:, 0]

    # The best of those that change nothing at the end, added to it.
    _, _, rows = np.linalg.svd(ends)
    free = rows[2:].T
    if free.shape[1]:
        shares, *_ = np.linalg.lstsq(basis @ free, target - basis @ coefficients, rcond=None)
        coefficients = coefficients + free @ shares
    kind = "displacement" if displacement else "velocity"
    note = f"baseline: polynomial of degree {degree} fitted to the {kind}, v = u = 0 at the end"
    return record.changed(record.acceleration - powers @ coefficients, note)
