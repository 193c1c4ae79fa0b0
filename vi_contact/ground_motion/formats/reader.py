"""Read a record file of any known format; the format is recognised by content, never by the file's name."""

import math
import os

import numpy as np

from ...core.arguments import checked
from ...core.checks import number
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from ..processing import resampled
from ..record import LARGEST_PEAK, Record
from . import afad, at2, columns, cosmos, esm, knet, smc
from .text import load_text

SEVERAL = (cosmos, afad)  # formats whose files may hold several components
STEPS = 1e-6, 100.0  # shortest and longest time step [s] of a file; that of seismographs is 0.001 to 0.05


@checked
def read_record(path: str | os.PathLike[str], units: str | None = None, *, dt: float | None = None,
                resample_dt: float | None = None, channel: int | None = None, largest: float = LARGEST_PEAK) -> Record:
    """Read one component of ground motion from a file of any format listed in docs/guide/records.md.

    units: a key of UNITS ("m/s2", "cm/s2", "gal", "g", ...); required for columns, elsewhere only
    checked against what the file states. dt: time step [s], for files that do not state one. resample_dt: time step [s]
    the record is brought to by `resampled`; it also allows uneven times in a column file. channel: which one, from 1,
    of a file that holds several (SEVERAL). largest: the greatest peak acceleration [m/s²] that is believed; give more
    where the motion is that strong.
    Raises InputError with one sentence that names the file and, where there is one, the line: for a velocity or
    displacement, no or another number of samples than announced, entries of the header or samples that are missing,
    unknown or no numbers, units or a step that nobody states or that contradict each other."""
    text = load_text(path, units=units, dt=dt, resample_dt=resample_dt, channel=channel)
    reader = next((one for one in (*SEVERAL, smc, knet, esm, at2) if one.recognises(text)), columns)
    if channel is not None and reader not in SEVERAL:
        raise InputError(f"{text.path}: channel={channel} was passed but the file holds one record; leave channel out")
    number("read_record", "largest", largest, positive=True, unit="m/s²")
    record = reader.read(text)
    peak = float(np.max(np.abs(record.acceleration)))
    if peak > largest:
        raise InputError(f"{record.source}: the peak acceleration is {peak / STANDARD_GRAVITY:.4g} g = {peak:.4g} m/s2 "
                         f"if the unit is {record.units}; give the right units=, or largest= in m/s2 where the motion "
                         "is that strong")
    if not STEPS[0] <= record.dt <= STEPS[1]:
        raise InputError(f"{record.source}: a time step of {record.dt:g} s is not usual for ground motions; give "
                         f"seconds from {STEPS[0]:g} to {STEPS[1]:g}, or make a Record of the samples")
    if resample_dt is not None and not math.isclose(record.dt, resample_dt, rel_tol=1e-9):
        record = resampled(record, resample_dt)
    return record
