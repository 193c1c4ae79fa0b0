"""Find the time step of times that are printed with few decimals, or held in single precision."""

import math
from collections.abc import Sequence

import numpy as np

from ....core.algebra import Array
from ....core.checks import check_count, number
from ....core.errors import InputError
from .text import SAME_STEP, TextFile

# Part of a step that rounding may take: above it a row that was lost could hide behind it.
COARSE = 0.2


def rises_evenly(times: Array, *, decimals: int | None = None) -> bool:
    """Tell whether numbers, three or more, count up by one step, but for their rounding."""
    if times.size < 3 or not np.all(np.diff(times) > 0.0):
        return False
    steps = np.diff(times)
    usual = float(np.median(steps))
    if np.all(np.abs(steps - usual) <= SAME_STEP * usual):
        return True
    return _is_rounded(times, _largest_rounding(times, decimals))


def time_step(
    text: TextFile,
    lines: Sequence[int],
    times: Array,
    *,
    decimals: int | None = None,
    unit: float = 1.0,
) -> tuple[float, float, bool]:
    """Return the step of times, its relative error, and whether they are uneven.

    The error is the one that the rounding of the times leaves. Uneven times are allowed only where
    the caller wants to interpolate; the step is then the one to interpolate to: resample_dt, or the
    nearest whole part of it that is not longer than the usual step, so that reading does not alias.

    Args:
        text: the file.
        lines: index of the line of each time.
        times: (n,) [s].
        decimals: of the times as they are printed; None where they have exponents.
        unit: in which they are printed [s].

    Raises:
        InputError: times that do not rise; uneven times that nobody wants to interpolate.
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
    rounding = _largest_rounding(times / unit, decimals) * unit
    if _is_rounded(times, rounding):
        step, error = _find_roundest_step(times, rounding)
        return step, error, False
    if text.resample_dt is None:
        k = int(np.argmax(odd)) + 1
        raise InputError(
            f"{text.at(lines[k])}: the step to time {times[k]:.9g} s is {steps[k - 1]:.9g} s, "
            f"others {usual:.9g} s; pass resample_dt= to interpolate, or correct the time"
        )
    dt = number("read_record", "resample_dt", text.resample_dt, positive=True, unit="seconds")
    step = dt / math.ceil(dt / usual * (1.0 - SAME_STEP))
    check_count("read_record", f"resample_dt = {dt!r} s", (times[-1] - times[0]) / step)
    return step, SAME_STEP, True


def interpolate(times: Array, samples: Array, step: float) -> Array:
    """Return the samples on even times, read off straight lines.

    Args:
        times: (n,), that rise [s].
        samples: (n,), at these times.
        step: of the even times, from the first one on [s]. The last time is kept.
    """
    last = (times[-1] - times[0]) / step
    rounding = 2.0 * float(_largest_rounding(times, None)) / step
    count = int(last * (1.0 + 1e-12) + min(rounding, COARSE) + 1.0)
    even_times = times[0] + step * np.arange(count)
    return np.asarray(np.interp(even_times, times, samples))


def _largest_rounding(times: Array, decimals: int | None) -> float:
    """Return the largest error of times that are printed to `decimals` or had single precision."""
    # In single precision they were computed too: a start and a multiple of the step, each rounded
    # once.
    single = float(np.spacing(np.float32(np.max(np.abs(times)))))
    printed = 0.0 if decimals is None else 0.5 * 10.0**-decimals
    return max(single, printed)


def _is_rounded(times: Array, rounding: float) -> bool:
    """Tell whether times are even but for a rounding that is too small to hide a lost row.

    A lost row moves the times at least a quarter of a step from any straight line.
    """
    if times.size < 3:
        return False
    number = np.arange(times.size)
    line = np.polynomial.Polynomial.fit(number, times, 1)
    away = float(np.max(np.abs(times - line(number))))
    step = (times[-1] - times[0]) / (times.size - 1)
    return 2.0 * rounding <= COARSE * step and away <= 2.0 * rounding


def _find_roundest_step(times: Array, rounding: float) -> tuple[float, float]:
    """Return the roundest step that the rounded times allow, and its relative error.

    It is the one with the fewest digits, or the whole sampling rate.
    """
    mean = float(times[-1] - times[0]) / (times.size - 1)
    error = 2.0 * rounding / (times.size - 1)
    rate = round(1.0 / mean)
    candidates = [float(f"{mean:.{digits}e}") for digits in (0, 1)]
    if rate > 0:
        candidates.append(1.0 / rate)
    candidates += [float(f"{mean:.{digits}e}") for digits in range(2, 16)]
    step = next((candidate for candidate in candidates if abs(candidate - mean) <= error), mean)
    return step, max(SAME_STEP, 2.0 * error / mean)
