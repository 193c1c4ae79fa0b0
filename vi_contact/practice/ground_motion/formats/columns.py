"""Read plain columns.

They are times and one or more accelerations, or accelerations alone, with or without a heading.

Accelerations alone are the path series of OpenSees (.th, .g3, .acc): values in one column or row by
row. Lines before the numbers are read for units, time step, number of samples and names of columns
(``statements``, ``headings``); what they say is believed, and what the caller says must agree.
Lines with "#" among the numbers and empty lines are skipped; columns are separated by blanks,
commas or semicolons. Units are never guessed.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ....core.algebra import Array
from ....core.checks import shown
from ....core.errors import InputError
from ..record import Record, canonical_units
from .at2 import begin_data
from .headings import Column, column_heading
from .statements import (
    TIME_UNITS,
    agree,
    agree_on_units,
    find_counts,
    find_steps,
    find_units,
    find_unknown_units,
    refuse_other_motion,
)
from .text import NUMBER, SAME_STEP, TextFile
from .times import interpolate, rises_evenly, time_step

LONGEST_TIME_STEP = (
    0.5  # s; times that count up by more, in a unit that nobody states, may be in ms or be numbers
)
INTERLEAVED = (
    0.5  # columns that are so much smoother than the rows are components, and no series in rows
)

_WORD = re.compile(r"[^\W\d_]{3,}\W*+")
_NO_VALUE = ("nan", "inf", "infinity", "null", "none", "missing", "nodata")
_RULER = re.compile(r"^[\s\-=+_|*]*$")
_OURS = re.compile(rf"^#\s*+time \[s\], acceleration \[([^\]]++)\], dt = ({NUMBER}) s$")
_WHOLE = re.compile(r"[\s\d+,;-]++")


@dataclass
class _Found:
    """Hold what the header says.

    That is units and their line, time step, number of samples, columns; and what is doubted.
    """

    units: tuple[int, str] | None = None
    step: tuple[int, float] | None = None
    count: tuple[int, float] | None = None
    columns: list[Column] | None = None
    doubts: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read(text: TextFile) -> Record:
    """Return the record of a file of columns.

    `units` and `dt` are needed where the file does not state them.

    Uneven times are refused unless resample_dt [s] is given: see ``time_step``. The first time of
    the file becomes t = 0. A first column that counts up evenly is a time, or the number of the
    sample. channel: which of several components, from 1, or its name in the heading. With dt and
    without channel, rows of three or more values are read one after the other, unless the first
    column is a time.
    """
    header, lines = _parts(text)
    rows = list(text.rows(lines))
    header, lines, rows, found = _header(text, header, lines, rows)
    if len(rows) < 2 and len(rows[0] if rows else ()) < (3 if text.dt is None else 2):
        raise InputError(f"{text.path}: the file has {len(rows)} samples; give two or more")
    text.refuse_uneven_rows(lines, rows)
    text.refuse_misaligned(lines)
    step = text.dt if found.step is None else found.step[1]
    leading = _leading(text, lines, rows, found)
    if not leading and _is_series(text, lines, rows, found, step is not None):
        return _series(text, header, lines, rows, found)
    if len(rows[-1]) != len(rows[0]):
        raise InputError(
            f"{text.at(lines[-1])}: {len(rows[-1])} columns instead of {len(rows[0])}; a value is "
            "missing, get the complete file"
        )
    return _component(text, header, lines, np.array(rows), found, leading)


def _parts(text: TextFile) -> tuple[list[int], list[int]]:
    """Return the indices of the lines of the header, and of the numbers."""
    start = begin_data(text) or 0
    header = list(range(start))
    lines: list[int] = []
    for index in text.find_filled(start):
        line = text.heads[index].strip()
        if line.startswith("#"):
            if not lines:
                header.append(index)
        elif not lines and _is_words(line):
            header.append(index)
        else:
            lines.append(index)
    return [index for index in header if text.heads[index].strip()], lines


def _is_words(line: str) -> bool:
    """Tell whether a line before the numbers is one of words, and not a damaged row of numbers."""
    start = line.lstrip("\"'%!/;([ \t")
    if start[:3].lower() in ("nan", "inf") and not start[3:4].isalpha():
        return False
    if start[:1].isalpha():
        return start.split()[0].strip(",;").lower() not in _NO_VALUE
    words = [
        word
        for word in line.replace(",", " ").split()
        if _WORD.fullmatch(word) and word.lower() not in _NO_VALUE
    ]
    return (
        bool(words) or bool(line) and bool(_RULER.match(line)) and len(line) > 2 and "*" not in line
    )


def _header(
    text: TextFile, header: list[int], lines: list[int], rows: list[list[float]]
) -> tuple[list[int], list[int], list[list[float]], _Found]:
    """Return the lines of the header, those of the numbers, the numbers.

    With them comes what the header says.
    """
    found = _Found()
    ours = next((index for index in header if _OURS.match(text.heads[index])), None)
    if ours is not None and (match := _OURS.match(text.heads[ours])):
        # our own files: title, this line, then notes of what was done, which speak of other files
        # and former steps
        found.units = (ours, canonical_units(text.at(ours), match[1]))
        found.step = (ours, text.number(ours, match[2]))
        return header, lines, rows, found
    counts, steps = find_counts(text, header), find_steps(text, header)
    if len(rows) > 2 and (first := _count_and_step(rows)) is not None:
        # the two lines of eqsig: a label, then number of samples and time step; or the number alone
        counts, steps = (
            [*counts, (lines[0], first[0])],
            [*steps, *((lines[0], one) for one in first[1:2])],
        )
        used = 2 if len(first) > 2 else 1
        header, lines, rows = [*header, *lines[:used]], lines[used:], rows[used:]
    width = max((len(row) for row in rows), default=0)
    found.columns = column_heading(text, header, width)
    told = [index for index in header if not found.columns or index != found.columns[0].line]
    found.count, found.step = (
        agree(text, "the number of samples", counts),
        agree(text, "the time step", steps),
    )
    if found.columns is None or not any(one.kind == "acceleration" for one in found.columns):
        refuse_other_motion(text, told)
    found.units = agree_on_units(text, find_units(text, told))
    strange = find_unknown_units(text, told) if found.units is None else None
    if strange is not None and not any(one.unit for one in found.columns or ()):
        canonical_units(text.at(strange[0]), strange[1])
    return header, lines, rows, found


def _count_and_step(rows: Sequence[Sequence[float]]) -> tuple[float, ...] | None:
    """Return the number of samples, and the time step.

    They stand before the samples in the first row or two.

    They are two numbers before rows of one, of which the first is whole; or one number, or two on
    two lines, before exactly as many numbers as it says. A third member tells that two rows were
    taken.
    """
    first, others = rows[0], rows[1:]
    count = first[0]
    if count != round(count) or count < 2.0:
        return None
    values = sum(len(row) for row in others)
    single = all(len(row) == 1 for row in others)
    agrees = count in (values, len(others)) and len(others[0]) != 2
    if len(first) == 2 and 0.0 < first[1] < 1.0 and (single or agrees):
        return count, first[1]
    if len(first) == 1 and count == values:
        return (count,)
    if len(first) == 1 and len(rows[1]) == 1 and 0.0 < rows[1][0] < 1.0 and count == values - 1:
        return count, rows[1][0], 2.0
    return None


def _leading(
    text: TextFile, lines: Sequence[int], rows: Sequence[Sequence[float]], found: _Found
) -> list[int]:
    """Return the columns that are no motion: numbers of samples and, the last of them, the time.

    The heading decides. Without one they are the first columns that count up evenly; of two columns
    the first one, if it rises. Rows that follow one another rise together, and have no time.
    """
    width = len(rows[0])
    if found.columns is not None and len(found.columns) == width:
        numbers = [k for k, one in enumerate(found.columns) if one.kind == "number"]
        times = [k for k, one in enumerate(found.columns) if one.kind == "time"]
        if times:
            return [*numbers, times[0]]
        unnamed = [k for k, one in enumerate(found.columns) if one.kind == ""]
        return [*numbers, *(k for k in unnamed[:1] if k == 0 and _counts(text, lines, rows, k))]
    if width < 2 or len(rows[-1]) != width:
        return []
    whole_rows = rows if len(rows) > 2 else []
    if (
        whole_rows
        and width > 2
        and all(row[0] < row[1] < row[2] < after[0] for row, after in pairwise(whole_rows))
    ):
        return []  # a series in rows that rises all the time
    leading = [
        k for k in range(width - 1) if all(_counts(text, lines, rows, j) for j in range(k + 1))
    ]
    if leading:
        steps = [rows[1][k] - rows[0][k] for k in leading]
        keep = 2 if len(leading) > 1 and steps[0] == 1.0 and float(rows[0][0]).is_integer() else 1
        return leading[:keep]
    first = np.array([row[0] for row in rows])
    rising = bool(np.all(np.diff(first) > 0.0))
    return (
        [0]
        if rising
        and (width == 2 or len(rows) > 7)
        or width == 2
        and text.dt is None
        and found.step is None
        else []
    )


def _counts(
    text: TextFile, lines: Sequence[int], rows: Sequence[Sequence[float]], column: int
) -> bool:
    """Tell whether a column counts up evenly."""
    times = np.array([row[column] for row in rows])
    return rises_evenly(times, decimals=text.decimals(lines, column))


def _is_series(
    text: TextFile,
    lines: Sequence[int],
    rows: Sequence[Sequence[float]],
    found: _Found,
    step_known: bool,
) -> bool:
    """Tell whether rows are one series.

    It raises InputError where columns are components, or nobody can tell.
    """
    width, values = len(rows[0]), sum(len(row) for row in rows)
    if width == 1:
        return True
    if found.columns is not None or text.channel is not None:
        return False
    if found.count is not None and found.count[1] in (values, len(rows)):
        return found.count[1] == values
    if len(rows[-1]) != width:
        return width > 2 or step_known
    names = _listed([Column("", "", None, 0)] * width)
    if not step_known:
        remedy = (
            "pass dt= in seconds, and channel= for one of the columns, or write one value a line"
            if width < 4
            else "pass dt= in seconds where the rows follow one another, and channel= too where "
            "the columns are components"
        )
        raise InputError(
            f"{text.at(lines[0])}: {width} columns instead of 2, and none is a time ({names}); "
            f"{remedy}"
        )
    table = np.array(rows)
    across = float(np.mean(np.abs(np.diff(table.ravel()))))
    along = float(np.mean(np.abs(np.diff(table, axis=0)))) if len(rows) > 1 else np.inf
    # a series is smoother from value to value than from row to row, components are smoother down
    # their columns
    components = along < INTERLEAVED * across and len(rows) > 9 and width < 5
    if components or width < 4 and along < across / INTERLEAVED:
        raise InputError(
            f"{text.at(lines[0])}: {width} columns of which none is a time ({names}); pass "
            "channel= for one of them, or write one value a line where the rows follow one another"
        )
    found.doubts.append(
        f"rows of {width} values are read one after the other; if the columns are components, pass "
        "channel="
    )
    return True


def _listed(columns: Sequence[Column]) -> str:
    return ", ".join(f"{k}: {one.name or f'column {k}'}" for k, one in enumerate(columns, 1))


def _series(
    text: TextFile,
    header: Sequence[int],
    lines: Sequence[int],
    rows: Sequence[Sequence[float]],
    found: _Found,
) -> Record:
    """Return the record of values that follow one another."""
    values = [value for row in rows for value in row]
    text.refuse_empty_lines(lines, rows)
    if (
        header
        and len(rows) > 1
        and len(rows[0]) > 1
        and _WHOLE.fullmatch(text.lines[lines[0]])
        and not all(_WHOLE.fullmatch(text.lines[index]) for index in lines)
    ):
        raise InputError(
            f"{text.at(lines[0])}: {shown(text.lines[lines[0]].strip())} are whole numbers and "
            "others are not, so that they may belong to the header; begin lines of the header with "
            "#"
        )
    if text.channel is not None:
        text.choose(["acceleration"])
    if found.count is not None:
        text.refuse_other_count(found.count[0], found.count[1], len(values))
    return _record(
        text,
        header,
        found,
        values,
        [index for index, row in zip(lines, rows, strict=True) for _ in row],
        found.step and found.step[1],
    )


def _component(
    text: TextFile,
    header: Sequence[int],
    lines: Sequence[int],
    table: Array,
    found: _Found,
    leading: Sequence[int],
) -> Record:
    """Return the record of one column of a table."""
    width = table.shape[1]
    if table.shape[0] < 2:
        raise InputError(f"{text.path}: the file has {table.shape[0]} samples; give two or more")
    columns = found.columns or [Column(f"column {k + 1}", "", None, 0) for k in range(width)]
    places = [
        k for k in range(width) if k not in leading and columns[k].kind in ("acceleration", "")
    ]
    clear = [k for k in places if columns[k].kind == "acceleration"]
    places = clear or places
    if not places:
        line = columns[0].line
        kinds = ", ".join(f"{one.name}: {one.kind}" for one in columns)
        raise InputError(
            f"{text.at(line)}: the heading names no acceleration ({kinds}); get the file of "
            "accelerations"
        )
    if found.count is not None:
        text.refuse_other_count(found.count[0], found.count[1], table.shape[0])
    place = places[text.choose([columns[k].name for k in places])]
    column = columns[place]
    if column.unit is not None:
        known = canonical_units(text.at(column.line), column.unit)
        found.units = agree_on_units(
            text, [*([found.units] if found.units else []), (column.line, known)]
        )
    samples = table[:, place]
    step, rounding, at = found.step and found.step[1], SAME_STEP, "header"
    if leading:
        samples, step, rounding = _timed(
            text, lines, table[:, leading[-1]], samples, found, columns[leading[-1]], leading
        )
        at = "times in the file"
    name = column.name if len(places) > 1 else ""
    return _record(
        text,
        header,
        found,
        samples,
        lines if len(samples) == len(lines) else None,
        step,
        rounding=rounding,
        dt_from=at,
        component=name,
    )


def _timed(
    text: TextFile,
    lines: Sequence[int],
    times: Array,
    samples: Array,
    found: _Found,
    column: Column,
    leading: Sequence[int],
) -> tuple[Array, float | None, float]:
    """Return the samples on even times, their step [s] and its rounding.

    The step is None where the numbers are counts.
    """
    unit, stated = (
        TIME_UNITS.get((column.unit or "").strip().lower().replace("sec", "s")),
        found.step and found.step[1],
    )
    decimals = text.decimals(lines, leading[-1])
    told = stated if stated is not None else text.dt
    usual = float(np.median(np.diff(times)))
    rising = bool(np.all(np.diff(times) > 0.0))
    if column.unit is not None and unit is None:
        raise InputError(
            f"{text.at(column.line)}: {column.unit!r} is no unit of time known here; write s or ms"
        )
    numbered = usual == 1.0 and unit is None and rises_evenly(times, decimals=decimals)
    if column.kind == "number" or numbered and (told is not None and told != 1.0):
        found.notes.append("the first column counts the samples")
        return samples, stated, SAME_STEP
    if unit is None and rising and told is not None and abs(1e-3 * usual - told) <= 1e-3 * told:
        unit = 1e-3
        found.doubts.append("the times are taken to be milliseconds, as the time step says")
    if (
        unit is None
        and rising
        and usual >= LONGEST_TIME_STEP
        and (told is None or abs(usual - told) > 1e-3 * told)
    ):
        raise InputError(
            f"{text.at(lines[1])}: the first column counts up by {usual:g}, which may be seconds, "
            "milliseconds or numbers of samples"
            + (f", but not with a time step of {told:g} s" if told is not None else "")
            + "; pass the time step that they mean as dt= in seconds"
        )
    factor = 1.0 if unit is None else unit
    seconds = times if factor == 1.0 else times * factor
    step, rounding, uneven = time_step(text, lines, seconds, decimals=decimals, unit=factor)
    if uneven:
        samples = interpolate(seconds, samples, step)
        found.notes.append(f"uneven times interpolated linearly to a step of {step:g} s")
    elif told is not None and abs(step - told) <= rounding * told:
        step = told if rounding > SAME_STEP else step
    elif stated is not None:
        raise InputError(
            f"{text.at(found.step[0] if found.step else 0)}: the header states a time step of "
            f"{stated:g} s but the times count up by {step:g} s; correct the file, or get it again"
        )
    if times[0] != 0.0:
        found.notes.append(f"the first time in the file is {seconds[0]:g} s and is t = 0 here")
    return samples, step, max(rounding, SAME_STEP)


def _record(
    text: TextFile,
    header: Sequence[int],
    found: _Found,
    samples: Sequence[float] | Array,
    lines: Sequence[int] | None,
    step: float | None,
    *,
    rounding: float = SAME_STEP,
    dt_from: str = "",
    component: str = "",
) -> Record:
    """Return the record, its title and notes from the header."""
    words = [text.heads[index].strip().lstrip("# ").rstrip() for index in header]
    comments = tuple(
        word for index, word in zip(header, words, strict=True) if word or "#" in text.heads[index]
    )
    if found.step is not None and not dt_from.startswith("times"):
        dt_from = f"header, line {found.step[0] + 1}"
    return text.record(
        samples,
        units=found.units and found.units[1],
        line=found.units and found.units[0],
        dt=step,
        lines=lines,
        title=comments[0] if comments else "",
        format="columns",
        notes=(*comments, *found.notes),
        counted="counted" if found.count is None else "counted, as the header says",
        dt_from=dt_from,
        dt_rounding=rounding,
        component=component,
        doubts=tuple(found.doubts),
    )
