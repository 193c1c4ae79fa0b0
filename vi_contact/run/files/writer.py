"""Write everything a run writes while it works, in one place.

This is histories, fields, checkpoints, log and summary.
"""

import logging
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ...core.algebra import Array, SerialComm, largest
from ...core.files import list_frames, on_root, push, to_json, write_atomically
from ...core.hdf5_changes import undo_broken_change
from ...core.problem import ContactProblem
from ...core.step import Report, Row, State
from ...core.vtkhdf import FIELDS_VTKHDF, list_steps
from .checkpoint import RestartPoint, write_checkpoint
from .folder import CHECKPOINT, LOG, SUMMARY, clear, remove_litter, take
from .history import GEOMETRY, HistoryFiles
from .log import RunLog
from .stored_rows import StoredRows, read_times
from .table import Table

log = logging.getLogger(__name__)
# Seconds that a row may wait, the next step included, if that takes as long as this one.
LATEST = 0.5


class OpenFields(Protocol):
    """Write frames of fields; collective."""

    def write(self, state: State, acceleration: Array, report: Report | None = None) -> None:
        """Write a frame of the state.

        Args:
            state: at the end of a base step.
            acceleration: of the equation of motion of its last step (n,) [m/s²].
            report: of this step, None for the first state.
        """


class FieldWriter(Protocol):
    """Write field output: ``fem.XDMF`` and ``fem.VTKHDF`` do."""

    @property
    def every(self) -> int:
        """Return how many steps lie between two frames."""

    def open(self, problem: ContactProblem, folder: Path, kept: Mapping[int, float]) -> OpenFields:
        """Return the open files of fields in the folder. Collective.

        Args:
            problem: whose fields they are.
            folder: of the run.
            kept: step -> time [s] of the frames that are there and stay.
        """


def _read_frame_times(folder: Path) -> dict[int, float]:
    """Return step -> time [s] of the frames in a run folder that have a row in the histories."""
    undo_broken_change(folder / FIELDS_VTKHDF)
    return read_times(folder, {*list_frames(folder), *list_steps(folder)})


class Writer:
    """Write into the folder of a run, or into none: then nothing is written.

    Every method but ``rescue`` is collective.
    """

    def __init__(
        self,
        problem: ContactProblem,
        folder: Path | None,
        fields: FieldWriter | None,
        table: Table,
        stored: StoredRows | None = None,
    ) -> None:
        """Hold what is written; no file is touched before ``open``.

        Args:
            problem: what is marched.
            folder: of the run, None to write nothing.
            fields: writes frames for ParaView, if it is given.
            table: the rows.
            stored: the rows of an earlier run that this one continues. Unless they are in this
                folder, ``open`` clears it.
        """
        self._problem = problem
        self.folder = folder
        self._table = table
        self._stored = stored
        self._continued = (
            stored is not None
            and folder is not None
            and stored.folder.resolve() == folder.resolve()
        )
        self._settings = fields  # which make the open ``_fields``
        self._comm = problem.system.algebra.comm
        self._fields: OpenFields | None = None
        self._files: HistoryFiles | None = None
        self._log: RunLog | None = None
        self._step_of_checkpoint = -1  # of the last one
        self._waiting: list[Row] = []  # rows that are neither in the files nor in the table
        self._time_of_row = time.monotonic()
        self._time_of_flush = self._time_of_row

    @property
    def rest(self) -> str:
        """Return what remains of a run that was ended early, for a sentence."""
        if self.folder is None:
            return "without an output folder its histories are lost"
        return f"restart it from its checkpoint in '{self.folder}'"

    def open(self, state: State) -> None:
        """Make the files and write the first frame."""
        folder = self.folder
        if folder is None:
            return

        # Log and histories, on rank 0, with the contact points of all ranks.
        surface = self._problem.surface
        values = {name: getattr(surface, name) for name in GEOMETRY}
        if surface.uncovered is None:
            values["uncovered"] = np.zeros(surface.count, dtype=bool)
        geometry = {name: surface.on_first(array) for name, array in values.items()}
        on_root(self._comm, partial(self._make, folder, geometry))

        # Fields, on all ranks; of a run that goes on in its folder earlier frames stay.
        if self._settings is not None:
            frames: Mapping[int, float] = {}
            if self._continued:
                frames = on_root(self._comm, partial(_read_frame_times, folder)) or {}
            self._fields = self._settings.open(self._problem, folder, frames)
            if not self._continued:
                self._fields.write(state, np.zeros_like(state.u))

    def _make(self, folder: Path, geometry: Mapping[str, Array]) -> None:
        """Make log and histories, on rank 0."""
        take(folder)
        remove_litter(folder)
        if not self._continued:
            clear(folder)
        self._log = RunLog(folder / LOG, append=self._continued)
        self._files = HistoryFiles(folder, self._table, geometry, self._stored)

    def append(self, row: Row) -> None:
        """Take a row of the histories.

        It is written, with all that wait, when the next one might be late.
        """
        if self.folder is None:
            self._table.append(row)
            return
        self._waiting.append(row)
        # The next row comes after as long as this one came after the row before.
        before = self._time_of_row
        self._time_of_row = time.monotonic()
        next_row = 2.0 * self._time_of_row - before
        if largest(self._comm, next_row - self._time_of_flush > LATEST):
            self.flush()

    def flush(self, *, alone: bool = False) -> None:
        """Write rows that wait, then put them into the table.

        Collective, unless others may not come (``alone``).
        """
        if self._waiting:
            on_root(SerialComm() if alone else self._comm, self._flush)
            for row in self._waiting:
                self._table.append(row)
            self._waiting = []
            self._time_of_flush = time.monotonic()

    def _flush(self) -> None:
        """Write rows that wait into the files, on rank 0."""
        if self._log is not None and self._files is not None:
            self._log.check()
            self._files.append(*self._waiting)

    def frame(self, report: Report, number: int) -> None:
        """Write a frame of the fields at the end of a base step, when one is due by its number."""
        if self._fields is None or self._settings is None:
            return
        if number % self._settings.every == 0:
            self._fields.write(report.new, report.balance.a, report)

    def checkpoint(self, place: RestartPoint, run_of: Callable[[], Mapping[str, Any]]) -> None:
        """Write a checkpoint of this place, unless there is one already.

        ``run_of`` says what run it is of, when that is needed: see ``write_checkpoint``.
        """
        k = place.state.k
        self.flush()
        if self.folder is None or self._step_of_checkpoint == k:
            return
        files = self._files
        rows = on_root(
            self._comm, lambda: (files.checksum(k), files.sync()) if files else ("", True)
        )
        checksum, safe = self._comm.bcast(rows)
        write_checkpoint(
            self.folder, self._problem, place, run_of=run_of(), rows=checksum, safe=safe
        )
        self._step_of_checkpoint = k
        if self._comm.rank == 0:
            log.info("checkpoint of step %d", k)

    def close(self, facts: Mapping[str, Any]) -> None:
        """Write the last version of every file."""
        on_root(self._comm, lambda: self._close(facts))

    def rescue(self, facts: Mapping[str, Any]) -> None:
        """Do the same after a failure.

        It is not collective, as others might not come; no error hides the first.
        """
        # of any kind: the first error is raised again, and this one comes of it or after it
        with suppress(Exception):
            self._close(facts)

    def _close(self, facts: Mapping[str, Any]) -> None:
        """Write the summary and close the files, on rank 0, each even if others fail."""
        if self.folder is None or self._comm.rank != 0:
            return
        try:
            log.info("%s after %d steps %s", facts["status"], facts["steps"], facts["reason"])
            try:
                write_atomically(self.folder / SUMMARY, (to_json(facts) + "\n").encode())
            finally:
                if self._files is not None:
                    self._files.close()
                push(self.folder / CHECKPOINT)
            if self._log is not None:
                self._log.check()
        finally:
            if self._log is not None:
                self._log.close()
