"""Name the ways a run stops early: wrong input, a step without a certificate, a signal."""

import errno
import signal
from collections.abc import Iterator

PETSC_ERR_MEM = 55  # of petscsystypes.h
_MEMORY = (
    "out of memory",
    "cannot allocate memory",
    "unable to allocate",
    "memory allocation failed",
    "bad_alloc",
)
_MACHINE = (
    errno.ENOMEM,
    errno.EMFILE,
    errno.ENFILE,
    errno.EACCES,
    errno.EPERM,
    errno.ESTALE,
    errno.ENOSPC,
    errno.EDQUOT,
)


class ViContactError(Exception):
    """Name every error raised on purpose.

    The command line prints its one sentence and exits with 1.
    """


class InputError(ViContactError, ValueError):
    """Say that the input is wrong.

    The message is one sentence that names the offending thing and the remedy.
    """


class NoEquilibrium(InputError):
    """Say that loads drive a rigid motion that nothing stops: there is no static equilibrium."""


class StepFailure(ViContactError, RuntimeError):
    """Say that a step passed no certificate with any method; nothing before it is lost."""


class Interrupted(KeyboardInterrupt):
    """Say that a signal (Ctrl-C, SIGTERM, SIGHUP) ended a run after a step, on all ranks.

    The run's folder has all steps so far. Like Ctrl-C it is no ``Exception``: no loop over runs
    goes on.

    Attributes:
        number: that of the signal.
        status: with which a command exits, 128 + number.
    """

    def __init__(self, message: str = "interrupted", number: int = signal.SIGINT) -> None:
        super().__init__(message, number)
        self.number = number
        self.status = 128 + number

    def __str__(self) -> str:
        return str(self.args[0])


class OutOfTime(Interrupted):
    """Say that a run ended, on all ranks, because its wall time was nearly over; a restart goes on.

    ``status`` is 75, which says that the command may be given again (EX_TEMPFAIL).
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.status = 75


def is_of_memory(error: BaseException) -> bool:
    """Say whether an error, or one it came from, is that there is no memory.

    Errors of Python, numpy, HDF5 and PETSc are known.
    """
    return any(map(_lacks_memory, _causes(error)))


def _lacks_memory(error: BaseException) -> bool:
    """Say whether an error itself is that there is no memory."""
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    if getattr(error, "ierr", None) == PETSC_ERR_MEM:
        return True
    # The package's own sentences may name memory and mean something else.
    if isinstance(error, ViContactError):
        return False
    text = str(error).lower()
    return any(words in text for words in _MEMORY)


def is_of_machine(error: BaseException) -> bool:
    """Say whether an error comes from the machine: from memory, permissions, open files.

    Such an error says nothing of what a file holds. A handler that takes other errors for the
    damage of a file raises these again.
    """
    return is_of_memory(error) or (isinstance(error, OSError) and error.errno in _MACHINE)


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error and those it came from, each once."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
