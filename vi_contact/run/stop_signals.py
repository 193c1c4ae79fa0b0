"""Note signals that ask a run to end when they come.

They are acted on between two steps, on all ranks together.

Ctrl-C (SIGINT), a scheduler's or container's end of time (SIGTERM), a closed terminal (SIGHUP).
PETSc has handlers of its own for some of them, which print pages and stop; those of the run come
after them and win.
"""

import os
import signal
import threading
from types import FrameType
from typing import Any

import numpy as np

from ..core.algebra import Comm

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopSignals:
    """Listen from ``with`` to its end, in the main thread only; other threads never see a signal.

    A signal that was ignored stays so (nohup, jobs in the background), and so do handlers that the
    caller wrote. A second Ctrl-C ends the process at once. What nobody has acted on in the end is
    sent again, to the old handlers. ``lasting``: for several runs, all of which are told once one
    has been.
    """

    def __init__(self, *, lasting: bool = False) -> None:
        self._number = 0  # of the signal that nobody has acted on yet
        self._lasting = lasting
        self._late = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> "StopSignals":
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                before = signal.getsignal(number)
                if before in (signal.SIG_DFL, signal.default_int_handler, None):
                    self._before[number] = before or signal.SIG_DFL
                    signal.signal(number, self._note)
                elif before == signal.SIG_IGN:
                    signal.signal(number, signal.SIG_IGN)  # PETSc's handler does not ask
        return self

    def _note(self, number: int, frame: FrameType | None) -> None:
        """Keep the number of the first signal; the second Ctrl-C is Python's own again."""
        self._number = self._number or number
        if number == signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)

    def ask_all(self, comm: Comm, over: bool = False) -> tuple[int, bool]:
        """Return (number of a signal that some rank has got or 0, whether time is over for one).

        Collective.
        """
        over = over or self._late
        if comm.size == 1:
            number = self._number
            late = over
        else:
            number, late = comm.max(np.array([self._number, over], dtype=float))
        if self._lasting:
            self._late = bool(late)
        elif number:
            self._number = 0
        return int(number), bool(late)

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        if self._number and error is None:
            os.kill(os.getpid(), self._number)
