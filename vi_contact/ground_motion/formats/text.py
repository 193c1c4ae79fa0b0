"""Hold a record file with what its caller says about it, and read numbers as Fortran writes them.

What do commas mean? "0,12" is one number or two. With a decimal point anywhere in the data, with a blank beside a
comma, or with two commas in one word, commas separate. With semicolons between the columns, as spreadsheets of half of
Europe write them, they are decimal. Nobody can tell in any other case."""

import hashlib
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.checks import LARGEST, shown
from ...core.errors import InputError
from ..record import UNITS, Record, canonical_units

NUMBER = r"[+-]?(?:(?<![\d.])\d++(?:\.\d*+)?|(?<!\d)\.\d++)(?:[EeDd][+-]?\d++)?"
"""Regular expression of one Fortran or C number: 1, -1., .5, -.123E-02, 1.0D+3. It begins in no middle of digits, so
that a search takes a time that grows as the line does."""

HEAD = 1000  # characters of a line in which words of a header are looked for
BYTES = 20 * LARGEST  # of a file: the text of the most numbers that an input may hold
SAME_STEP = 1e-6  # relative difference between time steps that still counts as rounding

_NUMBER = re.compile(NUMBER)
_BETWEEN = re.compile(r"[\s,;]+")
_BETWEEN_DECIMALS = re.compile(r"[\s;]+")
_COMMA_INSIDE = re.compile(r"(?<=\d),(?=\d)")

Entries = Mapping[str, tuple[int, str]]  # key of a header -> index of its line, and value


@dataclass(frozen=True, kw_only=True)
class TextFile:
    """Hold a file as read: path as given, lines without ends, sha256 of its bytes; and what ``read_record`` is told."""

    path: str
    lines: tuple[str, ...]
    sha256: str
    units: str | None
    dt: float | None
    resample_dt: float | None
    channel: int | None

    @cached_property
    def heads(self) -> tuple[str, ...]:
        """Return the beginning of every line, for patterns of headers: a line of data may be as long as the file."""
        return tuple(line[:HEAD] for line in self.lines)

    def at(self, index: int) -> str:
        """Return 'path, line N' of lines[index], counted from 1 as editors do."""
        return f"{self.path}, line {index + 1}"

    def record(self, samples: Sequence[float] | Array, *, units: str | None, dt: float | None, line: int | None = None,
               scale: float = 1.0, **told: Any) -> Record:
        """Return the record of ``scale`` times samples, with the units and time step [s] that the file states.

        None: it does not state them. line: index of the one with the units. told: title, notes, format, station,
        component. Raises InputError for what the file and its caller leave open, or state differently."""
        place = self.path if line is None else self.at(line)
        names = [canonical_units(place, one) for one in (units, self.units) if one is not None]
        step = self.dt if dt is None else dt
        if not names:
            raise InputError(f"{place}: the file does not state its units; pass units= as one of {', '.join(UNITS)}")
        if UNITS[names[0]] != UNITS[names[-1]]:
            raise InputError(f"{place}: the file states its units as {names[0]} but units={self.units!r} was passed; "
                             "leave units out or correct the file")
        if step is None:
            raise InputError(f"{self.path}: the file does not state its time step; pass dt= in seconds")
        if dt is not None and self.dt is not None and not math.isclose(dt, self.dt, rel_tol=SAME_STEP):
            raise InputError(f"{self.path}: the file states a time step of {step:g} s but dt={self.dt!r} was passed; "
                             "leave dt out or correct the file")
        return Record(acceleration=UNITS[names[0]] * scale * np.array(samples, dtype=float), units=names[0], dt=step,
                      source=self.path, sha256=self.sha256, **told)

    def chosen(self, components: Sequence[str]) -> int:
        """Return which component the caller chose, from 0; InputError that lists them where none or another one is."""
        if self.channel is None and len(components) == 1:
            return 0
        if self.channel in range(1, len(components) + 1):
            return int(self.channel or 1) - 1
        names = ", ".join(f"{k}: {name or 'unnamed'}" for k, name in enumerate(components, 1))
        wrong = "" if self.channel is None else f"there is no channel {self.channel}: "
        count = "1 channel" if len(components) == 1 else f"{len(components)} channels"
        raise InputError(f"{self.path}: {wrong}the file holds {count} ({names}); pass channel=")

    def refuse_other_count(self, index: int, announced: float, found: int) -> None:
        """Raise InputError unless as many samples were found as lines[index] announces."""
        if found != announced:
            raise InputError(f"{self.at(index)}: {announced:.12g} samples are announced but {found} follow; get the "
                             "complete file")

    def filled(self, start: int) -> Sequence[int]:
        """Return the indices of the lines from `start` on that are not blank."""
        return [index for index in range(start, len(self.lines)) if self.lines[index].strip()]

    def values(self, start: int) -> list[float]:
        """Return all values on the lines from `start` on."""
        return [value for row in self.rows(self.filled(start)) for value in row]

    def rows(self, indices: Sequence[int]) -> Iterator[list[float]]:
        """Return the values on each of these lines, all the data of the file: see ``numbers``."""
        decimal = self._decimal_commas(indices)
        return (self.numbers(index, decimal) for index in indices)

    def numbers(self, index: int, decimal_commas: bool = False) -> list[float]:
        """Return the values on lines[index], divided by blanks, commas or semicolons, or by the sign of the next.

        Raises InputError naming file, line and word for anything else, "1.234.567" included: where two unsigned
        numbers touch nobody can tell where the first one ends."""
        values = []
        for word in (_BETWEEN_DECIMALS if decimal_commas else _BETWEEN).split(self.lines[index].strip()):
            written = word.replace(",", ".") if decimal_commas else word
            parts = _NUMBER.findall(written)
            if "".join(parts) != written or any(part[0] not in "+-" for part in parts[1:]):
                parts = [word]  # which is no number, and is refused as one
            values += [self.number(index, part) for part in parts]
        return values

    def fixed(self, index: int, width: int) -> list[float]:
        """Return the values on lines[index] in columns of `width` characters, which may touch."""
        line = self.lines[index].rstrip()
        return [self.number(index, line[left:left + width].strip(), f" in columns {left + 1} to {left + width}")
                for left in range(0, len(line), width)]

    def number(self, index: int, word: str, where: str = "") -> float:
        """Return a finite number, also with Fortran's exponent letter D; InputError naming file, line and word."""
        found = float(word.upper().replace("D", "E")) if _NUMBER.fullmatch(word) else math.nan
        if not math.isfinite(found):
            raise InputError(f"{self.at(index)}: {shown(word)}{where} is not a number; correct it or get another file")
        return found

    def entry(self, header: Entries, key: str) -> tuple[int, str]:
        """Return the line and the value of a header's key; InputError where it is missing or empty."""
        if not header.get(key, (0, ""))[1]:
            raise InputError(f"{self.path}: the header does not give {key}; get the complete file")
        return header[key]

    def entry_number(self, header: Entries, key: str) -> float:
        """Return the number after a header's key."""
        return self.number(*self.entry(header, key), f" of {key}")

    def _decimal_commas(self, indices: Sequence[int]) -> bool:
        """Tell whether commas in these lines are decimal, and do not separate; InputError where it cannot be told."""
        data = [self.lines[index] for index in indices]
        inside = next((index for index, line in zip(indices, data, strict=True) if _COMMA_INSIDE.search(line)), None)
        points, semicolons = (any(sign in line for line in data) for sign in ".;")
        if inside is None or points and not semicolons:
            return False
        words = (word for line in data for word in _BETWEEN_DECIMALS.split(line))
        if any(word.count(",") > 1 or word.strip(",") != word for word in words):
            return False
        if semicolons and not points:
            return True
        raise InputError(f"{self.at(inside)}: the comma between digits may be a decimal comma or a separator; write "
                         "decimal points, and blanks between the numbers")


def load_text(path: str | os.PathLike[str], **said: Any) -> TextFile:
    """Read `path` as UTF-8 or, failing that, Latin-1, with any line ends; said: what the caller says about it.

    Raises InputError when the file is missing, unreadable, empty, too large or not text."""
    name = os.fspath(path)
    if "\0" in name:
        raise InputError(f"{shown(name)}: a path cannot contain the character NUL; correct it")
    try:
        with open(name, "rb") as file:
            data = file.read(BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"{name}: there is no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror}); check that it is a file you may read") from None
    if len(data) > BYTES:
        raise InputError(f"{name}: the file is larger than {BYTES:.0e} bytes; give one record")
    if not data.strip():
        raise InputError(f"{name}: the file is empty; download or copy it again")
    if b"\0" in data:
        raise InputError(f"{name}: this is not a text file; convert MiniSEED and SAC, unpack archives")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return TextFile(path=name, lines=tuple(lines), sha256=hashlib.sha256(data).hexdigest(), **said)
