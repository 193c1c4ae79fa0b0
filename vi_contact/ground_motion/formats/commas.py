"""Find out what the commas of a file mean: separators between numbers, or the points of decimal fractions.

"0,12" is one number or two. With a decimal point anywhere in the data, with a blank beside a comma, or with two commas
in one word, commas separate. With semicolons between the columns, as spreadsheets of half of Europe write them, they
are decimal. Nobody can tell in any other case.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from enum import Enum

from ...core.errors import InputError

_WORD = re.compile(r"[^\s;]++")
_INSIDE = re.compile(r"(?<=\d),(?=\d)")


class Commas(Enum):
    """Name what commas mean in the data of a file."""

    SEPARATE = "separators"
    DECIMAL = "decimal"


def commas_of(data: Sequence[str], at: Callable[[int], str]) -> Commas:
    """Return what commas mean in all the lines of data of a file; ``at``: the place of one of them, for a sentence.

    Raises InputError where it cannot be told.
    """
    inside = next((k for k, line in enumerate(data) if _INSIDE.search(line)), None)
    if inside is None:
        return Commas.SEPARATE
    points, semicolons = (any(sign in line for line in data) for sign in ".;")
    if points and not semicolons:
        return Commas.SEPARATE
    single = all(word.count(",") <= 1 and word.strip(",") == word for line in data for word in _WORD.findall(line))
    if not single:
        return Commas.SEPARATE
    if semicolons and not points:
        return Commas.DECIMAL
    raise InputError(
        f"{at(inside)}: the comma between digits may be a decimal one or a separator; write decimal points, and blanks "
        "between the numbers"
    )
