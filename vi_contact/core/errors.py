"""Name the ways a run stops early: wrong input, a step that no method could certify, or somebody asked it to."""

import signal


class ViContactError(Exception):
    """Name every error raised on purpose; the command line prints its one sentence and exits with 1."""


class InputError(ViContactError, ValueError):
    """Say that the input is wrong: the message is one sentence that names the offending thing and the remedy."""


class StepFailure(ViContactError, RuntimeError):
    """Say that a step stayed above the certificate tolerance with every method; nothing before it is lost."""


class Interrupted(KeyboardInterrupt):
    """Say that a signal (Ctrl-C, SIGTERM, SIGHUP) ended a run after a step, on all ranks; its folder has all so far.

    Like Ctrl-C it is no ``Exception``: no loop over runs goes on. ``number``: the signal; ``status``: 128 + number."""

    def __init__(self, message: str = "interrupted", number: int = signal.SIGINT) -> None:
        super().__init__(message, number)
        self.number, self.status = number, 128 + number

    def __str__(self) -> str:
        return str(self.args[0])


class OutOfTime(Interrupted):
    """Say that a run ended, on all ranks, because its wall time was nearly over; a restart goes on.

    ``status`` is 75, which says that the command may be given again (EX_TEMPFAIL)."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.status = 75
