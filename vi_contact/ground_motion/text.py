"""The lines of a record file, and numbers as Fortran writes them."""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass

from ..errors import InputError

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?"
"""Regular expression of one Fortran or C number: 1, -1., .5, -.123E-02, 1.0D+3."""

_NUMBER = re.compile(NUMBER)


@dataclass(frozen=True)
class TextFile:
    """A file as read: its path as given by the caller, its lines without line ends, the sha256 of its bytes."""

    path: str
    lines: tuple[str, ...]
    sha256: str

    def at(self, index: int) -> str:
        """'path, line N' of lines[index], counted from 1 as editors do."""
        return f"{self.path}, line {index + 1}"

    def numbers(self, index: int) -> list[float]:
        """Values on lines[index], separated by blanks, commas or semicolons, or touching where the next has a sign.

        Raises InputError naming file, line and word for anything else, "1.234.567" included: where two unsigned
        numbers touch nobody can tell where the first one ends.
        """
        values = []
        for word in re.split(r"[\s,;]+", self.lines[index].strip()):
            parts = _NUMBER.findall(word)
            if "".join(parts) != word or any(part[0] not in "+-" for part in parts[1:]):
                raise InputError(f"{self.at(index)}: {word!r} is not a number; correct or remove it")
            values += [to_float(part) for part in parts]
        return values

    def fixed(self, index: int, width: int) -> list[float]:
        """Values on lines[index] in columns of `width` characters, which may touch; trailing blanks are ignored.

        Raises InputError naming file, line, columns and word for anything that is not a number.
        """
        line = self.lines[index].rstrip()
        values = []
        for left in range(0, len(line), width):
            word = line[left:left + width].strip()
            try:
                values.append(to_float(word))
            except ValueError:
                raise InputError(f"{self.at(index)}: {word!r} in columns {left + 1} to {left + width} is not a number; "
                                 "correct it or get the file again") from None
        return values


def to_float(number: str) -> float:
    """float() that also reads the exponent letter D of Fortran, and no NaN; ValueError for anything else."""
    if not _NUMBER.fullmatch(number):
        raise ValueError(number)
    return float(number.upper().replace("D", "E"))


def load_text(path: str | os.PathLike[str]) -> TextFile:
    """Read `path` as UTF-8 or, failing that, Latin-1, with any line ends.

    Raises InputError when the file is missing, unreadable, empty or not text.
    """
    name = os.fspath(path)
    try:
        with open(name, "rb") as file:
            data = file.read()
    except FileNotFoundError:
        raise InputError(f"{name}: there is no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror}); check that it is a file you may read") from None
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
