"""Keep the rows of a run in files from the step they were computed in.

The memory need not hold them.

``history.csv``      one line per step with all numbers, written at least once a second and before
                     every checkpoint: a killed run loses no more.
``history.h5``       numbers and arrays with units as attributes, and the contact geometry;
                     replaced as a whole at checkpoints, every ten seconds if it has grown by a
                     quarter, and at the end.
``history.journal``  the array columns of the steps since then (float64: k, then the arrays of the
                     row).
"""

import hashlib
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.files import (
    STRIDE,
    copy_start,
    hdf5_atomically,
    open_hdf5,
    push,
    to_json,
    write_all,
    write_atomically,
)
from ...core.own_files import open_new, open_to_append, open_to_read, remove
from ...core.step import Row
from .folder import COLUMNS, FORMAT, HISTORY_CSV, HISTORY_H5, JOURNAL
from .stored_rows import StoredArrays, StoredRows, pack_records, read_blocks, write_lines
from .table import Block, Table

# of contact points, units
GEOMETRY = {
    "points": "m",
    "normals": "-",
    "weights": "m²",
    "gap0": "m",
    "bilateral": "-",
    "uncovered": "-",
    "alone": "-",
}
PUSH = 1.0  # seconds after which rows are pushed onto the medium again
SAVE = 10.0  # seconds after which history.h5 is rewritten again
# history.h5 is rewritten when it has grown by this factor: what is written stays in proportion
GROWTH = 1.25


class HistoryFiles:
    """Keep the files of a table (rank 0 only) and the GEOMETRY of contact points.

    Every method may raise OSError.
    """

    def __init__(
        self,
        folder: Path,
        table: Table,
        geometry: Mapping[str, Array],
        stored: StoredRows | None = None,
    ) -> None:
        """Make the files, or go on with those of an earlier run.

        Args:
            folder: of the run, with its lock.
            table: the rows.
            geometry: name -> values of all contact points, as GEOMETRY names them.
            stored: the rows of an earlier run that this one continues, in this folder (later ones
                are dropped) or another.
        """
        self._folder = folder
        self._table = table
        self._geometry = geometry
        self._rows = 0  # in history.csv
        self._last = 0  # step of the last of them
        self._saved = 0  # rows in history.h5
        self._tail = 0  # byte of history.csv where the rows begin that history.h5 has not
        self._hash = hashlib.sha256()  # of all rows
        self._journal: Any = None
        self._time_of_push = time.monotonic()
        self._time_of_save = time.monotonic()
        columns = {}
        for name, (unit, meaning) in table.columns.items():
            columns[name] = {"unit": unit, "meaning": meaning}
        write_atomically(folder / COLUMNS, (to_json(columns) + "\n").encode())
        if stored is None:
            self._csv = open_new(folder / HISTORY_CSV)
            _append((self._csv, (",".join(table.numbers) + "\n").encode()))
            self._tail = self._csv.tell()
            self._open_journal()
            self.append(table.first)
        else:
            self._continue(stored)

    def _continue(self, stored: StoredRows) -> None:
        """Take over the rows of an earlier run, up to the step of its checkpoint."""
        self._rows = self._table.count
        self._replace(stored.blocks())
        self._hash = stored.hash.copy()
        self._last = stored.k
        csv = self._folder / HISTORY_CSV
        if stored.folder.resolve() != self._folder.resolve():
            copy_start(stored.folder / HISTORY_CSV, csv, stored.length)
        self._csv = open_to_append(csv)
        self._csv.truncate(stored.length)
        self._csv.seek(stored.length)
        self._tail = stored.length
        self._open_journal()

    def _open_journal(self) -> None:
        """Begin a journal for the arrays of later rows, if the run records any."""
        if self._journal is not None:
            self._journal.close()
        if self._table.arrays:
            self._journal = open_new(self._folder / JOURNAL)

    def append(self, *rows: Row) -> None:
        """Write rows onto the disk; those that it has no room for are taken back, all of them."""
        lines = write_lines(self._table, rows)
        block = {}
        for name in ("k", *self._table.arrays):
            block[name] = np.array([row[name] for row in rows])
        records = pack_records(self._table, block)
        _append((self._journal, b"".join(records)), (self._csv, b"".join(lines)))
        for line, record in zip(lines, records, strict=True):
            self._hash.update(line + record)
        self._rows += len(rows)
        self._last = int(rows[-1]["k"])

    def checksum(self, k: int) -> str:
        """Return the checksum of the rows up to step k.

        Later ones are of a base step that is not at its end.
        """
        if k == self._last:
            return self._hash.hexdigest()
        stored = StoredRows(self._folder, self._table, k)
        for _ in stored.blocks():
            pass
        return stored.hash.hexdigest()

    def sync(self) -> bool:
        """Push rows onto the medium unless that was done a moment ago.

        history.h5 is pushed when it has grown enough. The answer says whether a checkpoint can rely
        on them even when the power fails.
        """
        now = time.monotonic()
        if now - self._time_of_push < PUSH:
            return False
        for file in filter(None, (self._csv, self._journal)):
            os.fsync(file.fileno())
        if now - self._time_of_save >= SAVE and self._rows >= GROWTH * self._saved:
            self.save()
            self._time_of_save = time.monotonic()
        self._time_of_push = time.monotonic()
        return True

    def save(self) -> None:
        """Write history.h5 with all rows, from the memory if they are there.

        The journal starts anew.
        """
        rows = self._table.rows_in_memory() if self._rows == self._table.count else None
        if rows is not None:
            since_then = {name: values[self._saved :] for name, values in rows.items()}
            self._replace(iter([since_then]), self._saved)
        else:
            path = self._folder / HISTORY_CSV
            stored = StoredArrays(self._folder, self._table)
            with open_to_read(path) as csv, closing(stored) as arrays:
                csv.seek(self._tail)
                since = read_blocks(csv, self._table, arrays, first=self._saved)
                self._replace((block for _, block in since), self._saved)
        self._tail = self._csv.tell()
        self._open_journal()

    def _replace(self, blocks: Iterator[Block], old_rows: int = 0) -> None:
        """Write history.h5 with so many rows of the old one, and these."""
        hdf5_atomically(self._folder / HISTORY_H5, lambda file: self._fill(file, blocks, old_rows))
        self._saved = self._rows

    def _fill(self, file: Any, blocks: Iterator[Block], old_rows: int) -> None:
        """Fill a new history.h5.

        Args:
            file: the open file, empty.
            blocks: the rows after those of the old one.
            old_rows: how many rows the old one gives.
        """
        file.attrs["format"] = FORMAT
        datasets = {}
        for name, (unit, meaning) in self._table.columns.items():
            sample = self._table.arrays.get(name, np.zeros(()))
            dataset = file.create_dataset(name, (self._rows, *sample.shape), sample.dtype)
            dataset.attrs.update(unit=unit, meaning=meaning)
            datasets[name] = (dataset, sample.nbytes)
        if old_rows:  # a stride at a time: they may be larger than the memory
            with open_hdf5(self._folder / HISTORY_H5) as old:
                for name, (dataset, size) in datasets.items():
                    stride = max(1, STRIDE // max(size, 1))
                    for first in range(0, old_rows, stride):
                        rows = slice(first, min(first + stride, old_rows))
                        dataset[rows] = old[name][rows]
        first = old_rows
        for block in blocks:
            rows = slice(first, first + len(block["k"]))
            for name, (dataset, _) in datasets.items():
                dataset[rows] = block[name]
            first = rows.stop
        for name, unit in GEOMETRY.items():
            file.create_dataset(f"contact/{name}", data=self._geometry[name]).attrs["unit"] = unit

    def close(self) -> None:
        """Write all rows into history.h5 and leave no journal.

        What cannot be written stays in the other files.
        """
        try:
            push(self._folder / HISTORY_CSV)
            self.save()
        finally:
            for file in filter(None, (self._csv, self._journal)):
                with suppress(OSError):
                    file.close()
        remove(self._folder / JOURNAL)


def _append(*pairs: tuple[Any, bytes]) -> None:
    """Write these bytes to the files that there are.

    What one has no room for is cut off from all of them.
    """
    begun: list[tuple[Any, int]] = []
    try:
        for file, data in pairs:
            if file is not None:
                begun.append((file, file.tell()))
                write_all(file, data)
    except OSError as error:
        for other, start in begun:
            with suppress(OSError):
                other.truncate(start)
                other.seek(start)
        raise OSError(error.errno, error.strerror, str(file.name)) from error
