"""Read plain columns: time [s] and acceleration, or acceleration alone with the time step given by the caller.

The latter are the path series of OpenSees (.th, .g3, .acc): no header, values in one column or row by row.

Lines starting with "#" and empty lines are skipped; columns are separated by blanks, commas or semicolons. A header
that ends in `*** Begin data ***` is skipped too. The units are never guessed."""

import math

import numpy as np

from ...core.algebra import Array
from ...core.checks import counted, number, shown
from ...core.errors import InputError
from ..record import Record
from .at2 import begin_data
from .text import SAME_STEP, TextFile


def read(text: TextFile) -> Record:
    """Return the record of a column file; `units` is required, `dt` too when there is no time column.

    Uneven times are refused unless resample_dt [s] is given: then straight lines between the samples are read off at
    resample_dt, or at the nearest whole part of it that is not longer than the usual step, so that reading does not
    alias. The first time of the file becomes t = 0. With dt, rows of three or more values are read one after the other.
    """
    lines, table = _table(text, series=text.dt is not None)
    comments = tuple(line.lstrip("# ").rstrip() for line in text.heads if line.startswith("#"))
    notes, step, samples = comments, None, table[:, -1]
    if table.shape[1] == 2:
        times = table[:, 0]
        step, uneven = _even_step(text, lines, times)
        if uneven:
            count = int((times[-1] - times[0]) / step * (1.0 + 1e-12) + 1.0)
            samples = np.interp(times[0] + step * np.arange(count), times, samples)
            notes += (f"uneven times interpolated linearly to a step of {step:g} s",)
        if times[0] != 0.0:
            notes += (f"the first time in the file is {times[0]:g} s and is t = 0 here",)
    return text.record(samples, units=None, dt=step, title=comments[0] if comments else "", format="columns",
                       notes=notes)


def _table(text: TextFile, *, series: bool) -> tuple[list[int], Array]:
    """Return the line index of every row and the rows, shape (n, 1) or (n, 2), n >= 2; series:
    rows of more than two values, the last perhaps shorter, are one column written in rows."""
    lines = [index for index in text.filled(begin_data(text) or 0) if not text.lines[index].lstrip().startswith("#")]
    heading = text.lines[lines[0]].strip() if lines else ""
    start = heading.lstrip("\"'")[:3].lower()
    if start[:1].isalpha() and start not in ("nan", "inf"):
        raise InputError(f"{text.at(lines[0])}: {shown(heading)} is no row of numbers; begin a heading with #, or get "
                         "another file")
    rows = list(text.rows(lines))
    if series and rows and len(rows[0]) > 2:
        return lines, np.array([value for row in rows for value in row])[:, None]
    for index, row in zip(lines, rows, strict=True):
        if len(row) not in (1, 2) or len(row) != len(rows[0]):
            raise InputError(f"{text.at(index)}: {len(row)} columns instead of {min(len(rows[0]), 2)}; give time and "
                             "acceleration, or acceleration alone, or dt= if rows of accelerations follow each other")
    if len(rows) < 2:
        raise InputError(f"{text.path}: the file has {len(rows)} samples; give two or more")
    return lines, np.array(rows)


def _even_step(text: TextFile, lines: list[int], times: Array) -> tuple[float, bool]:
    """Return the time step, and whether samples must be interpolated to it; InputError where nobody asked for that."""
    steps = np.diff(times)
    usual = float(np.median(steps))
    backward = steps <= 0.0
    if np.any(backward):
        k = int(np.argmax(backward)) + 1
        raise InputError(f"{text.at(lines[k])}: time {times[k]:g} s does not come after {times[k - 1]:g} s; "
                         "sort the rows and remove repeated times")
    odd = np.abs(steps - usual) > SAME_STEP * usual
    if not np.any(odd):
        return (times[-1] - times[0]) / (times.size - 1), False
    if text.resample_dt is None:
        k = int(np.argmax(odd)) + 1
        raise InputError(f"{text.at(lines[k])}: the step to time {times[k]:.9g} s is {steps[k - 1]:.9g} s, others "
                         f"{usual:.9g} s; pass resample_dt= to interpolate, or correct the time")
    wanted = number("read_record", "resample_dt", text.resample_dt, positive=True, unit="seconds")
    step = wanted / math.ceil(wanted / usual * (1.0 - SAME_STEP))
    counted("read_record", f"resample_dt = {wanted!r} s", (times[-1] - times[0]) / step)
    return step, True
