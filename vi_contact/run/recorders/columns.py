"""Name columns of which a recorder has one for each axis."""

from ...core.step import Columns


def expand_axes(columns: Columns, axes: str) -> Columns:
    """Return the columns with {axis} in their names and meanings filled in for each of the axes."""
    named = {}
    for name, (unit, meaning) in columns.items():
        for axis in axes if "{axis}" in name else "-":  # once where the name has no axis
            named[name.format(axis=axis)] = (unit, meaning.format(axis=axis))
    return named
