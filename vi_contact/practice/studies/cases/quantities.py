"""Read texts where numbers or functions are asked for: "30 MPa", "2*9.81", "9810*max(0, 35 - y)".

A unit is a product of powers, as "kN/m3", "kg/m^3", "Pa*s", "1/s"; its dimension must be that of
the key, whose unit stands in the annotation of the argument (``core.quantities``).
"""

import math
import re
import tomllib
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any, get_origin

from ....core.algebra import Array
from ....core.checks import quote
from ....core.errors import InputError
from .expressions import LENGTH, Expression, Places
from .table_calls import Spot

FIELD, AT_START, HISTORY = (
    Callable[[Array, float], Array],
    Callable[[Array], Array],
    Callable[[float], float],
)
"""Functions of points and time, of points, of the time, for which expressions may stand."""
Dimension = tuple[int, ...]  # exponents of metre, kilogram, second, radian
_NUMBER, _NAME = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?", "[A-Za-zµμ°%]+"
_VALUE = re.compile(rf"(?<![\w.\s])\s*((?>{_NUMBER}))\s*((?:1\s*/\s*)?{_NAME}[^()+]*)")
_FACTOR = re.compile(rf"([*·/]?)(?:(?<!\s)\s+)?(1(?=\s*/|$)|{_NAME})(?:\^?(-?[0-9])|([²³]))?\s*")
_TABLES = tomllib.loads(files(__package__).joinpath("units.toml").read_text(encoding="utf-8"))
_UNITS = _TABLES["alone"] | {
    start + name: [factor * unit[0], *unit[1:]]
    for start, factor in _TABLES["prefixes"].items()
    for name, unit in _TABLES["with_prefix"].items()
}


def text_node(text: str, members: Sequence[Any], spot: Spot) -> Any:
    """Return the number or function that a text stands for.

    It is None where a key of these types takes neither.

    InputError: no arithmetic, a unit of another dimension than that of the key, a value that is not
    finite or whole.
    """
    one_value = float in members or not any(
        get_origin(member) in (tuple, list, Sequence) for member in members
    )
    kinds = ((FIELD, "xyzt"), (Expression, "xyz"), (HISTORY, "t"))
    kind, letters = next((one for one in kinds if one[0] in members and one_value), (None, ""))
    if kind is None and float not in members and int not in members:
        return None
    expression = _expression(text, letters, spot)
    if kind is None or (float in members and not expression.used):
        value = float(expression())
        if not math.isfinite(value) or (float not in members and value != int(value)):
            raise spot.wrong(
                f"is {quote(text)}, which is {value:g}: give a finite number, a whole one of things"
            )
        return value if float in members else int(value)
    return Places(expression) if kind == FIELD else expression


def list_node(values: list[Any], members: Sequence[Any], spot: Spot) -> Places | None:
    """Return the vector field that a list stands for.

    It is None where none is asked for or nothing in it has variables.
    """
    letters = (
        "xyzt"
        if FIELD in members
        else "xyz"
        if AT_START in members and spot.unit in ("m", "m/s")
        else ""
    )
    if not letters or float in members or not any(isinstance(one, str) for one in values):
        return None
    texts = [
        one if isinstance(one, str) else repr(one)
        for one in values
        if isinstance(one, str | int | float)
    ]
    found = tuple(
        _expression(one, letters, spot.entry(number)) for number, one in enumerate(texts, start=1)
    )
    return Places(found) if len(found) == len(values) and any(one.used for one in found) else None


def _expression(text: str, letters: str, spot: Spot) -> Expression:
    """Return the arithmetic of a text, or the number with a unit that it is.

    The number is in the unit of the key.
    """
    found = _VALUE.fullmatch(text.rstrip()) if len(text) <= LENGTH else None
    try:
        if found is None or found[2] in tuple(letters):
            return Expression(text, letters)
        if spot.unit is None:
            raise InputError(f"no unit is known for it here: leave {quote(found[2])} out")
        (factor, dimension), (own, asked) = _unit(found[2]), _unit(spot.unit)
        if dimension != asked:
            proper = "% or as a plain number" if spot.unit == "1" else spot.unit
            raise InputError(f"{quote(found[2])} is not a unit of it: give it in {proper}")
        return Expression(repr(float(found[1]) * (factor / own)))
    except InputError as error:
        arithmetic = f" of {', '.join(letters)}" if letters else ""
        ask = (
            f"give a number, one with its unit, or arithmetic{arithmetic}; "
            if found is None
            else ""
        )
        raise spot.wrong(f"is {quote(text)}: {ask}{error}") from None


def _unit(text: str) -> tuple[float, Dimension]:
    """Return the factor to SI units and the dimension of a product.

    After a "/" all divides up to the next "*".
    """
    size, place, below = 1.0, 0, False
    total: Dimension = (0, 0, 0, 0)
    while place < len(text):
        found = _FACTOR.match(text, place)
        if found is None:
            raise InputError(f"{quote(text)} is not a unit: write one as kN/m3, cm/s^2 or Pa*s")
        sign, name, digits, raised = found.groups()
        below = sign == "/" or (below and not sign)
        power = (int(digits) if digits else {"²": 2, "³": 3}.get(raised, 1)) * (-1 if below else 1)
        if name not in _UNITS:
            known = ", ".join((*_TABLES["with_prefix"], *_TABLES["alone"]))
            raise InputError(f"{quote(name)} is not a unit here: there are {known}, kPa, mm")
        factor, *dimension = _UNITS[name]
        size *= factor**power
        total = tuple(a + power * b for a, b in zip(total, dimension, strict=True))
        place = found.end()
    return size, total
