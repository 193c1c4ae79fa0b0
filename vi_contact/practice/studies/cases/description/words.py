"""Say in lines of text what ``describe`` found."""

from collections.abc import Mapping
from typing import Any

from ....units.report_units import ReportUnits
from .tables import input_tables, print_tables


def put_in_words(model: Mapping[str, Any], units: ReportUnits | None = None) -> str:
    """Return what ``describe`` found, as lines of text: the tables, then what is doubted.

    Args:
        model: as of ``describe``.
        units: in which numbers are written; None: the usual ones.
    """
    tables = print_tables(input_tables(model, units or ReportUnits()))
    doubts = [f"doubt: {warning}" for warning in model["warnings"]]
    return "\n".join([str(model["title"]), tables, *doubts])


def count_doubts(model: Mapping[str, Any]) -> str:
    """Return how many doubts there are about a model, in words."""
    number = len(model["warnings"])
    if number == 0:
        return "no doubts about the model"
    return "1 doubt about the model" if number == 1 else f"{number} doubts about the model"
