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
        self._found, self._lasting, self._late = 0, lasting, False
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
        self._found = self._found or number
        if number == signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)

    def asked(self, comm: Comm, over: bool = False) -> tuple[int, bool]:
        """Return the number of a signal that a rank has got, or 0. Collective.

        Whether time is over for a rank is returned too.
        """
        over = over or self._late
        number, late = (
            (self._found, over)
            if comm.size == 1
            else comm.max(np.array([self._found, over], dtype=float))
        )
        if self._lasting:
            self._late = bool(late)
        elif number:
            self._found = 0
        return int(number), bool(late)

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        if self._found and error is None:
            os.kill(os.getpid(), self._found)
