"""Hand out the histories of a run as a Dataset of xarray."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.step import Columns
from .files.reading import ContactGeometry

AXES = "xyz"
TIME = "t"
POINT = "point"  # a contact condition: one point, or one of its faces
TANGENT = "tangent"
# of contact points: their unit and meaning
_GEOMETRY = {
    "weight": ("m²", "area of a contact point; in the plane per thickness, if it has none"),
    "gap0": ("m", "initial gap"),
    "bilateral": ("-", "whether the point is held in both directions"),
}
# what a Dataset tells of the run
_FACTS = (
    "status",
    "scheme",
    "solver",
    "mass",
    "unknowns",
    "contact_points",
    "worst_certificate",
    "energy_defect",
    "energy_created",
)


def make_dataset(
    history: Mapping[str, Array],
    columns: Columns,
    facts: Mapping[str, Any],
    contact: ContactGeometry | None,
) -> Any:
    """Return histories as a Dataset with units and long names.

    Args:
        history: column -> (rows,) or (rows, m, …).
        columns: column -> (unit, meaning).
        facts: of the summary.
        contact: of the contact points of the arrays, None without.

    Raises:
        InputError: xarray is not installed.
    """
    try:
        xarray: Any = import_module("xarray")
    except ImportError as error:
        raise InputError(
            "to_xarray: xarray is not installed: pip install xarray, or use solution.history and "
            "solution.columns"
        ) from error
    count = 0 if contact is None else len(contact.points)

    # A column of numbers has one value a step; the second axis of arrays is that of the points.
    variables = {}
    for name, values in history.items():
        unit, meaning = columns.get(name, ("-", name))
        dimensions = (TIME, *_name_axes(name, values.shape[1:], count))
        variables[name] = (dimensions, values, _describe(unit, meaning))
    coordinates = {TIME: variables.pop(TIME)}
    if contact is not None:
        coordinates |= _describe_points(contact)
    told = {name: facts[name] for name in _FACTS if isinstance(facts.get(name), str | int | float)}
    return xarray.Dataset(variables, coordinates, told)


def _name_axes(name: str, shape: tuple[int, ...], count: int) -> list[str]:
    """Return names of the axes of an array after the first.

    Args:
        name: of the array.
        shape: of a row.
        count: number of contact points.
    """
    if not shape:
        return []
    axes = [f"{name}_{i}" for i in range(1, len(shape) + 1)]
    if shape[0] == count:
        axes[0] = POINT
        if len(shape) == 2 and name in ("traction_t", "slip"):
            axes[1] = TANGENT
    return axes


def _describe(unit: str, meaning: str) -> dict[str, str]:
    """Return the attributes of a variable; a pure number has the unit 1, as readers expect."""
    return {"units": "1" if unit == "-" else unit, "long_name": meaning}


def _describe_points(contact: ContactGeometry) -> dict[str, Any]:
    """Return the coordinates of contact points and the numbers that belong to them."""
    found: dict[str, Any] = {}
    for i, axis in enumerate(AXES[: contact.points.shape[1]]):
        found[axis] = (POINT, contact.points[:, i], _describe("m", f"{axis} of the contact point"))
        meaning = f"component {axis} of the direction away from the obstacle"
        found[f"normal_{axis}"] = (POINT, contact.normals[:, i], _describe("-", meaning))
    values = {
        "weight": contact.weights,
        "gap0": contact.gap0,
        "bilateral": np.asarray(contact.bilateral, dtype=bool),
    }
    for name, (unit, meaning) in _GEOMETRY.items():
        found[name] = (POINT, values[name], _describe(unit, meaning))
    return found
