"""Name columns of which a recorder has one for each axis."""

from ...core.step import Columns


def along_axes(columns: Columns, axes: str) -> Columns:
    """Return the columns with {axis} in their names and meanings filled in for each of the axes."""
    return {
        name.format(axis=one): (unit, meaning.format(axis=one))
        for name, (unit, meaning) in columns.items()
        for one in (axes if "{axis}" in name else "-")
    }
