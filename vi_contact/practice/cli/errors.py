"""Tell errors in one sentence, and end a command on all its ranks.

Those of the machine and of libraries are among them.
"""

import argparse
import os
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from textwrap import shorten
from typing import Any, NoReturn

from ...core.algebra import SerialComm
from ...core.checks import SHOWN, quote
from ...core.errors import InputError, ViContactError, is_of_memory
from ...core.files import describe_os_error

PATIENCE = 30.0  # seconds between the first rank that has failed and the last
LIBRARIES = ("dolfinx", "ufl", "basix", "petsc4py", "mpi4py", "h5py", "gmsh", "matplotlib", "tqdm")
OUT_OF_MEMORY = (
    "out of memory: take a coarser mesh, fewer steps or samples, or more ranks on more machines; a "
    "run keeps what it has written, and --restart continues it"
)


def check_words(arguments: Sequence[str]) -> None:
    """Raise InputError for impossible names.

    They are words that no shell can give or file can have as a name, and empty names of outputs.
    """
    for word in arguments:
        if "\0" in word:
            raise InputError(f"{quote(word)} contains the character NUL: leave it out")
        if word.startswith("--") and word.endswith("=--"):
            raise InputError(f"{quote(word)} has no value: give one")
    for option, value in zip(arguments, [*arguments[1:], None], strict=True):
        if (option in ("--out", "--csv", "--png") and value == "") or option in (
            "--out=",
            "--csv=",
            "--png=",
        ):
            raise InputError(
                f"{option.rstrip('=')} is empty: give the name of a file or folder, or leave it out"
            )


class Parser(argparse.ArgumentParser):
    """Parse as argparse does, with sentences that stay short where a word is long."""

    def error(self, message: str) -> NoReturn:
        """Print usage and message, and end the program."""
        super().error(
            shorten(" ".join(part[:SHOWN] for part in message.split()), 400, placeholder=" …")
        )


def told(run: Callable[[], Any], spelling: Mapping[str, str]) -> Any:
    """Return what the call returns.

    It raises ViContactError of one sentence for errors of memory, files and sizes of numbers.

    spelling: argument -> option: what sentences call units= is --units here.
    """
    try:
        return run()
    except ViContactError as error:
        if is_of_memory(error):
            raise ViContactError(OUT_OF_MEMORY) from error
        if spelling and isinstance(error, InputError):
            said = str(error)
            for argument, option in spelling.items():
                said = said.replace(f" {argument}= ", f" {option} ").replace(
                    f" {argument}=", f" {option} "
                )
            raise InputError(said.rstrip()) from error
        raise
    except Exception as error:  # those that have no sentence are raised again
        text = _sentence(error)
        if text is None:
            raise
        raise ViContactError(text) from error


def printable(text: str) -> str:
    """Return the text without what standard output cannot write.

    Such are names of files that are no UTF-8. It is also without characters that steer a terminal.
    """
    text = re.sub("[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f]", lambda found: ascii(found[0])[1:-1], text)
    encoding = sys.stdout.encoding or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def say(text: str) -> None:
    """Print a text.

    Where nobody reads it any more (head has ended), it and all that follows is dropped.
    """
    try:
        print(printable(text), flush=True)
    except BrokenPipeError:
        # or Python complains at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def keep_streams() -> None:
    """Give standard streams that are closed, as daemons have them, a place.

    Else the next file that is opened gets their number, and what a library prints goes into it.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free: this one
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # Python found it closed
            # Open for as long as the process goes on.
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115


def _sentence(error: Exception) -> str | None:
    if is_of_memory(error):
        return OUT_OF_MEMORY
    if isinstance(error, OSError):
        return describe_os_error(error)
    if isinstance(error, ModuleNotFoundError) and error.name in LIBRARIES:
        return (
            f"{error.name} is needed and this Python does not find it: install it "
            "(docs/start/install.md)"
        )
    if isinstance(error, OverflowError | FloatingPointError):
        return (
            f"a number is too large for the machine ({error}): check the sizes and units of "
            "all inputs"
        )
    return None


def world() -> Any:
    """Return MPI's communicator of all ranks.

    It is that of this process alone where MPI has not been started.
    """
    return sys.modules["mpi4py.MPI"].COMM_WORLD if "mpi4py.MPI" in sys.modules else SerialComm()


def fail_together(text: str) -> None:
    """Return when all ranks come here.

    Else it says what stopped this one and ends the others, which wait. Collective.
    """
    ranks = world()
    if ranks.size == 1:
        return
    request, end = ranks.Ibarrier(), time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > end:
            print(
                f"vi-contact: rank {ranks.rank} of {ranks.size} stopped alone: {text}",
                file=sys.stderr,
                flush=True,
            )
            ranks.Abort(1)
        time.sleep(0.02)
