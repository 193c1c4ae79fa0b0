"""Read a record file of any known format, which is recognised by content, never by its name."""

import math
import os
from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from ....core.arguments import check_arguments
from ....core.checks import quote
from ....core.errors import InputError
from ....core.quantities import Positive, Unit
from ....core.units import STANDARD_GRAVITY
from ..processing import resampled
from ..record import LARGEST_PEAK, Record
from . import afad, at2, columns, cosmos, cwa, esm, geonet, knet, smc, unam, volume1
from .text import load_text
from .unread import refuse_unread

# formats whose files may hold several components
SEVERAL = (geonet, volume1, cosmos, afad, unam, cwa)
# A peak outside of these is rare in a record that is used.
LOW_PEAK = 1e-3 * STANDARD_GRAVITY
HIGH_PEAK = 3.0 * STANDARD_GRAVITY
# Time steps of a file [s]; those of seismographs are 0.001 to 0.05.
SHORTEST_STEP = 1e-6
LONGEST_STEP = 100.0


@check_arguments
def read_record(
    path: str | os.PathLike[str],
    units: str | None = None,
    *,
    dt: Annotated[float | None, Unit("s")] = None,
    resample_dt: Annotated[float | None, Unit("s")] = None,
    channel: int | str | None = None,
    largest: Annotated[float, Positive, Unit("m/s²")] = LARGEST_PEAK,
) -> Record:
    """Read one component of ground motion from a file of any known format.

    The formats are listed in docs/guide/records.md.

    Args:
        path: of the file.
        units: a key of UNITS ("m/s2", "cm/s2", "gal", "g", ...). They are required where the file
            does not state them, and elsewhere only checked against what the file states.
        dt: time step [s], for files that do not state one.
        resample_dt: time step that the record is brought to by `resampled` [s]; it also allows
            uneven times.
        channel: which component of a file that holds several: its number, from 1, times not
            counted, or its name in the file ("N00E", "north").
        largest: the greatest peak acceleration that is believed [m/s²]; give more where the motion
            is that strong.

    Raises:
        InputError: a velocity or displacement; no or another number of samples than announced;
            entries of the header or samples that are missing, unknown or no numbers; units or a
            step that nobody states or that contradict each other. The sentence names the file and,
            where there is one, the line.
    """
    text = load_text(path, units=units, dt=dt, resample_dt=resample_dt, channel=channel)
    refuse_unread(text)
    reader: Any = columns
    for known in (*SEVERAL, smc, knet, esm, at2):
        if known.recognises(text):
            reader = known
            break
    if channel is not None and reader not in (*SEVERAL, columns):
        raise InputError(
            f"{text.path}: channel={quote(channel)} was passed but the file holds one record; "
            "leave channel out"
        )
    record = reader.read(text)
    peak = float(np.max(np.abs(record.acceleration)))
    if peak > largest:
        raise InputError(
            f"{record.source}: the peak acceleration is {peak / STANDARD_GRAVITY:.4g} g = "
            f"{peak:.4g} m/s2 if the unit is {record.units}; give the right units=, or largest= in "
            "m/s2 where the motion is that strong"
        )
    if 0.0 < peak < LOW_PEAK or peak > HIGH_PEAK:
        doubt = (
            f"the peak is {peak / STANDARD_GRAVITY:.4g} g if the unit is {record.units}; check the "
            f"unit, which comes from: {record.units_from}"
        )
        record = replace(record, doubts=(*record.doubts, doubt))
    if not SHORTEST_STEP <= record.dt <= LONGEST_STEP:
        raise InputError(
            f"{record.source}: a time step of {record.dt:g} s is not usual for ground motions; "
            f"give seconds from {SHORTEST_STEP:g} to {LONGEST_STEP:g}, or make a Record of the "
            "samples"
        )
    if resample_dt is not None and not math.isclose(record.dt, resample_dt, rel_tol=1e-9):
        record = resampled(record, resample_dt)
    return record
