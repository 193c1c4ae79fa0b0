"""Hold the histories of a run in memory, and tally them.

These are compact columns; of a run with a folder only so much of them is held.
"""

import copy
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array, Comm, SerialComm
from ...core.checks import quote
from ...core.errors import InputError, ViContactError
from ...core.files import open_hdf5
from ...core.step import Columns, Row

BLOCK = 256  # rows that are turned into columns together, or those of so many bytes of arrays:
BYTES = 16 * 2**20
KEPT = 64 * 2**20  # bytes of histories that stay in memory of a run with a folder, on each rank
SHARED = 10_000  # rows of an array (contact points) up to which every rank gets it at the end

# Terms of the energy ledger: column -> title, in the order in which a summary prints them.
LEDGER = {
    "work_input": "input work",
    "energy_kinetic": "kinetic energy",
    "energy_strain": "strain energy",
    "loss_damping": "damping",
    "loss_contact": "contact work",
    "loss_friction": "friction work",
    "loss_impact": "impact loss",
    "loss_algorithmic": "algorithmic loss",
    "loss_plastic": "work of yielding",
    "energy_defect": "defect",
}

LOSSES = [name for name in LEDGER if name.startswith("loss_") and name != "loss_plastic"]

# Shares with friction, nan while open: column -> their name in the summary.
SHARES = {"friction_used": "friction_used", "contact_slipping": "slipping"}

# column -> values of some rows: (rows,) float64, or (rows, *shape) of the arrays
Block = dict[str, Array]


class Table:
    """Hold columns and rows of a run: numbers on every rank, arrays on rank 0.

    Rows are gathered in blocks, which are columns: less memory, and what the files want.

    Attributes:
        columns: column -> (unit, meaning).
        first: the row it was made with.
        count: rows so far.
        numbers: columns of history.csv, in order.
        arrays: on rank 0 the others, which only HDF5 holds, with a sample.
        file: the history.h5 of a run with a folder, which has the rows too: beyond KEPT bytes the
            memory lets them go.
        block: how many rows are turned into columns, read or written together.
    """

    def __init__(
        self, columns: Columns, first: Row, file: Path | None = None, comm: Comm | None = None
    ) -> None:
        """Begin with the row of the first state.

        Args:
            columns: column -> (unit, meaning).
            first: the row.
            file: the history.h5 of a run with a folder.
            comm: of the ranks that share the run; this rank alone when None.
        """
        self.columns = columns
        self.first = first
        self.file = file
        self.count = 0
        self._comm = comm or SerialComm()
        self._types: set[type] = set()
        self.check(first)
        self.numbers = [name for name in columns if not isinstance(first[name], np.ndarray)]
        arrays = [] if self._comm.rank else [name for name in columns if name not in self.numbers]
        self.arrays = {name: np.array(first[name]) for name in arrays}
        bytes_of_row = max(sum(sample.nbytes for sample in self.arrays.values()), 1)
        self.block = max(1, min(BLOCK, BYTES // bytes_of_row))
        self._open: list[Row] = []  # rows that are not yet a block
        self._blocks: list[Block] = []
        self._size = 0  # bytes of all blocks so far
        self._complete = True  # whether the memory has all of them
        self._tally = Tally()
        self.append(first)

    def check(self, row: Row) -> None:
        """Raise InputError for a row with other columns than its recorder has announced.

        So it does for a row that is not of numbers.
        """
        if row.keys() == self.columns.keys() and self._types.issuperset(map(type, row.values())):
            return
        for name in sorted(row.keys() ^ self.columns.keys()):
            raise InputError(
                f"a recorder names the column '{name}' in columns() only, or in start() and row() "
                "only: let all three name the same columns"
            )
        for name, value in row.items():
            numeric = isinstance(value, int | float | np.generic | np.ndarray)
            if not numeric or isinstance(value, np.str_):
                raise InputError(
                    f"column '{name}' is {quote(value)}: let its recorder return a number or an "
                    "array"
                )
        self._types.update(map(type, row.values()))

    def append(self, row: Row) -> None:
        """Add one more row."""
        self._open.append(row)
        self.count += 1
        if len(self._open) == self.block:
            self._gather()

    def _gather(self) -> None:
        """Turn the rows that wait into a block."""
        if self._open:
            rows = self._open
            self._open = []
            self._store(self._make_columns(rows))

    def restore(self, block: Block) -> None:
        """Add rows of an earlier run.

        They are those before the one that the table was made with.
        """
        if self.count == 1 and self._open:
            self._open = []
            self.count = 0
        self.count += len(block["k"])
        self._store(block)

    def _make_columns(self, rows: list[Row]) -> Block:
        """Return rows as columns: numbers as float64, arrays as their recorder gives them."""
        block: Block = {}
        for name in self.numbers:
            block[name] = np.array([row[name] for row in rows], dtype=float)
        for name in self.arrays:
            block[name] = np.array([row[name] for row in rows])
        return block

    def _store(self, block: Block) -> None:
        """Tally a block and hold it, unless the file has it and the memory is full."""
        self._tally.add(block)
        self._size += sum(values.nbytes for values in block.values())
        if self.file is not None and self._size > KEPT:
            self._complete = False
            self._blocks = []
        if self._complete:
            self._blocks.append(block)

    def rows_in_memory(self) -> Block | None:
        """Return all rows, column -> values, arrays on rank 0 only.

        It is None when the memory has let some go.
        """
        self._gather()
        if not self._complete:
            return None
        rows: Block = {}
        for name in [*self.numbers, *self.arrays]:
            rows[name] = np.concatenate([block[name] for block in self._blocks])
        return rows

    def facts(self) -> dict[str, Any]:
        """Return what the rows say about the run, for its summary."""
        tally = copy.deepcopy(self._tally)
        if self._open:
            tally.add(self._make_columns(self._open))
        return tally.facts()

    def history(self) -> Mapping[str, Array]:
        """Return column -> values of all rows. Collective.

        They are (rows,) float64, or (rows, *shape of the arrays); of too many rows for the memory,
        or points for every rank, as they are in the file.
        """
        rows = self.rows_in_memory() or {}

        # Rank 0 hands arrays of few points to all ranks, in pieces: a message of MPI holds 2 GB at
        # most.
        pieces: dict[str, int] = {}
        for name, sample in self.arrays.items():
            if name in rows and sample.shape[:1] <= (SHARED,):
                pieces[name] = 1 + rows[name].nbytes // BYTES
        pieces = self._comm.bcast(pieces)
        if self._comm.size > 1:
            for name, count in pieces.items():
                parts: list[Any] = [None] * count
                if self._comm.rank == 0:
                    parts = np.array_split(rows[name], count)
                rows[name] = np.concatenate([self._comm.bcast(part) for part in parts])
        if len(rows) == len(self.columns):
            return rows
        return StoredHistory(self.file, rows, list(self.columns))


class StoredHistory(Mapping[str, Array]):
    """Hold histories that are read column by column from history.h5 when somebody asks.

    Those that are in memory are not read.

    Raises:
        ViContactError: there is no file, or not any more, or it no longer holds these rows.
    """

    def __init__(self, file: Path | None, in_memory: Block, names: list[str]) -> None:
        """Note which state of the file has the rows.

        Args:
            file: the history.h5, None for a run without a folder.
            in_memory: columns that need not be read.
            names: of all columns.
        """
        self._file = file
        self._in_memory = in_memory
        self._names = names
        self._stamp = self._stamp_now()

    def _stamp_now(self) -> tuple[int, int] | None:
        """Return time and size of the file, None where there is none."""
        try:
            status = os.lstat(self._file or "")
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size

    def __getitem__(self, name: str) -> Array:
        if name not in self._names:
            raise KeyError(name)
        if name in self._in_memory:
            return self._in_memory[name]
        if self._file is None:
            raise ViContactError(
                f"'{name}' of more than {SHARED} points is on rank 0 only: give the run an output "
                "folder (out=), from which every rank reads it"
            )
        if self._stamp is None or self._stamp_now() != self._stamp:
            raise ViContactError(
                f"'{self._file}', which holds the histories of this run, was replaced or is not on "
                "this machine: give every run a folder of its own on a shared disk"
            )
        with open_hdf5(self._file) as file:
            return np.asarray(file[name][()])

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Tally:
    """Tally steps, iterations, worst certificate, contact and energy ledger of a run.

    Row 0 is the initial state, which is no step.
    """

    def __init__(self) -> None:
        self._rows = 0
        self._sums: dict[str, float] = {}
        self._most: dict[str, float] = {}
        self._first: dict[str, float] = {}
        self._last: dict[str, float] = {}

    def add(self, rows: Mapping[str, Array]) -> None:
        """Add rows, in order: column -> values."""
        ends = [name for name in ("t", *LEDGER, *SHARES) if name in rows]
        self._last = {name: float(rows[name][-1]) for name in ends}
        if not self._first:
            self._first = {name: float(rows[name][0]) for name in ends}
        steps = slice(0 if self._rows else 1, None)
        self._rows += len(rows["t"])
        self._add_to_sum("iterations", rows["iterations"][steps])
        self._add_to_sum("escalated", rows["escalated"])
        self._take_largest("iterations", rows["iterations"][steps])
        self._take_largest("certificate", rows["certificate"])
        if "contact_uplift" in rows:
            self._take_largest("uplift", rows["contact_uplift"])
            self._take_largest(
                "depth", -rows["contact_min_gap"], np.fmax
            )  # nan without contact points
            self._add_to_sum("contact", np.sign(rows["contact_active"][steps]))
        for name in SHARES:
            if name in rows:
                self._take_largest(name, rows[name], np.fmax)  # nan while open
        if "energy_defect" in rows:
            self._take_largest("energy", rows["energy_kinetic"] + rows["energy_strain"])
            self._take_largest("work", np.abs(rows["work_input"]))
            self._take_largest("defect", np.abs(rows["energy_defect"]))
            # what yielding takes hides nothing that the scheme creates
            losses = sum(rows[name] for name in LOSSES if name in rows)
            if "energy_joint" in rows:
                # those of a joint hold the works of water and prestress, and what it gives back
                stored = self._sums.setdefault("joint at the start", rows["energy_joint"][0])
                losses = losses + rows["work_joint_water"] + rows["work_prestress"]
                losses = losses - (rows["energy_joint"] - stored)
            self._take_largest("created", -np.asarray(losses))

    def _add_to_sum(self, name: str, values: Array) -> None:
        """Add values to a sum."""
        self._sums[name] = self._sums.get(name, 0.0) + float(np.sum(values))

    def _take_largest(self, name: str, values: Array, larger: np.ufunc = np.maximum) -> None:
        """Take the largest so far.

        Args:
            name: of what is largest.
            values: of some rows (rows,).
            larger: NaN stays NaN with ``np.maximum``, and is left out with ``np.fmax``.
        """
        if len(values):
            largest = float(larger.reduce(values))
            self._most[name] = float(larger(self._most.get(name, largest), largest))

    def facts(self) -> dict[str, Any]:
        """Return the numbers for summary.json."""
        steps = self._rows - 1
        most = self._most
        mean = self._sums["iterations"] / steps if steps else 0.0
        iterations = {"mean": mean, "max": int(most.get("iterations", 0))}
        facts: dict[str, Any] = {
            "steps": steps,
            "t_start": self._first["t"],
            "t_end": self._last["t"],
            "iterations_per_step": iterations,
            "escalated_steps": int(self._sums["escalated"]),
            "worst_certificate": most["certificate"],
        }
        if "uplift" in most:  # a negative gap: gap drift of the scheme
            facts |= {
                "largest_uplift": most["uplift"],
                "smallest_gap": -most["depth"],
                "steps_in_contact": int(self._sums["contact"]),
            }
        for name, fact in SHARES.items():
            if name in most:  # of no contact in the whole run there is none: nan
                ends = {"end": self._last[name], "largest": most[name]}
                facts[fact] = {key: None if np.isnan(x) else x for key, x in ends.items()}
        if "defect" in most:
            facts |= self._sum_up_energy()
        return facts

    def _sum_up_energy(self) -> dict[str, Any]:
        """Return the ledger at the end [J], and its largest defect.

        The defect is relative to the largest energy or input work of the run.
        """
        most = self._most
        last = self._last
        start = self._first["energy_kinetic"] + self._first["energy_strain"]
        size = max(most["energy"], most["work"])
        relative = most["defect"] / size if size > 0.0 else most["defect"]
        created = max(0.0, most["created"])
        energy = {
            "energy_start": start,
            "energy_max": most["energy"],
            **{name: last[name] for name in LEDGER if name in last and name != "energy_defect"},
            "energy_defect_joule": last["energy_defect"],
            "energy_defect": relative,
        }
        created = created / size if size > 0.0 else created
        return {"energy": energy, "energy_defect": relative, "energy_created": created}
