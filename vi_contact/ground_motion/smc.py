"""USGS SMC files (National Strong-Motion Program), type 2 CORRECTED ACCELEROGRAM, accelerations in cm/s².

Layout: 11 lines of text; 6 lines of 8 integers in columns of 10; 10 lines of 5 reals in columns of 15; comment lines
starting with "|"; the samples, 8 a line in columns of 10 that touch, so they are cut by column and not by blanks. The
first integer and the first real are the marks of an undefined value (-32768 and 1.7E38).
"""

from __future__ import annotations

import re

import numpy as np

from ..algebra import Array
from ..errors import InputError
from .record import UNITS, Record, file_dt, file_units
from .text import TextFile, to_float

TEXT_LINES, INTEGER_LINES, REAL_LINES = 11, 6, 10
INTEGER_WIDTH, REAL_WIDTH, SAMPLE_WIDTH = 10, 15, 10
VERTICAL, AZIMUTH, COMMENTS, SAMPLES, PROBLEM = 12, 13, 15, 16, 17  # places among the 48 integers, from 0
SAMPLING_RATE = 1  # place among the 50 reals
UNDEFINED = 1e38  # any real at least this large is the mark of an undefined value

_KIND = re.compile(r"^\s*\d\s+(?:(?:UN)?CORRECTED ACCELEROGRAM|UNKNOWN|VELOCITY|DISPLACEMENT|RESPONSE|FOURIER)",
                   re.IGNORECASE)


def recognises(text: TextFile) -> bool:
    """Whether the first line is the type line of an SMC file, of any type."""
    return _KIND.match(text.lines[0]) is not None


def read(text: TextFile, units: str | None = None, dt: float | None = None) -> Record:
    """The record of an SMC file; dt is needed only where the file leaves its sampling rate undefined.

    Raises InputError naming the file, mostly with a line: a type other than corrected acceleration, a short file,
    a number of samples unlike the header's, an undefined sample, text where a number should be.
    """
    _refuse_other_kinds(text)
    integers = _fields(text, TEXT_LINES, INTEGER_LINES, INTEGER_WIDTH, 8)
    reals = _fields(text, TEXT_LINES + INTEGER_LINES, REAL_LINES, REAL_WIDTH, 5)
    comments_start = TEXT_LINES + INTEGER_LINES + REAL_LINES
    start = comments_start + int(integers[COMMENTS])
    comments = text.lines[comments_start:start]
    if not 0 <= integers[COMMENTS] < len(text.lines) or any(not line.startswith("|") for line in comments):
        raise InputError(f"{text.at(TEXT_LINES + 1)}: the header announces {int(integers[COMMENTS])} comment lines but "
                         "as many lines starting with '|' do not follow; get the file again")
    name = file_units(text.path, "cm/s2", units)
    rate = reals[SAMPLING_RATE]
    stated = 1.0 / rate if 0.0 < rate < UNDEFINED else None
    notes = _orientation(integers) + tuple(line[1:].strip() for line in comments if line[1:].strip())
    return Record(acceleration=UNITS[name] * _samples(text, start, int(integers[SAMPLES])),
                  dt=file_dt(text.path, stated, dt), title=_title(text), source=text.path, format="USGS SMC",
                  units=name, sha256=text.sha256, notes=notes)


def _refuse_other_kinds(text: TextFile) -> None:
    kind = text.lines[0].strip()
    if kind.upper().startswith("1"):
        raise InputError(f"{text.at(0)}: {kind!r} holds unequally spaced (time, acceleration) pairs before instrument "
                         "correction; get the file of type '2 CORRECTED ACCELEROGRAM'")
    if not kind.upper().startswith("2"):
        raise InputError(f"{text.at(0)}: {kind!r} is not an acceleration; get the file of type "
                         "'2 CORRECTED ACCELEROGRAM'")


def _fields(text: TextFile, start: int, lines: int, width: int, per_line: int) -> list[float]:
    """`lines` lines from `start` cut into `per_line` columns of `width` characters."""
    values: list[float] = []
    for index in range(start, start + lines):
        row = _cut(text, index, width) if index < len(text.lines) else []
        if len(row) != per_line:
            raise InputError(f"{text.at(index)}: {len(row)} header values instead of {per_line}; get the file again")
        values += row
    return values


def _cut(text: TextFile, index: int, width: int) -> list[float]:
    """The numbers in columns of `width` characters on one line, trailing blanks ignored."""
    line = text.lines[index].rstrip()
    values = []
    for left in range(0, len(line), width):
        word = line[left:left + width].strip()
        try:
            values.append(to_float(word))
        except ValueError:
            raise InputError(f"{text.at(index)}: {word!r} in columns {left + 1} to {left + width} is not a number; "
                             "correct it or get the file again") from None
    return values


def _samples(text: TextFile, start: int, count: int) -> Array:
    """The samples in cm/s², shape (count,)."""
    values: list[float] = []
    for index in range(start, len(text.lines)):
        row = _cut(text, index, SAMPLE_WIDTH)
        if any(abs(value) >= UNDEFINED for value in row):
            raise InputError(f"{text.at(index)}: a sample is marked as undefined; fill the gap or use another record")
        values += row
    if len(values) != count:
        raise InputError(f"{text.at(TEXT_LINES + 2)}: the header announces {count} samples but {len(values)} follow; "
                         "get the complete file")
    return np.array(values)


def _title(text: TextFile) -> str:
    """Event (text line 4) and station (text line 6), blanks squeezed."""
    return "; ".join(" ".join(text.lines[index].split()) for index in (3, 5) if text.lines[index].strip(" *"))


def _orientation(integers: list[float]) -> tuple[str, ...]:
    """The component's direction and the problem flag, in words."""
    undefined = integers[0]
    notes = []
    if integers[VERTICAL] in (0.0, 180.0):
        notes.append(f"component: vertical, {'up' if integers[VERTICAL] == 0.0 else 'down'}")
    elif integers[AZIMUTH] != undefined:
        notes.append(f"component: azimuth {integers[AZIMUTH]:g} degrees clockwise from north")
    if integers[PROBLEM] == 1.0:
        notes.append("the file carries the agency's problem flag: read its comments")
    return tuple(notes)
