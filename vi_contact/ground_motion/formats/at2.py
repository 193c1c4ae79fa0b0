"""Read PEER .AT2 files: a few header lines with NPTS and DT, then the samples row by row.

Variants met in the wild and all read here: `NPTS=  1559, DT= .02000 SEC` with or without filter
data after it, `3930 0.00500 NPTS, DT`, NPTS and DT on lines of their own, before or behind a line
`*** Begin data ***`, and files without NPTS whose data start after such a line, the time step
standing only in a sentence. Any number of values per row; the last row may be short and lack its
line end. What the header says twice must agree.
"""

import re
from itertools import pairwise

from ...core.errors import InputError
from ..record import Record, canonical_units, known_units
from .statements import agree, find_counts, find_steps, refuse_other_motion
from .text import NUMBER, TextFile

HEADER_LINES = 8  # NPTS and DT are looked for in this many first lines
OURS = "PEER AT2 format, written by vi_contact"  # first line of the files that ``write_at2`` writes

_NPTS = re.compile(r"\bNPTS\s*+[=:]\s*+(\d++)", re.IGNORECASE)
_DT = re.compile(rf"\bDT\s*+[=:]\s*+({NUMBER})", re.IGNORECASE)
_VALUES_FIRST = re.compile(rf"^\s*+(\d++)[\s,]++({NUMBER})\s*+,?\s*+NPTS\b", re.IGNORECASE)
_BEGIN = re.compile(r"(?<!\*)\*++\s*+begin\s++data\s*+\*", re.IGNORECASE)
_UNITS = re.compile(r"\bunits?\s*+(?:of|are|is|in|[=:])\s*+(\([^()]*+\)|[^\s,;]++)", re.IGNORECASE)


def begin_data(text: TextFile) -> int | None:
    """Return the index of the first line of numbers after `*** Begin data ***`.

    NPTS and DT are skipped; None stands for no such line.
    """
    start = next((k + 1 for k, line in enumerate(text.heads) if _BEGIN.search(line)), None)
    while start is not None and start < len(text.lines) and _states(text.heads[start]):
        start += 1
    return start


def _states(line: str) -> bool:
    """Tell whether a line states NPTS or DT."""
    return any(pattern.search(line) for pattern in (_NPTS, _DT, _VALUES_FIRST))


def recognises(text: TextFile) -> bool:
    """Tell whether the first lines say NPTS, outside "#" comments.

    It is also true where a `*** Begin data ***` line stands before rows of accelerations, and not
    before times and accelerations.
    """
    start = begin_data(text)
    if start is not None:
        rows = list(text.rows(text.find_filled(start)))
        pairs = all(len(row) == 2 for row in rows)
        return not (pairs and all(after[0] > before[0] >= 0.0 for before, after in pairwise(rows)))
    header = [line for line in text.heads[:HEADER_LINES] if not line.startswith("#")]
    if not any(_NPTS.search(line) or _VALUES_FIRST.search(line) for line in header):
        return False
    last = max(k for k, line in enumerate(text.heads[:HEADER_LINES]) if _states(line))
    after = next((line.strip() for line in text.heads[last + 1 :] if line.strip()), "")
    return not after[:1].isalpha()  # a heading of columns follows


def read(text: TextFile) -> Record:
    """Return the record of an AT2 file.

    Units and dt are needed only where the file does not state them.
    """
    npts, stated_dt, start = _header(text)
    told = [index for index in range(start) if text.heads[index].strip()]
    # the title of another file
    told = [index for index in told if not (text.heads[0].startswith(OURS) and index == 1)]
    header = [
        " ".join(text.heads[index].split()) for index in range(start) if text.heads[index].strip()
    ]
    line, units = _stated_units(text, told)
    if line is not None and units is not None:
        canonical_units(text.at(line), units)
    refuse_other_motion(text, told)
    values, lines = text.series(start)
    if npts is not None:
        text.refuse_other_count(int(npts[0]), npts[1], len(values))
    title = next((line for line in header if not line.upper().startswith("PEER")), "")
    return text.record(
        values,
        units=units,
        line=line,
        dt=stated_dt and stated_dt[1],
        lines=lines,
        title=title,
        format="PEER AT2",
        notes=tuple(header),
        dt_from=f"header, line {stated_dt[0] + 1}" if stated_dt else "",
        counted="counted" if npts is None else "counted, as the header says",
    )


def _stated_units(text: TextFile, told: list[int]) -> tuple[int | None, str | None]:
    """Return the line that states the units, and the units.

    It raises InputError where two lines state different ones.
    """
    found = [(index, match[1]) for index in told for match in _UNITS.finditer(text.heads[index])]
    for index, units in found[1:]:
        if known_units(units) is not None and known_units(units) != known_units(found[0][1]):
            raise InputError(
                f"{text.at(index)}: the header states units as {units}, but line {found[0][0] + 1} "
                f"states them as {found[0][1]}; correct the file, or get it again"
            )
    return found[0] if found else (None, None)


def _header(text: TextFile) -> tuple[tuple[int, float] | None, tuple[int, float] | None, int]:
    """Return the line of NPTS and NPTS, and that of DT and DT.

    They are None where they are not stated. With them comes the index of the first data line.
    """
    counts: list[tuple[int, float]] = []
    steps: list[tuple[int, float]] = []
    begin, last = begin_data(text), 0
    for index, line in enumerate(text.heads[: HEADER_LINES if begin is None else begin]):
        both, count, step = _VALUES_FIRST.search(line), _NPTS.search(line), _DT.search(line)
        if begin is None and counts and (both or count):
            raise InputError(f"{text.at(index)}: NPTS is stated a second time; give one record")
        if both:
            counts.append((index, text.number(index, both[1])))
            steps.append((index, text.number(index, both[2])))
        if count:
            counts.append((index, text.number(index, count[1])))
        if step:
            steps.append((index, text.number(index, step[1])))
        last = index if both or count or step else last
    start = last + 1 if begin is None else begin
    prose = [
        index
        for index in range(start)
        if not _states(text.heads[index]) and not (text.heads[0].startswith(OURS) and index == 1)
    ]
    # a sentence "1559 points at equal spacing of 0.02 sec", if there is exactly one, says the same
    # as NPTS and DT
    sentences = find_steps(text, prose)
    if len({value for _, value in sentences}) == 1:
        steps += sentences
    return (
        agree(text, "the number of samples", [*counts, *find_counts(text, prose)]),
        agree(text, "the time step", steps),
        start,
    )
