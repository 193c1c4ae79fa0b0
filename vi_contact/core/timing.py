"""Tell how long the parts of setting up take: to the log, and to the terminal of a command."""

import ctypes
import logging
import sys
import time
from collections import deque
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

log = logging.getLogger(__name__)
F = TypeVar("F", bound=Callable[..., Any])
NOTICED = 1.0  # seconds that somebody at a terminal notices
_MALLOC_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)
_lines: deque[str] = deque(maxlen=50)  # of the parts that were timed
_on_terminal = [False]  # whether long parts are told there too


def report_time(name: str) -> Callable[[F], F]:
    """Return a decorator that reports, on the first rank, how long a function took.

    All ranks then give back the memory that the function has freed.
    """

    def decorate(function: F) -> F:
        @wraps(function)
        def call_timed(*args: Any, **kwargs: Any) -> Any:
            begin = time.perf_counter()
            result = function(*args, **kwargs)
            release_memory()
            _report(name, time.perf_counter() - begin)
            return result

        return cast(F, call_timed)

    return decorate


def release_memory() -> None:
    """Return freed memory to the system, where the C library (glibc) keeps it."""
    if _MALLOC_TRIM is not None:
        _MALLOC_TRIM(0)


def _report(name: str, seconds: float) -> None:
    """Note and log how long a part took; print it where somebody waits for it."""
    if "mpi4py.MPI" in sys.modules and sys.modules["mpi4py.MPI"].COMM_WORLD.rank:
        return
    line = f"{name} {seconds:.3g} s"
    _lines.append(line)
    log.info("%s", line)
    if _on_terminal[0] and seconds >= NOTICED:
        print(f"vi-contact: {line}", file=sys.stderr, flush=True)


def show_on_terminal(wanted: bool) -> None:
    """Choose whether parts that take more than a second are printed on a terminal too.

    Nothing is printed where standard error is no terminal.
    """
    _on_terminal[0] = wanted and sys.stderr is not None and sys.stderr.isatty()


def take_report() -> str:
    """Return the parts that were timed since this was last asked, in one line."""
    report = ", ".join(_lines)
    _lines.clear()
    return report
