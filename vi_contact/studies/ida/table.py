"""The table of an incremental dynamic analysis: from the folders of its runs to tidy rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError
from ...ground_motion import scaled
from ...run.files.reading import read_run
from ..cases.case import Case
from .measures import Demand, Intensity
from .runs import ROW, Shaking, read_row

Row = dict[str, Any]
Units = dict[str, tuple[str, str]]


def tabulated(case: Case, out: Path, measure: Intensity, demands: Sequence[Demand]) -> tuple[list[Row], Units]:
    """Return (rows by record and scale, column -> (unit, meaning)) of all runs in the folder that have ended.

    What a run has not measured is None: its demands when it failed, its intensity when its record cannot be read.
    InputError when a finished run has no such column.
    """
    found = [(path.parent, row) for path in out.glob(f"*/{ROW}") if (row := read_row(path)) is not None]
    found.sort(key=lambda one: (one[1]["record"], math.inf if one[1]["scale"] is None else one[1]["scale"]))
    units: Units = {
        "record": ("-", "name of the record"),
        "scale": ("-", "factor on the motion of the case"),
        measure.name: (measure.unit, f"{measure.meaning} of the scaled motion"),
    } | {one.name: ("", one.meaning) for one in demands} | {
        "certificate": ("-", "worst certificate of the run"),
        "energy_created": ("-", "energy that contact and time scheme created, over the largest; with Energy() only"),
        "steps": ("-", "steps of the run"),
        "status": ("-", "finished or failed"),
        "reason": ("-", "why a run failed"),
    }
    rows = []
    for folder, row in found:
        measured: Row = {measure.name: _intensity(case, row, measure)} | {one.name: None for one in demands}
        if row["status"] == "finished":
            history, of_column = _history(folder, tuple(one.column for one in demands))
            for one in demands:
                measured[one.name] = one.of(history)
                units[one.name] = (of_column[one.column][0], f"{one.meaning}: {of_column[one.column][1]}")
        rows.append({name: measured.get(name, row.get(name)) for name in units})
    return rows, units


def _intensity(case: Case, row: Row, measure: Intensity) -> float | None:
    shaking = Shaking(row["record"], tuple(Path(path) for path in row["files"]))
    if row["scale"] is None:
        return None
    try:
        return measure.of(scaled(shaking.record(case), factor=row["scale"]))
    except InputError:
        return None


@cache
def _history(folder: Path, wanted: tuple[str, ...]) -> tuple[dict[str, Array], Units]:
    """Columns of a finished run, read once: the wanted ones; all names where one of them is missing."""
    run = read_run(folder)
    numbers = {name: values for name, values in run.history.items() if np.ndim(values) == 1}
    kept = {name: numbers[name] for name in wanted if name in numbers}
    return (kept if len(kept) == len(set(wanted)) else numbers), dict(run.columns)
