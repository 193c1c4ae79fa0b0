"""Cutting a record and lengthening it with zeros. Every function returns a new Record and notes what it did."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..core.checks import counted
from ..core.errors import InputError
from .record import Record


def trimmed(record: Record, start: float = 0.0, end: float | None = None) -> Record:
    """The samples at start <= t <= end [s]; the first one kept becomes t = 0. end: the record's last sample.

    Raises InputError unless 0 <= start < end <= duration and two samples are left.
    """
    last = record.duration if end is None else end
    slack = 1e-9 * record.dt
    if not -slack <= start < last <= record.duration + slack:
        raise InputError(f"trimmed: start={start!r} and end={end!r} s; give 0 <= start < end <= {record.duration:g} s")
    inside = (record.times >= start - slack) & (record.times <= last + slack)
    if np.count_nonzero(inside) < 2:
        raise InputError(f"trimmed: fewer than two samples lie from {start:g} to {last:g} s; give a longer piece")
    first = float(record.times[inside][0])
    return replace(record, acceleration=record.acceleration[inside],
                   notes=(*record.notes, f"trimmed to {first:g} ... {float(record.times[inside][-1]):g} s"))


def padded(record: Record, before: float = 0.0, after: float = 0.0) -> Record:
    """Zeros for `before` seconds ahead of the record and `after` seconds behind it, rounded up to whole steps.

    Raises InputError unless both are zero or positive.
    """
    if not all(0.0 <= length < math.inf for length in (before, after)):
        raise InputError(f"padded: before={before!r} and after={after!r} s; give zero or positive lengths")
    asked = [length / record.dt * (1.0 - 1e-9) for length in (before, after)]
    counted("padded", f"before={before!r} and after={after!r} s", record.acceleration.size + sum(asked))
    counts = [math.ceil(samples) for samples in asked]
    note = f"zeros added: {counts[0] * record.dt:g} s before, {counts[1] * record.dt:g} s after"
    return replace(record, acceleration=np.pad(record.acceleration, counts), notes=(*record.notes, note))
