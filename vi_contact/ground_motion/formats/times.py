"""Find the time step of a column of times.

They are printed with few decimals or were held in single precision.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...core.algebra import Array
from ...core.checks import counted, number
from ...core.errors import InputError
from .text import SAME_STEP, TextFile

COARSE = (
    0.2  # part of a step that rounding may take: above it a row that was lost could hide behind it
)


def rises_evenly(times: Array, *, decimals: int | None = None) -> bool:
    """Tell whether numbers, three or more, count up by one step.

    The rounding of their digits is left out of account.
    """
    if times.size < 3 or not np.all(np.diff(times) > 0.0):
        return False
    steps = np.diff(times)
    usual = float(np.median(steps))
    return bool(np.all(np.abs(steps - usual) <= SAME_STEP * usual)) or _is_rounded(
        times, _rounding(times, decimals)
    )


def time_step(
    text: TextFile,
    lines: Sequence[int],
    times: Array,
    *,
    decimals: int | None = None,
    unit: float = 1.0,
) -> tuple[float, float, bool]:
    """Return the step of times, its relative error, and whether they are uneven.

    The error is the one that the rounding of the times leaves.

    times and the step are in s. lines: index of the line of each. decimals: of the times as they
    are printed in their unit [s]. Uneven times are allowed only where the caller wants to
    interpolate; the step is then the one to interpolate to: resample_dt, or the nearest whole part
    of it that is not longer than the usual step, so that reading does not alias. Raises InputError
    for times that do not rise, and for uneven ones nobody asked for.
    """
    steps = np.diff(times)
    usual = float(np.median(steps))
    backward = steps <= 0.0
    if np.any(backward):
        k = int(np.argmax(backward)) + 1
        raise InputError(
            f"{text.at(lines[k])}: time {times[k]:g} s does not come after {times[k - 1]:g} s; "
            "sort the rows and remove repeated times"
        )
    odd = np.abs(steps - usual) > SAME_STEP * usual
    if not np.any(odd):
        return (times[-1] - times[0]) / (times.size - 1), SAME_STEP, False
    rounding = _rounding(times / unit, decimals) * unit
    if _is_rounded(times, rounding):
        step, error = _roundest_step(times, rounding)
        return step, error, False
    if text.resample_dt is None:
        k = int(np.argmax(odd)) + 1
        raise InputError(
            f"{text.at(lines[k])}: the step to time {times[k]:.9g} s is {steps[k - 1]:.9g} s, "
            f"others {usual:.9g} s; pass resample_dt= to interpolate, or correct the time"
        )
    wanted = number("read_record", "resample_dt", text.resample_dt, positive=True, unit="seconds")
    step = wanted / math.ceil(wanted / usual * (1.0 - SAME_STEP))
    counted("read_record", f"resample_dt = {wanted!r} s", (times[-1] - times[0]) / step)
    return step, SAME_STEP, True


def interpolate(times: Array, samples: Array, step: float) -> Array:
    """Return the samples on even times from the first one on.

    They are read off straight lines; the last one is kept.
    """
    last = (times[-1] - times[0]) / step
    rounding = 2.0 * float(_rounding(times, None)) / step
    count = int(last * (1.0 + 1e-12) + min(rounding, COARSE) + 1.0)
    found: Array = np.interp(times[0] + step * np.arange(count), times, samples)
    return found


def _rounding(times: Array, decimals: int | None) -> float:
    """Return the largest error of times that are printed to `decimals`.

    It is also that of times that were held in single precision.
    """
    # held in single precision, and computed in it: a start and a multiple of the step, each rounded
    # once
    single = float(np.spacing(np.float32(np.max(np.abs(times)))))
    return max(single, 0.0 if decimals is None else 0.5 * 10.0**-decimals)


def _is_rounded(times: Array, rounding: float) -> bool:
    """Tell whether times are even but for their rounding.

    The rounding is too small to hide a row that was lost.

    A lost row moves the times at least a quarter of a step from any straight line.
    """
    if times.size < 3:
        return False
    line = np.polynomial.Polynomial.fit(np.arange(times.size), times, 1)
    away = float(np.max(np.abs(times - line(np.arange(times.size)))))
    step = (times[-1] - times[0]) / (times.size - 1)
    return 2.0 * rounding <= COARSE * step and away <= 2.0 * rounding


def _roundest_step(times: Array, rounding: float) -> tuple[float, float]:
    """Return the step with the fewest digits, or the whole sampling rate, and its error.

    It is one that the rounded times allow.
    """
    mean = float(times[-1] - times[0]) / (times.size - 1)
    error = 2.0 * rounding / (times.size - 1)
    rate = round(1.0 / mean)
    tried = [float(f"{mean:.{digits}e}") for digits in (0, 1)]
    tried += [1.0 / rate] if rate > 0 else []
    tried += [float(f"{mean:.{digits}e}") for digits in range(2, 16)]
    step = next((one for one in tried if abs(one - mean) <= error), mean)
    return step, max(SAME_STEP, 2.0 * error / mean)
