"""Read PEER .AT2 files: a few header lines with NPTS and DT, then the samples row by row.

Variants met in the wild and all read here: `NPTS=  1559, DT= .02000 SEC` with or without filter data
after it, `3930 0.00500 NPTS, DT`, NPTS and DT on lines of their own, and files without NPTS whose data start after a
line `*** Begin data ***`, the time step standing only in a sentence. Any number of values per row; the last row may be
short and lack its line end."""

import re
from itertools import pairwise

from ...core.errors import InputError
from ..record import Record
from .text import NUMBER, TextFile

HEADER_LINES = 8  # NPTS and DT are looked for in this many first lines

_NPTS = re.compile(r"\bNPTS\s*+[=:]\s*+(\d++)", re.IGNORECASE)
_DT = re.compile(rf"\bDT\s*+[=:]\s*+({NUMBER})", re.IGNORECASE)
_VALUES_FIRST = re.compile(rf"^\s*+(\d++)[\s,]++({NUMBER})\s*+,?\s*+NPTS\b", re.IGNORECASE)
_BEGIN = re.compile(r"(?<!\*)\*++\s*+begin\s++data\s*+\*", re.IGNORECASE)
_SECONDS = rf"({NUMBER})\s*+-?s(?:ec(?:ond)?s?)?\b"
_PROSE_DT = (re.compile(rf"\b(?:spacing|spaced|step|intervals?|every|sampled at)\b[^\d.+-]{{0,20}}{_SECONDS}",
                        re.IGNORECASE),
             re.compile(rf"{_SECONDS}\.?\s++(?:time\s++)?(?:spacing|steps?|intervals?)\b", re.IGNORECASE))
_UNITS = re.compile(r"\bunits?\s*+(?:of|are|is|in|[=:])\s*+(\([^()]*+\)|[^\s,;]++)", re.IGNORECASE)


def begin_data(text: TextFile) -> int | None:
    """Return the index of the first line after `*** Begin data ***`, or None."""
    return next((k + 1 for k, line in enumerate(text.heads) if _BEGIN.search(line)), None)


def recognises(text: TextFile) -> bool:
    """Tell whether the first lines say NPTS, outside "#" comments, or a `*** Begin data ***` line stands before rows of
    accelerations, and not before times and accelerations."""
    start = begin_data(text)
    if start is not None:
        rows = list(text.rows(text.filled(start)))
        pairs = all(len(row) == 2 for row in rows)
        return not (pairs and all(after[0] > before[0] >= 0.0 for before, after in pairwise(rows)))
    header = [line for line in text.heads[:HEADER_LINES] if not line.startswith("#")]
    return any(_NPTS.search(line) or _VALUES_FIRST.search(line) for line in header)


def read(text: TextFile) -> Record:
    """Return the record of an AT2 file; units and dt are needed only where the file does not state them."""
    npts, stated_dt, npts_line, start = _header(text)
    header = [" ".join(line.split()) for line in text.heads[:start] if line.strip()]
    values = text.values(start)
    if npts is not None:
        text.refuse_other_count(npts_line, npts, len(values))
    title = next((line for line in header if not line.upper().startswith("PEER")), "")
    units = next((match[1] for match in map(_UNITS.search, header) if match), None)
    return text.record(values, units=units, dt=stated_dt, title=title, format="PEER AT2", notes=tuple(header))


def _header(text: TextFile) -> tuple[float | None, float | None, int, int]:
    """Return NPTS, DT, the index of the NPTS line and the index of the first data line."""
    npts, dt, npts_line, start = None, None, 0, begin_data(text)
    last = 0
    for index, line in enumerate(text.heads[:HEADER_LINES if start is None else start]):
        both, count, step = _VALUES_FIRST.search(line), _NPTS.search(line), _DT.search(line)
        if npts is not None and (both or count):
            raise InputError(f"{text.at(index)}: NPTS is stated a second time; give one record")
        if both:
            npts, dt = text.number(index, both[1]), text.number(index, both[2])
            npts_line = last = index
        if count:
            npts, npts_line, last = text.number(index, count[1]), index, index
        if step:
            dt, last = text.number(index, step[1]), index
    if start is None:
        start = last + 1
    if dt is None:  # of a sentence "1559 points at equal spacing of 0.02 sec", if there is exactly one
        found = {text.number(index, match[1]) for index in range(start) for pattern in _PROSE_DT
                 for match in pattern.finditer(text.heads[index])}
        dt = found.pop() if len(found) == 1 else None
    return npts, dt, npts_line, start
