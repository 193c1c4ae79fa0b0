"""Read a record file of any known format; the format is recognised by content, never by the file's name."""

from __future__ import annotations

import math
import os

from . import at2, columns, smc
from .processing import resampled
from .record import Record
from .text import TextFile, load_text


def read_record(path: str | os.PathLike[str], units: str | None = None, *, dt: float | None = None,
                resample_dt: float | None = None) -> Record:
    """One component of ground motion from a PEER AT2, a USGS SMC or a column file.

    units: "m/s2", "cm/s2", "gal", "g", "mm/s2", "in/s2" or "ft/s2"; required for column files, elsewhere only checked
    against what the file states. dt: time step [s], for files that do not state one. resample_dt: time step [s] the
    record is brought to by `resampled`; it also allows uneven times in a column file.
    Raises InputError with one sentence that names the file and, where there is one, the line.
    """
    text = load_text(path)
    record = _read(text, units, dt, resample_dt)
    if resample_dt is not None and not math.isclose(record.dt, resample_dt, rel_tol=1e-9):
        record = resampled(record, resample_dt)
    return record


def _read(text: TextFile, units: str | None, dt: float | None, resample_dt: float | None) -> Record:
    if smc.recognises(text):
        return smc.read(text, units, dt)
    if at2.recognises(text) and not columns.follow_begin_data(text):
        return at2.read(text, units, dt)
    return columns.read(text, units, dt, resample_dt)
