"""Read files of GeoNet (New Zealand), .V1A and .V2A, of three components in mm/s².

Each component has 16 lines of text, 4 lines of 10 integers and 6 lines of 10 reals in columns of 8,
then blocks of accelerations, velocities and displacements, ten a line in columns of 8. Integers 34
to 36 are the numbers of accelerations, velocities and displacements. Velocities and displacements
are skipped.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from ....core.errors import InputError
from ..record import Record
from .statements import Statement, agree
from .text import NUMBER, TextFile

TEXT_LINES = 16
INTEGER_LINES = 4
REAL_LINES = 6
PER_LINE = 10  # numbers on a line
WIDTH = 8  # of their columns
COUNTS = slice(33, 36)  # places of the three numbers of samples among the 40 integers, from 0
STEP = 25  # place of the time step among the 60 reals

_FIRST = re.compile(r"^\s*+(?:un)?corrected\s++accelerogram\b", re.IGNORECASE)
_PROCESSED = re.compile(r"^\s*+accelerogram\b.*\bprocessed\b", re.IGNORECASE)
_POINTS = re.compile(r"\bnumber of points\s*+(\d++)", re.IGNORECASE)
_DURATION = re.compile(rf"\bduration\s*+({NUMBER})", re.IGNORECASE)
_STEP = re.compile(
    rf"\bat intervals of\s++({NUMBER})\s*+s|\bat\s++({NUMBER})\s*+sec intervals", re.IGNORECASE
)
_SCALE = re.compile(rf"\breadings in units of\s++({NUMBER})\s*+mm/s", re.IGNORECASE)
_COMPONENT = re.compile(r"^\s*+component\s++(\S++)", re.IGNORECASE)
_STATION = re.compile(r"^\s*+site\s++(\S++)", re.IGNORECASE)
_PEAK = re.compile(rf"^\s*+acceleration:\s*+peak\s*+({NUMBER})\s*+mm/s/s", re.IGNORECASE)


@dataclass(frozen=True)
class _Part:
    """Describe one component.

    Attributes:
        start: index of its first line.
        name: direction.
        counts: numbers of samples of its three blocks.
    """

    start: int
    name: str
    counts: tuple[int, ...]

    @property
    def data(self) -> int:
        """Return the index of the first line of accelerations."""
        return self.start + TEXT_LINES + INTEGER_LINES + REAL_LINES

    @property
    def end(self) -> int:
        """Return the index of the line after the last block."""
        return self.data + sum(-(-count // PER_LINE) for count in self.counts)


def recognises(text: TextFile) -> bool:
    """Tell whether two of three are there: the first line, "… Processed", a peak in mm/s/s."""
    head = text.heads[:TEXT_LINES]
    signs = (
        _FIRST.search(head[0]) is not None,
        any(map(_PROCESSED.search, head)),
        any(map(_PEAK.search, head)),
    )
    return sum(signs) >= 2


def read(text: TextFile) -> Record:
    """Return the record of one component.

    ``channel`` is 1 for the first of the file, or its name such as "S16W".
    """
    parts = list(_find_parts(text))
    part = parts[text.choose([part.name for part in parts])]
    values, lines = _read_samples(text, part)

    # Number of samples and step, which the header states more than once.
    header = range(part.start, part.start + TEXT_LINES)
    count_line, count = _read_first(text, header, _POINTS, "Number of points")
    if count != part.counts[0]:
        raise InputError(
            f"{text.at(count_line)}: {count:g} points are announced but the integers of the "
            f"header say {part.counts[0]}; get the file again"
        )
    step_line, step = _read_first(text, header, _STEP, "the interval of the samples")
    _check_step(text, part, (step_line, step), count)

    scale = _find_number(text, header, _SCALE)
    if scale is None:
        scale = 1.0
    peak = _find_number(text, header, _PEAK)
    largest = max(map(abs, values)) * scale
    doubts = []
    if peak is not None and not abs(largest - abs(peak)) <= 0.01 * abs(peak) + 0.1:
        doubts.append(
            f"the header says that the peak is {abs(peak):g} mm/s2, and the samples have "
            f"{largest:g} mm/s2"
        )
    words = [" ".join(text.heads[index].split()) for index in header]
    stations = [match[1] for match in map(_STATION.search, words) if match]
    station = stations[0] if stations else ""
    return text.record(
        values,
        units="mm/s2",
        scale=scale,
        dt=step,
        lines=lines,
        line=None,
        format="GeoNet",
        title=" ".join(filter(None, (words[7], station))),
        notes=tuple(filter(None, words)),
        station=station,
        component=part.name,
        dt_from=f"header, line {step_line + 1}",
        doubts=tuple(doubts),
    )


def _find_parts(text: TextFile) -> Iterator[_Part]:
    """Yield the components of the file, which follow one another without a gap."""
    start = 0
    total = len(text.lines)
    while total and not text.lines[total - 1].strip():
        total -= 1
    while start < total:
        head = text.heads[start : start + TEXT_LINES]
        if not (_FIRST.search(head[0]) or any(map(_PROCESSED.search, head))):
            raise InputError(
                f"{text.at(start)}: a component should begin here with 'Corrected accelerogram' or "
                "'Uncorrected accelerogram'; lines were lost or added, get the complete file"
            )
        integers = _read_fields(text, start + TEXT_LINES, INTEGER_LINES)
        names = [match[1] for match in map(_COMPONENT.search, head) if match]
        counts = tuple(int(count) for count in integers[COUNTS])
        part = _Part(start, names[0] if names else "", counts)
        if part.counts[0] < 2 or min(part.counts) < 0 or part.end > total:
            raise InputError(
                f"{text.at(start + TEXT_LINES + 3)}: {part.counts[0]} accelerations, "
                f"{part.counts[1]} velocities and {part.counts[2]} displacements are announced but "
                f"the file has {total - part.data} lines for them; get the complete file"
            )
        yield part
        start = part.end


def _read_fields(text: TextFile, start: int, lines: int) -> list[float]:
    """Return the values of lines of ten fields."""
    values: list[float] = []
    for index in range(start, start + lines):
        row = text.cut_fields(index, WIDTH) if index < len(text.lines) else []
        if len(row) != PER_LINE:
            raise InputError(
                f"{text.path}, line {index + 1}: {len(row)} header values instead of {PER_LINE}; "
                "get the file again"
            )
        values += row
    return values


def _read_samples(text: TextFile, part: _Part) -> tuple[list[float], list[int]]:
    """Return the accelerations as they are written, and the index of the line of each."""
    values: list[float] = []
    lines: list[int] = []
    for index in range(part.data, part.data + -(-part.counts[0] // PER_LINE)):
        row = text.cut_fields(index, WIDTH)
        expected = min(PER_LINE, part.counts[0] - len(values))
        if len(row) != expected:
            raise InputError(
                f"{text.at(index)}: the row has {len(row)} values instead of {expected}; a value "
                "is missing or too many, get the complete file"
            )
        values += row
        lines += [index] * len(row)
    return values, lines


def _read_first(
    text: TextFile, header: range, pattern: re.Pattern[str], quantity: str
) -> tuple[int, float]:
    """Return the line and the number of the first match.

    Raises InputError, which names the quantity that is missing, where there is none.

    Args:
        text: the file.
        header: indices of the lines of the header.
        pattern: with the number in a group.
        quantity: that it states, in words for messages.
    """
    for index in header:
        match = pattern.search(text.heads[index])
        if match:
            return index, text.number(index, next(filter(None, match.groups())))
    raise InputError(
        f"{text.at(header[0])}: the header does not give {quantity}; get the complete file"
    )


def _find_number(text: TextFile, header: range, pattern: re.Pattern[str]) -> float | None:
    """Return the number of the first match, or None where there is none."""
    for index in header:
        match = pattern.search(text.heads[index])
        if match:
            return text.number(index, match[1])
    return None


def _check_step(text: TextFile, part: _Part, step: Statement, count: float) -> None:
    """Raise InputError unless the step agrees with the one among the reals, and the duration.

    Args:
        text: the file.
        part: the component.
        step: line that states the step, and the step [s].
        count: number of accelerations.
    """
    step_line, seconds_of_step = step
    if seconds_of_step <= 0.0:
        raise InputError(
            f"{text.at(step_line)}: the interval of the samples is {seconds_of_step:g} s; get the "
            "file again"
        )
    index = part.start + TEXT_LINES + INTEGER_LINES + STEP // PER_LINE
    column = STEP % PER_LINE
    word = text.lines[index][WIDTH * column : WIDTH * (column + 1)].strip()
    printed = text.number(index, word)
    if printed > 0.0:
        _, _, decimals = word.partition(".")
        half_digit = 0.5 * 10.0 ** -len(decimals)
        rounding = max(1e-6, 1.01 * half_digit / seconds_of_step)
        agree(text, "the time step", [step, (index, printed)], rounding=rounding)
    for place in range(part.start, part.start + TEXT_LINES):
        match = _DURATION.search(text.heads[place])
        if not match:
            continue
        seconds = text.number(place, match[1])
        if not abs(seconds - count * seconds_of_step) <= 1.01 * seconds_of_step + 0.01:
            raise InputError(
                f"{text.at(place)}: {seconds:g} s are announced but {count:g} points at "
                f"{seconds_of_step:g} s follow; get the complete file"
            )
