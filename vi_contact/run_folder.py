"""What a run left in its folder, read back: histories, units, facts and the geometry of the contact points."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .algebra import Array, Mask
from .errors import InputError
from .output import COLUMNS, HISTORY_CSV, HISTORY_H5, SUMMARY, check_folder_format


@dataclass(frozen=True)
class ContactGeometry:
    """Contact points as group ``contact`` of history.h5 has them: see ``ContactSurface``."""

    points: Array
    normals: Array
    weights: Array
    gap0: Array
    bilateral: Mask


@dataclass(frozen=True)
class RunFolder:
    """A run read from its files, as ``Solution`` has it.

    Attributes:
        folder: where it is. history: column -> values, (rows,) or (rows, …) for arrays per contact point.
        columns: column -> (unit, meaning). facts: summary.json; empty while a run goes on or after it was killed.
        contact: None when history.h5 is missing, as early in a run, or the problem has no contact points.
    """

    folder: Path
    history: Mapping[str, Array]
    columns: Mapping[str, tuple[str, str]]
    facts: Mapping[str, Any]
    contact: ContactGeometry | None


def read_run(folder: str | Path) -> RunFolder:
    """Reads a run folder of ``simulate``; of a run that goes on or was killed what is there.

    Numbers come from history.csv, which has every step. Arrays come from history.h5, when it has all steps too (it does
    once the run has ended). InputError when there is no history, or a file is damaged.
    """
    folder = Path(folder)
    if not (folder / HISTORY_CSV).is_file():
        raise InputError(f"'{folder}' has no {HISTORY_CSV}: give the output folder of a run")
    check_folder_format(folder)
    history = _numbers(folder / HISTORY_CSV)
    try:
        described = json.loads((folder / COLUMNS).read_text(encoding="utf-8"))
        columns = {name: (one["unit"], one["meaning"]) for name, one in described.items()}
        path = folder / SUMMARY
        facts = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        arrays, contact = _arrays(folder / HISTORY_H5, len(history["t"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"a file of the run in '{folder}' is missing or damaged ({error}): restore it") from error
    return RunFolder(folder, history | arrays, columns, facts, contact)


def _numbers(path: Path) -> dict[str, Array]:
    """Columns of history.csv; a last line that a crash cut short is left out."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    rows = list(csv.reader(line for line in lines if line.endswith("\n")))
    try:
        values = np.array([[float(text) for text in row] for row in rows[1:]]).reshape(len(rows) - 1, len(rows[0]))
        if not len(values) or "t" not in rows[0]:
            raise ValueError("no rows")
    except (ValueError, IndexError) as error:
        raise InputError(f"'{path}' is damaged ({error}): restore it or run again") from error
    return {name: values[:, i] for i, name in enumerate(rows[0])}


def _arrays(path: Path, rows: int) -> tuple[dict[str, Array], ContactGeometry | None]:
    """(array columns when they have all rows, geometry of the contact points)."""
    if not path.is_file():
        return {}, None
    with h5py.File(path, "r") as file:
        group = file["contact"]
        geometry = ContactGeometry(*(group[name][()] for name in ("points", "normals", "weights", "gap0", "bilateral")))
        arrays = {
            name: item[()] for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.ndim > 1 and item.shape[0] == rows
        }
    return arrays, geometry if len(geometry.weights) else None
