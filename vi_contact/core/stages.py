"""Tell how long the stages of setting up take: to the log, and to the terminal of a command."""

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
LONG = 1.0  # seconds that somebody at a terminal notices
_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)
_done: deque[str] = deque(maxlen=50)
_shown = [False]


def stage(name: str) -> Callable[[F], F]:
    """Return a decorator that tells how long a function took.

    The first rank tells it, and all ranks give back what memory it freed.
    """

    def decorate(function: F) -> F:
        @wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
            begin = time.perf_counter()
            result = function(*args, **kwargs)
            trim()
            _tell(name, time.perf_counter() - begin)
            return result

        return cast(F, timed)

    return decorate


def trim() -> None:
    """Return memory that has been freed to the system, where the C library (glibc) keeps it."""
    if _TRIM is not None:
        _TRIM(0)


def _tell(name: str, seconds: float) -> None:
    if "mpi4py.MPI" in sys.modules and sys.modules["mpi4py.MPI"].COMM_WORLD.rank:
        return
    text = f"{name} {seconds:.3g} s"
    _done.append(text)
    log.info("%s", text)
    if _shown[0] and seconds >= LONG:
        print(f"vi-contact: {text}", file=sys.stderr, flush=True)


def show(shown: bool) -> None:
    """Choose whether stages that take long are told on a terminal too.

    These are stages of more than a second, where standard error is a terminal.
    """
    _shown[0] = shown and sys.stderr is not None and sys.stderr.isatty()


def done() -> str:
    """Return the stages since this was last asked, in a line."""
    said = ", ".join(_done)
    _done.clear()
    return said
