"""Find the values that stand for missing samples: -999, 9999.999, -9.99E+02 and the like."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from ....core.algebra import Array
from ....core.errors import InputError

_SAC = 12345.0  # what SAC writes for an undefined number, with a minus
# Between these a number is a mark (1e30, 1.7e38) and no motion in any unit.
_HUGE = 1e20
_HUGEST = 1e40


def refuse_fill_values(samples: Sequence[float] | Array, place: Callable[[int], str]) -> None:
    """Raise InputError where a sample is a mark of a missing one.

    ``place`` gives the file and the line of sample k. The mark is a number of nines only, or
    -12345, or a huge one, that no other sample reaches or that stands apart: it is farther from
    both its neighbours than any other two neighbours are from one another. A sample may be 999.0 by
    chance, between 997.2 and 1001.4.
    """
    values = np.asarray(samples, dtype=float)
    marks = np.array([_is_mark(value) for value in np.abs(values)], dtype=bool)
    if not np.any(marks):
        return
    most = float(np.max(np.abs(values[~marks]), initial=0.0))
    jumps = np.abs(np.diff(values))
    beside_marks = marks[:-1] | marks[1:]
    usual_jump = float(np.max(jumps[~beside_marks], initial=0.0))
    for k in np.flatnonzero(marks):
        # Jumps to the neighbours that are no marks themselves.
        own_jumps = []
        for j in (k - 1, k):
            if 0 <= j < jumps.size and not marks[[j, j + 1]].all():
                own_jumps.append(jumps[j])
        apart = bool(own_jumps) and min(own_jumps) > usual_jump
        whole = values[k] == round(values[k])
        beyond_others = abs(values[k]) > (1.0 if whole else 1.5) * most
        if beyond_others or apart:
            raise InputError(
                f"{place(int(k))}: the sample {values[k]:.10g} stands for a missing value; fill "
                "the gap or use another record"
            )


def _is_mark(size: float) -> bool:
    """Tell whether a number is huge, that of SAC, or of nines only, three before the point."""
    if _HUGE <= size <= _HUGEST or size == _SAC:
        return True
    if size < 999.0 or not math.isfinite(size):
        return False
    return set(f"{size:.10g}".replace(".", "")) == {"9"}
