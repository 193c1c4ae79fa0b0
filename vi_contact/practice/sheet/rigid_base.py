"""Set the pressure of a rigid base beside that at the edge of an elastic one.

Elastic ground has no largest pressure under the edge of a stiff base: what a run finds there grows
as elements are made smaller. Statics gives a number that does not, from N and its eccentricity e.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..plots.report_numbers import ReportNumbers
from ..units.report_units import write_number
from .deciding import DecidingNumber
from .rules import History

ENDS = ("pressure_low_", "pressure_high_")  # beginnings of columns


def find_edge_pressure(N: float, e: float, width: float, area: float) -> float:
    """Return the pressure [Pa] at the more pressed edge of a rigid base on springs.

    It is N/A (1 + 6 |e|/W) while the whole base is pressed, |e| <= W/6, and beyond
    2 N W / (3 A (W/2 - |e|)), as springs do not pull; nan where N acts outside of the base.

    Args:
        N: normal force, compression positive [N].
        e: its eccentricity from the middle [m].
        width: W of the base [m].
        area: A of the base [m²].
    """
    off = abs(e) / width
    if not (N > 0.0 and off < 0.5):
        return np.nan
    if off <= 1.0 / 6.0:
        return N / area * (1.0 + 6.0 * off)
    return 2.0 * N / (3.0 * area * (0.5 - off))


def explain_edge_pressures(
    deciding: Sequence[DecidingNumber],
    history: History,
    model: Mapping[str, Any],
    numbers: ReportNumbers,
) -> list[str]:
    """Say of each pressure at an end of a part in the plane what statics gives there and then.

    Args:
        deciding: the numbers of page 1.
        history: of the run.
        model: model.json, in which the part has its area.
        numbers: writes them.
    """
    sentences = []
    for number in deciding:
        part = _find_part(number.column)
        area, width = _find_base(part, model)
        if not width or not {f"N_{part}", f"e_{part}"} <= set(history):
            continue
        row = int(np.searchsorted(history["t"], number.t))
        N = float(history[f"N_{part}"][row])
        e = float(history[f"e_{part}"][row])
        pressure = find_edge_pressure(N, e, width, area)
        if np.isnan(pressure):
            continue
        rigid = numbers.write(pressure, number.column, "Pa")
        force = numbers.write(N, f"N_{part}", "N")
        sentences.append(
            f"{number.column}: the pressure under an edge of an elastic base grows as elements are "
            f"made smaller, without limit. At {write_number(number.t)} s a rigid base on springs, "
            f"N/A + N e/W where it is wholly pressed, has {rigid} at its edge: N = {force}, "
            f"e = {write_number(abs(e))} m, width {write_number(width)} m."
        )
    return sentences


def _find_part(column: str) -> str:
    """Return the part of the contact whose pressure a column is; "" for other columns."""
    for beginning in ENDS:
        if column.startswith(beginning):
            return column.removeprefix(beginning)
    return ""


def _find_base(part: str, model: Mapping[str, Any]) -> tuple[float, float]:
    """Return (area [m²], width [m]) of a part in the plane; zeros where they are not known."""
    section = model.get("section")
    if not part or model.get("dimension") != 2 or not isinstance(section, Mapping):
        return 0.0, 0.0
    thickness = section.get("thickness", 0.0)
    contact = model.get("contact")
    for entry in contact if isinstance(contact, list) else ():
        if isinstance(entry, Mapping) and entry.get("name") == part:
            area = entry.get("size", 0.0)
            if all(isinstance(size, int | float) and size > 0.0 for size in (area, thickness)):
                return float(area), float(area / thickness)
    return 0.0, 0.0
