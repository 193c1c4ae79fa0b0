"""Read PEER .AT2 files: a few header lines with NPTS and DT, then the samples row by row.

Variants met in the wild and all read here: `NPTS=  1559, DT= .02000 SEC` with or without filter
data after it, `3930 0.00500 NPTS, DT`, NPTS and DT on lines of their own, before or behind a line
`*** Begin data ***`, and files without NPTS whose data start after such a line, the time step
standing only in a sentence. Any number of values per row; the last row may be short and lack its
line end. What the header says twice must agree.
"""

import re
from itertools import pairwise

from ....core.errors import InputError
from ..record import Record, canonical_units, recognise_units
from .statements import Statement, agree, find_counts, find_steps, refuse_other_motion
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

    Lines with NPTS and DT are skipped. Without such a line the answer is None.
    """
    begin = next((k for k, line in enumerate(text.heads) if _BEGIN.search(line)), None)
    if begin is None:
        return None
    start = begin + 1
    while start < len(text.lines) and _states(text.heads[start]):
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
        in_pairs = all(len(row) == 2 for row in rows)
        has_times = in_pairs and all(
            after[0] > before[0] >= 0.0 for before, after in pairwise(rows)
        )
        return not has_times
    head = text.heads[:HEADER_LINES]
    header = [line for line in head if not line.startswith("#")]
    if not any(_NPTS.search(line) or _VALUES_FIRST.search(line) for line in header):
        return False

    # Where a heading of columns follows, the file is one of columns.
    last = max(k for k, line in enumerate(head) if _states(line))
    after = next((line.strip() for line in text.heads[last + 1 :] if line.strip()), "")
    return not after[:1].isalpha()


def read(text: TextFile) -> Record:
    """Return the record of an AT2 file.

    Units and dt are needed only where the file does not state them.
    """
    npts, stated_dt, start = _read_header(text)
    filled_lines = [index for index in range(start) if text.heads[index].strip()]
    believed = [index for index in filled_lines if not _is_title_of_ours(text, index)]
    header = [" ".join(text.heads[index].split()) for index in filled_lines]
    line, units = _find_units(text, believed)
    if line is not None and units is not None:
        canonical_units(text.at(line), units)
    refuse_other_motion(text, believed)
    values, lines = text.series(start)
    if npts is not None:
        count_line, count = npts
        text.refuse_other_count(count_line, count, len(values))
    title = next((line for line in header if not line.upper().startswith("PEER")), "")
    return text.record(
        values,
        units=units,
        line=line,
        dt=stated_dt[1] if stated_dt else None,
        lines=lines,
        title=title,
        format="PEER AT2",
        notes=tuple(header),
        dt_from=f"header, line {stated_dt[0] + 1}" if stated_dt else "",
        counted="counted" if npts is None else "counted, as the header says",
    )


def _is_title_of_ours(text: TextFile, index: int) -> bool:
    """Tell whether a line is the title of a file that ``write_at2`` wrote.

    It may be that of another file, and say what is true of that one only.
    """
    return index == 1 and text.heads[0].startswith(OURS)


def _find_units(text: TextFile, indices: list[int]) -> tuple[int | None, str | None]:
    """Return the line that states the units, and the units, or None and None.

    Raises InputError where two lines state different ones.
    """
    statements = []
    for index in indices:
        for match in _UNITS.finditer(text.heads[index]):
            statements.append((index, match[1]))
    if not statements:
        return None, None
    first_line, first_units = statements[0]
    for index, units in statements[1:]:
        if recognise_units(units) is not None and recognise_units(units) != recognise_units(
            first_units
        ):
            raise InputError(
                f"{text.at(index)}: the header states units as {units}, but line {first_line + 1} "
                f"states them as {first_units}; correct the file, or get it again"
            )
    return first_line, first_units


def _read_header(text: TextFile) -> tuple[Statement | None, Statement | None, int]:
    """Return NPTS and DT, each with its line or None, and the index of the first data line."""
    counts: list[Statement] = []
    steps: list[Statement] = []
    begin = begin_data(text)
    last = 0  # the last line that states one of both
    for index, line in enumerate(text.heads[: HEADER_LINES if begin is None else begin]):
        count_and_step = _VALUES_FIRST.search(line)
        count = _NPTS.search(line)
        step = _DT.search(line)
        if begin is None and counts and (count_and_step or count):
            raise InputError(f"{text.at(index)}: NPTS is stated a second time; give one record")
        if count_and_step:
            counts.append((index, text.number(index, count_and_step[1])))
            steps.append((index, text.number(index, count_and_step[2])))
        if count:
            counts.append((index, text.number(index, count[1])))
        if step:
            steps.append((index, text.number(index, step[1])))
        if count_and_step or count or step:
            last = index
    start = last + 1 if begin is None else begin

    # A sentence "1559 points at equal spacing of 0.02 sec", if there is exactly one, says the same
    # as NPTS and DT.
    prose = []
    for index in range(start):
        if not _states(text.heads[index]) and not _is_title_of_ours(text, index):
            prose.append(index)
    sentences = find_steps(text, prose)
    if len({value for _, value in sentences}) == 1:
        steps += sentences
    counts += find_counts(text, prose)
    count_statement = agree(text, "the number of samples", counts)
    return count_statement, agree(text, "the time step", steps), start
