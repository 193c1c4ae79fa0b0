"""Read USGS SMC files (National Strong-Motion Program), type 2 CORRECTED ACCELEROGRAM, in cm/s².

Layout: 11 lines of text; 6 lines of 8 integers in columns of 10; 10 lines of 5 reals in columns of
15; comment lines starting with "|"; the samples, 8 a line in columns of 10 that touch, so they are
cut by column and not by blanks. The first integer and the first real are the marks of an undefined
value (-32768 and 1.7E38).
"""

import re

from ....core.errors import InputError
from ..record import Record
from .text import TextFile, join_rows

TEXT_LINES = 11
INTEGER_LINES = 6
REAL_LINES = 10
INTEGER_WIDTH = 10  # of columns
REAL_WIDTH = 15
SAMPLE_WIDTH = 10
# Places among the 48 integers, from 0.
VERTICAL = 12
AZIMUTH = 13
COMMENTS = 15
SAMPLES = 16
PROBLEM = 17
SAMPLING_RATE = 1  # place among the 50 reals
UNDEFINED = 1e38  # any real at least this large is the mark of an undefined value

_KIND = re.compile(
    r"^\s*+\d\s++(?:(?:UN)?CORRECTED ACCELEROGRAM|UNKNOWN|VELOCITY|DISPLACEMENT|RESPONSE|FOURIER)",
    re.IGNORECASE,
)
_STATION = re.compile(r"station\s*+=\s*+(.*+)", re.IGNORECASE)


def recognises(text: TextFile) -> bool:
    """Tell whether the first line is the type line of an SMC file, of any type."""
    return _KIND.match(text.heads[0]) is not None


def read(text: TextFile) -> Record:
    """Return the record of an SMC file.

    ``dt`` is needed only where the file leaves its sampling rate undefined.
    """
    kind = text.heads[0].strip()
    if kind.upper().startswith("1"):
        raise InputError(
            f"{text.at(0)}: {kind!r} holds unequally spaced (time, acceleration) pairs before "
            "instrument correction; get the file of type '2 CORRECTED ACCELEROGRAM'"
        )
    if not kind.upper().startswith("2"):
        raise InputError(
            f"{text.at(0)}: {kind!r} is not an acceleration; get the file of type "
            "'2 CORRECTED ACCELEROGRAM'"
        )
    integers = _read_fields(text, TEXT_LINES, INTEGER_LINES, INTEGER_WIDTH, 8)
    reals = _read_fields(text, TEXT_LINES + INTEGER_LINES, REAL_LINES, REAL_WIDTH, 5)
    comments_start = TEXT_LINES + INTEGER_LINES + REAL_LINES
    start = comments_start + int(integers[COMMENTS])
    comments = text.heads[comments_start:start]
    possible = 0 <= integers[COMMENTS] < len(text.lines)
    if not possible or any(not line.startswith("|") for line in comments):
        raise InputError(
            f"{text.at(TEXT_LINES + 1)}: the header announces {integers[COMMENTS]:g} comment lines "
            "but as many lines starting with '|' do not follow; get the file again"
        )
    rate = reals[SAMPLING_RATE]
    stated_step = 1.0 / rate if 0.0 < rate < UNDEFINED else None
    direction = _describe_direction(integers)
    notes = []
    if direction:
        notes.append(f"component: {direction}")
    if integers[PROBLEM] == 1.0:
        notes.append("the file carries the agency's problem flag: read its comments")
    notes += [line[1:].strip() for line in comments if line[1:].strip()]
    title_lines = [text.heads[index] for index in (3, 5) if text.heads[index].strip(" *")]
    title = "; ".join(" ".join(line.split()) for line in title_lines)
    samples, lines = _read_samples(text, start, integers[SAMPLES])
    return text.record(
        samples,
        lines=lines,
        units="cm/s2",
        dt=stated_step,
        format="USGS SMC",
        title=title,
        notes=tuple(notes),
        station=_find_station(text),
        component=direction,
    )


def _read_fields(text: TextFile, start: int, lines: int, width: int, per_line: int) -> list[float]:
    """Return the values on some lines of the header.

    Args:
        text: the file.
        start: index of the first line.
        lines: number of lines.
        width: of the columns, in characters.
        per_line: number of columns.
    """
    values: list[float] = []
    for index in range(start, start + lines):
        row = text.cut_fields(index, width) if index < len(text.lines) else []
        if len(row) != per_line:
            raise InputError(
                f"{text.at(index)}: {len(row)} header values instead of {per_line}; get the file "
                "again"
            )
        values += row
    return values


def _read_samples(text: TextFile, start: int, count: float) -> tuple[list[float], list[int]]:
    """Return the samples in cm/s², and the index of the line of each."""
    lines = list(range(start, len(text.lines)))
    rows = [text.cut_fields(index, SAMPLE_WIDTH) for index in lines]
    while rows and not rows[-1]:  # blank lines at the end
        rows.pop()
        lines.pop()
    for index, row in zip(lines, rows, strict=True):
        if any(abs(value) >= UNDEFINED for value in row):
            raise InputError(
                f"{text.at(index)}: a sample is marked as undefined; fill the gap or use another "
                "record"
            )
    values, line_of_value = join_rows(lines, rows)
    text.refuse_other_count(TEXT_LINES + 2, count, len(values))
    text.refuse_uneven_rows(lines, rows)
    return values, line_of_value


def _describe_direction(integers: list[float]) -> str:
    """Return the component's direction in words."""
    if integers[VERTICAL] == 0.0:
        return "vertical, up"
    if integers[VERTICAL] == 180.0:
        return "vertical, down"
    undefined = integers[0]
    if integers[AZIMUTH] == undefined:
        return ""
    return f"azimuth {integers[AZIMUTH]:g} degrees clockwise from north"


def _find_station(text: TextFile) -> str:
    """Return what follows "station =" on text line 6, up to "component"."""
    match = _STATION.search(text.heads[5])
    name = match[1] if match else ""
    end = name.lower().find("component")
    if end >= 0:
        name = name[:end]
    return " ".join(name.split())
