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
    """Return the command of these runs; each begins from its checkpoint if there is one.

    Args:
        runs: of one case.
        launch: words in front, such as ("mpirun", "-n", "4").
        end: of the wall time.

    Raises:
        OutOfTime: without wall time left.
    """
    case = runs[0].case
    folders = [run.folder for run in runs]
    request = {
        "case": str(case.path),
        "allow": case.allowed,
        "settings": [run.settings for run in runs],
        "folders": [*map(str, folders)],
        "restart": [is_own(folder / CHECKPOINT) for folder in folders],
        "wall_time": None,
    }
    if end.text is not None:
        left = int(end.left - ASIDE)
        if left < 1:
            raise OutOfTime(f"{end.words} {AGAIN}")
        request["wall_time"] = f"{left // 60}:{left % 60:02d}"
    return [*launch, sys.executable, "-m", "vi_contact.practice.cli.batch", json.dumps(request)]


def start_process(
    runs: Sequence[OneRun], launch: Sequence[str], end: WallTime
) -> subprocess.Popen[str]:
    """Start the process of these runs, and remove what tells how they ended before.

    Args:
        runs: of one case.
        launch: words in front of the command.
        end: of the wall time.

    Raises:
        InputError: for words in front that are no program.
        OutOfTime: without wall time left.
    """
    # The package of this process, and one thread, unless the user has asked for more.
    package = str(Path(__file__).resolve().parents[2])
    search_path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment = threads | dict(os.environ) | {"PYTHONPATH": search_path}
    words = build_command(runs, launch, end)
    for run in runs:
        if read_row(run.folder / ROW) is not None:
            remove(run.folder / ROW)
        if is_marked(run.folder):
            remove(run.folder / SUMMARY)
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

    Several threads use it, each for one process at a time.

    Attributes:
        shares: process -> runs, and parts of runs, that it has made.
    """

    def __init__(self, launch: Sequence[str], end: WallTime) -> None:
        self._launch = launch
        self._end = end
        self._stopped = threading.Event()
        self._lock = threading.Lock()  # of what goes on, so that none begins after the stop
        self._going: set[subprocess.Popen[str]] = set()
        self.shares: dict[subprocess.Popen[str], float] = {}

    def execute(self, runs: Sequence[OneRun]) -> Iterator[Row | None]:
        """Yield the row of each run as it ends, None when more is done.

        What a dead process has left is run one by one.
        """
        for _ in range(ATTEMPTS):
            process = self._start(runs)
            left = list(runs)
            other_lines = yield from self._follow(process, runs, left)
            self._forget(process)
            self.shares[process] = len(runs) - len(left)
            if process.returncode == os.EX_TEMPFAIL:
                raise OutOfTime(f"{self._end.words} {AGAIN}")
            runs = left
            # Only a process that fails without a word is tried again.
            if not left or process.returncode <= 0 or other_lines:
                break
        if len(runs) > 1:
            for run in runs:
                yield from self.execute([run])
        elif runs:
            yield runs[0].keep("".join(other_lines), process.returncode)

    def _follow(
        self, process: subprocess.Popen[str], runs: Sequence[OneRun], left: list[OneRun]
    ) -> Generator[Row | None, None, list[str]]:
        """Yield what a process tells, until it ends.

        Args:
            process: of the runs.
            runs: in the order in which it numbers them.
            left: the same; those that end are taken from it.

        Yields:
            The row of a run that ends; None when more is done.

        Returns:
            All other lines.
        """
        other_lines = []
        for line in process.stdout or ():
            news = _read_news(line)
            if "ended" in news:
                run = runs[news["ended"]]
                left.remove(run)
                yield run.keep(news["said"], news["status"])
            elif "share" in news:
                self.shares[process] = news["share"] * len(runs)
                yield None
            else:
                other_lines.append(line)
        return other_lines

    def _forget(self, process: subprocess.Popen[str]) -> None:
        """Wait for the end of a process; KeyboardInterrupt where all were told to stop."""
        process.wait()
        with self._lock:
            self._going.discard(process)
            if self._stopped.is_set():
                raise KeyboardInterrupt

    def _start(self, runs: Sequence[OneRun]) -> subprocess.Popen[str]:
        """Start the process of these runs; KeyboardInterrupt where all were told to stop."""
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
            going = list(self._going)
        _stop(going)


def execute_runs(
    runs: Sequence[OneRun], jobs: int, launch: Sequence[str], end: WallTime
) -> Iterator[Row | float]:
    """Run processes, so many at a time, and yield the row of each run when it ends.

    Left early, it stops those that go on.

    Args:
        runs: of one case.
        jobs: processes at the same time.
        launch: words in front of their command; each run has a process of its own then.
        end: of the wall time.

    Yields:
        Rows, and between them how many runs have been made, with parts of runs.

    Raises:
        OutOfTime: when a process has ended with its status.
    """
    processes = Processes(launch, end)
    news = SimpleQueue[Row | BaseException | float]()  # from the threads that follow processes

    def make(batch: Sequence[OneRun]) -> None:
        try:
            for row in processes.execute(batch):
                # The sum of now, as others go on before it is read.
                news.put(float(sum(list(processes.shares.values()))) if row is None else row)
        except BaseException as error:
            # of any kind: it is raised again by the thread that waits for this one
            news.put(error)

    # Runs that cannot run at all end at once.
    wrong = [run for run in runs if run.wrong]
    for run in wrong:
        yield run.keep(f"vi-contact: {run.wrong}", 1)

    # The others go in batches, each in a process of its own.
    right = [run for run in runs if not run.wrong]
    size = 1 if launch else max(min(TOGETHER, -(-len(right) // jobs)), 1)
    batches = [right[first : first + size] for first in range(0, len(right), size)]
    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(make, batch) for batch in batches]
        try:
            ended = 0
            while ended < len(right):
                item = news.get()
                if isinstance(item, BaseException):
                    raise item
                if isinstance(item, float):
                    yield len(wrong) + item
                else:
                    ended += 1
                    yield item
        finally:
            processes.stop()
            for future in futures:
                future.cancel()


def _read_news(line: str) -> dict[str, Any]:
    """Return what a process tells in a line of JSON; empty for other lines."""
    try:
        news = json.loads(line)
    except ValueError:
        return {}
    return news if isinstance(news, dict) else {}


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
