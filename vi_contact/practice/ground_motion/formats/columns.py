"""Read plain columns: times and one or more accelerations, or accelerations alone.

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
from typing import NamedTuple

import numpy as np

from ....core.algebra import Array
from ....core.checks import quote
from ....core.errors import InputError
from ..record import Record, canonical_units
from .at2 import begin_data
from .headings import Column, column_heading
from .statements import (
    TIME_UNITS,
    Statement,
    agree,
    agree_on_units,
    find_counts,
    find_steps,
    find_units,
    find_unknown_units,
    refuse_other_motion,
)
from .text import NUMBER, SAME_STEP, TextFile, join_rows
from .times import interpolate, rises_evenly, time_step

# s; times that count up by more, in a unit that nobody states, may be in ms or be numbers.
LONGEST_TIME_STEP = 0.5
# Columns that are so much smoother than the rows are components, and no series in rows.
INTERLEAVED = 0.5

_WORD = re.compile(r"[^\W\d_]{3,}\W*+")
_NO_VALUE = ("nan", "inf", "infinity", "null", "none", "missing", "nodata")
_RULER = re.compile(r"^[\s\-=+_|*]*$")
_OURS = re.compile(rf"^#\s*+time \[s\], acceleration \[([^\]]++)\], dt = ({NUMBER}) s$")
_WHOLE = re.compile(r"[\s\d+,;-]++")


@dataclass
class _Header:
    """Hold what the header says, and what becomes clear while the numbers are read.

    Attributes:
        units: the line that states them, and their key.
        step: the line that states the time step, and the step [s].
        count: the line that states the number of samples, and that number.
        columns: that a heading names.
        doubts: what was read in one of several ways that were possible.
        notes: what was done while reading.
    """

    units: tuple[int, str] | None = None
    step: Statement | None = None
    count: Statement | None = None
    columns: list[Column] | None = None
    doubts: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def dt(self) -> float | None:
        """Return the time step that is stated [s], or None."""
        return None if self.step is None else self.step[1]


def read(text: TextFile) -> Record:
    """Return the record of a file of columns.

    The caller's units and dt are needed where the file does not state them. Uneven times are
    refused unless resample_dt is given: see ``time_step``. The first time of the file becomes t =
    0. A first column that counts up evenly is a time, or the number of the sample. The channel is
    which of several components, from 1, or its name in the heading. With dt and without channel,
    rows of three or more values are read one after the other, unless the first column is a time.
    """
    header, lines = _split_lines(text)
    rows = list(text.rows(lines))
    header, lines, rows, facts = _read_header(text, header, lines, rows)
    if len(rows) < 2 and len(rows[0] if rows else ()) < (3 if text.dt is None else 2):
        raise InputError(f"{text.path}: the file has {len(rows)} samples; give two or more")
    text.refuse_uneven_rows(lines, rows)
    text.refuse_misaligned(lines)
    step_known = facts.step is not None or text.dt is not None
    leading = _find_leading_columns(text, lines, rows, facts)
    if not leading and _is_series(text, lines, rows, facts, step_known):
        return _read_series(text, header, lines, rows, facts)
    if len(rows[-1]) != len(rows[0]):
        raise InputError(
            f"{text.at(lines[-1])}: {len(rows[-1])} columns instead of {len(rows[0])}; a value is "
            "missing, get the complete file"
        )
    return _read_component(text, header, lines, np.array(rows), facts, leading)


def _split_lines(text: TextFile) -> tuple[list[int], list[int]]:
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
    for word in line.replace(",", " ").split():
        if _WORD.fullmatch(word) and word.lower() not in _NO_VALUE:
            return True
    is_ruler = _RULER.match(line) is not None
    return is_ruler and len(line) > 2 and "*" not in line


def _read_header(
    text: TextFile, header: list[int], lines: list[int], rows: list[list[float]]
) -> tuple[list[int], list[int], list[list[float]], _Header]:
    """Return the lines of the header, those of the numbers, the numbers, what the header says.

    Numbers of samples and time steps that stand before the samples are moved to the header.

    Args:
        text: the file.
        header: indices of the lines of words.
        lines: indices of the lines of numbers.
        rows: the numbers on these.
    """
    facts = _Header()
    for index in header:
        match = _OURS.match(text.heads[index])
        if match:
            # Our own files: title, this line, then notes of what was done, which speak of other
            # files and former steps.
            facts.units = (index, canonical_units(text.at(index), match[1]))
            facts.step = (index, text.number(index, match[2]))
            return header, lines, rows, facts
    counts = find_counts(text, header)
    steps = find_steps(text, header)
    first = _find_count_and_step(rows) if len(rows) > 2 else None
    if first is not None:
        # The two lines of eqsig: a label, then number of samples and time step; or the number
        # alone.
        counts.append((lines[0], first.samples))
        if first.step is not None:
            steps.append((lines[0], first.step))
        header = [*header, *lines[: first.rows]]
        lines = lines[first.rows :]
        rows = rows[first.rows :]
    facts.count = agree(text, "the number of samples", counts)
    facts.step = agree(text, "the time step", steps)

    # Units and kind of motion, from all lines but that of the heading.
    width = max((len(row) for row in rows), default=0)
    facts.columns = column_heading(text, header, width)
    columns = facts.columns or []
    prose = [index for index in header if not columns or index != columns[0].line]
    if not any(column.kind == "acceleration" for column in columns):
        refuse_other_motion(text, prose)
    facts.units = agree_on_units(text, find_units(text, prose))
    if facts.units is None and not any(column.unit for column in columns):
        unknown = find_unknown_units(text, prose)
        if unknown is not None:
            line, name = unknown
            canonical_units(text.at(line), name)
    return header, lines, rows, facts


class _First(NamedTuple):
    """Hold what the first rows of numbers say about the others."""

    samples: float  # number of samples
    step: float | None  # time step [s]
    rows: int  # how many rows say so


def _find_count_and_step(rows: Sequence[Sequence[float]]) -> _First | None:
    """Return the number of samples, and the time step, that stand before the samples, or None.

    They are two numbers before rows of one, of which the first is whole; or one number, or two on
    two lines, before exactly as many numbers as it says.
    """
    first = rows[0]
    later_rows = rows[1:]
    count = first[0]
    if count != round(count) or count < 2.0:
        return None
    values = sum(len(row) for row in later_rows)
    if len(first) == 2 and 0.0 < first[1] < 1.0:
        single = all(len(row) == 1 for row in later_rows)
        agrees = count in (values, len(later_rows)) and len(later_rows[0]) != 2
        if single or agrees:
            return _First(count, first[1], 1)
    if len(first) == 1 and count == values:
        return _First(count, None, 1)
    if len(first) == 1 and len(rows[1]) == 1 and 0.0 < rows[1][0] < 1.0 and count == values - 1:
        return _First(count, rows[1][0], 2)
    return None


def _find_leading_columns(
    text: TextFile, lines: Sequence[int], rows: Sequence[Sequence[float]], facts: _Header
) -> list[int]:
    """Return the columns that are no motion: numbers of samples and, the last of them, the time.

    The heading decides. Without one they are the first columns that count up evenly; of two columns
    the first one, if it rises. Rows that follow one another rise together, and have no time.

    Args:
        text: the file.
        lines: indices of the lines of the rows.
        rows: the numbers.
        facts: what the header says.
    """
    width = len(rows[0])
    if facts.columns is not None and len(facts.columns) == width:
        kinds = [column.kind for column in facts.columns]
        numbers = [k for k, kind in enumerate(kinds) if kind == "number"]
        if "time" in kinds:
            return [*numbers, kinds.index("time")]
        if kinds[0] == "" and _counts_up(text, lines, rows, 0):
            return [*numbers, 0]
        return numbers
    if width < 2 or len(rows[-1]) != width or _rises_in_rows(rows):
        return []

    # The first columns that count up evenly: a time, or numbers of samples and a time.
    even = 0
    while even < width - 1 and _counts_up(text, lines, rows, even):
        even += 1
    if even:
        is_number = rows[1][0] - rows[0][0] == 1.0 and float(rows[0][0]).is_integer()
        return [0, 1] if even > 1 and is_number else [0]

    # A first column that rises; of two columns the first one where nothing else gives a step.
    first = np.array([row[0] for row in rows])
    rising = bool(np.all(np.diff(first) > 0.0))
    if rising and (width == 2 or len(rows) > 7):
        return [0]
    if width == 2 and text.dt is None and facts.step is None:
        return [0]
    return []


def _rises_in_rows(rows: Sequence[Sequence[float]]) -> bool:
    """Tell whether rows of three or more are a series that rises all the time."""
    if len(rows) <= 2 or len(rows[0]) <= 2:
        return False
    return all(row[0] < row[1] < row[2] < after[0] for row, after in pairwise(rows))


def _counts_up(
    text: TextFile, lines: Sequence[int], rows: Sequence[Sequence[float]], column: int
) -> bool:
    """Tell whether a column counts up evenly.

    Args:
        text: the file.
        lines: indices of the lines of the rows.
        rows: the numbers.
        column: number of the column, from 0.
    """
    times = np.array([row[column] for row in rows])
    return rises_evenly(times, decimals=text.decimals(lines, column))


def _is_series(
    text: TextFile,
    lines: Sequence[int],
    rows: Sequence[Sequence[float]],
    facts: _Header,
    step_known: bool,
) -> bool:
    """Tell whether rows are one series.

    Raises InputError where columns are components, or nobody can tell.

    Args:
        text: the file.
        lines: indices of the lines of the rows.
        rows: the numbers.
        facts: what the header says; a doubt may be added.
        step_known: whether the file or its caller states a time step.
    """
    width = len(rows[0])
    values = sum(len(row) for row in rows)
    if width == 1:
        return True
    if facts.columns is not None or text.channel is not None:
        return False
    if facts.count is not None and facts.count[1] in (values, len(rows)):
        return facts.count[1] == values
    if len(rows[-1]) != width:
        return width > 2 or step_known
    names = ", ".join(f"{k}: column {k}" for k in range(1, width + 1))
    if not step_known:
        if width < 4:
            remedy = (
                "pass dt= in seconds, and channel= for one of the columns, or write one value a "
                "line"
            )
        else:
            remedy = (
                "pass dt= in seconds where the rows follow one another, and channel= too where "
                "the columns are components"
            )
        raise InputError(
            f"{text.at(lines[0])}: {width} columns instead of 2, and none is a time ({names}); "
            f"{remedy}"
        )

    # A series is smoother from value to value than from row to row, components are smoother down
    # their columns.
    table = np.array(rows)
    across = float(np.mean(np.abs(np.diff(table.ravel()))))
    along = float(np.mean(np.abs(np.diff(table, axis=0)))) if len(rows) > 1 else np.inf
    components = along < INTERLEAVED * across and len(rows) > 9 and width < 5
    may_be_components = width < 4 and along < across / INTERLEAVED
    if components or may_be_components:
        raise InputError(
            f"{text.at(lines[0])}: {width} columns of which none is a time ({names}); pass "
            "channel= for one of them, or write one value a line where the rows follow one another"
        )
    facts.doubts.append(
        f"rows of {width} values are read one after the other; if the columns are components, pass "
        "channel="
    )
    return True


def _read_series(
    text: TextFile,
    header: Sequence[int],
    lines: Sequence[int],
    rows: Sequence[Sequence[float]],
    facts: _Header,
) -> Record:
    """Return the record of values that follow one another.

    Args:
        text: the file.
        header: indices of the lines of the header.
        lines: indices of the lines of the rows.
        rows: the values.
        facts: what the header says.
    """
    values, line_of_value = join_rows(lines, rows)
    text.refuse_empty_lines(lines, rows)
    if header and len(rows) > 1 and len(rows[0]) > 1:
        whole = [bool(_WHOLE.fullmatch(text.lines[index])) for index in lines]
        if whole[0] and not all(whole):
            raise InputError(
                f"{text.at(lines[0])}: {quote(text.lines[lines[0]].strip())} are whole numbers and "
                "others are not, so that they may belong to the header; begin lines of the header "
                "with #"
            )
    if text.channel is not None:
        text.choose(["acceleration"])
    if facts.count is not None:
        count_line, count = facts.count
        text.refuse_other_count(count_line, count, len(values))
    return _make_record(text, header, facts, values, line_of_value, facts.dt)


def _read_component(
    text: TextFile,
    header: Sequence[int],
    lines: Sequence[int],
    table: Array,
    facts: _Header,
    leading: Sequence[int],
) -> Record:
    """Return the record of one column of a table.

    Args:
        text: the file.
        header: indices of the lines of the header.
        lines: indices of the lines of the rows.
        table: (rows, columns), the numbers.
        facts: what the header says.
        leading: columns that are no motion, the last of them the time.
    """
    length, width = table.shape
    if length < 2:
        raise InputError(f"{text.path}: the file has {length} samples; give two or more")

    # The accelerations that a heading names, or all columns that may be some.
    columns = facts.columns or [Column(f"column {k + 1}", "", None, 0) for k in range(width)]
    motions = [k for k in range(width) if k not in leading]
    accelerations = [k for k in motions if columns[k].kind == "acceleration"]
    places = accelerations or [k for k in motions if columns[k].kind == ""]
    if not places:
        line = columns[0].line
        kinds = ", ".join(f"{column.name}: {column.kind}" for column in columns)
        raise InputError(
            f"{text.at(line)}: the heading names no acceleration ({kinds}); get the file of "
            "accelerations"
        )
    if facts.count is not None:
        count_line, count = facts.count
        text.refuse_other_count(count_line, count, length)
    place = places[text.choose([columns[k].name for k in places])]
    column = columns[place]
    if column.unit is not None:
        known = canonical_units(text.at(column.line), column.unit)
        statements = [facts.units] if facts.units else []
        facts.units = agree_on_units(text, [*statements, (column.line, known)])

    samples = table[:, place]
    step = facts.dt
    rounding = SAME_STEP
    step_from = "header"
    if leading:
        time_place = leading[-1]
        decimals = text.decimals(lines, time_place)
        samples, step, rounding = _bring_to_even_times(
            text, lines, table[:, time_place], samples, facts, columns[time_place], decimals
        )
        step_from = "times in the file"
    return _make_record(
        text,
        header,
        facts,
        samples,
        lines if len(samples) == len(lines) else None,
        step,
        rounding=rounding,
        dt_from=step_from,
        component=column.name if len(places) > 1 else "",
    )


def _bring_to_even_times(
    text: TextFile,
    lines: Sequence[int],
    times: Array,
    samples: Array,
    facts: _Header,
    column: Column,
    decimals: int | None,
) -> tuple[Array, float | None, float]:
    """Return the samples on even times, their step [s] and its rounding.

    The step is the stated one, or None, where the numbers are counts.

    Args:
        text: the file.
        lines: index of the line of every time.
        times: (n,), in their unit.
        samples: (n,), at these times.
        facts: what the header says; notes and doubts may be added.
        column: what the heading says of the times.
        decimals: of the times as they are printed; None where they have exponents.
    """
    unit = TIME_UNITS.get((column.unit or "").strip().lower().replace("sec", "s"))
    stated = facts.dt
    dt = text.dt if stated is None else stated  # that the file or its caller states
    usual = float(np.median(np.diff(times)))
    rising = bool(np.all(np.diff(times) > 0.0))
    if column.unit is not None and unit is None:
        raise InputError(
            f"{text.at(column.line)}: {column.unit!r} is no unit of time known here; write s or ms"
        )

    # Numbers of samples?
    numbered = usual == 1.0 and unit is None and rises_evenly(times, decimals=decimals)
    other_step = dt is not None and dt != 1.0
    if column.kind == "number" or (numbered and other_step):
        facts.notes.append("the first column counts the samples")
        return samples, stated, SAME_STEP

    # Seconds or milliseconds? A time step that is stated tells.
    in_ms = dt is not None and abs(1e-3 * usual - dt) <= 1e-3 * dt
    if unit is None and rising and in_ms:
        unit = 1e-3
        facts.doubts.append("the times are taken to be milliseconds, as the time step says")
    agrees = dt is not None and abs(usual - dt) <= 1e-3 * dt
    if unit is None and rising and usual >= LONGEST_TIME_STEP and not agrees:
        but = "" if dt is None else f", but not with a time step of {dt:g} s"
        raise InputError(
            f"{text.at(lines[1])}: the first column counts up by {usual:g}, which may be seconds, "
            f"milliseconds or numbers of samples{but}; pass the time step that they mean as dt= in "
            "seconds"
        )

    factor = 1.0 if unit is None else unit
    seconds = times if factor == 1.0 else times * factor
    step, rounding, uneven = time_step(text, lines, seconds, decimals=decimals, unit=factor)
    if uneven:
        samples = interpolate(seconds, samples, step)
        facts.notes.append(f"uneven times interpolated linearly to a step of {step:g} s")
    elif dt is not None and abs(step - dt) <= rounding * dt:
        step = dt if rounding > SAME_STEP else step
    elif stated is not None:
        raise InputError(
            f"{text.at(facts.step[0] if facts.step else 0)}: the header states a time step of "
            f"{stated:g} s but the times count up by {step:g} s; correct the file, or get it again"
        )
    if times[0] != 0.0:
        facts.notes.append(f"the first time in the file is {seconds[0]:g} s and is t = 0 here")
    return samples, step, max(rounding, SAME_STEP)


def _make_record(
    text: TextFile,
    header: Sequence[int],
    facts: _Header,
    samples: Sequence[float] | Array,
    lines: Sequence[int] | None,
    step: float | None,
    *,
    rounding: float = SAME_STEP,
    dt_from: str = "",
    component: str = "",
) -> Record:
    """Return the record, its title and notes from the header.

    Args:
        text: the file.
        header: indices of the lines of the header.
        facts: what the header says.
        samples: as the file has them.
        lines: index of the line of every sample; None where they were interpolated.
        step: time step [s]; None where nobody states it.
        rounding: relative difference to the caller's step that counts as rounding.
        dt_from: where the step comes from.
        component: name of the column.
    """
    comments = []
    for index in header:
        comment = text.heads[index].strip().lstrip("# ").rstrip()
        if comment or "#" in text.heads[index]:
            comments.append(comment)
    units_line, units = facts.units or (None, None)
    if facts.step is not None and not dt_from.startswith("times"):
        dt_from = f"header, line {facts.step[0] + 1}"
    return text.record(
        samples,
        units=units,
        line=units_line,
        dt=step,
        lines=lines,
        title=comments[0] if comments else "",
        format="columns",
        notes=(*comments, *facts.notes),
        counted="counted" if facts.count is None else "counted, as the header says",
        dt_from=dt_from,
        dt_rounding=rounding,
        component=component,
        doubts=tuple(facts.doubts),
    )
