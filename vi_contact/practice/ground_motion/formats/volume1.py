"""Read uncorrected files in the layout of Volume I of Caltech: BHRC, RENADIC, USC and CSMIP.

A component has 13 lines of text, which give the number of points, the duration and "UNITS … ARE SEC
AND G/10", then 7 lines of integers, 7 lines of reals, and the samples: pairs of time and
acceleration in columns of 7, five pairs a line, or (BHRC) accelerations alone at equal steps in
columns of 13, ten a line. Lines may begin with one blank for the printer. A line "/&" ends a
component.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....core.algebra import Array
from ....core.errors import InputError
from ..record import Record
from .cosmos import begins_blocks
from .text import NUMBER, TextFile
from .times import interpolate, time_step

INTEGER_LINES = 7
REAL_LINES = 7
PAIR_WIDTH = 7  # of the columns of times and accelerations
PAIR_DECIMALS = 3
SINGLE_WIDTH = 13  # of those of accelerations alone
FIELDS = 10  # on a line

_FIRST = re.compile(
    r"^\s*+(?:\*\s*+VOL\d|FILE\s++\d++\s++OF\s++UNCORRECTED|UNCORRECTED\s++ACCELEROGRAM\s++DATA)",
    re.IGNORECASE,
)
_POINTS = re.compile(
    rf"\bNO\.?\s*+OF\s++POINTS\s*+=\s*+(\d++)\s++(?:DURATION|RECORD\s++LENGTH)\s*+=\s*+({NUMBER})",
    re.IGNORECASE,
)
_UNITS = re.compile(r"^\s*+UNITS\b.*\bARE\s++SEC(?:ONDS)?\s++AND\s++([A-Z/0-9]++)", re.IGNORECASE)
_COMPONENT = re.compile(r"^\s*+(?:COMP\s++(\S++)|CHAN\s++\d++:\s*+([^(]*+))", re.IGNORECASE)
_STATION = re.compile(r"\bSTATION\s++(?:NO\.\s*+(\d++(?![\d.]))|USC#\s*+(\d++))", re.IGNORECASE)
_ORIGIN = (("RENADIC", "RENADIC"), ("VOL1DS", "BHRC"), ("USC#", "USC"))
_INTEGERS = re.compile(r"[\s\d-]++")


@dataclass(frozen=True)
class _Part:
    """Describe one component.

    Attributes:
        header: indices of the lines of text.
        data: index of the line of the first sample.
        end: index of the line after the last sample.
        name: direction.
    """

    header: range
    data: int
    end: int
    name: str


def recognises(text: TextFile) -> bool:
    """Tell whether two of three signs of Volume I stand at the beginning.

    They are its first line, points and duration, and units in seconds and g/10. A line that
    announces a block of samples, as in later volumes, tells that it is none.
    """
    head = text.heads[:20]
    signs = [any(map(pattern.search, head)) for pattern in (_FIRST, _POINTS, _UNITS)]
    return sum(signs) >= 2 and not begins_blocks(text)


def read(text: TextFile) -> Record:
    """Return the record of one component.

    ``channel`` is 1 for the first of the file, or its name such as "N00W". Where times are uneven,
    as digitisers of films gave them, resample_dt is needed.
    """
    parts = _find_parts(text)
    part = parts[text.choose([part.name for part in parts])]
    line, count, seconds = _read_announcement(text, part)
    units_line, units = _find_units(text, part)
    rows = list(range(part.data, part.end))
    width = _find_width(text, rows)
    pairs = width == PAIR_WIDTH
    values, lines = _read_fields(text, rows, width)
    samples: Array = np.array(values[1::2] if pairs else values)
    text.refuse_other_count(line, count, samples.size)
    if pairs and len(values) % 2:
        raise InputError(
            f"{text.at(rows[-1])}: the last time has no acceleration; get the complete file"
        )

    # Without times the step is that of the points and the duration.
    notes: list[str] = []
    rounding = 1e-6
    sample_lines = lines[1::2] if pairs else lines
    step = seconds / count
    step_from = f"header, line {line + 1}: points and duration"
    if pairs:
        times = np.array(values[0::2])
        step, rounding, uneven = time_step(text, lines[0::2], times, decimals=PAIR_DECIMALS)
        step_from = "times in the file"
        longest_step = float(np.max(np.diff(times)))
        if abs(times[-1] - times[0] + step - seconds) > 1.5 * longest_step + 1e-3:
            raise InputError(
                f"{text.at(line)}: {seconds:g} s are announced but the times end at {times[-1]:g} "
                "s; get the complete file"
            )
        if uneven:
            samples = interpolate(times, samples, step)
            sample_lines = []
            notes.append(f"uneven times interpolated linearly to a step of {step:g} s")
        step = float(f"{step:.12g}")
        if text.dt is not None and not uneven and abs(text.dt - step) <= rounding * step:
            step = text.dt

    words = [" ".join(text.heads[index].split()) for index in part.header]
    origin = "CSMIP"
    for sign, name in reversed(_ORIGIN):  # the first one counts
        if any(sign in word.upper() for word in words):
            origin = name
    stations = [match for match in map(_STATION.search, words) if match]
    station = next(filter(None, stations[0].groups())) if stations else ""
    return text.record(
        samples,
        units=units,
        line=units_line,
        dt=step,
        lines=sample_lines or None,
        dt_rounding=rounding,
        title=next((word for word in words[1:3] if word), ""),
        format=f"{origin} volume 1",
        station=station,
        component=part.name,
        notes=(*filter(None, words), *notes),
        dt_from=step_from,
    )


def _find_units(text: TextFile, part: _Part) -> tuple[int, str]:
    """Return the line that states the units, and the units, or raise InputError without one."""
    for index in part.header:
        match = _UNITS.search(text.heads[index])
        if match:
            return index, match[1]
    raise InputError(
        f"{text.at(part.header[0])}: the header has no line 'UNITS ARE SEC AND'; get the "
        "complete file"
    )


def _find_parts(text: TextFile) -> list[_Part]:
    """Return the components of the file."""
    starts = []
    for k, line in enumerate(text.heads):
        if _FIRST.search(line) and any(map(_POINTS.search, text.heads[k : k + 20])):
            starts.append(k)
    starts = starts or [0]
    parts = []
    for start, after in zip(starts, [*starts[1:], len(text.lines)], strict=True):
        # The text ends where integers begin; the samples end at a line "/&" or blank lines.
        numbers = next((k for k in range(start + 1, after) if _has_integers(text.lines[k])), after)
        data = numbers + INTEGER_LINES + REAL_LINES
        behind_header = range(min(data, after), after)
        marks = [k for k in behind_header if text.lines[k].lstrip().startswith("/&")]
        end = marks[0] if marks else after
        while end > data and not text.lines[end - 1].strip():
            end -= 1
        if end <= data:
            raise InputError(
                f"{text.at(start)}: no samples follow the header; get the complete file"
            )
        header_lines = text.lines[numbers:data]
        blank = any(not line.strip() for line in header_lines)
        whole = all(_INTEGERS.fullmatch(line) for line in header_lines[:INTEGER_LINES])
        if blank or not whole or _INTEGERS.fullmatch(header_lines[INTEGER_LINES]):
            raise InputError(
                f"{text.at(numbers)}: {INTEGER_LINES} lines of integers and {REAL_LINES} lines of "
                "reals do not follow the text; lines were lost or added, get the complete file"
            )
        components = [match for match in map(_COMPONENT.search, text.heads[start:numbers]) if match]
        name = components[0][1] or components[0][2] or "" if components else ""
        parts.append(_Part(range(start, numbers), data, end, " ".join(name.split())))
    return parts


def _has_integers(line: str) -> bool:
    """Tell whether a line holds ten integers or more, and nothing else."""
    return bool(line.strip() and _INTEGERS.fullmatch(line) and len(line.split()) > 9)


def _read_announcement(text: TextFile, part: _Part) -> tuple[int, float, float]:
    """Return the line of the number of points, that number, and the duration [s]."""
    for index in part.header:
        match = _POINTS.search(text.heads[index])
        if not match:
            continue
        count = text.number(index, match[1])
        seconds = text.number(index, match[2])
        if count < 2.0 or seconds <= 0.0:
            raise InputError(
                f"{text.at(index)}: {count:g} points in {seconds:g} s are announced; get the "
                "file again"
            )
        return index, count, seconds
    raise InputError(
        f"{text.at(part.header[0])}: the header does not give NO. OF POINTS; get the complete file"
    )


def _find_width(text: TextFile, rows: Sequence[int]) -> int:
    """Return the width of the columns, as the first row tells it."""
    row = text.lines[rows[0]].rstrip()
    return SINGLE_WIDTH if "E" in row.upper() else PAIR_WIDTH


def _read_fields(text: TextFile, rows: Sequence[int], width: int) -> tuple[list[float], list[int]]:
    """Return all values by column, and the index of the line of each.

    Raises InputError where a row is not full, but for the last one.
    """
    values: list[float] = []
    lines: list[int] = []
    offset = len(text.lines[rows[0]].rstrip()) % width  # a blank for the printer
    for index in rows:
        begins_blank = not text.lines[index][:offset].strip()
        row = text.cut_fields(index, width, offset if begins_blank else 0)
        last = index == rows[-1]
        if len(row) != FIELDS and not (last and 0 < len(row) < FIELDS):
            raise InputError(
                f"{text.at(index)}: the row has {len(row)} values instead of {FIELDS}; a value is "
                "missing or too many, get the complete file"
            )
        values += row
        lines += [index] * len(row)
    return values, lines
