"""Read the rows that an earlier run left in its folder, block by block.

They are what a restart goes on from.

Numbers are in history.csv, arrays in history.h5, of later steps in history.journal; the checkpoint
has their checksum.
"""

import hashlib
import os
from collections.abc import Container, Iterator, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError, is_of_machine
from ...core.files import open_hdf5
from ...core.own_files import is_own, open_to_read
from ...core.step import Row
from .folder import HISTORY_CSV, HISTORY_H5, JOURNAL, check_folder_format
from .table import Block, Table


def write_lines(table: Table, rows: Sequence[Row]) -> list[bytes]:
    """Return lines of history.csv.

    Whole numbers stay whole, all others are floats that read back to the last bit.
    """
    values = []
    for row in rows:
        numbers = [row[name] for name in table.numbers]
        values.append([x if type(x) is int else float(x) for x in numbers])
    # One repr of all rows, [[…],[…]] without blanks, is much faster than one of each number.
    text = repr(values).replace(" ", "").encode()
    return [line + b"\n" for line in text[2:-2].split(b"],[")]


def pack_records(table: Table, block: Block) -> list[bytes]:
    """Return the arrays of rows as the journal has them.

    They are float64, k first; empty ones when there are none.
    """
    n = len(block["k"])
    if not table.arrays:
        return [b""] * n
    arrays = [np.asarray(block[name], dtype=float).reshape(n, -1) for name in ("k", *table.arrays)]
    return [record.tobytes() for record in np.hstack(arrays)]


class StoredRows:
    """Read the rows of an earlier run up to a step.

    Attributes, the last two after ``blocks`` has come to its end:
        folder: where they are.
        k: the step.
        length: bytes of their part of history.csv.
        hash: of what was read.
    """

    def __init__(self, folder: Path, table: Table, k: int, checksum: str = "") -> None:
        """Say which rows are read.

        Args:
            folder: where they are.
            table: whose columns they must have.
            k: the step up to which they are read.
            checksum: what they must have, as of the checkpoint; "" for one without.
        """
        self.folder = folder
        self.k = k
        self.length = 0
        self.hash = hashlib.sha256()
        self._table = table
        self._checksum = checksum

    def blocks(self) -> Iterator[Block]:
        """Yield the rows, in order.

        Raises:
            InputError: something is missing, damaged or of other columns.
        """
        check_folder_format(self.folder)
        path = self.folder / HISTORY_CSV
        names = self._table.numbers
        if not is_own(path):
            raise InputError(
                f"'{path}' is missing, so the histories cannot be continued: start a new run"
            )
        self.hash = hashlib.sha256()
        with open_to_read(path) as csv, closing(StoredArrays(self.folder, self._table)) as arrays:
            header = csv.readline()
            if header.decode(errors="replace").strip() != ",".join(names):
                raise InputError(
                    f"'{path}' holds other columns than this run records: restart with the same "
                    "recorders"
                )
            self.length = len(header)
            for lines, block in read_blocks(csv, self._table, arrays, k=self.k):
                for line, record in zip(lines, pack_records(self._table, block), strict=True):
                    self.length += len(line)
                    self.hash.update(line + record)
                yield block
            if self._checksum and self.hash.hexdigest() != self._checksum:
                raise InputError(
                    f"the histories in '{self.folder}' do not belong to the checkpoint, or a file "
                    "is damaged: restore the folder or start a new run"
                )


def read_blocks(
    csv: Any, table: Table, arrays: "StoredArrays", *, first: int = 0, k: int | None = None
) -> Iterator[tuple[list[bytes], Block]]:
    """Yield (lines, rows) from where history.csv is open; a line that is cut short is left out.

    Args:
        csv: the open history.csv.
        table: of its columns.
        arrays: from which the arrays of its rows are read.
        first: the row at which it is.
        k: the step to which is read; to the end of the file when None.

    Raises:
        InputError: steps are missing, or something is damaged.
    """
    done = first
    while True:
        lines = [line for line in islice(csv, table.block) if line.endswith(b"\n")]
        numbers = parse_numbers(csv.name, lines, len(table.numbers), done)
        steps = numbers[:, table.numbers.index("k")]
        if len(steps) and not np.array_equal(steps, steps[0] + np.arange(len(steps))):
            raise InputError(
                f"the steps in '{csv.name}' after line {done + 1} do not follow each other: "
                "restore it or start a new run"
            )
        n = len(steps) if k is None else int(np.searchsorted(steps, k, side="right"))
        if n:
            block = dict(zip(table.numbers, numbers[:n].T, strict=True))
            yield lines[:n], block | arrays.rows(done, steps[:n])
        done += n
        if k is not None and n and steps[n - 1] == k:
            return
        if n < table.block:
            if k is None:
                return
            raise InputError(
                f"'{csv.name}' does not reach step {k} of the checkpoint: restore it or start a "
                "new run"
            )


def parse_numbers(path: str, lines: list[bytes], width: int, before: int) -> Array:
    """Return the numbers of lines (rows, width).

    Args:
        path: of the file, for the sentence.
        lines: of it.
        width: how many numbers each must have.
        before: how many rows are before them in the file.

    Raises:
        InputError: names the first line that holds something else.
    """
    values: list[list[float]] = []
    for i, line in enumerate(lines):
        texts = line.replace(b"_", b"?").split(b",")  # float() would read 1_0 as ten
        try:
            values.append([float(text) for _, text in zip(range(width), texts, strict=True)])
        except ValueError as error:
            raise InputError(
                f"line {before + i + 2} of '{path}' is damaged: restore it or start a new run"
            ) from error
    return np.array(values).reshape(-1, width)


class StoredArrays:
    """Read the arrays of a table in history.h5 (the first rows) and in the journal (later ones)."""

    def __init__(self, folder: Path, table: Table) -> None:
        self._path = folder / HISTORY_H5
        self._samples = table.arrays
        self._file: Any = None
        self._journal: Array
        if table.arrays:
            width = 1 + sum(sample.size for sample in table.arrays.values())  # k, then the arrays
            self._journal = _open_journal(folder / JOURNAL, width)
            try:
                self._file = open_hdf5(self._path)
            except OSError as error:  # missing or damaged: the journal may still have all
                if is_of_machine(error):
                    raise

    def close(self) -> None:
        """Close history.h5."""
        if self._file is not None:
            self._file.close()

    def rows(self, first: int, steps: Array) -> Block:
        """Return the arrays of consecutive rows, of these steps.

        Raises:
            InputError: one is missing.
        """
        if not self._samples:
            return {}
        n = self._count_in_hdf5(first, steps)
        parts = [self._read_hdf5(first, n)] if n else []
        if n < len(steps):
            parts.append(self._read_journal(steps[n:]))
        block: Block = {}
        for name in self._samples:
            block[name] = np.concatenate([part[name] for part in parts])
        return block

    def _count_in_hdf5(self, first: int, steps: Array) -> int:
        """Return how many of the rows history.h5 has, all of the right shape."""
        try:
            stored = self._file["k"]
            for name, sample in self._samples.items():
                if self._file[name].shape != (*stored.shape, *sample.shape):
                    return 0
            n = min(max(stored.shape[0] - first, 0), len(steps))
            return n if np.array_equal(stored[first : first + n], steps[:n]) else 0
        except InputError:
            raise
        except (TypeError, KeyError, AttributeError, ValueError, OSError, RuntimeError) as error:
            # h5py's, of damage
            if is_of_machine(error):
                raise
            return 0

    def _read_hdf5(self, first: int, n: int) -> Block:
        """Return the arrays of n rows from the first on."""
        try:
            block = {}
            for name, sample in self._samples.items():
                values = np.asarray(self._file[name][first : first + n])
                block[name] = values.astype(sample.dtype)
            return block
        except (TypeError, ValueError, OSError, RuntimeError) as error:
            # h5py's, of a file that is damaged
            if is_of_machine(error):
                raise
            raise InputError(
                f"'{self._path}' is damaged ({error}): restore it or start a new run"
            ) from error

    def _read_journal(self, steps: Array) -> Block:
        """Return the arrays of these steps; InputError when they are not there."""
        journal = self._journal
        start = -1
        if len(journal) and np.isfinite(journal[0, 0]):
            start = int(steps[0] - journal[0, 0])
        part = journal[start : start + len(steps)] if start >= 0 else journal[:0]
        if not np.array_equal(part[:, 0], steps):
            missing = int(steps[len(part)] if len(part) < len(steps) else steps[0])
            raise InputError(
                f"'{self._path}' does not hold {', '.join(self._samples)} of step {missing}: "
                "restore it or start a new run"
            )

        # The arrays stand side by side in a row of the journal, after k.
        ends = np.cumsum([sample.size for sample in self._samples.values()])[:-1]
        columns = np.split(np.array(part[:, 1:]), ends, axis=1)
        block = {}
        for (name, sample), column in zip(self._samples.items(), columns, strict=True):
            block[name] = column.reshape(len(part), *sample.shape).astype(sample.dtype)
        return block


def _open_journal(path: Path, width: int) -> Array:
    """Return the rows of the journal; one that was cut short by a crash is left out."""
    if not is_own(path):
        return np.zeros((0, width))
    with open_to_read(path) as file:
        rows = os.fstat(file.fileno()).st_size // (8 * width)
        if not rows:
            return np.zeros((0, width))
        return np.memmap(file, dtype=float, mode="r", shape=(rows, width))


def read_times(folder: Path, steps: Container[int]) -> dict[int, float]:
    """Return step -> time [s] of some rows of history.csv, whose first columns these are."""
    times: dict[int, float] = {}
    with open_to_read(folder / HISTORY_CSV) as file:
        for line in islice(file, 1, None):
            t, k, *_ = line.split(b",", 2)
            if int(k) in steps:
                times[int(k)] = float(t)
    return times
