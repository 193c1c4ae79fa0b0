"""Read texts where numbers or functions are asked for: "30 MPa", "2*9.81", "9810*max(0, 35 - y)".

Arithmetic of numbers alone may have a unit behind it: "50*9.81 kN/m2".

A unit is a product of powers, as "kN/m3", "kg/m^3", "Pa*s", "1/s"; its dimension must be that of
the key, whose unit stands in the annotation of the argument (``core.quantities``).
"""

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, get_origin

from ....core.algebra import Array
from ....core.checks import quote
from ....core.errors import InputError
from ...units.reading import NAME, read_unit
from .expressions import LENGTH, Expression, Places
from .table_calls import Spot

# Types of functions for which expressions may stand.
FIELD = Callable[[Array, float], Array]  # of points and the time
AT_START = Callable[[Array], Array]  # of points
OF_POINTS = Callable[[Array], Any]  # of points, one value each
HISTORY = Callable[[float], float]  # of the time
_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_VALUE = re.compile(rf"(?<![\w.\s])\s*((?>{_NUMBER}))\s*((?:1\s*/\s*)?{NAME}[^()+]*)")
# arithmetic of numbers alone with a unit behind it: "50*9.81 kN/m2"
_ARITHMETIC = re.compile(
    rf"(?<![-+*/^().\w\s])((?>(?:[-+*/^().\d\s]|(?<=[\d.])[eE](?=[-+\d]))+))(?<=\s)({NAME}[^()+]*)",
    re.ASCII,
)


def read_quantity(text: str, members: Sequence[Any], spot: Spot) -> Any:
    """Return the number or function that a text stands for.

    Args:
        text: of the file.
        members: the types that the key takes.
        spot: where the text stands, with the unit of the key.

    Returns:
        A number in the unit of the key, an expression, or None where a key of these types takes
        neither.

    Raises:
        InputError: for what is no arithmetic, a unit of another dimension than that of the key, and
            a value that is not finite, or not whole where things are counted.
    """
    kind, letters = _select_function(members)
    if kind is None and float not in members and int not in members:
        return None
    expression = _read_expression(text, letters, spot)

    # Arithmetic without variables is a number, unless the key takes functions only.
    if kind is None or (float in members and not expression.used):
        value = float(expression())
        if not math.isfinite(value) or (float not in members and value != int(value)):
            raise spot.make_error(
                f"is {quote(text)}, which is {value:g}: give a finite number, a whole one of things"
            )
        return value if float in members else int(value)
    return Places(expression) if kind in (FIELD, OF_POINTS) else expression


def _select_function(members: Sequence[Any]) -> tuple[Any, str]:
    """Return the type of function that one text stands for, and its variables.

    It is (None, "") where there is none. A key that takes lists and no number asks for a vector,
    for which ``read_field`` reads a text for each component.
    """
    takes_lists = any(get_origin(member) in (tuple, list, Sequence) for member in members)
    if takes_lists and float not in members:
        return None, ""
    for kind, letters in ((FIELD, "xyzt"), (OF_POINTS, "xyz"), (Expression, "xyz"), (HISTORY, "t")):
        if kind in members:
            return kind, letters
    return None, ""


def read_field(values: list[Any], members: Sequence[Any], spot: Spot) -> Places | None:
    """Return the vector field that a list stands for.

    Args:
        values: of the file, numbers and texts.
        members: the types that the key takes.
        spot: where the list stands, with the unit of the key.

    Returns:
        None where no field is asked for, and where nothing in the list has variables.
    """
    letters = ""
    if FIELD in members:
        letters = "xyzt"
    elif AT_START in members and spot.unit in ("m", "m/s", "Pa"):
        letters = "xyz"
    has_texts = any(isinstance(value, str) for value in values)
    if not letters or float in members or not has_texts:
        return None
    texts = [
        value if isinstance(value, str) else repr(value)
        for value in values
        if isinstance(value, str | int | float)
    ]
    components = tuple(
        _read_expression(text, letters, spot.go_to_entry(number))
        for number, text in enumerate(texts, start=1)
    )
    if len(components) < len(values) or not any(component.used for component in components):
        return None
    return Places(components)


def _read_expression(text: str, letters: str, spot: Spot) -> Expression:
    """Return the arithmetic of a text, or the number with a unit that it is.

    The number is in the unit of the key.
    """
    match = None
    if len(text) <= LENGTH:
        match = _VALUE.fullmatch(text.rstrip()) or _ARITHMETIC.fullmatch(text.rstrip())
    try:
        # "2 x" is arithmetic of a variable, and no number of a unit x.
        if match is None or match[2] in tuple(letters):
            return Expression(text, letters)
        number, unit = match.groups()
        if spot.unit is None:
            raise InputError(f"no unit is known for it here: leave {quote(unit)} out")
        factor, dimension = read_unit(unit)
        own_factor, own_dimension = read_unit(spot.unit)
        if dimension != own_dimension:
            proper = "% or as a plain number" if spot.unit == "1" else spot.unit
            raise InputError(f"{quote(unit)} is not a unit of it: give it in {proper}")
        value = float(Expression(number)())
        return Expression(repr(value * (factor / own_factor)))
    except InputError as error:
        variables = f" of {', '.join(letters)}" if letters else ""
        remedy = ""
        if match is None:
            remedy = f"give a number, one with its unit, or arithmetic{variables}; "
        raise spot.make_error(f"is {quote(text)}: {remedy}{error}") from None
