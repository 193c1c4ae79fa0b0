"""Read COSMOS and CSMIP files (.V1, .V2, .V2c) of one or more channels.

A channel has text, numbers and blocks of samples. A block begins with a line that states its number
of points, quantity, units and Fortran format, such as "7500 points of accel data equally spaced at
.010 sec, in cm/sec2. (8f10.6)" (CSMIP) or "12091 acceleration pts, approx 120 secs,
units=cm/sec2(04),Format=(8F10.5)" (COSMOS). The time step of the latter is real number 34 of its
header. Without a stated format it is (8F10.3). Samples
are cut by column, for they may touch. Velocities and displacements are skipped.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ....core.errors import InputError
from ..record import Record, recognise_units
from .statements import agree
from .text import NUMBER, TextFile

STEP = 33  # place of the time step among the real header values of COSMOS, from 0
USUAL_FORMAT = (8, 10)  # samples on a line and their width, where no format is stated

_FIRST = re.compile(
    r"^\s*+(?:un)?corrected\s++accelerogram\b|\(\s*+format\s++v[\d.]++ with \d++ text lines",
    re.IGNORECASE,
)
_COUNT = re.compile(r"^\s*+(\d++)\s")
_QUANTITY = re.compile(r"\b(acc|vel|dis)\w*+", re.IGNORECASE)
_SAMPLES = re.compile(r"\b(?:pts|spaced|data)\b", re.IGNORECASE)
_FORMAT = re.compile(r"\(\s*+(\d*+)\s*+(?:1P)?[FEIDG](\d++)[^()]*+\)", re.IGNORECASE)
_UNITS = (
    re.compile(r"units?\s*+(?:[=:]|\bof\b)\s*+(g/10|[^,()\s]++)", re.IGNORECASE),
    re.compile(
        r"\bin\s++(?:units\s++)?(g/10|cms?/s(?:ec)?[*^]*+2|cms?/s(?:ec)?/s(?:ec)?|g)\b",
        re.IGNORECASE,
    ),
)
_SPACED = re.compile(
    rf"equally[- ]spaced\s++(?:at|intervals\s++of)\s++({NUMBER})\s*+sec", re.IGNORECASE
)
_UNEVEN = re.compile(r"unequally", re.IGNORECASE)
_RATE = re.compile(rf"\bat\s++({NUMBER})\s*+pts/sec", re.IGNORECASE)
_PEAK = re.compile(rf"\bpeak\s++accel\w*+\s*+=\s*+({NUMBER})\s*+(\S++)\s++at\b", re.IGNORECASE)
_REALS = re.compile(
    r"^\s*+(\d++)\s++real-header values follow on\s++(\d++)\s++lines", re.IGNORECASE
)
_CHANNEL = re.compile(r"\bchan?:?\s++([\w?]++):([^(]*+)", re.IGNORECASE)
_COMPONENT = re.compile(r"^\s*+COMP\s++(\S++)")
_FROM = re.compile(r"\bfrom\b", re.IGNORECASE)
_STATION = re.compile(r"\bstat(?:io)?n\s*+(?:no|id)[.:](.*+)", re.IGNORECASE)
_CODE = re.compile(r"\bcode:(.*+)", re.IGNORECASE)
_EVENT = re.compile(r"re?co?rd of", re.IGNORECASE)
_END = re.compile(r"^\s*+(?:end-of-data|/&)", re.IGNORECASE)
_VALUE = re.compile(NUMBER)
_NUMBERS = re.compile(r"[\s\d-]++")
_UNKNOWN = re.compile(rf"unknown/unspecified:\s*+{NUMBER}[,\s]++({NUMBER})", re.IGNORECASE)


@dataclass(frozen=True)
class Block:
    """Describe a block of samples.

    Attributes:
        line: index of the line that announces them.
        header: indices of the lines of the channel's header.
        count: number of samples.
        per_line: number of samples on a line.
        width: of a sample, in characters.
    """

    line: int
    header: range
    count: int
    per_line: int
    width: int

    @property
    def end(self) -> int:
        """Return the index of the line after the samples."""
        return self.line + 1 + -(-self.count // self.per_line)


def recognises(text: TextFile) -> bool:
    """Tell whether the first line is one of a COSMOS or CSMIP file of any volume.

    It is also true where a line begins its samples.
    """
    return _FIRST.search(text.heads[0]) is not None or begins_blocks(text)


def begins_blocks(text: TextFile) -> bool:
    """Tell whether one of the first lines announces a block of samples, with format or step."""
    for index, line in enumerate(text.heads[:400]):
        if "header" in line.lower():
            continue
        if _read_announcement(text, index) and (_FORMAT.search(line) or _SPACED.search(line)):
            return True
    return False


def read(text: TextFile) -> Record:
    """Return the record of one channel.

    ``channel`` is 1 for the first of the file, required where it holds several.
    """
    blocks = _find_blocks(text)
    if not blocks:
        raise InputError(
            f"{text.at(0)}: no block of accelerations follows, which a line such as '7500 points "
            "of accel data equally spaced at .010 sec, in cm/sec2. (8f10.6)' begins; other layouts "
            "are not read, write columns of time and acceleration"
        )
    block = blocks[text.choose([_find_component(text, block) for block in blocks])]
    line = text.heads[block.line]
    if _UNEVEN.search(line):
        raise InputError(
            f"{text.at(block.line)}: the samples are unequally spaced; get the corrected file (V2)"
        )
    words, comments = _read_words(text, block)
    cosmos = "format v" in text.heads[0].lower()
    event = next(filter(_EVENT.match, words), " ".join(words[1:2] if cosmos else words[2:3]))
    samples, lines = _read_samples(text, block)

    # The units stand on the line of the block, or with a peak that the samples have.
    units_line: int = block.line
    units: str | None = None
    for pattern in reversed(_UNITS):  # the first one counts
        match = pattern.search(line)
        if match:
            units = match[1]
    if units is None:
        of_peak = _find_peak_units(text, block, samples)
        if of_peak is not None:
            units_line, units = of_peak
    return text.record(
        samples,
        lines=lines,
        units=units,
        dt=_find_step(text, block),
        line=units_line,
        title=event,
        format="COSMOS" if cosmos else "CSMIP",
        notes=(*words, *comments),
        station=_find_station(text, block),
        component=_find_component(text, block),
    )


def _find_blocks(text: TextFile) -> list[Block]:
    """Return the blocks of accelerations.

    Blocks of other quantities belong to the channel before them.
    """
    blocks = []
    index = 0
    start = 0  # of the header of a channel
    while index < len(text.lines):
        announcement = _read_announcement(text, index)
        form = _FORMAT.search(text.heads[index]) if announcement else None
        if announcement and (form or _SPACED.search(text.heads[index])):
            count, quantity = announcement
            per_line, width = USUAL_FORMAT
            if form:
                per_line = int(text.number(index, form[1] or "1"))
                width = int(text.number(index, form[2]))
            block = Block(index, range(start, index), count, max(per_line, 1), max(width, 1))
            if quantity == "acc":
                blocks.append(block)
            index = block.end
            start = index
        elif _END.match(text.heads[index]):
            index += 1
            start = index
        else:
            index += 1
    return blocks


def _read_announcement(text: TextFile, index: int) -> tuple[int, str] | None:
    """Return the number of points and the quantity ("acc", "vel", "dis") of a line of a block.

    A line that begins no block gives None.
    """
    line = text.heads[index]
    count = _COUNT.match(line)
    quantity = _QUANTITY.search(line, count.end()) if count else None
    if count is None or quantity is None or not _SAMPLES.search(line, quantity.end()):
        return None
    return int(text.number(index, count[1])), quantity[1].lower()


def _read_words(text: TextFile, block: Block) -> tuple[list[str], list[str]]:
    """Return the text of a channel's header, and its comments, with blanks squeezed.

    The text ends where numbers begin.
    """
    header = [" ".join(text.heads[index].split()) for index in block.header]
    end = len(header)
    for k, entry in enumerate(header):
        if _NUMBERS.fullmatch(entry) or "header values" in entry:
            end = k
            break
    words = [entry for entry in header[:end] if entry]
    comments = [entry.lstrip("| ") for entry in header if entry.startswith("|")]
    return words, [comment for comment in comments if comment]


def _read_samples(text: TextFile, block: Block) -> tuple[list[float], list[int]]:
    """Return the samples in the file's units, and the index of the line of each."""
    marks = [text.number(index, mark[1]) for index, mark in _search(text, block.header, _UNKNOWN)]
    unknown = marks[0] if marks else None
    values: list[float] = []
    lines: list[int] = []
    for index in range(block.line + 1, block.end):
        line = text.lines[index].rstrip() if index < len(text.lines) else ""
        fields = -(-len(line) // block.width)
        expected = min(block.per_line, block.count - len(values))
        if fields != expected:
            raise InputError(
                f"{text.at(block.line)}: {block.count:.12g} samples are announced but line "
                f"{index + 1} holds {fields} of them instead of {expected:g}; get the complete file"
            )
        row = text.cut_fields(index, block.width)
        if unknown in row:
            raise InputError(
                f"{text.at(index)}: a sample is marked as unknown ({unknown:g}); use another record"
            )
        values += row
        lines += [index] * len(row)

    # Numbers alone, in columns of the same width, are samples that nobody announces.
    after = text.lines[block.end] if block.end < len(text.lines) else ""
    numbers_alone = bool(after.strip()) and not _VALUE.sub("", after).strip()
    if numbers_alone and len(after.rstrip()) % block.width == 0:
        raise InputError(
            f"{text.at(block.line)}: {block.count:.12g} samples are announced but line "
            f"{block.end + 1} holds more of them; get the complete file"
        )
    return values, lines


def _find_step(text: TextFile, block: Block) -> float | None:
    """Return the time step that is stated with the samples, or in the header, or None."""
    rate = _RATE.search(text.heads[block.line])
    if rate and text.number(block.line, rate[1]) > 0.0:
        return 1.0 / text.number(block.line, rate[1])
    steps = []
    for index, spaced in _search(text, (block.line, *block.header), _SPACED):
        steps.append((index, text.number(index, spaced[1])))
    if not steps:
        return _find_step_among_reals(text, block)
    statement = agree(text, "the time step", steps)
    return statement[1] if statement else None


def _find_step_among_reals(text: TextFile, block: Block) -> float | None:
    """Return the time step among the real numbers of the header, or None."""
    for index, reals in _search(text, block.header, _REALS):
        form = _FORMAT.search(text.heads[index])
        if not form:
            continue
        lines = int(text.number(index, reals[2]))
        width = max(int(text.number(index, form[2])), 1)
        values: list[float] = []
        for row in range(index + 1, min(index + 1 + lines, block.line)):
            values += text.cut_fields(row, width)
        return values[STEP] if len(values) > STEP and values[STEP] > 0.0 else None
    return None


def _find_peak_units(text: TextFile, block: Block, samples: list[float]) -> tuple[int, str] | None:
    """Return the line and the units of a peak that the header states and the samples have."""
    for index, match in _search(text, block.header, _PEAK):
        peak = abs(text.number(index, match[1]))
        largest = max(map(abs, samples), default=0.0)
        if recognise_units(match[2]) is not None and abs(largest - peak) <= 1e-3 * peak:
            return index, match[2]
    return None


def _find_component(text: TextFile, block: Block) -> str:
    """Return the direction of the channel in the header, such as "90 Deg" or "UP"."""
    for _, match in _search(text, block.header, _CHANNEL):
        direction, *_ = _FROM.split(match[2], maxsplit=1)
        if direction.strip():
            return " ".join(direction.split())
    for _, match in _search(text, block.header, _COMPONENT):  # of older files
        return match[1]
    return ""


def _find_station(text: TextFile, block: Block) -> str:
    """Return the number or code of the station, from the text of the header."""
    for _, match in _search(text, block.header, _STATION):
        code = _CODE.search(match[1]) or match
        words = code[1].split()
        return words[0] if words else ""
    return ""


def _search(
    text: TextFile, indices: Iterable[int], pattern: re.Pattern[str]
) -> Iterator[tuple[int, re.Match[str]]]:
    """Yield those of the lines in which there is the pattern, and the first match on each."""
    for index in indices:
        match = pattern.search(text.heads[index])
        if match:
            yield index, match
