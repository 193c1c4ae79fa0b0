"""List peak values of histories as a tidy table.

Loops of a force over a deformation are followed too, with their work.
"""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.checks import instance, number, several
from ...core.errors import InputError
from ...core.files import write_csv
from ...core.step import Columns

HEADER = ("name", "quantity", "unit", "max", "t_max", "min", "t_min")
GROWS = "; raw, not convergent at impacts: it grows as dt falls"
_NOT_PEAKS = ("t", "k", "iterations", "escalated")
NEARLY = 0.9  # of a peak: it lasts while the values around it are above


@dataclass(frozen=True)
class Peak:
    """Hold the largest and smallest value of a column and when they came first [s].

    They are nan where the column is all nan.
    """

    name: str
    quantity: str
    unit: str
    max: float
    t_max: float
    min: float
    t_min: float


def peaks(
    history: Mapping[str, Array], columns: Columns, names: Sequence[str] | None = None
) -> list[Peak]:
    """Return the largest and smallest values of columns; nan values are left out.

    The peak of an acceleration is that of the time step where contact closes, and is marked so: it
    grows as dt falls.

    Args:
        history: column -> values (rows,) of a run.
        columns: column -> (unit, meaning).
        names: of the columns; None: all columns of numbers but the counters.

    Raises:
        InputError: a column that the history does not have, or one of arrays.
    """
    for kind, mapping in (("history", history), ("columns", columns)):
        instance("peaks", kind, mapping, Mapping, f"give the {kind} of a solution")
    if names is None:
        names = [
            name
            for name in columns
            if name not in _NOT_PEAKS and name in history and history[name].ndim == 1
        ]
    rows = []
    for name in several("peaks", "names", names, "give a list of columns, or None"):
        values = column_of(history, name)
        t = history["t"]
        unit, quantity = columns[name]
        if name.startswith(("a_x_", "a_y_", "a_z_")):
            quantity += GROWS
        numbers = [float("nan")] * 4
        if not np.isnan(values).all():
            high = int(np.nanargmax(values))
            low = int(np.nanargmin(values))
            numbers = [float(x) for x in (values[high], t[high], values[low], t[low])]
        rows.append(Peak(name, quantity, unit, *numbers))
    return rows


def find_stretch(sizes: Array) -> tuple[int, int]:
    """Return the rows about the largest value that are above ``NEARLY`` of it: first and last.

    Rows that are not a number are below.

    Args:
        sizes: (rows,) of which the largest number is positive.
    """
    row = int(np.nanargmax(sizes))
    below = np.flatnonzero(~(sizes >= NEARLY * sizes[row]))
    earlier = below[below < row]
    later = below[below > row]
    first = int(earlier[-1]) + 1 if len(earlier) else 0
    last = int(later[0]) - 1 if len(later) else len(sizes) - 1
    return first, last


@check_arguments
def write_peaks(path: str | Path, rows: Sequence[Peak]) -> Path:
    """Write ``peaks.csv``.

    Its columns are name, quantity (its meaning), unit, max, t_max [s], min, t_min [s], to the last
    bit.
    """
    return write_csv(path, HEADER, map(astuple, rows))


@dataclass(frozen=True)
class Loop:
    """Hold deformation, force and work, (rows,) each.

    The work is ∫ F dx since the start by the trapezoidal rule.

    For a closed loop run through clockwise it is the area, the work that the structure took up.
    """

    deformation: Array
    force: Array
    work: Array

    @property
    def stiffness(self) -> float:
        """Return the secant stiffness between the largest and the smallest deformation.

        It is nan where nothing moved.
        """
        high = int(np.argmax(self.deformation))
        low = int(np.argmin(self.deformation))
        way = self.deformation[high] - self.deformation[low]
        return float((self.force[high] - self.force[low]) / way) if way > 0.0 else float("nan")


def hysteresis(
    history: Mapping[str, Array], deformation: str, force: str, *, sign: float = 1.0
) -> Loop:
    """Return the loop of two columns.

    Such are base shear over top displacement, shear over racking, or M over theta.

    Args:
        history: column -> values (rows,) of a run.
        deformation: column of x.
        force: column of F.
        sign: factor of the force; -1 for reactions on the body, which push against its
            deformation.

    Raises:
        InputError: a column that the history does not have, or one of arrays.
    """
    number("hysteresis", "sign", sign)
    x = column_of(history, deformation)
    y = sign * column_of(history, force)

    # Work by the trapezoidal rule.
    work = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])
    return Loop(x, y, work)


def column_of(history: Mapping[str, Array], name: str) -> Array:
    """Return a column of numbers; InputError names the columns there are."""
    instance("history", "the name of a column", name, str, "give a text, such as 'u_x_top'")
    instance("history", "it", history, Mapping, "give the history of a solution")
    if name not in history:
        known = [column for column in history if np.ndim(history[column]) == 1]
        raise InputError(f"the history has no column '{name}': it has {', '.join(known)}")
    values = np.asarray(history[name], dtype=float)
    if values.ndim != 1:
        raise InputError(f"column '{name}' holds arrays: choose a column of numbers")
    return values
