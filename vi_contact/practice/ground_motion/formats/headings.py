"""Read the heading over columns: what each column is, in which unit, and what it is called.

A heading has a cell for each column, between commas, semicolons, tabs, wide gaps, brackets or
blanks, and is the last line before the numbers: "Time [s],Acceleration [g],Velocity [m/s]". Names
and units may stand on a line each.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..record import known_units
from .statements import TIME_UNITS
from .text import TextFile

_MARKS = "#%!;/*'\" \t"  # before a heading
_SPLITS = (
    re.compile(r"[,;\t|]"),
    re.compile(r"\s{2,}+"),
    re.compile(r"(?<=[)\]])\s*+(?=\S)"),
    re.compile(r"\s++"),
)
_UNIT_BEHIND = re.compile(r"[\[(]\s*+([^\[\]()]*+(?:\([^()]*+\))?+)\s*+[\])]\s*+$")
_UNIT_WORD = re.compile(r"^(.*?)(?:[\s_]+(?:in[\s_]+)?|/)(\S+)$")
_KINDS = (
    ("time", re.compile(r"^(?:t|tiempo|temps|zeit|tempo|elapsed|seconds|.*\btimes?)$", re.I)),
    ("acceleration", re.compile(r"\bac(?:c|c?[eé]l)|^(?:a|ag|a_g)$|beschleunig", re.I)),
    ("velocity", re.compile(r"\b(?:vel(?:oc\w*+)?|vitesse)\b", re.I)),
    ("displacement", re.compile(r"\b(?:dis|disp\w*+|desplaz\w*+|spostam\w*+)\b", re.I)),
    (
        "number",
        re.compile(r"^(?:no\.?|nr\.?|n|#|index|idx|samples?|step|i|points?|k|row|id)$", re.I),
    ),
)
_COMPONENT = re.compile(
    r"^[+-]?(?:n-?s|e-?w|u-?d|[nsewzudvxyhlrt]\d?|up|down|north|south|east|west|vert\w*+|long\w*+|"
    r"trans\w*+|radial|comp\w*+|chan\w*+|ch\d++|h[nlh][nezxyr123]|[ns]\d++[ew])$",
    re.I,
)
_VELOCITIES = {"m/s", "cm/s", "mm/s", "in/s", "ft/s", "km/s", "km/h", "kine"}
_LENGTHS = {"m", "cm", "mm", "in", "ft", "um", "inch"}
_COUNTS = {"count", "counts", "digit", "digits", "v", "mv", "volt", "volts", "raw"}


@dataclass(frozen=True)
class Column:
    """Describe a column.

    It has its name, its kind ("time", "acceleration", "velocity", "displacement", "counts",
    "number", or "" where the heading does not tell), and its unit, or None; ``line`` is the index
    of the heading.
    """

    name: str
    kind: str
    unit: str | None
    line: int


def column_heading(text: TextFile, header: Sequence[int], width: int) -> list[Column] | None:
    """Return the columns that the last line of the header names.

    It is None where that is no heading of `width` columns.
    """
    lines = [index for index in header if text.heads[index].strip(_MARKS + "-=+_")]
    if width < 2 or not lines:
        return None
    found = _cells(text.heads[lines[-1]], width)
    if found is None:
        return None
    units = [_kind_of_unit(cell.strip("()[] ")) for cell in found]
    if (
        len(lines) > 1
        and all(units)
        and (names := _cells(text.heads[lines[-2]], width)) is not None
    ):
        return [
            _column(f"{name} [{cell.strip('()[] ')}]", lines[-1])
            for name, cell in zip(names, found, strict=True)
        ]
    columns = [_column(cell, lines[-1]) for cell in found]
    # beside "t" small letters are quantities, and "V" is vertical
    if any(one.name == "t" for one in columns):
        letters = {"v": "velocity", "d": "displacement"}
        columns = [replace(one, kind=one.kind or letters.get(one.name, "")) for one in columns]
    known = [bool(one.kind) or _COMPONENT.match(one.name) is not None for one in columns]
    # a word for each column: may be a title
    sentence = len(text.heads[lines[-1]].strip(_MARKS).split()) == width
    return columns if all(known) or any(known) and not sentence else None


def _cells(line: str, width: int) -> list[str] | None:
    """Return the cells of a line if it can be split into `width` of them."""
    line = line.strip().strip(_MARKS).rstrip(",;")
    for split in _SPLITS:
        cells = [cell.strip("'\" ") for cell in split.split(line)]
        if (
            len(cells) == width
            and all(cells)
            and any(re.match(r"[^\W\d_]", cell.lstrip("([")) for cell in cells)
        ):
            return cells
    return None


def _column(cell: str, line: int) -> Column:
    """Return what one cell says."""
    if match := _UNIT_BEHIND.search(cell):
        name, unit = cell[: match.start()].rstrip(" _"), match[1].strip()
    else:
        word = _UNIT_WORD.match(cell)
        name, unit = (
            (word[1], word[2]) if word and word[1] and _kind_of_unit(word[2]) else (cell, None)
        )
    by_unit = _kind_of_unit(unit) if unit else ""
    by_name = next((kind for kind, pattern in _KINDS if pattern.search(name.strip(" .:"))), "")
    if by_name == "time" and by_unit not in ("time", ""):
        by_name = ""
    if by_name == "acceleration" and unit:
        # a unit of something else is refused with its place
        return Column(name.strip(), "acceleration", unit, line)
    return Column(name.strip(), by_unit or by_name, unit or None, line)


def _kind_of_unit(unit: str) -> str:
    """Return the kind of motion that a unit measures, "" where it is unknown."""
    if known_units(unit) is not None:
        return "acceleration"
    word = "".join(unit.lower().split()).replace("sec", "s")
    if word in TIME_UNITS or unit.strip().lower() in TIME_UNITS:
        return "time"
    kinds = (("velocity", _VELOCITIES), ("displacement", _LENGTHS), ("counts", _COUNTS))
    return next((kind for kind, units in kinds if word in units), "")
