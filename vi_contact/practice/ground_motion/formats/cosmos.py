"""Read COSMOS and CSMIP files (.V1, .V2, .V2c).

They have one or more channels, each with text, numbers and blocks of samples.

A block begins with a line that states its number of points, quantity, units and Fortran format,
such as "7500 points of accel data equally spaced at .010 sec, in cm/sec2. (8f10.6)" (CSMIP) or
"12091 acceleration pts, approx 120 secs, units=cm/sec2(04),Format=(8F10.5)" (COSMOS), the time step
of the latter being real number 34 of its header. Without a stated format it is (8F10.3). Samples
are cut by column, for they may touch. Velocities and displacements are skipped.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ....core.errors import InputError
from ..record import Record, known_units
from .statements import agree
from .text import NUMBER, TextFile

STEP = 33  # place of the time step among the real header values of COSMOS, from 0

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
    """Describe samples announced on lines[line].

    There are `count` of them, `per_line` a line, `width` wide; ``header`` has its lines.
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
    """Tell whether one of the first lines announces a block of samples.

    It does so with its format or its step.
    """
    lines = [
        (index, line) for index, line in enumerate(text.heads[:400]) if "header" not in line.lower()
    ]
    return any(
        _announced(text, index) and (_FORMAT.search(line) or _SPACED.search(line))
        for index, line in lines
    )


def read(text: TextFile) -> Record:
    """Return the record of one channel.

    ``channel`` is 1 for the first of the file, required where it holds several.
    """
    blocks = _blocks(text)
    if not blocks:
        raise InputError(
            f"{text.at(0)}: no block of accelerations follows, which a line such as '7500 points "
            "of accel data equally spaced at .010 sec, in cm/sec2. (8f10.6)' begins; other layouts "
            "are not read, write columns of time and acceleration"
        )
    block = blocks[text.choose([_component(text, block) for block in blocks])]
    line = text.heads[block.line]
    if _UNEVEN.search(line):
        raise InputError(
            f"{text.at(block.line)}: the samples are unequally spaced; get the corrected file (V2)"
        )
    stated = next((match[1] for pattern in _UNITS if (match := pattern.search(line))), None)
    words, comments = _words(text, block)
    cosmos = "format v" in text.heads[0].lower()
    event = next(filter(_EVENT.match, words), " ".join(words[1:2] if cosmos else words[2:3]))
    samples, lines = _samples(text, block)
    place = block.line
    if stated is None and (peak := _peak_units(text, block, samples)) is not None:
        place, stated = peak
    return text.record(
        samples,
        lines=lines,
        units=stated,
        dt=_step(text, block),
        line=place,
        title=event,
        format="COSMOS" if cosmos else "CSMIP",
        notes=(*words, *comments),
        station=_station(text, block),
        component=_component(text, block),
    )


def _blocks(text: TextFile) -> list[Block]:
    """Return the blocks of accelerations.

    Blocks of other quantities belong to the channel before them.
    """
    found, index, start = [], 0, 0
    while index < len(text.lines):
        announced = _announced(text, index)
        form = _FORMAT.search(text.heads[index]) if announced else None
        if announced and (form or _SPACED.search(text.heads[index])):
            count, quantity = announced
            per_line, width = (
                (int(text.number(index, part or "1")) for part in form.groups())
                if form
                else (8, 10)
            )
            block = Block(index, range(start, index), count, max(per_line, 1), max(width, 1))
            if quantity == "acc":
                found.append(block)
            index = start = block.end
        elif _END.match(text.heads[index]):
            index = start = index + 1
        else:
            index += 1
    return found


def _announced(text: TextFile, index: int) -> tuple[int, str] | None:
    """Return the number of points and quantity ("acc", "vel", "dis") of a line.

    The line begins a block; another one gives None.
    """
    line = text.heads[index]
    count = _COUNT.match(line)
    quantity = _QUANTITY.search(line, count.end()) if count else None
    if count is None or quantity is None or not _SAMPLES.search(line, quantity.end()):
        return None
    return int(text.number(index, count[1])), quantity[1].lower()


def _words(text: TextFile, block: Block) -> tuple[list[str], list[str]]:
    """Return the text of a channel's header, and its comments.

    The text ends where numbers begin; blanks are squeezed.
    """
    header = [" ".join(text.heads[index].split()) for index in block.header]
    numbers = (
        k for k, entry in enumerate(header) if _NUMBERS.fullmatch(entry) or "header values" in entry
    )
    comments = [entry.lstrip("| ") for entry in header if entry.startswith("|")]
    return [entry for entry in header[: next(numbers, len(header))] if entry], [
        entry for entry in comments if entry
    ]


def _samples(text: TextFile, block: Block) -> tuple[list[float], list[int]]:
    """Return the samples in the file's units, and the index of the line of each."""
    unknown = next(
        (text.number(index, mark[1]) for index, mark in _found(text, block.header, _UNKNOWN)), None
    )
    values: list[float] = []
    lines: list[int] = []
    for index in range(block.line + 1, block.end):
        line = text.lines[index].rstrip() if index < len(text.lines) else ""
        fields, wanted = (
            -(-len(line) // block.width),
            min(block.per_line, block.count - len(values)),
        )
        if fields != wanted:
            raise InputError(
                f"{text.at(block.line)}: {block.count:.12g} samples are announced but line "
                f"{index + 1} holds {fields} of them instead of {wanted:g}; get the complete file"
            )
        row = text.cut_fields(index, block.width)
        if unknown in row:
            raise InputError(
                f"{text.at(index)}: a sample is marked as unknown ({unknown:g}); use another record"
            )
        values += row
        lines += [index] * len(row)
    after = text.lines[block.end] if block.end < len(text.lines) else ""
    if (
        after.strip()
        and not _VALUE.sub("", after).strip()
        and len(after.rstrip()) % block.width == 0
    ):
        raise InputError(
            f"{text.at(block.line)}: {block.count:.12g} samples are announced but line "
            f"{block.end + 1} holds more of them; get the complete file"
        )
    return values, lines


def _step(text: TextFile, block: Block) -> float | None:
    """Return the time step stated with the samples.

    It stands in the text of the header or among its real numbers.
    """
    rate = _RATE.search(text.heads[block.line])
    if rate and text.number(block.line, rate[1]) > 0.0:
        return 1.0 / text.number(block.line, rate[1])
    found = [
        (index, text.number(index, spaced[1]))
        for index, spaced in _found(text, (block.line, *block.header), _SPACED)
    ]
    for index, reals in _found(text, block.header, _REALS) if not found else ():
        if form := _FORMAT.search(text.heads[index]):
            rows = range(index + 1, min(index + 1 + int(text.number(index, reals[2])), block.line))
            width = max(int(text.number(index, form[2])), 1)
            values = [value for row in rows for value in text.cut_fields(row, width)]
            return values[STEP] if len(values) > STEP and values[STEP] > 0.0 else None
    stated = agree(text, "the time step", found)
    return stated[1] if stated else None


def _peak_units(text: TextFile, block: Block, samples: list[float]) -> tuple[int, str] | None:
    """Return the line and the units of the peak that the header states.

    They are those of a header where the samples have that peak.
    """
    for index, match in _found(text, block.header, _PEAK):
        peak, found = abs(text.number(index, match[1])), max(map(abs, samples))
        if known_units(match[2]) is not None and abs(found - peak) <= 1e-3 * peak:
            return index, match[2]
    return None


def _component(text: TextFile, block: Block) -> str:
    """Return the direction of the channel, such as "90 Deg" or "UP".

    It comes from the text of its header.
    """
    named = (
        _FROM.split(match[2], maxsplit=1)[0].split()
        for _, match in _found(text, block.header, _CHANNEL)
    )
    older = (match[1] for _, match in _found(text, block.header, _COMPONENT))
    return " ".join(next(filter(None, named), [])) or next(older, "")


def _station(text: TextFile, block: Block) -> str:
    """Return the number or code of the station, from the text of the header."""
    named = next((match for _, match in _found(text, block.header, _STATION)), None)
    return next(iter((_CODE.search(named[1]) or named)[1].split()), "") if named else ""


def _found(
    text: TextFile, indices: Iterable[int], pattern: re.Pattern[str]
) -> Iterator[tuple[int, re.Match[str]]]:
    """Yield those of the lines in which there is the pattern."""
    return ((index, match) for index in indices if (match := pattern.search(text.heads[index])))
