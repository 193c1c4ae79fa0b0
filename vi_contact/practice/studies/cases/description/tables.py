"""Write what model.json says in tables: quantity, value, unit and remark.

``run --check`` prints these rows, and the report has the same before its first figure.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

from ....plots.report_numbers import read_slice
from ....plots.sections import Table
from ....units.report_units import ReportUnits
from .pen import NONE, Model, Pen, Row
from .rows_of_actions import list_contact, list_loads, list_supports
from .rows_of_bodies import list_bodies, list_model
from .rows_of_motions import list_motions, list_spectra
from .rows_of_steps import list_damping, list_sides, list_steps
from .water_and_joints import list_reservoir

HEADER = ("quantity", "value", "unit", "remark")
# Title of a table -> its rows.
TABLES: Mapping[str, Callable[[Model, Pen], Iterator[Row]]] = {
    "model": list_model,
    "bodies and materials": list_bodies,
    "reservoir": list_reservoir,
    "loads": list_loads,
    "supports": list_supports,
    "contact": list_contact,
    "motions": list_motions,
    "response spectra": list_spectra,
    "damping and periods": list_damping,
    "time steps and waves": list_steps,
    "sides of the model": list_sides,
}


def input_tables(model: Model, units: ReportUnits) -> list[Table]:
    """Return what a model is made of and what acts on it, in tables of rows.

    Keys that a model does not have, as one that an earlier version wrote, are left out.

    Args:
        model: as of ``describe``, or what model.json holds.
        units: in which numbers are written.

    Returns:
        Tables with the columns of HEADER; those without rows are left out.
    """
    pen = Pen(units, read_slice(model))
    tables = []
    for title, list_rows in TABLES.items():
        rows = list(list_rows(model, pen))
        if rows:
            tables.append(Table(HEADER, rows, title))
    return tables


def print_tables(tables: Sequence[Table]) -> str:
    """Return tables as lines of text, each below its title, with their columns in line."""
    lines = []
    for table in tables:
        lines.append(f"{table.title}:")
        widths = [max(len(row[column]) for row in table.rows) for column in range(3)]
        for quantity, value, unit, remark in table.rows:
            shown = "" if unit == NONE else unit
            cells = (quantity.ljust(widths[0]), value.rjust(widths[1]), shown.ljust(widths[2]))
            lines.append(f"  {'  '.join((*cells, remark))}".rstrip())
    return "\n".join(lines)
