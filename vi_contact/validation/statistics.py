"""Say how well many computed values agree with those of a source.

The rule of a report of a release of pySLAMMER, of which the book takes its limits: a straight line
of found over wanted, and the share of single values within a band. R² alone proves nothing where
one value is much larger than the others; so the median of the relative error is told too.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array

# What can be asked of a series: name -> (meaning, whether it has the unit of the values).
QUANTITIES: Mapping[str, tuple[str, bool]] = {
    "slope": ("slope of found over wanted, least squares", False),
    "intercept": ("intercept of that line", True),
    "r2": ("R² of that line", False),
    "share": ("share of the single values within their limits", False),
    "median": ("median of the relative error", False),
    "largest": ("largest difference", True),
}


@dataclass(frozen=True)
class Agreement:
    """Hold how well a series of values agrees.

    Attributes:
        slope: of the line of least squares, found = slope wanted + intercept.
        intercept: of this line, in the unit of the values.
        r2: share of the scatter of what was found that the line explains.
        share: of the values whose difference is within their limit, 0 to 1.
        median: of |found - wanted| / |wanted|, over values that are not zero.
        largest: |found - wanted| where it is largest, in the unit of the values.
        where: the name of that value.
        count: number of the values.
    """

    slope: float
    intercept: float
    r2: float
    share: float
    median: float
    largest: float
    where: str
    count: int


def agreement(names: list[str], found: Array, wanted: Array, limits: Array) -> Agreement:
    """Return how well found values agree with wanted ones.

    Args:
        names: (n,) of the values, of which one is told.
        found: (n,) computed; one NaN makes every number NaN and counts as outside of its limit.
        wanted: (n,) of the source, in the same unit, not all alike.
        limits: (n,) the largest difference that each is allowed, in the same unit.
    """
    # the line of least squares through (wanted, found), and what of the scatter it leaves
    spread = wanted - wanted.mean()
    slope = float(spread @ found / (spread @ spread)) if spread.any() else np.nan
    intercept = float(found.mean() - slope * wanted.mean())
    left = found - slope * wanted - intercept
    scatter = found - found.mean()
    r2 = float(1.0 - left @ left / (scatter @ scatter)) if scatter.any() else np.nan

    difference = np.abs(found - wanted)
    nonzero = wanted != 0.0
    relative = difference[nonzero] / np.abs(wanted[nonzero])
    worst = int(np.argmax(np.nan_to_num(difference, nan=np.inf)))
    return Agreement(
        slope=slope,
        intercept=intercept,
        r2=r2,
        share=float(np.mean(difference <= limits)),
        median=float(np.median(relative)) if len(relative) else np.nan,
        largest=float(difference[worst]),
        where=names[worst],
        count=len(names),
    )
