"""Write rows of the tables of a model: quantity, value, unit and remark."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten
from typing import Any

from ....units.report_units import ReportUnits, choose_unit, write_number, write_quantity

Model = Mapping[str, Any]
Row = tuple[str, str, str, str]
NONE = "-"  # where there is no unit
ROUNDING = 1e-9  # of the largest component of a vector: what is less is none


@dataclass(frozen=True)
class Pen:
    """Write numbers of a model in the units of a report.

    Attributes:
        units: those of the report.
        slice_thickness: in plane strain that of the slice [m], else None.
    """

    units: ReportUnits
    slice_thickness: float | None

    def row(
        self, name: str, value: float, unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of a number in an SI unit.

        Args:
            name: what the number is.
            value: the number.
            unit: its SI unit, "-" for none.
            remark: what is said beside it.
            quantity: as of ``write_quantity``.
        """
        written = write_quantity(
            value, unit, self.units, quantity=quantity, slice_thickness=self.slice_thickness
        )
        return (clip(name), written.number, written.unit, clip(remark))

    def row_of_several(
        self, name: str, values: Sequence[float], unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of the components of a vector, as (1, 2); arguments as of ``row``."""
        size = max((abs(value) for value in values), default=0.0)
        factor, name_of_unit = self._choose_unit(unit, quantity, size)
        # what is rounding beside the largest component is zero
        kept = [0.0 if abs(value) <= ROUNDING * size else value for value in values]
        numbers = [write_number(factor * value) for value in kept]
        text = numbers[0] if len(numbers) == 1 else f"({', '.join(numbers)})"
        return (clip(name), text, name_of_unit, clip(remark))

    def row_of_range(
        self, name: str, ends: Sequence[float], unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of what goes from one number to another; arguments as of ``row``."""
        factor, name_of_unit = self._choose_unit(unit, quantity, max(abs(end) for end in ends))
        low, high = (write_number(factor * end) for end in ends)
        text = low if low == high else f"{low} to {high}"
        return (clip(name), text, name_of_unit, clip(remark))

    def _choose_unit(self, unit: str, quantity: str, size: float) -> tuple[float, str]:
        """Return factor and name of the unit for numbers up to a size in an SI unit."""
        return choose_unit(
            unit,
            self.units,
            quantity=quantity,
            slice_thickness=self.slice_thickness,
            size=size,
        )


def clip(value: Any) -> str:
    """Return a text of a file on one line, which nobody made too long to be read."""
    return shorten(str(value), 300, placeholder=" …")


def say(name: str, value: Any, remark: str = "") -> Row:
    """Return the row of a word or a count."""
    return (clip(name), clip(value), NONE, clip(remark))


def list_objects(model: Model, key: str) -> list[Mapping[str, Any]]:
    """Return the entries of a list of the model; none where there is no list."""
    entries = model.get(key)
    return [entry for entry in entries or () if isinstance(entry, Mapping)]
