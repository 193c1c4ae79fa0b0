"""Read uncorrected files in the layout of Volume I of Caltech.

They are those of BHRC (Iran), RENADIC (Chile), USC and CSMIP.

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

INTEGER_LINES, REAL_LINES = 7, 7
PAIR_WIDTH, PAIR_DECIMALS, SINGLE_WIDTH = 7, 3, 13
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

    It has the lines of text, the line of the first sample, and the line after the last one.
    """

    header: range
    data: int
    end: int
    name: str


def recognises(text: TextFile) -> bool:
    """Tell whether two of three signs of Volume I stand at the beginning.

    They are its first line, points and duration, and units in seconds and g/10; and there is no
    line that announces a block of samples as in later volumes.
    """
    head = text.heads[:20]
    signs = [any(map(pattern.search, head)) for pattern in (_FIRST, _POINTS, _UNITS)]
    return sum(signs) >= 2 and not begins_blocks(text)


def read(text: TextFile) -> Record:
    """Return the record of one component.

    ``channel`` is 1 for the first of the file, or its name such as "N00W".

    Where times are uneven, as digitisers of films gave them, resample_dt is needed.
    """
    parts = _parts(text)
    part = parts[text.choose([part.name for part in parts])]
    line, count, seconds = _announced(text, part)
    units_line, units = next(
        ((k, match[1]) for k in part.header if (match := _UNITS.search(text.heads[k]))), (0, "")
    )
    if not units:
        raise InputError(
            f"{text.at(part.header[0])}: the header has no line 'UNITS ARE SEC AND'; get the "
            "complete file"
        )
    rows = list(range(part.data, part.end))
    pairs = _width(text, rows) == PAIR_WIDTH
    values, lines = _fields(text, rows, PAIR_WIDTH if pairs else SINGLE_WIDTH)
    samples: Array = np.array(values[1::2] if pairs else values)
    text.refuse_other_count(line, count, samples.size)
    if pairs and len(values) % 2:
        raise InputError(
            f"{text.at(rows[-1])}: the last time has no acceleration; get the complete file"
        )
    notes: list[str] = []
    rounding, sample_lines = 1e-6, lines[1::2] if pairs else lines
    step = seconds / count
    at = f"header, line {line + 1}: points and duration"
    if pairs:
        times = np.array(values[0::2])
        step, rounding, uneven = time_step(text, lines[0::2], times, decimals=PAIR_DECIMALS)
        at = "times in the file"
        if abs(times[-1] - times[0] + step - seconds) > 1.5 * float(np.max(np.diff(times))) + 1e-3:
            raise InputError(
                f"{text.at(line)}: {seconds:g} s are announced but the times end at {times[-1]:g} "
                "s; get the complete file"
            )
        if uneven:
            samples, sample_lines = interpolate(times, samples, step), []
            notes.append(f"uneven times interpolated linearly to a step of {step:g} s")
        step = float(f"{step:.12g}")
        if text.dt is not None and not uneven and abs(text.dt - step) <= rounding * step:
            step = text.dt
    words = [" ".join(text.heads[index].split()) for index in part.header]
    origin = next(
        (name for sign, name in _ORIGIN if any(sign in word.upper() for word in words)), "CSMIP"
    )
    station = next(
        (next(filter(None, match.groups())) for word in words if (match := _STATION.search(word))),
        "",
    )
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
        dt_from=at,
    )


def _parts(text: TextFile) -> list[_Part]:
    """Return the components of the file."""
    starts = [k for k, line in enumerate(text.heads) if _FIRST.search(line)]
    starts = [k for k in starts if any(map(_POINTS.search, text.heads[k : k + 20]))] or [0]
    parts = []
    for start, after in zip(starts, [*starts[1:], len(text.lines)], strict=True):
        numbers = next(
            (
                k
                for k in range(start + 1, after)
                if text.lines[k].strip()
                and _INTEGERS.fullmatch(text.lines[k])
                and len(text.lines[k].split()) > 9
            ),
            after,
        )
        data = numbers + INTEGER_LINES + REAL_LINES
        end = next(
            (k for k in range(min(data, after), after) if text.lines[k].lstrip().startswith("/&")),
            after,
        )
        while end > data and not text.lines[end - 1].strip():
            end -= 1
        if end <= data:
            raise InputError(
                f"{text.at(start)}: no samples follow the header; get the complete file"
            )
        short = [k for k in range(numbers, data) if not text.lines[k].strip()]
        whole = all(
            _INTEGERS.fullmatch(text.lines[k]) for k in range(numbers, numbers + INTEGER_LINES)
        )
        if short or not whole or _INTEGERS.fullmatch(text.lines[numbers + INTEGER_LINES]):
            raise InputError(
                f"{text.at(numbers)}: {INTEGER_LINES} lines of integers and {REAL_LINES} lines of "
                "reals do not follow the text; lines were lost or added, get the complete file"
            )
        named = (_COMPONENT.search(text.heads[k]) for k in range(start, numbers))
        name = next(
            (" ".join((match[1] or match[2] or "").split()) for match in named if match), ""
        )
        parts.append(_Part(range(start, numbers), data, end, name))
    return parts


def _announced(text: TextFile, part: _Part) -> tuple[int, float, float]:
    """Return the line of the number of points, that number, and the duration [s]."""
    for index in part.header:
        if match := _POINTS.search(text.heads[index]):
            count, seconds = text.number(index, match[1]), text.number(index, match[2])
            if count < 2.0 or seconds <= 0.0:
                raise InputError(
                    f"{text.at(index)}: {count:g} points in {seconds:g} s are announced; get the "
                    "file again"
                )
            return index, count, seconds
    raise InputError(
        f"{text.at(part.header[0])}: the header does not give NO. OF POINTS; get the complete file"
    )


def _width(text: TextFile, rows: Sequence[int]) -> int:
    """Return the width of the columns.

    It is that of the first row, which is full unless there is one row only.
    """
    row = text.lines[rows[0]].rstrip()
    return SINGLE_WIDTH if "E" in row.upper() else PAIR_WIDTH


def _fields(text: TextFile, rows: Sequence[int], width: int) -> tuple[list[float], list[int]]:
    """Return all values by column.

    With each comes the index of its line. It raises InputError where a row is not full.
    """
    values: list[float] = []
    lines: list[int] = []
    offset = len(text.lines[rows[0]].rstrip()) % width
    for index in rows:
        row = (
            text.cut_fields(index, width, offset)
            if text.lines[index][:offset].strip() == ""
            else text.cut_fields(index, width)
        )
        last = index == rows[-1]
        if len(row) != FIELDS and not (last and 0 < len(row) < FIELDS):
            raise InputError(
                f"{text.at(index)}: the row has {len(row)} values instead of {FIELDS}; a value is "
                "missing or too many, get the complete file"
            )
        values += row
        lines += [index] * len(row)
    return values, lines
