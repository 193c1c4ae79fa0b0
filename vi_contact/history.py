"""Histories: the rows of a run in memory, and the files that keep them from the step they were computed in.

``history.csv``      one line per step with all numbers, written through at once: a killed run loses nothing.
``columns.json``     unit and meaning of every column.
``history.h5``       numbers and arrays with units as attributes, and the contact geometry; replaced as a whole
                     at checkpoints, once it has grown by a quarter, and at the end.
``history.journal``  the array columns of the steps since then (float64: k, then the arrays of the row).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .algebra import Array
from .errors import InputError
from .output import COLUMNS, HISTORY_CSV, HISTORY_H5, JOURNAL, hdf5_image, to_json, write_all, write_atomically
from .recorders import Columns, Row
from .surfaces import ContactSurface

GROWTH = 1.25  # history.h5 is rewritten when it has grown by this factor: what is written stays in proportion


@dataclass
class Table:
    """Columns and rows of a run, the same on every rank. ``numbers`` and ``arrays`` name the two kinds of columns."""

    columns: Columns
    rows: list[Row] = field(default_factory=list)

    @property
    def numbers(self) -> list[str]:
        """Columns of history.csv, in order."""
        return [name for name in self.columns if not isinstance(self.rows[0][name], np.ndarray)]

    @property
    def arrays(self) -> list[str]:
        """Columns that only HDF5 holds."""
        return [name for name in self.columns if isinstance(self.rows[0][name], np.ndarray)]

    def history(self) -> dict[str, Array]:
        """Column -> values of all rows: (rows,) float64, or (rows, *shape of the arrays)."""
        numbers = {name: np.array([row[name] for row in self.rows], dtype=float) for name in self.numbers}
        return numbers | {name: np.array([row[name] for row in self.rows]) for name in self.arrays}


class HistoryFiles:
    """The files of a table (rank 0 only). Every method may raise OSError.

    ``continued``: the folder holds the rows of the table already, and perhaps later ones, which are dropped.
    """

    def __init__(self, folder: Path, table: Table, surface: ContactSurface, *, continued: bool = False) -> None:
        self._folder, self._table, self._surface = folder, table, surface
        self._numbers, self._arrays = table.numbers, table.arrays
        self._saved = 0
        write_atomically(folder / COLUMNS, (to_json(describe(table.columns)) + "\n").encode())
        if continued:
            _cut(folder / HISTORY_CSV, len(table.rows))
        self._csv = open(folder / HISTORY_CSV, "ab" if continued else "wb", buffering=0)  # noqa: SIM115
        if not continued:
            self._write(self._csv, (",".join(self._numbers) + "\n").encode())
            for row in table.rows:
                self._write(self._csv, self._line(row))
        self._journal: Any = None
        if len(table.rows) > 1:
            self.save()
        elif self._arrays:
            self._open_journal()
            self._write(self._journal, self._record(table.rows[0]))

    def _open_journal(self) -> None:
        if self._journal is not None:
            self._journal.close()
        self._journal = open(self._folder / JOURNAL, "wb", buffering=0)  # noqa: SIM115

    def append(self, row: Row) -> None:
        """A row onto the disk; a line that the disk has no room for is taken back as a whole."""
        if self._arrays:
            self._write(self._journal, self._record(row))
        self._write(self._csv, self._line(row))

    def _write(self, file: Any, data: bytes) -> None:
        start = file.tell()
        try:
            write_all(file, data)
        except OSError as error:
            with suppress(OSError):
                file.truncate(start)
            raise OSError(error.errno, error.strerror, file.name) from error

    def _line(self, row: Row) -> bytes:
        """Whole numbers stay whole, all others are floats that read back to the last bit."""
        values = [row[name] for name in self._numbers]
        return (",".join([repr(v if type(v) is int else float(v)) for v in values]) + "\n").encode()

    def _record(self, row: Row) -> bytes:
        arrays = [np.asarray(row[name], dtype=float).ravel() for name in self._arrays]
        return np.concatenate([[float(row["k"])], *arrays]).tobytes()

    def sync(self) -> None:
        """Rows onto the medium before a checkpoint relies on them; history.h5 when it has grown enough."""
        os.fsync(self._csv.fileno())
        if self._journal is not None:
            os.fsync(self._journal.fileno())
        if len(self._table.rows) >= GROWTH * self._saved:
            self.save()

    def save(self) -> None:
        """history.h5 with all rows; the journal starts anew."""
        write_atomically(self._folder / HISTORY_H5, hdf5_image(self._fill))
        self._saved = len(self._table.rows)
        if self._arrays:
            self._open_journal()

    def _fill(self, file: h5py.File) -> None:
        for name, values in self._table.history().items():
            dataset = file.create_dataset(name, data=values)
            dataset.attrs["unit"], dataset.attrs["meaning"] = self._table.columns[name]
        geometry = file.create_group("contact")
        surface = self._surface
        arrays: tuple[tuple[str, str, Any], ...] = (
            ("points", "m", surface.points),
            ("normals", "-", surface.normals),
            ("weights", "m²", surface.weights),
            ("gap0", "m", surface.gap0),
            ("bilateral", "-", surface.bilateral),
        )
        for name, unit, values in arrays:
            geometry.create_dataset(name, data=values).attrs["unit"] = unit

    def close(self) -> None:
        """All rows in history.h5, no journal left; what cannot be written stays in the other files."""
        try:
            self.save()
            self._close()
            (self._folder / JOURNAL).unlink(missing_ok=True)
        finally:
            self._close()

    def _close(self) -> None:
        for file in (self._csv, self._journal):
            if file is not None:
                with suppress(OSError):
                    file.close()


def describe(columns: Columns) -> dict[str, dict[str, str]]:
    """Column -> unit and meaning, as columns.json has it."""
    return {name: {"unit": unit, "meaning": meaning} for name, (unit, meaning) in columns.items()}


def _cut(path: Path, rows: int) -> None:
    """Keeps the header and the first rows of history.csv; later ones are computed again."""
    with open(path, "rb") as file:
        length = sum(len(file.readline()) for _ in range(rows + 1))
    os.truncate(path, length)


def _values(line: bytes, names: list[str]) -> dict[str, Any]:
    """Numbers of a line; whole ones stay integers."""
    fields = line.decode().strip().split(",")
    values = [int(text) if text.lstrip("-").isdigit() else float(text) for text in fields]
    return dict(zip(names, values, strict=True))


def read_rows(folder: Path, template: Table, k: int) -> list[Row]:
    """The rows up to step k that an earlier run left; InputError when they are missing or have other columns.

    ``template`` is a table with the columns of this run and one row, which gives the shapes of arrays.
    """
    path, names = folder / HISTORY_CSV, template.numbers
    if not path.is_file():
        raise InputError(f"'{path}' is missing, so the histories cannot be continued: start a new run")
    lines = path.read_bytes().splitlines(keepends=True)
    if not lines or lines[0].decode(errors="replace").strip() != ",".join(names):
        raise InputError(f"'{path}' holds other columns than this run records: restart with the same recorders")
    rows: list[dict[str, Any]] = []
    try:
        for line in lines[1:]:
            if line.endswith(b"\n") and (not rows or rows[-1]["k"] < k):
                rows.append(_values(line, names))
    except ValueError as error:
        raise InputError(f"line {len(rows) + 2} of '{path}' is damaged: restore it or start a new run") from error
    if not rows or rows[-1]["k"] != k:
        raise InputError(f"'{path}' does not reach step {k} of the checkpoint: restore it or start a new run")
    _add_arrays(folder, template, rows)
    return list(rows)


def _add_arrays(folder: Path, template: Table, rows: list[dict[str, Any]]) -> None:
    """Array columns from history.h5 and, for later steps, from the journal."""
    shapes = {name: np.asarray(template.rows[0][name]) for name in template.arrays}
    if not shapes:
        return
    found = _stored_arrays(folder / HISTORY_H5, list(shapes)) | _journal(folder / JOURNAL, shapes)
    for row in rows:
        k = int(row["k"])
        if k not in found or any(found[k][name].shape != shape.shape for name, shape in shapes.items()):
            raise InputError(f"'{folder / HISTORY_H5}' does not hold {', '.join(shapes)} of step {k}: start a new run")
        row.update(found[k])


def _stored_arrays(path: Path, names: list[str]) -> dict[int, dict[str, Any]]:
    """k -> arrays in history.h5; nothing when it is missing or damaged (the journal may still have all)."""
    try:
        with h5py.File(path, "r") as file:
            steps = file["k"][()].astype(int)
            values = {name: file[name][()] for name in names}
    except (OSError, KeyError):
        return {}
    return {int(k): {name: values[name][i] for name in names} for i, k in enumerate(steps)}


def _journal(path: Path, shapes: Mapping[str, Array]) -> dict[int, dict[str, Any]]:
    """k -> arrays in the journal; a record cut short by a crash is left out."""
    if not path.is_file():
        return {}
    width = 1 + sum(one.size for one in shapes.values())
    data = np.fromfile(path, dtype=float)
    found = {}
    for record in data[: len(data) // width * width].reshape(-1, width):
        parts = np.split(record[1:], np.cumsum([one.size for one in shapes.values()])[:-1])
        found[int(record[0])] = {
            name: part.reshape(one.shape).astype(one.dtype)
            for (name, one), part in zip(shapes.items(), parts, strict=True)
        }
    return found
