"""Say whether the numbers that decide change with half the time step or half the element size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...run.files.reading import RunFolder
from ..plots.sections import NOISE, find_scales
from ..units.report_units import write_number
from .deciding import DecidingNumber, measure_again

# A number is called converged where half the step changes it by no more. CHOSEN: with an error of
# first order, that of the number is then 10 %, as large as what is known of loads and soils.
LIMIT = 0.05
NOT_TESTED = "not tested"
TESTS = {"dt": "converged in time? (dt/2)", "h": "converged in the mesh? (h/2)"}


@dataclass(frozen=True)
class Change:
    """Hold how a number changes in a refined run.

    Attributes:
        share: (number of the refined run - number) / |number|; nan where it has none.
        text: of a cell.
        is_brief: whether the peak lasts one step in both runs, and so is as short as the step is.
    """

    share: float
    text: str
    is_brief: bool = False

    @property
    def is_converged(self) -> bool:
        """Say whether the change is within ``LIMIT``; False where it is unknown."""
        return bool(abs(self.share) <= LIMIT) and not self.is_brief


def compare(
    run: RunFolder,
    numbers: Sequence[DecidingNumber],
    refined: Mapping[str, RunFolder],
    failed: Mapping[str, str],
) -> dict[str, list[Change]]:
    """Return "dt" and "h" -> the change of each number in the refined run.

    Args:
        run: what ``read_run`` returned.
        numbers: of the run.
        refined: "h" or "dt" -> the refined run, as of ``read_refined``.
        failed: "h" or "dt" -> why there is none.
    """
    scales = find_scales(run)
    changes: dict[str, list[Change]] = {}
    for name in TESTS:
        if name not in refined:
            text = "its run failed" if name in failed else NOT_TESTED
            changes[name] = [Change(np.nan, text)] * len(numbers)
            continue
        changes[name] = []
        for number in numbers:
            unit = run.columns[number.column][0]
            # shares and factors have no unit in common
            scale = abs(number.value) if unit == "-" else scales[unit]
            changes[name].append(_find_change(number, refined[name], scale))
    return changes


def _find_change(number: DecidingNumber, refined: RunFolder, scale: float) -> Change:
    """Return the change of a number.

    Args:
        number: of the run.
        refined: the refined run.
        scale: the largest number in the same unit: a change of ``NOISE`` of it is none.
    """
    other = measure_again(number, refined.history)
    if other is None or np.isnan(other.value) or np.isnan(number.value):
        return Change(np.nan, "-")
    difference = other.value - number.value
    if abs(difference) <= NOISE * scale:
        return Change(0.0, "yes: no change")
    if number.value == 0.0:
        return Change(np.inf, "no: it was zero")
    share = difference / abs(number.value)
    is_brief = number.is_brief and other.is_brief
    verdict = "yes" if abs(share) <= LIMIT and not is_brief else "no"
    sign = "+" if share > 0.0 else ""
    still = ", still one step" if is_brief else ""
    return Change(share, f"{verdict}: {sign}{write_number(100.0 * share, 2)} %{still}", is_brief)
