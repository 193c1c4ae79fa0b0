"""Hold the lines of a record file, and read numbers as Fortran writes them."""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from ...core.checks import LARGEST, shown
from ...core.errors import InputError
from .commas import Commas, commas_of

NUMBER = r"[+-]?(?:(?<![\d.])\d++(?:\.\d*+)?|(?<!\d)\.\d++)(?:[EeDd][+-]?\d++)?"
"""Regular expression of one Fortran or C number: 1, -1., .5, -.123E-02, 1.0D+3. It begins in no middle of digits, so
that a search takes a time that grows as the line does."""

HEAD = 1000  # characters of a line in which words of a header are looked for
BYTES = 20 * LARGEST  # of a file: the text of the most numbers that an input may hold

_NUMBER = re.compile(NUMBER)
_BETWEEN = re.compile(r"[\s,;]+")
_BETWEEN_DECIMALS = re.compile(r"[\s;]+")


@dataclass(frozen=True)
class TextFile:
    """Describe a file as read: its path as the caller gave it, its lines without ends, the sha256 of its bytes."""

    path: str
    lines: tuple[str, ...]
    sha256: str

    @cached_property
    def heads(self) -> tuple[str, ...]:
        """Return the beginning of every line, for patterns of headers: a line of data may be as long as the file."""
        return tuple(line[:HEAD] for line in self.lines)

    def at(self, index: int) -> str:
        """Return 'path, line N' of lines[index], counted from 1 as editors do."""
        return f"{self.path}, line {index + 1}"

    def rows(self, indices: Sequence[int]) -> Iterator[list[float]]:
        """Return the values on each of these lines, all the data of the file: see ``numbers`` and ``commas_of``."""
        commas = commas_of([self.lines[index] for index in indices], lambda k: self.at(indices[k]))
        return (self.numbers(index, commas) for index in indices)

    def numbers(self, index: int, commas: Commas = Commas.SEPARATE) -> list[float]:
        """Return the values on lines[index], divided by blanks, commas or semicolons, or by the sign of the next.

        Raises InputError naming file, line and word for anything else, "1.234.567" included: where two unsigned
        numbers touch nobody can tell where the first one ends.
        """
        between = _BETWEEN if commas is Commas.SEPARATE else _BETWEEN_DECIMALS
        values = []
        for word in between.split(self.lines[index].strip()):
            written = word if commas is Commas.SEPARATE else word.replace(",", ".")
            parts = _NUMBER.findall(written)
            if "".join(parts) != written or any(part[0] not in "+-" for part in parts[1:]):
                raise InputError(f"{self.at(index)}: {shown(word)} is not a number; correct or remove it")
            values += [stated_number(self, index, part) for part in parts]
        return values

    def fixed(self, index: int, width: int) -> list[float]:
        """Return the values on lines[index] in columns of `width` characters, which may touch.

        Raises InputError naming file, line, columns and word for anything that is not a number.
        """
        line = self.lines[index].rstrip()
        values = []
        for left in range(0, len(line), width):
            word = line[left:left + width].strip()
            try:
                values.append(to_float(word))
            except ValueError:
                raise InputError(f"{self.at(index)}: {shown(word)} in columns {left + 1} to {left + width} is not a "
                                 "number; correct it or get the file again") from None
        return values


def to_float(number: str) -> float:
    """Read a float, also with Fortran's exponent letter D; ValueError for anything else, NaN and infinity too."""
    if not _NUMBER.fullmatch(number):
        raise ValueError(number)
    found = float(number.upper().replace("D", "E"))
    if not math.isfinite(found):
        raise ValueError(number)
    return found


def stated_count(text: TextFile, index: int, digits: str) -> int:
    """Return the whole number of these digits; InputError where there are too many to count samples with."""
    if len(digits) > 12:
        raise InputError(f"{text.at(index)}: a count of {shown(digits)} is too large; get the file again")
    return int(digits)


def stated_number(text: TextFile, index: int, word: str) -> float:
    """Return the number that a header states; InputError where it is too large for one."""
    try:
        return to_float(word)
    except ValueError:
        raise InputError(f"{text.at(index)}: {shown(word)} is no number; get the file again") from None


def header_number(text: TextFile, header: dict[str, tuple[int, str]], key: str) -> float:
    """Return the number after a key of the header."""
    if key not in header:
        raise InputError(f"{text.path}: the header does not give {key}; get the complete file")
    index, value = header[key]
    try:
        return to_float(value)
    except ValueError:
        raise InputError(f"{text.at(index)}: {key} is {value!r}, not a number; get the file again") from None


def filled_lines(text: TextFile, start: int) -> Sequence[int]:
    """Return the indices of the lines from `start` on that are not blank."""
    return [index for index in range(start, len(text.lines)) if text.lines[index].strip()]


def load_text(path: str | os.PathLike[str]) -> TextFile:
    """Read `path` as UTF-8 or, failing that, Latin-1, with any line ends.

    Raises InputError when the file is missing, unreadable, empty, too large or not text.
    """
    name = os.fspath(path)
    if "\0" in name:
        raise InputError(f"{shown(name)}: no path holds the character NUL; correct it")
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
    return TextFile(path=name, lines=tuple(lines), sha256=hashlib.sha256(data).hexdigest())
