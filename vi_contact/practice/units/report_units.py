"""Choose the units of a report once, and write numbers in them as people do.

Files stay in SI units. A column or a line of a model says its SI unit; here stands the unit of the
trade that takes its place.
"""

from dataclasses import dataclass, fields

import numpy as np

from ...core.checks import quote
from ...core.errors import InputError
from .reading import read_unit

DIGITS = 4  # of a number in a report
# Between these sizes a number of four digits is written without a power of ten.
_PLAIN = (1e-4, 1e7)


@dataclass(frozen=True)
class ReportUnits:
    """Name the units of a report; each is a unit of the quantity that it stands for.

    A moment is written in the unit of force times metre. In plane strain, forces, moments,
    energies and masses are those of a metre of the body and are written so: kN/m, kN m/m, t/m.

    Attributes:
        force: of forces and thrusts.
        length: of what moves: displacements, slips, openings, gaps.
        size: of what stays: heights, widths, places.
        stress: of stresses and contact pressures.
        modulus: of Young's moduli and shear moduli.
        mass: of bodies.
        angle: of rotations.
        acceleration: of motions.
        energy: of the columns of the ledger.
    """

    force: str = "kN"
    length: str = "mm"
    size: str = "m"
    stress: str = "kPa"
    modulus: str = "GPa"
    mass: str = "t"
    angle: str = "rad"
    acceleration: str = "m/s²"
    energy: str = "kJ"

    def __post_init__(self) -> None:
        for field in fields(self):
            self._check(field.name, getattr(self, field.name), field.default)

    @staticmethod
    def _check(quantity: str, unit: object, usual: object) -> None:
        """Raise InputError for what is no unit of a quantity; the usual one is offered."""
        remedy = f"give a unit of {quantity}, such as '{usual}'"
        if not isinstance(unit, str):
            raise InputError(f"units: {quantity} is {quote(unit)}: {remedy}")
        try:
            dimension = read_unit(unit)[1]
        except InputError as error:
            raise InputError(f"units: {quantity} is {quote(unit)}: {error}") from error
        if dimension != read_unit(_SI[quantity])[1]:
            raise InputError(f"units: {quantity} is {quote(unit)}, which is none: {remedy}")


# The SI unit of each quantity of ``ReportUnits``.
_SI = {
    "force": "N",
    "length": "m",
    "size": "m",
    "stress": "Pa",
    "modulus": "Pa",
    "mass": "kg",
    "angle": "rad",
    "acceleration": "m/s²",
    "energy": "J",
}
# The quantity that an SI unit of a column stands for, where nothing else is said.
_QUANTITIES = {
    "N": "force",
    "N m": "moment",
    "m": "length",
    "Pa": "stress",
    "kg": "mass",
    "rad": "angle",
    "m/s²": "acceleration",
    "J": "energy",
}
# What is less than one (moduli, masses), or than a thousandth (others), of the usual unit is
# written in the first of these in which it is no less than one, or in the last of them.
_SMALLER = {
    "GPa": ("MPa", "kPa", "Pa"),
    "t": ("kg",),
    "kN": ("N",),
    "kJ": ("J",),
    "kPa": ("Pa",),
    "mm": ("µm",),
    "rad": ("µrad",),
}
_LEAST = {"modulus": 1.0, "mass": 1.0}
_LEAST_OF_OTHERS = 1e-3
# Quantities that are those of a metre of the body in plane strain.
_PER_METRE = ("force", "moment", "mass", "energy")


@dataclass(frozen=True)
class Written:
    """Hold a number as it is read by people, and its unit."""

    number: str
    unit: str

    def __str__(self) -> str:
        return f"{self.number} {self.unit}".removesuffix(" -").rstrip()


def write_quantity(
    value: float,
    unit: str,
    units: ReportUnits,
    *,
    quantity: str = "",
    slice_thickness: float | None = None,
) -> Written:
    """Write a number of an SI unit in the unit of the report.

    Args:
        value: the number [``unit``].
        unit: its SI unit, as in columns.json; "-" for none.
        units: those of the report.
        quantity: the field of ``units`` that it is, or "moment"; "": the usual one of the unit.
        slice_thickness: in plane strain that of the slice [m], by which forces, moments and masses
            are divided; None where the body has a thickness of its own or is in space.
    """
    factor, name = choose_unit(
        unit, units, quantity=quantity, slice_thickness=slice_thickness, size=abs(value)
    )
    return Written(write_number(factor * value), name)


def choose_unit(
    unit: str,
    units: ReportUnits,
    *,
    quantity: str = "",
    slice_thickness: float | None = None,
    size: float = np.inf,
) -> tuple[float, str]:
    """Return (factor from the SI unit, name of the unit) of the report.

    A unit that no field of ``units`` stands for is kept. For small numbers a smaller unit takes the
    place of the usual one, and of no other.

    Args:
        unit: the SI unit.
        units: those of the report.
        quantity: as of ``write_quantity``.
        slice_thickness: as of ``write_quantity``.
        size: of the largest number that is written in it [``unit``].
    """
    quantity = quantity or _QUANTITIES.get(unit, "")
    if not quantity:
        return 1.0, unit
    # in plane strain a force is that of so many metres
    depth = slice_thickness if slice_thickness and quantity in _PER_METRE else None
    field = "force" if quantity == "moment" else quantity
    name = _fit_unit(field, getattr(units, field), size / (depth or 1.0))
    factor = read_unit(_SI[field])[0] / read_unit(name)[0]
    if quantity == "moment":
        name = f"{name} m"
    return (factor, name) if depth is None else (factor / depth, f"{name}/m")


def _fit_unit(field: str, name: str, size: float) -> str:
    """Return a unit, or a smaller one where it is the usual one and the number is small.

    Args:
        field: of ``ReportUnits``.
        name: of the unit.
        size: of the number, in the SI unit.
    """
    least = _LEAST.get(field, _LEAST_OF_OTHERS)
    is_usual = name == getattr(ReportUnits, field)
    if not is_usual or not 0.0 < size < least * read_unit(name)[0]:
        return name
    for smaller in _SMALLER.get(name, ()):
        name = smaller
        if size >= read_unit(name)[0]:
            break
    return name


def write_number(value: float, digits: int = DIGITS) -> str:
    """Write a number with so many digits, without a power of ten where that is usual.

    A dash stands for no number.
    """
    if np.isnan(value):
        return "-"
    size = abs(value)
    if value == 0.0 or not np.isfinite(value):
        return f"{value + 0.0:g}"
    if not _PLAIN[0] <= size < _PLAIN[1]:
        return f"{value:.{digits}g}"
    rounded = float(f"{value:.{digits}g}")
    places = max(digits - 1 - int(np.floor(np.log10(abs(rounded)))), 0)
    text = f"{rounded:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
