"""Tell errors in one sentence, also those of the machine and of libraries.

A command that fails ends on all its ranks.
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
from ...core.packages import explain_no_dolfinx

PATIENCE = 30.0  # seconds between the first rank that has failed and the last
LIBRARIES = ("dolfinx", "ufl", "basix", "petsc4py", "mpi4py", "h5py", "gmsh", "matplotlib", "tqdm")
STREAMS = ("/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")  # names of standard output
OUTPUTS = ("--out", "--csv", "--png")
CONTROLS = re.compile("[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f]")  # characters that steer a terminal
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
        apart = option in OUTPUTS and value == ""
        joined = option.endswith("=") and option.removesuffix("=") in OUTPUTS
        if apart or joined:
            raise InputError(
                f"{option.rstrip('=')} is empty: give the name of a file or folder, or leave it out"
            )


class Parser(argparse.ArgumentParser):
    """Parse as argparse does, with sentences that stay short where a word is long."""

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse as argparse does; an unknown option is told under the usage of its command."""
        options, unknown = self.parse_known_args(args, namespace)
        if unknown:
            getattr(options, "parser", self).error(f"unknown option: {' '.join(unknown)}")
        return options

    def error(self, message: str) -> NoReturn:
        """Print usage and message, and end the program."""
        words = " ".join(word[:SHOWN] for word in message.split())
        super().error(shorten(words, 400, placeholder=" …"))


def explain_errors(call: Callable[[], Any], spelling: Mapping[str, str]) -> Any:
    """Return what a call returns, and raise its errors as sentences for users.

    Args:
        call: without arguments.
        spelling: argument -> option; what sentences call units= is --units here.

    Raises:
        ViContactError: of one sentence, also for errors of memory, files and sizes of numbers.
        Exception: any other one, as it is.
    """
    try:
        return call()
    except ViContactError as error:
        if is_of_memory(error):
            raise ViContactError(OUT_OF_MEMORY) from error
        if is_of_pipe(error):
            raise
        if spelling and isinstance(error, InputError):
            raise InputError(_spell_options(str(error), spelling)) from error
        raise
    except Exception as error:
        if is_of_pipe(error):
            raise
        text = _explain(error)
        if text is None:
            raise
        raise ViContactError(text) from error


def _spell_options(text: str, spelling: Mapping[str, str]) -> str:
    """Write options in place of the arguments of functions in a sentence."""
    for argument, option in spelling.items():
        # with a blank after it first, or two blanks would be left
        text = text.replace(f" {argument}= ", f" {option} ")
        # as sentences of case files have it
        text = text.replace(f" {argument} = … ", f" {option} ")
        text = text.replace(f" {argument}=", f" {option} ")
    return text.rstrip()


def is_of_pipe(error: BaseException | None) -> bool:
    """Tell whether standard output was the file to write, and nobody reads it any more.

    This is no fault: ``motion convert FILE /dev/stdout | head -1`` has what it wants.
    """
    while error is not None:
        if isinstance(error, BrokenPipeError) and error.filename in STREAMS:
            return True
        error = error.__cause__
    return False


def escape_unprintable(text: str) -> str:
    """Return the text without what standard output cannot write.

    Such are names of files that are no UTF-8. It is also without characters that steer a terminal.
    """
    text = CONTROLS.sub(lambda match: ascii(match[0])[1:-1], text)
    encoding = sys.stdout.encoding or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def say(text: str) -> None:
    """Print a text.

    Where nobody reads it any more (head has ended), it and all that follows is dropped.
    """
    try:
        print(escape_unprintable(text), flush=True)
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


def _explain(error: Exception) -> str | None:
    """Return the sentence of an error of the machine or of a library; None if it has none."""
    if is_of_memory(error):
        return OUT_OF_MEMORY
    if isinstance(error, OSError):
        return describe_os_error(error)
    if isinstance(error, ModuleNotFoundError) and error.name in LIBRARIES:
        return explain_no_dolfinx("this command", error.name) or (
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
    """Wait until all ranks have failed.

    Where one does not come here in time, the others wait for something else: this rank then says
    what stopped it, and ends them. Collective.
    """
    ranks = world()
    if ranks.size == 1:
        return
    request = ranks.Ibarrier()
    end = time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > end:
            print(
                f"vi-contact: rank {ranks.rank} of {ranks.size} stopped alone: {text}",
                file=sys.stderr,
                flush=True,
            )
            ranks.Abort(1)
        time.sleep(0.02)
