"""Read the numbers of a source: a csv file that says where they come from.

The file begins with lines ``# key: value``, then has the names of its columns and a row for each
value. ``source``, ``version``, ``licence``, ``how`` and ``uncertainty`` are needed, and
``unit of NAME`` for every column; a column of words has the unit ``name``. A dash says that the
source has no value there. A cell without anything, NaN and infinity are refused.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.checks import quote
from ..core.errors import InputError
from ..core.own_files import read_bytes

Row = Mapping[str, Any]  # column -> number or word; None where the source has none

NEEDED = ("source", "version", "licence", "how", "uncertainty")
WORDS = "name"  # the unit of a column of words
NONE = "-"  # a cell for which the source has no value
_UNIT = "unit of "


@dataclass(frozen=True)
class Data:
    """Hold the numbers of a source.

    Attributes:
        path: the file.
        about: key -> value of the lines above the table.
        units: column -> unit, "-" for pure numbers and "name" for words.
        rows: the table; None stands where the source has no value.
        checksum: sha256 of the text of the file, with line ends of one character.
    """

    path: Path
    about: Mapping[str, str]
    units: Mapping[str, str]
    rows: Sequence[Row]
    checksum: str


def read_data(path: str | Path) -> Data:
    """Read a csv file of a source.

    Raises:
        InputError: a file that is missing or no text, without a source, with a column that has no
            unit, or with a value that is missing or no finite number.
    """
    path = Path(path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise InputError(f"'{path}' is missing: put the data of the entry there") from error
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is no text in UTF-8: save it as one") from error
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    about = _read_header(path, comments)
    table = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    if len(table) < 2:
        raise InputError(f"'{path}' has no values: give a line of names and a line for each value")

    names = [name.strip() for name in table[0]]
    units = {name: about.get(f"{_UNIT}{name}", "") for name in names}
    for name, unit in units.items():
        if not unit:
            raise InputError(f"'{path}': column '{name}' has no unit: add '# {_UNIT}{name}: …'")
    if len(units) < len(names):
        raise InputError(f"'{path}' has two columns of one name: give each its own")
    rows = [_read_row(path, number, cells, units) for number, cells in enumerate(table[1:], 1)]
    return Data(path, about, units, tuple(rows), sha256("\n".join(lines).encode()).hexdigest())


def _read_header(path: Path, comments: Sequence[str]) -> dict[str, str]:
    """Return key -> value of the lines that begin with #; a line without a key goes on."""
    about: dict[str, str] = {}
    last = ""
    for line in comments:
        key, colon, value = line.lstrip("#").strip().partition(": ")
        if colon and (key in NEEDED or key.startswith(_UNIT) or not last):
            last = key
            about[key] = value.strip()
        elif last:
            about[last] += f" {line.lstrip('#').strip()}"
    for key in NEEDED:
        if not about.get(key):
            raise InputError(f"'{path}' does not say its {key}: add a line '# {key}: …'")
    return about


def _read_row(path: Path, number: int, cells: Sequence[str], units: Mapping[str, str]) -> Row:
    """Return a row of the table.

    Args:
        path: the file, for sentences.
        number: of the row, counted from 1.
        cells: its texts.
        units: column -> unit, in the order of the columns.
    """
    if len(cells) != len(units):
        raise InputError(
            f"'{path}': row {number} has {len(cells)} values for {len(units)} columns: give one "
            "for each"
        )
    row: dict[str, Any] = {}
    for (name, unit), cell in zip(units.items(), cells, strict=True):
        text = cell.strip()
        if not text:
            raise InputError(
                f"'{path}': row {number} has no value of {name}: give it, or '{NONE}' where the "
                "source has none"
            )
        if text == NONE:
            row[name] = None
        elif unit == WORDS:
            row[name] = text
        else:
            row[name] = _read_number(path, number, name, text)
    return row


def _read_number(path: Path, number: int, name: str, text: str) -> float:
    """Return a finite number; InputError names file, row and column."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"'{path}': row {number} has {name} = {quote(text)}: give a finite number")
    return value
