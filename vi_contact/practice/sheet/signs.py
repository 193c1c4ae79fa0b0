"""Say which way the numbers that decide are positive.

A recorder tells the sign of a column in its meaning, such as "normal force, tension positive". The
sign of a force along the contact follows from directions: with n̄ the direction of N towards the
support, T = F·t̄ and the sliding have t̄ = (-n̄_y, n̄_x) in the plane, which is n̄ turned
anticlockwise by a right angle. On level ground n̄ points down and t̄ to the right.
"""

from collections.abc import Sequence

from ...core.step import Columns
from .deciding import DecidingNumber
from .rules import History, find_part

ALONG = ("T", "sliding")  # of parts in the plane; in space they are sizes


def explain_signs(
    deciding: Sequence[DecidingNumber], columns: Columns, history: History
) -> list[str]:
    """Return the notes on signs, and on the point about which moments of parts are taken.

    Args:
        deciding: the numbers.
        columns: column -> (unit, meaning), of the run.
        history: of the run.
    """
    names = list(dict.fromkeys(number.column for number in deciding))
    told = [f"{sign} for {name}" for name in names if (sign := _find_sign(columns[name][1]))]
    along = [name for name in names if _is_along_contact(name, history)]
    if along:
        told.append(
            "to the right on level ground, and upwards on a face whose support is to its right, "
            f"for {' and '.join(along)}"
        )
    notes = [f"Positive means: {'; '.join(told)}. Forces are those on the body."] if told else []
    if any(_is_moment_of_part(name, history) for name in names):
        notes.append(
            "The centre of a moment is the middle of the part at the level of its lowest point, "
            "unless centre of its [[record]] is another point."
        )
    return notes


def _find_sign(meaning: str) -> str:
    """Return the clause of a meaning that tells the sign, without the word positive; "" if none."""
    clauses = [clause for clause in meaning.split(", ") if "positive" in clause]
    if not clauses:
        return ""
    return clauses[0].removesuffix(" positive").removeprefix("positive with ")


def _is_along_contact(name: str, history: History) -> bool:
    """Say whether a column is T or the sliding of a part in the plane."""
    part = find_part(name, history)
    return name.partition("_")[0] in ALONG and f"theta_{part}" in history


def _is_moment_of_part(name: str, history: History) -> bool:
    """Say whether a column is a moment of a part; in space it has an axis too, as M_x_base."""
    kind, _, rest = name.partition("_")
    return kind == "M" and bool(find_part(name, history) or find_part(rest, history))
