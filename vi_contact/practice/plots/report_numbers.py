"""Write the numbers of a report: in its units, those of a plane slice for a metre of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..units.report_units import ReportUnits, Written, choose_unit, write_number

PERCENT = (100.0, "%")
# Beginnings of columns that are places, and of columns that are shares of a whole.
PLACES = ("height_", "e_", "contact_x", "contact_y", "contact_z")
_SHARES = ("uplift_", "contact_uplift", "friction_used", "contact_slipping", "margin_")


@dataclass(frozen=True)
class ReportNumbers:
    """Write numbers of a run.

    Attributes:
        units: of the report.
        slice_thickness: in plane strain that of the slice [m]; None where forces are whole ones.
    """

    units: ReportUnits = ReportUnits()
    slice_thickness: float | None = None

    def choose_unit(self, column: str, unit: str, size: float = np.inf) -> tuple[float, str]:
        """Return (factor from the SI unit, name of the unit) for numbers of a column.

        Args:
            column: its name.
            unit: its SI unit.
            size: of the largest number [``unit``].
        """
        if unit == "-" and column.startswith(_SHARES):
            return PERCENT
        if unit in ("N/m", "N m/m"):  # those of a metre already
            factor, name = choose_unit(unit.removesuffix("/m"), self.units, size=size)
            return factor, f"{name}/m"
        quantity = "size" if unit == "m" and column.startswith(PLACES) else ""
        return choose_unit(
            unit,
            self.units,
            quantity=quantity,
            slice_thickness=self.slice_thickness,
            size=size,
        )

    def write(self, value: float, column: str, unit: str) -> Written:
        """Write a value [unit] of a column."""
        factor, name = self.choose_unit(column, unit, abs(value))
        return Written(write_number(factor * value), name)


def read_slice(model: Mapping[str, Any]) -> float | None:
    """Return the thickness [m] of the slice that model.json tells of; None but in plane strain."""
    section = model.get("section")
    if not isinstance(section, Mapping) or section.get("type") != "PlaneStrain":
        return None
    thickness = section.get("thickness", 1.0)
    is_number = isinstance(thickness, int | float) and not isinstance(thickness, bool)
    return float(thickness) if is_number and thickness > 0.0 else None
