"""Measure what an incremental dynamic analysis plots.

These are intensity measures of motions, and demands on the structure.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from ....core.algebra import Array
from ....core.errors import InputError
from ...ground_motion.intensity import arias, cav, housner_intensity, pga, pgd, pgv, psa
from ...ground_motion.record import Record

_WAYS: dict[str, tuple[Callable[[Array], float], str]] = {
    "max": (lambda values: float(np.fmax.reduce(values)), "largest value of"),
    "min": (lambda values: float(np.fmin.reduce(values)), "smallest value of"),
    "absmax": (lambda values: float(np.fmax.reduce(np.abs(values))), "largest magnitude of"),
    "last": (lambda values: float(values[-1]), "last value of"),
}


@dataclass(frozen=True)
class Intensity:
    """Define an intensity measure; a motion times f has f**degree of it.

    Attributes:
        name: of its column.
        unit: of its values.
        meaning: in words.
        degree: power of the scale in it [-].
        compute: record -> value in ``unit``.
    """

    name: str
    unit: str
    meaning: str
    degree: int
    compute: Callable[[Record], float]

    def scale(self, record: Record, level: float) -> float:
        """Return the factor that brings the record to this level.

        Raises:
            InputError: unless both are positive.
        """
        value = self.compute(record)
        if not (level > 0.0 and value > 0.0):
            raise InputError(
                f"level {level:g} of {self.name}: the record has {value:g}; give levels above "
                "zero, and records with a motion"
            )
        return float((level / value) ** (1.0 / self.degree))


_MEASURES = {
    measure.name: measure
    for measure in (
        Intensity("pga", "m/s²", "peak ground acceleration", 1, pga),
        Intensity("pgv", "m/s", "peak ground velocity", 1, pgv),
        Intensity("pgd", "m", "peak ground displacement", 1, pgd),
        Intensity("arias", "m/s", "Arias intensity", 2, arias),
        Intensity("cav", "m/s", "cumulative absolute velocity", 1, cav),
        Intensity("housner", "m", "Housner intensity", 1, housner_intensity),
    )
}


def _read_seconds(text: str) -> float:
    """Return the number in a text; zero where there is none."""
    try:
        return float(text)
    except ValueError:
        return 0.0


def read_intensity(text: str, first_period: Callable[[], float] | None = None) -> Intensity:
    """Return the measure of a word.

    Words are pga, pgv, pgd, arias, cav, housner, or sa:T (pseudo-acceleration at T s, 5 %), and
    "sa:T1" at the period that ``first_period`` finds [s].
    """
    word, _, period = text.partition(":")
    if word == "sa":
        if period == "T1" and first_period is not None:
            seconds = first_period()
        else:
            seconds = _read_seconds(period)
        if not 0.0 < seconds < np.inf:
            raise InputError(
                f"intensity '{text}': give the period after the colon in seconds, such as sa:0.5"
            )
        meaning = f"pseudo-acceleration at {seconds:g} s, 5 % damping"
        # asked often
        return Intensity(f"sa_{seconds:g}", "m/s²", meaning, 1, cache(partial(psa, period=seconds)))
    if period or word not in _MEASURES:
        raise InputError(
            f"unknown intensity '{text}': choose one of {', '.join(_MEASURES)}, or sa:T with T in "
            "seconds"
        )
    return _MEASURES[word]


@dataclass(frozen=True)
class Demand:
    """Define a demand parameter: a column of history.csv and what of it counts.

    Values that are not a number do not.

    Attributes:
        column: of history.csv.
        way: "max", "min", "absmax" or "last".
    """

    column: str
    way: str = "absmax"

    @property
    def name(self) -> str:
        """Return the column of the table, "u_x_top_absmax"."""
        return f"{self.column}_{self.way}"

    @property
    def meaning(self) -> str:
        """Return it in words."""
        return f"{_WAYS[self.way][1]} {self.column}"

    def compute(self, history: Mapping[str, Array]) -> float:
        """Return the value of a run; InputError for a column it has not recorded."""
        if self.column not in history:
            known = ", ".join(history)
            raise InputError(
                f"the run has no column '{self.column}': record it, or choose one of {known}"
            )
        return _WAYS[self.way][0](np.asarray(history[self.column], dtype=float))


def read_demand(text: str) -> Demand:
    """Return the demand of a word.

    It is "COLUMN" (its largest magnitude) or "COLUMN:max", ":min", ":absmax", ":last".
    """
    column, _, way = text.partition(":")
    if not column or (way or "absmax") not in _WAYS:
        raise InputError(
            f"demand '{text}': give COLUMN or COLUMN:WAY, WAY one of {', '.join(_WAYS)}"
        )
    return Demand(column, way or "absmax")


def compute_fractiles(
    curves: Mapping[str, tuple[Array, Array]], shares: tuple[float, ...]
) -> tuple[Array, Array]:
    """Return fractiles over the records of the demand at equal intensity.

    Levels are those of all records in the range that every record covers (Vamvatsikos and Cornell,
    Earthquake Engng Struct. Dyn. 31, 2002, section 5).

    Args:
        curves: record -> (intensities, demands), straight lines between them.
        shares: of the records below the fractiles.

    Returns:
        (levels (n,), demands (n, shares)); empty for fewer than two records and where ranges do not
        overlap.
    """
    full = [(im[np.argsort(im)], edp[np.argsort(im)]) for im, edp in curves.values() if len(im)]
    if len(full) < 2:
        return np.zeros(0), np.zeros((0, len(shares)))

    # Levels in the common range; those that round-off puts beside its ends are moved to them.
    low = max(im[0] for im, _ in full)
    high = min(im[-1] for im, _ in full)
    every = np.unique(np.concatenate([im for im, _ in full]))
    slack = 1e-9 * high
    levels = np.clip(every[(every >= low - slack) & (every <= high + slack)], low, max(low, high))

    demands = np.array([np.interp(levels, im, edp) for im, edp in full])
    return levels, np.quantile(demands, shares, axis=0).T
