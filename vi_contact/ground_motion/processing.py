"""Scaling, resampling and integration of records. Every function returns a new value and notes what it did.

Convention: between samples the acceleration is a straight line.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np

from ..core.algebra import Array
from ..core.checks import counted, number
from ..core.errors import InputError
from .record import Record

LARGEST_RATIO = 1000
"""Numerator and denominator of old dt / new dt may not exceed this; the filter grows with them."""


def scaled(record: Record, *, factor: float) -> Record:
    """Every sample times `factor`; a negative one turns the motion round. Raises InputError unless it is finite."""
    if not math.isfinite(factor):
        raise InputError(f"scaled: factor is {factor!r}; give a finite number")
    return replace(record, acceleration=factor * record.acceleration, notes=record.notes + (f"scaled by {factor:.6g}",))


def scaled_to_pga(record: Record, pga: float) -> Record:
    """Scaled so that the largest |acceleration| is `pga` [m/s²]; the sign of the motion is kept.

    Raises InputError unless pga > 0 and the record is not all zero.
    """
    if not math.isfinite(pga) or pga <= 0:
        raise InputError(f"scaled_to_pga: pga is {pga!r}; give a positive peak acceleration in m/s²")
    peak = float(np.max(np.abs(record.acceleration)))
    if peak == 0.0:
        raise InputError(f"{record.source or 'Record'}: every sample is zero, so no factor reaches a peak of {pga!r} "
                         "m/s²; use another record")
    return scaled(record, factor=pga / peak)


def resampled(record: Record, dt: float) -> Record:
    """The record at time step dt [s]: band-limited interpolation up, anti-aliased decimation down.

    scipy.signal.resample_poly: a zero-phase windowed-sinc filter (Kaiser, beta 5) whose amplitude is halved at the
    lower of the two Nyquist frequencies 1 / (2 dt). The record is taken as zero outside its samples, so a record
    that does not start and end near zero is bent towards zero over ten steps, of the longer kind, at each end. dt must
    be the record's step times a ratio of whole numbers up to 1000; `GroundMotion` interpolates for any other step.
    Sample 0 stays at t = 0; the new record ends at the last multiple of dt inside the old one.
    Raises InputError when dt is not positive, not such a ratio, or longer than the record.
    """
    dt = number("resampled", "dt", dt, positive=True, unit="seconds")
    counted("resampled", f"dt={dt!r} s", record.duration / dt)
    from scipy.signal import resample_poly  # late: it takes longer to import than the rest of the package

    ratio = Fraction(record.dt / dt).limit_denominator(LARGEST_RATIO)
    exact = math.isclose(ratio.numerator * dt, ratio.denominator * record.dt, rel_tol=1e-9)
    if ratio.numerator > LARGEST_RATIO or not exact:
        whole = min(round(max(record.dt / dt, dt / record.dt)), LARGEST_RATIO)
        near = record.dt / whole if dt < record.dt else record.dt * whole
        raise InputError(f"resampled: {dt!r} s and the record's step {record.dt!r} s are in no ratio of whole numbers "
                         f"up to {LARGEST_RATIO}; choose a step such as {near!r} s")
    count = (record.acceleration.size - 1) * ratio.numerator // ratio.denominator + 1
    if count < 2:
        raise InputError(f"resampled: a step of {dt!r} s leaves one sample of a record of {record.duration!r} s; "
                         "choose a shorter step")
    samples = resample_poly(record.acceleration, ratio.numerator, ratio.denominator)[:count]
    return replace(record, acceleration=samples, dt=float(dt),
                   notes=record.notes + (f"resampled from {record.dt:g} s to {dt:g} s",))


def integrated(record: Record) -> tuple[Array, Array]:
    """Ground velocity [m/s] and displacement [m] at the samples, both shape (n,) and zero at t = 0.

    Exact for an acceleration that is a straight line between samples: the trapezoidal rule for the velocity,
    v_{k+1} = v_k + dt (a_k + a_{k+1}) / 2, and u_{k+1} = u_k + dt v_k + dt² (2 a_k + a_{k+1}) / 6.
    Nothing is filtered and no baseline is corrected: what is left at the end is the drift of the record.
    """
    a, dt = record.acceleration, record.dt
    velocity = np.concatenate(([0.0], np.cumsum(0.5 * dt * (a[:-1] + a[1:]))))
    displacement = np.concatenate(([0.0], np.cumsum(dt * velocity[:-1] + dt**2 / 6.0 * (2.0 * a[:-1] + a[1:]))))
    return velocity, displacement
