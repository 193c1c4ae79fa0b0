"""Read a selection of records, as programs that select them write it: a table with a header.

The columns are found by their names, in capitals or not, with blanks or with underscores:

- files: file, filename, filename_1 and filename_2, h1 and h2 and v, or those of PEER,
  "Horizontal-1 Acc. Filename" and the like; or rsn ("Record Sequence Number"), whose files are
  looked for by PEER's names, RSN123_….AT2;
- a factor: sf, scale, scale_factor or scaling_factor, 1 where there is none.

Lines before the header that begin with # are passed over, as those of OpenQuake.
"""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ....core.errors import InputError

_FILES = (
    ("file", "filename", "filename_1", "file_1", "h1", "horizontal_1_acc_filename"),
    ("filename_2", "file_2", "h2", "horizontal_2_acc_filename"),
    ("filename_3", "file_3", "v", "vertical", "vertical_acc_filename"),
)
_NUMBER = ("rsn", "record_sequence_number")
_FACTOR = ("sf", "scale", "scale_factor", "scaling_factor")


@dataclass(frozen=True)
class Selected:
    """Hold a record of a selection.

    Attributes:
        files: of its components, in the order of the columns.
        factor: on all of them.
    """

    files: tuple[Path, ...]
    factor: float


def read_selection(path: str | Path) -> list[Selected]:
    """Read a table of records and their factors.

    Args:
        path: the table; files are relative to its folder.

    Raises:
        InputError: names the line and what is wrong with it.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(f"selection '{path}' cannot be read ({error})") from None
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    if len(numbered) < 2:
        raise InputError(f"selection '{path}' has no header with records below: give both")
    rows = list(csv.reader(line for _, line in numbered))
    names = [_simplify(name) for name in rows[0]]
    records = []
    for (number, _), row in zip(numbered[1:], rows[1:], strict=True):
        values = dict(zip(names, (value.strip() for value in row), strict=False))
        place = f"selection '{path}', line {number}"
        records.append(
            Selected(_find_files(place, path.parent, values), _read_factor(place, values))
        )
    return records


def _simplify(name: str) -> str:
    """Return the name of a column in small letters, its words joined by underscores."""
    return "_".join(re.findall(r"[a-z0-9]+", name.lower()))


def _find_files(place: str, folder: Path, values: dict[str, str]) -> tuple[Path, ...]:
    """Return the files of a record.

    Args:
        place: for sentences.
        folder: where they are.
        values: of its row, by column.
    """
    named = [_take(values, names) for names in _FILES]
    files = tuple(folder / name for name in named if name)
    if files:
        return files
    number = _take(values, _NUMBER)
    if not number:
        raise InputError(
            f"{place}: there is no column of files; call it filename_1, h1 or "
            "'Horizontal-1 Acc. Filename', or give rsn"
        )
    # PEER names the files of a record by its number; the vertical one ends in UP, V or DWN.
    digits = number.removesuffix(".0")
    begin = f"rsn{digits}_"
    names = [one.name for one in folder.iterdir() if one.name.lower().startswith(begin)]
    found = sorted(folder / name for name in names if name.lower().endswith(".at2"))
    if not found:
        raise InputError(f"{place}: there is no file RSN{digits}_….AT2 in '{folder}'")
    return tuple(sorted(found, key=_is_vertical))


def _is_vertical(path: Path) -> bool:
    """Return whether PEER's name of a file ends as those of vertical components."""
    return path.stem.lower().endswith(("up", "dwn", "-v", "_v", "ver"))


def _read_factor(place: str, values: dict[str, str]) -> float:
    """Return the factor of a record, 1 without one."""
    text = _take(values, _FACTOR)
    if not text:
        return 1.0
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 0.0 < factor < math.inf:
        raise InputError(f"{place}: the factor is '{text}'; give a positive number")
    return factor


def _take(values: dict[str, str], names: Sequence[str]) -> str:
    """Return the first of these columns that has something, "" without any."""
    return next((values[name] for name in names if values.get(name)), "")
