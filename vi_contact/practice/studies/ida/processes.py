"""Run the processes of an incremental dynamic analysis.

There are a few runs in each, so many at a time, until they are told to stop.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from ....core.errors import InputError, OutOfTime
from ....core.own_files import is_own, remove
from ....run.files.folder import CHECKPOINT, SUMMARY, is_marked
from ....run.wall_time import WallTime
from .runs import ROW, OneRun, Row, read_row

TOGETHER = 8  # runs in a process: so many share every pass over a matrix
# of runs that end without a word: Gmsh 4.8, asked before it is initialised, does that now and then
ATTEMPTS = 5
PATIENCE = 20.0  # seconds for a run to save its state
ASIDE = 5.0  # seconds of a wall time for the beginning and the end of a process
AGAIN = "ended the study: give the same command again to go on"
# in the environment of what mpirun has started
_MPI = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK")


def build_command(runs: Sequence[OneRun], launch: Sequence[str], end: WallTime) -> list[str]:
    """Return the command of these runs.

    Each begins from its checkpoint if there is one; it raises OutOfTime without wall time left.
    """
    case, folders = runs[0].case, [one.folder for one in runs]
    asked = {
        "case": str(case.path),
        "allow": case.allowed,
        "settings": [one.settings for one in runs],
        "folders": [*map(str, folders)],
        "restart": [is_own(one / CHECKPOINT) for one in folders],
        "wall_time": None,
    }
    if end.text is not None:
        if (left := int(end.left - ASIDE)) < 1:
            raise OutOfTime(f"{end.words} {AGAIN}")
        asked["wall_time"] = f"{left // 60}:{left % 60:02d}"
    return [*launch, sys.executable, "-m", "vi_contact.practice.cli.batch", json.dumps(asked)]


def start_process(
    runs: Sequence[OneRun], launch: Sequence[str], end: WallTime
) -> subprocess.Popen[str]:
    """Start them, in the environment without what MPI of this process may have put there."""
    package = str(Path(__file__).resolve().parents[2])
    way = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = (
        {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        | dict(os.environ)
        | {"PYTHONPATH": way}
    )
    words = build_command(runs, launch, end)
    for one in runs:
        if read_row(one.folder / ROW) is not None:
            remove(one.folder / ROW)
        if is_marked(one.folder):
            remove(one.folder / SUMMARY)
    try:
        return subprocess.Popen(
            words,
            env=environment,
            text=True,
            encoding="utf-8",
            errors="replace",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    except (FileNotFoundError, PermissionError) as error:
        # of a program; others tell of the machine
        raise InputError(
            f"'{error.filename}' cannot be started ({error.strerror}): correct --launch"
        ) from None


class Processes:
    """Keep the processes that go on, until they are all told to stop.

    ``shares``: runs that each has made.
    """

    def __init__(self, launch: Sequence[str], end: WallTime) -> None:
        self._launch, self._end = launch, end
        self._stopped, self._lock = threading.Event(), threading.Lock()
        self._going: set[subprocess.Popen[str]] = set()
        self.shares: dict[subprocess.Popen[str], float] = {}

    def rows(self, runs: Sequence[OneRun]) -> Iterator[Row | None]:
        """Yield the row of each run as it ends, None when more is done.

        What a dead process has left is run one by one.
        """
        for _ in range(ATTEMPTS):
            process, left = self._started(runs), list(runs)
            said = yield from self._follow(process, runs, left)
            self._forget(process)
            self.shares[process] = len(runs) - len(left)
            if process.returncode == os.EX_TEMPFAIL:
                raise OutOfTime(f"{self._end.words} {AGAIN}")
            runs = left
            if not left or process.returncode <= 0 or said:
                break
        if len(runs) > 1:
            for one in runs:
                yield from self.rows([one])
        elif runs:
            yield runs[0].keep("".join(said), process.returncode)

    def _follow(
        self, process: subprocess.Popen[str], runs: Sequence[OneRun], left: list[OneRun]
    ) -> Generator[Row | None, None, list[str]]:
        """Yield what a process tells, take runs that end from those left, return other lines."""
        said = []
        for line in process.stdout or ():
            found = _read(line)
            if "ended" in found:
                one = runs[found["ended"]]
                left.remove(one)
                yield one.keep(found["said"], found["status"])
            elif "share" in found:
                self.shares[process] = found["share"] * len(runs)
                yield None
            else:
                said.append(line)
        return said

    def _forget(self, process: subprocess.Popen[str]) -> None:
        """Wait for the end of a process; KeyboardInterrupt where all were told to stop."""
        process.wait()
        with self._lock:
            self._going.discard(process)
            if self._stopped.is_set():
                raise KeyboardInterrupt

    def _started(self, runs: Sequence[OneRun]) -> subprocess.Popen[str]:
        with self._lock:
            if self._stopped.is_set():
                raise KeyboardInterrupt
            process = start_process(runs, self._launch, self._end)
            self._going.add(process)
        return process

    def stop(self) -> None:
        """Stop those that go on; none begins any more."""
        with self._lock:
            self._stopped.set()
            left = list(self._going)
        _stop(left)


def execute_runs(
    runs: Sequence[OneRun], jobs: int, launch: Sequence[str], end: WallTime
) -> Iterator[Row | float]:
    """Run them in so many processes at a time, and yield the row of each when it ends.

    Between rows it yields how many have been made, with parts of runs. Left early, it stops those
    that go on; OutOfTime when one has ended with its status.
    """
    processes, told = Processes(launch, end), SimpleQueue[Row | BaseException | float]()

    def make(batch: Sequence[OneRun]) -> None:
        try:
            for row in processes.rows(batch):
                # The sum of now, as others go on before it is read.
                told.put(float(sum(list(processes.shares.values()))) if row is None else row)
        except BaseException as error:
            # of any kind: it is raised again by the thread that waits for this one
            told.put(error)

    wrong = [run for run in runs if run.wrong]
    for run in wrong:
        yield run.keep(f"vi-contact: {run.wrong}", 1)
    right = [run for run in runs if not run.wrong]
    size = 1 if launch else max(min(TOGETHER, -(-len(right) // jobs)), 1)
    with ThreadPoolExecutor(jobs) as pool:
        futures = [
            pool.submit(make, right[first : first + size]) for first in range(0, len(right), size)
        ]
        try:
            ended = 0
            while ended < len(right):
                found = told.get()
                if isinstance(found, BaseException):
                    raise found
                if isinstance(found, float):
                    yield len(wrong) + found
                else:
                    ended += 1
                    yield found
        finally:
            processes.stop()
            for future in futures:
                future.cancel()


def _read(line: str) -> dict[str, Any]:
    """Return what the process of ``command`` tells in a line of JSON; empty for other lines."""
    with suppress(ValueError):
        found = json.loads(line)
        return found if isinstance(found, dict) else {}
    return {}


def _stop(processes: Sequence[subprocess.Popen[str]]) -> None:
    """End processes with all they have started.

    It does so as by Ctrl-C, on which a run saves its state; else by SIGTERM.
    """
    for signum in (signal.SIGINT, signal.SIGTERM):
        for process in processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signum)
        deadline = time.monotonic() + PATIENCE
        for process in processes:
            with suppress(subprocess.TimeoutExpired):
                process.wait(max(deadline - time.monotonic(), 0.0))


def refuse_mpirun() -> None:
    """Raise InputError in a process of mpirun.

    It has started this one, and those it starts would take themselves for it.
    """
    if any(name in os.environ for name in _MPI):
        raise InputError(
            "ida starts processes and must not be one of MPI's: start it without mpirun, and give "
            "the runs their ranks with --launch 'mpirun -n N'"
        )
