"""Hold a record file with what its caller says about it, and read numbers as Fortran writes them.

What do commas mean? "0,12" is one number or two. With a decimal point anywhere in the data, with a
blank beside a comma, or with two commas in one word, commas separate. With semicolons between the
columns, as spreadsheets of half of Europe write them, they are decimal. Nobody can tell in any
other case.
"""

import hashlib
import math
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ....core.algebra import Array
from ....core.checks import LARGEST, quote
from ....core.errors import InputError
from ..record import UNITS, Record, canonical_units
from .gaps import refuse_fill_values

NUMBER = r"[+-]?(?:(?<![\d.])\d++(?:\.\d*+)?|(?<!\d)\.\d++)(?:[EeDd][+-]?\d++)?"
"""Regular expression of one Fortran or C number: 1, -1., .5, -.123E-02, 1.0D+3.

It begins in no middle of digits, so that a search takes a time that grows as the line does.
"""

HEAD = 1000  # characters of a line in which words of a header are looked for
BYTES = 20 * LARGEST  # of a file: the text of the most numbers that an input may hold
SAME_STEP = 1e-6  # relative difference between time steps that still counts as rounding

_NUMBER = re.compile(NUMBER)
_BETWEEN = re.compile(r"[\s,;]+")
_BETWEEN_DECIMALS = re.compile(r"[\s;]+")
_COMMA_INSIDE = re.compile(r"(?<=\d),(?=\d)")
_EMPTY_CELL = re.compile(r"[,;]\s*+[,;]|^\s*+[,;]")
_LEADING_ZERO = re.compile(r"[EeDd][+-]?0\d")
_END_DATA = re.compile(r"^\s*+\*++\s*+end\s++(?:of\s++)?data\b", re.IGNORECASE)
_EXPONENT = re.compile(r"[EeDd][+-]?(\d++)")

Entries = Mapping[str, tuple[int, str]]  # key of a header -> index of its line, and value


@dataclass(frozen=True, kw_only=True)
class TextFile:
    """Hold a file as it was read, and what the caller of ``read_record`` says about it.

    Attributes:
        path: of the file, as given.
        lines: without their ends.
        sha256: of the bytes.
        units: of the samples, or None.
        dt: time step, or None [s].
        resample_dt: time step that the record is to have, or None [s].
        channel: number or name of the component, or None.
    """

    path: str
    lines: tuple[str, ...]
    sha256: str
    units: str | None
    dt: float | None
    resample_dt: float | None
    channel: int | str | None

    @cached_property
    def heads(self) -> tuple[str, ...]:
        """Return the beginning of every line, for patterns of headers.

        A line of data may be as long as the file.
        """
        return tuple(line[:HEAD] for line in self.lines)

    def at(self, index: int) -> str:
        """Return 'path, line N' of lines[index], counted from 1 as editors do."""
        return f"{self.path}, line {index + 1}"

    def record(
        self,
        samples: Sequence[float] | Array,
        *,
        units: str | None,
        dt: float | None,
        line: int | None = None,
        scale: float = 1.0,
        lines: Sequence[int] | None = None,
        counted: str = "counted, as the header says",
        dt_from: str = "header",
        dt_rounding: float = SAME_STEP,
        **fields: Any,
    ) -> Record:
        """Return the record of ``scale`` times samples.

        Args:
            samples: as the file has them.
            units: that the file states; None if it does not.
            dt: time step that the file states [s]; None if it does not.
            line: index of the line with the units; None if there is none.
            scale: size of a sample in these units.
            lines: index of the line of every sample, where values are looked for that stand for
                missing ones; None for no such search.
            counted: where the number of samples comes from.
            dt_from: where the time step comes from.
            dt_rounding: relative difference to the step of the caller that counts as rounding.
            **fields: title, notes, format, station, component and doubts of the record.

        Raises:
            InputError: what the file and its caller leave open, or state differently.
        """
        place = self.path if line is None else self.at(line)
        name = self._agree_on_units(place, units)
        step = self._agree_on_step(dt, dt_rounding)
        if lines is not None:
            refuse_fill_values(samples, lambda k: self.at(lines[k]))
        stated = "header" if line is None else f"header, line {line + 1}"
        return Record(
            acceleration=UNITS[name] * scale * np.array(samples, dtype=float),
            units=name,
            dt=step,
            source=self.path,
            sha256=self.sha256,
            samples_from=counted,
            units_from="option" if units is None else stated,
            dt_from="option" if dt is None else dt_from,
            **fields,
        )

    def _agree_on_units(self, place: str, units: str | None) -> str:
        """Return the key of the units that the file states or the caller passes.

        Raises InputError where there are none, or both differ.
        """
        spellings = [name for name in (units, self.units) if name is not None]
        names = [canonical_units(place, name) for name in spellings]
        if not names:
            raise InputError(
                f"{place}: the file does not state its units; pass units= as one of "
                f"{', '.join(UNITS)}"
            )
        if UNITS[names[0]] != UNITS[names[-1]]:
            raise InputError(
                f"{place}: the file states its units as {names[0]} but units={self.units!r} was "
                "passed; leave units out or correct the file"
            )
        return names[0]

    def _agree_on_step(self, dt: float | None, rounding: float) -> float:
        """Return the time step that the file states or the caller passes [s].

        Raises InputError where there is none, or both differ by more than the rounding.
        """
        if dt is None:
            if self.dt is None:
                raise InputError(
                    f"{self.path}: the file does not state its time step; pass dt= in seconds"
                )
            return self.dt
        if self.dt is not None and not math.isclose(dt, self.dt, rel_tol=rounding):
            raise InputError(
                f"{self.path}: the file states a time step of {dt:g} s but dt={self.dt!r} was "
                "passed; leave dt out or correct the file"
            )
        return dt

    def choose(self, components: Sequence[str]) -> int:
        """Return which component the caller chose, from 0.

        ``channel`` is its number, from 1, or its name, capitals or not. Raises InputError, which
        lists the components, where none or another one is chosen.
        """
        if self.channel is None and len(components) == 1:
            return 0
        channel = self.channel
        if isinstance(channel, str):
            folded = channel.strip().casefold()
            places = [k for k, name in enumerate(components) if name.casefold() == folded]
            if len(places) == 1:
                return places[0]
            if channel.strip().isdecimal() and len(channel) < 9:
                channel = int(channel)
        numbers = range(1, len(components) + 1)
        if isinstance(channel, int) and not isinstance(channel, bool) and channel in numbers:
            return channel - 1
        names = ", ".join(f"{k}: {name or 'unnamed'}" for k, name in enumerate(components, 1))
        wrong = "" if self.channel is None else f"there is no channel {quote(self.channel)}: "
        count = "1 channel" if len(components) == 1 else f"{len(components)} channels"
        raise InputError(f"{self.path}: {wrong}the file holds {count} ({names}); pass channel=")

    def refuse_other_count(self, index: int, announced: float, count: int) -> None:
        """Raise InputError unless as many samples follow as lines[index] announces.

        Args:
            index: of the line that announces them.
            announced: number of samples.
            count: number of samples that the file has.
        """
        if count != announced:
            raise InputError(
                f"{self.at(index)}: {announced:.12g} samples are announced but {count} follow; get "
                "the complete file"
            )

    def find_filled(self, start: int) -> Sequence[int]:
        """Return the indices of the lines from `start` on that are not blank.

        They go up to a line '*** End data ***'.
        """
        filled_lines = []
        for index in range(start, len(self.lines)):
            if _END_DATA.match(self.heads[index]):
                break
            if self.lines[index].strip():
                filled_lines.append(index)
        return filled_lines

    def series(self, start: int) -> tuple[list[float], list[int]]:
        """Return all values on the lines from `start` on, and the index of the line of each.

        Raises InputError where a row but the last has another length than the first, or the last
        one is longer: a value was lost there, and those after it would be read too early.
        """
        lines = self.find_filled(start)
        rows = list(self.rows(lines))
        self.refuse_uneven_rows(lines, rows)
        self.refuse_misaligned(lines)
        self.refuse_empty_lines(lines, rows)
        return join_rows(lines, rows)

    def refuse_uneven_rows(self, lines: Sequence[int], rows: Sequence[Sequence[float]]) -> None:
        """Raise InputError unless all rows have the length that most have.

        The last one may be shorter.
        """
        lengths = [len(row) for row in rows]
        usual = max(set(lengths), key=lambda length: (lengths.count(length), length), default=0)
        for k, length in enumerate(lengths):
            ends_early = k == len(lengths) - 1 and length < usual
            if length != usual and not ends_early:
                raise InputError(
                    f"{self.at(lines[k])}: the row has {length} values and other rows have "
                    f"{usual}; a value is missing or too many, get the complete file"
                )

    def refuse_empty_lines(self, lines: Sequence[int], rows: Sequence[Sequence[float]]) -> None:
        """Raise InputError for an empty line among values that stand one a line.

        A value is missing there. Empty lines between all of them are line ends that were doubled.
        """
        gaps = []
        for before, after in pairwise(lines):
            if after > before + 1 and not self.lines[before + 1].strip():
                gaps.append(before)
        if gaps and len(gaps) < len(lines) - 1 and all(len(row) == 1 for row in rows):
            raise InputError(
                f"{self.at(gaps[0] + 1)}: the line is empty among values that stand one a line, so "
                "that a value is missing; get the complete file, or take the line out where none is"
            )

    def refuse_misaligned(self, lines: Sequence[int]) -> None:
        """Raise InputError for a row that is shorter than others that are aligned.

        Nine of ten rows then have numbers that end at the same places, and a character was lost. A
        longer row holds a number that is too wide for its columns, or more numbers than others.
        """
        if len(lines) < 5:
            return
        ends = []
        for index in lines:
            matches = _NUMBER.finditer(self.lines[index])
            ends.append(tuple(match.end() for match in matches))
        ((usual, often),) = Counter(ends[:-1]).most_common(1)
        if len(usual) < 2 or often < 0.9 * (len(lines) - 1):
            return
        for index, ends_of_row in zip(lines, ends, strict=True):
            count = len(ends_of_row)
            if not 0 < count <= len(usual):
                continue
            if ends_of_row[-1] < usual[count - 1]:
                raise InputError(
                    f"{self.at(index)}: the row is shorter than the others, whose numbers end at "
                    "the same places, so that a character is missing; get the complete file"
                )

    def rows(self, indices: Sequence[int]) -> Iterator[list[float]]:
        """Return the values on each of these lines, all the data of the file: see ``numbers``."""
        decimal = self._decimal_commas(indices)
        self._refuse_cut_numbers(indices, decimal)
        return (self.numbers(index, decimal) for index in indices)

    def numbers(self, index: int, decimal_commas: bool = False) -> list[float]:
        """Return the values on lines[index].

        They are divided by blanks, commas or semicolons, or by the sign of the next one.

        Raises InputError naming file, line and word for anything else, "1.234.567" included: where
        two unsigned numbers touch nobody can tell where the first one ends. An empty cell between
        two commas is refused too.
        """
        values = []
        if _EMPTY_CELL.search(self.lines[index]):
            raise InputError(
                f"{self.at(index)}: a cell is empty between two separators, so that a value is "
                "missing; get the complete file"
            )
        separator = _BETWEEN_DECIMALS if decimal_commas else _BETWEEN
        for word in separator.split(self.lines[index].strip()):
            written = word.replace(",", ".") if decimal_commas else word
            parts = _NUMBER.findall(written)

            # Numbers that touch have signs, and all of them a point or none: in "1.234-105" the
            # exponent lost its letter. What is no such word is refused as no number.
            complete = "".join(parts) == written
            alike = len({"." in part for part in parts}) <= 1
            signed = all(part[0] in "+-" for part in parts[1:])
            if not (complete and alike and signed):
                parts = [word]
            values += [self.number(index, part) for part in parts]
        return values

    def decimals(self, indices: Sequence[int], column: int) -> int | None:
        """Return the most decimals in a column of numbers, None where some have an exponent."""
        decimal = self._decimal_commas(indices)
        split = _BETWEEN_DECIMALS if decimal else _BETWEEN
        most = None
        for index in indices:
            row = split.split(self.lines[index].strip())
            if len(row) <= column:
                continue
            decimals, has_exponent = _style(row[column])
            if has_exponent:
                return None
            most = decimals if most is None else max(most, decimals)
        return most

    def cut_fields(self, index: int, width: int, offset: int = 0) -> list[float]:
        """Return the values on a line in columns of equal width, which may touch.

        Args:
            index: of the line.
            width: of the columns, in characters.
            offset: where the first column begins.

        Raises:
            InputError: a field that is no number, or that does not end at the end of its columns as
                numbers written by column do: a character was lost or added on the line.
        """
        line = self.lines[index].rstrip()
        values = []
        for begin in range(offset, len(line), width):
            field = line[begin : begin + width]
            where = f" in columns {begin + 1} to {begin + width}"
            values.append(self.number(index, field.strip(), where))
            if len(field) < width or field[-1].isspace():
                raise InputError(
                    f"{self.at(index)}: {quote(field.strip())}{where} does not end where its "
                    "columns do, so that a character is missing or too many on the line; get the "
                    "complete file"
                )
        return values

    def number(self, index: int, word: str, where: str = "") -> float:
        """Return a finite number, also with Fortran's exponent letter D.

        Args:
            index: of the line, for messages.
            word: the number as it is written.
            where: on the line it stands, for messages.

        Raises:
            InputError: a word that is no finite number.
        """
        value = float(word.upper().replace("D", "E")) if _NUMBER.fullmatch(word) else math.nan
        if not math.isfinite(value):
            raise InputError(
                f"{self.at(index)}: {quote(word)}{where} is not a number; correct it or get "
                "another file"
            )
        return value

    def entry(self, header: Entries, key: str) -> tuple[int, str]:
        """Return the line and the value of a header's key.

        Raises InputError where the key is missing or empty.
        """
        line, value = header.get(key, (0, ""))
        if not value:
            raise InputError(f"{self.path}: the header does not give {key}; get the complete file")
        return line, value

    def entry_number(self, header: Entries, key: str) -> float:
        """Return the number after a header's key."""
        line, value = self.entry(header, key)
        return self.number(line, value, f" of {key}")

    def _refuse_cut_numbers(self, indices: Sequence[int], decimal_commas: bool) -> None:
        """Raise InputError where the end of a number was cut off, as far as other numbers tell it.

        That is a number whose exponent has one digit where others have leading zeros ("1.2E-0" for
        "1.2E-02"), and a last number that has fewer decimals, or no exponent, where all the others
        in its column have as many.
        """
        words: list[list[str]] = []
        split = _BETWEEN_DECIMALS if decimal_commas else _BETWEEN
        zeros = any(_LEADING_ZERO.search(self.lines[index]) for index in indices)
        for index in indices:
            line = self.lines[index].strip()
            words.append([word for word in split.split(line) if word])
            for word in words[-1]:
                exponents = _EXPONENT.findall(word)
                if zeros and any(len(digits) == 1 for digits in exponents):
                    raise InputError(
                        f"{self.at(index)}: the exponent of {quote(word)} is shorter than those of "
                        "other numbers; a digit was lost, get the complete file"
                    )

        # The last number of the file, beside those above it.
        if len(words) < 2 or not words[-1]:
            return
        last = words[-1][-1]
        place = len(words[-1]) - 1
        first = 1 if len(words) > 4 else 0  # the first row may be one of a header
        column = [row[place] for row in words[first:-1] if len(row) > place]
        styles = {_style(word) for word in column}
        if len(column) < 3 or len(styles) != 1 or not _NUMBER.fullmatch(last.replace(",", ".")):
            return
        ((decimals, exponent),) = styles
        last_decimals, last_exponent = _style(last)
        if last_decimals < decimals or (exponent and not last_exponent):
            raise InputError(
                f"{self.at(indices[-1])}: the last number {quote(last)} is cut off, others in its "
                f"column have {decimals} decimals{' and an exponent' if exponent else ''}; get the "
                "complete file"
            )

    def _decimal_commas(self, indices: Sequence[int]) -> bool:
        """Tell whether commas in these lines are decimal, and do not separate.

        Raises InputError where it cannot be told.
        """
        inside = None  # the first line with a comma between digits
        points = False
        semicolons = False
        for index in indices:
            line = self.lines[index]
            if inside is None and _COMMA_INSIDE.search(line):
                inside = index
            points = points or "." in line
            semicolons = semicolons or ";" in line
        if inside is None or (points and not semicolons):
            return False

        # Two commas in a word, or one beside a blank: commas separate.
        for index in indices:
            for word in _BETWEEN_DECIMALS.split(self.lines[index]):
                if word.count(",") > 1 or word.strip(",") != word:
                    return False
        if semicolons and not points:
            return True
        raise InputError(
            f"{self.at(inside)}: the comma between digits may be a decimal comma or a separator; "
            "write decimal points, and blanks between the numbers"
        )


def _style(word: str) -> tuple[int, bool]:
    """Return the number of decimals of a number, and whether it has an exponent."""
    written = word.upper().replace(",", ".").replace("D", "E")
    mantissa, letter, _ = written.partition("E")
    _, _, decimals = mantissa.partition(".")
    return len(decimals), bool(letter)


def join_rows(
    lines: Sequence[int], rows: Sequence[Sequence[float]]
) -> tuple[list[float], list[int]]:
    """Return the values of all rows, one after the other, and the index of the line of each."""
    values: list[float] = []
    line_of_value: list[int] = []
    for index, row in zip(lines, rows, strict=True):
        values += row
        line_of_value += [index] * len(row)
    return values, line_of_value


def load_text(path: str | os.PathLike[str], **options: Any) -> TextFile:
    """Read `path` as UTF-8 or, failing that, Latin-1; line ends may be any.

    ``options`` is what the caller says about the file: the other fields of ``TextFile``.

    Raises InputError where the file is missing, unreadable, empty, too large or not text.
    """
    name = os.fspath(path)
    if "\0" in name:
        raise InputError(f"{quote(name)}: a path cannot contain the character NUL; correct it")
    try:
        with open(name, "rb") as file:
            data = file.read(BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"{name}: there is no such file; check the path") from None
    except OSError as error:
        raise InputError(
            f"{name}: cannot be read ({error.strerror}); check that it is a file you may read"
        ) from None
    if len(data) > BYTES:
        raise InputError(f"{name}: the file is larger than {BYTES:.0e} bytes; give one record")
    if not data.strip():
        raise InputError(f"{name}: the file is empty; download or copy it again")
    if b"\0" in data:
        raise InputError(
            f"{name}: this is not a text file; convert MiniSEED and SAC, unpack archives"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    sha256 = hashlib.sha256(data).hexdigest()
    return TextFile(path=name, lines=tuple(lines), sha256=sha256, **options)
