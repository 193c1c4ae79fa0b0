"""Tell what a run does while it works.

It is told in ``run.log`` through the logging module, and as progress with the time left.
"""

import logging
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from ...core.files import write_all
from ...core.own_files import open_new, open_to_append
from ...core.version import __version__

LOGGER = logging.getLogger("vi_contact")
log = logging.getLogger(__name__)
SHARE = 0.1  # of the run: a line in the log for each such part of it,
SECONDS = 30.0  # or this often


class _LogFile(logging.Handler):
    """Write lines into a file of the run folder.

    The error of a line that could not be written is kept, for the run to raise on all ranks.
    """

    def __init__(self, path: Path, *, append: bool) -> None:
        super().__init__()
        self.path = path
        self.error: OSError | None = None
        self._file = open_to_append(path, make=True) if append else open_new(path)

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line through to the disk."""
        try:
            write_all(self._file, (self.format(record) + "\n").encode("utf-8", "backslashreplace"))
        except OSError as error:
            self.error = error
        except (TypeError, ValueError):  # a line whose words and arguments do not fit
            self.handleError(record)

    def close(self) -> None:
        """Close the file; OSError when the disk refuses what the system still holds of it."""
        super().close()
        self._file.close()


class RunLog:
    """Send everything logged under ``vi_contact`` to a file while it is open.

    Warnings go to the terminal too; all this on rank 0.

    While runs take turns (``give_turn``) a line goes to the logs that were opened in this turn. The
    root logger is left out: form compilers make it print every line.
    """

    turn: ClassVar[object] = None
    _open: ClassVar[int] = 0
    _before: ClassVar[tuple[int, bool]] = (logging.NOTSET, True)

    def __init__(self, path: Path, *, append: bool) -> None:
        if not RunLog._open:
            RunLog._before = LOGGER.level, LOGGER.propagate
        turn = RunLog.turn
        self._file = _LogFile(path, append=append)
        self._terminal = logging.StreamHandler()
        self._terminal.setLevel(logging.WARNING)
        self._file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        for handler in (self._file, self._terminal):
            handler.addFilter(lambda record: RunLog.turn is turn)
            LOGGER.addHandler(handler)
        RunLog._open += 1
        LOGGER.setLevel(logging.INFO)
        LOGGER.propagate = False

    def check(self) -> None:
        """Raise the OSError of a line that could not be written."""
        error = self._file.error
        if error is not None:
            raise OSError(error.errno, error.strerror, str(self._file.path))

    def close(self) -> None:
        """Give the logger back as it was."""
        LOGGER.removeHandler(self._file)
        LOGGER.removeHandler(self._terminal)
        RunLog._open -= 1
        if not RunLog._open:
            LOGGER.setLevel(RunLog._before[0])
            LOGGER.propagate = RunLog._before[1]
        with suppress(OSError):  # the disk is full: check() or the histories have told
            self._file.close()


@contextmanager
def give_turn(run: object) -> Iterator[None]:
    """Give one of several runs its turn with the logs."""
    RunLog.turn = run
    try:
        yield
    finally:
        RunLog.turn = None


def list_versions(*needed: str) -> dict[str, str]:
    """Return the version of everything that computes in this process.

    What else is needed to write is there too.
    """
    for name in needed:
        with suppress(ModuleNotFoundError):  # nothing is written, else the folder was refused
            import_module(name)
    names = [
        name
        for name in ("numpy", "scipy", "h5py", "petsc4py", "mpi4py", "dolfinx")
        if sys.modules.get(name)
    ]
    own = {"vi_contact": __version__, "python": platform.python_version()}
    return own | {name: str(sys.modules[name].__version__) for name in names}


class Progress:
    """Show progress by tqdm on a terminal, and by lines in the log.

    There is a line for every tenth of the run, or every 30 s.
    """

    def __init__(self, total: int, *, shown: bool) -> None:
        self._total = total
        self._done = 0
        self._begin = time.monotonic()
        self._time_of_line = self._begin
        self._next = SHARE * total
        self._bar: Any = None
        if shown and sys.stderr is not None and sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(total=total, unit="step", dynamic_ncols=True)

    def close(self) -> None:
        """Leave the line on the terminal as it is."""
        if self._bar is not None:
            self._bar.close()

    def step(self, k: int, t: float, *, iterations: int, worst: float) -> None:
        """Count one more step as done.

        Args:
            k: its number.
            t: the time at its end [s].
            iterations: of the solver.
            worst: the worst certificate of the run so far.
        """
        self._done += 1
        if self._bar is not None:
            self._bar.set_postfix_str(
                f"t={t:.4g} s, iterations={iterations}, worst={worst:.1e}", refresh=False
            )
            self._bar.update()
        now = time.monotonic()
        if self._done >= self._next or now - self._time_of_line >= SECONDS:
            self._time_of_line = now
            self._next = self._done + SHARE * self._total
            left = (now - self._begin) / self._done * (self._total - self._done)
            log.info(
                "step %d, t = %.6g s: %d of %d steps, %d iterations, worst certificate %.1e, %s "
                "left",
                k,
                t,
                self._done,
                self._total,
                iterations,
                worst,
                timedelta(seconds=int(left)),
            )
