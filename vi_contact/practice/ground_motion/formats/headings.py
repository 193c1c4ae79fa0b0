"""Read the heading over columns: what each column is, in which unit, and what it is called.

A heading has a cell for each column, between commas, semicolons, tabs, wide gaps, brackets or
blanks, and is the last line before the numbers: "Time [s],Acceleration [g],Velocity [m/s]". Names
and units may stand on a line each.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..record import recognise_units
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

    Attributes:
        name: in the heading.
        kind: "time", "acceleration", "velocity", "displacement", "counts", "number", or "" where
            the heading does not tell.
        unit: in the heading, or None.
        line: index of the heading.
    """

    name: str
    kind: str
    unit: str | None
    line: int


def column_heading(text: TextFile, header: Sequence[int], width: int) -> list[Column] | None:
    """Return the columns that the last line of the header names.

    It is None where that is no heading of so many columns.

    Args:
        text: the file.
        header: indices of the lines of the header.
        width: number of columns.
    """
    lines = [index for index in header if text.heads[index].strip(_MARKS + "-=+_")]
    if width < 2 or not lines:
        return None
    last = lines[-1]
    cells = _split_cells(text.heads[last], width)
    if cells is None:
        return None

    # A line of units alone: the names stand above it.
    units = [cell.strip("()[] ") for cell in cells]
    if len(lines) > 1 and all(_kind_of_unit(unit) for unit in units):
        names = _split_cells(text.heads[lines[-2]], width)
        if names is not None:
            named = zip(names, units, strict=True)
            return [_describe_column(f"{name} [{unit}]", last) for name, unit in named]
    columns = [_describe_column(cell, last) for cell in cells]

    # Beside "t" small letters are quantities, and "V" is vertical.
    if any(column.name == "t" for column in columns):
        letters = {"v": "velocity", "d": "displacement"}
        for k, column in enumerate(columns):
            columns[k] = replace(column, kind=column.kind or letters.get(column.name, ""))

    # A word for each column may be a title: it is a heading if all words are known.
    known = [bool(column.kind or _COMPONENT.match(column.name)) for column in columns]
    may_be_title = len(text.heads[last].strip(_MARKS).split()) == width
    if all(known) or (any(known) and not may_be_title):
        return columns
    return None


def _split_cells(line: str, width: int) -> list[str] | None:
    """Return the cells of a line if it can be split into `width` of them."""
    line = line.strip().strip(_MARKS).rstrip(",;")
    for split in _SPLITS:
        cells = [cell.strip("'\" ") for cell in split.split(line)]
        has_words = any(re.match(r"[^\W\d_]", cell.lstrip("([")) for cell in cells)
        if len(cells) == width and all(cells) and has_words:
            return cells
    return None


def _describe_column(cell: str, line: int) -> Column:
    """Return what one cell says: its name, its unit, and the kind that both tell."""
    name, unit = _split_cell(cell)
    by_unit = _kind_of_unit(unit) if unit else ""
    by_name = next((kind for kind, pattern in _KINDS if pattern.search(name.strip(" .:"))), "")
    if by_name == "time" and by_unit not in ("time", ""):
        by_name = ""
    if by_name == "acceleration" and unit:
        # A unit of something else is refused later, with its place.
        return Column(name.strip(), "acceleration", unit, line)
    return Column(name.strip(), by_unit or by_name, unit or None, line)


def _split_cell(cell: str) -> tuple[str, str | None]:
    """Return the name and the unit of a cell such as "Acc [g]" or "acc in g", or None for it."""
    brackets = _UNIT_BEHIND.search(cell)
    if brackets:
        return cell[: brackets.start()].rstrip(" _"), brackets[1].strip()
    word = _UNIT_WORD.match(cell)
    if word and word[1] and _kind_of_unit(word[2]):
        return word[1], word[2]
    return cell, None


def _kind_of_unit(unit: str) -> str:
    """Return the kind of motion that a unit measures, or "" where it is unknown."""
    if recognise_units(unit) is not None:
        return "acceleration"
    word = "".join(unit.lower().split()).replace("sec", "s")
    if word in TIME_UNITS or unit.strip().lower() in TIME_UNITS:
        return "time"
    kinds = (("velocity", _VELOCITIES), ("displacement", _LENGTHS), ("counts", _COUNTS))
    return next((kind for kind, units in kinds if word in units), "")
