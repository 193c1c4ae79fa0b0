"""Describe a reservoir, and the joint law of a [[contact]] number by number.

`run --check` has a row for each number then, with its unit, as the case file has it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from .....core.quantities import read_quantities
from ..bodies import BODY_TABLES
from ..table_calls import build
from .pen import Model, Pen, Row, list_objects, say

NO_UNIT = "-"
SIZES = ("level", "tail", "silt", "length", "heel", "toe", "drain")  # of the model, in metres


def describe_reservoir(case: Any, tags: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what [reservoir] says, name by name; [] without it.

    Args:
        case: a ``Case``.
        tags: groups of the mesh.
    """
    if "reservoir" not in case.nodes or any(name in case.nodes for name in BODY_TABLES):
        return []
    return list(describe_values(build(case.nodes["reservoir"], {"tags": tags})))


def describe_values(owner: Any, prefix: str = "") -> Iterator[dict[str, Any]]:
    """Yield the values of a reservoir or a law that are given: name, value and unit.

    What it holds in its turn, as the water of a joint, follows with its own name before: "water:
    level". None is left out.

    Args:
        owner: a dataclass with quantities at its fields.
        prefix: of all names.
    """
    quantities = read_quantities(type(owner))
    for field in fields(owner):
        value = getattr(owner, field.name)
        name = f"{prefix}{field.name}"
        if field.name.startswith("_") or value is None:
            continue
        if hasattr(value, "indices"):  # a group of the mesh
            yield {"name": name, "value": value.name, "unit": NO_UNIT}
        elif is_dataclass(value) and not hasattr(value, "text"):
            yield from describe_values(value, f"{name}: ")
        else:
            unit = quantities[field.name].unit if field.name in quantities else None
            symbol = NO_UNIT if unit is None or unit.symbol == "1" else unit.symbol
            yield {"name": name, "value": _make_plain(value), "unit": symbol}


def _make_plain(value: Any) -> Any:
    """Return a number, a flag or a list of numbers as it is, and all else as its text."""
    if isinstance(value, tuple) and all(isinstance(entry, int | float) for entry in value):
        return [float(entry) for entry in value]
    return value if isinstance(value, bool | int | float) else str(value)


def list_reservoir(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the rows of the reservoir."""
    for entry in list_objects(model, "reservoir"):
        yield write_value("", entry, pen)


def list_joint(part: Mapping[str, Any], pen: Pen) -> Iterator[Row]:
    """Yield the rows of the joint law of a part of the contact.

    Args:
        part: of the model's ``contact``, with the key ``joint``.
        pen: writes numbers.
    """
    law = str(part["friction"]).partition("(")[0]
    yield say(f"{part['name']}: joint", law)
    for entry in list_objects(part, "joint"):
        yield write_value(part["name"], entry, pen)


def write_value(owner: str, entry: Mapping[str, Any], pen: Pen) -> Row:
    """Return the row of a value, in the unit of the report.

    Args:
        owner: before its name; "" for none.
        entry: as of ``describe_values``.
        pen: writes numbers.
    """
    name = f"{owner}: {entry['name']}".removeprefix(": ")
    value = entry["value"]
    quantity = "size" if entry["name"].split(": ")[-1] in SIZES else ""
    if isinstance(value, bool):
        return say(name, "yes" if value else "no")
    if isinstance(value, int | float):
        return pen.row(name, value, entry["unit"], quantity=quantity)
    if isinstance(value, list):
        return pen.row_of_several(name, value, entry["unit"], quantity=quantity)
    return say(name, value)
