"""Errors of the machine and of libraries that are no defect of the package, told in one sentence as its own are."""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from .checks import shown
from .errors import InputError, ViContactError
from .output import sentence

PETSC_ERR_MEM = 55  # of petscsystypes.h
_MEMORY = ("out of memory", "cannot allocate memory", "unable to allocate", "memory allocation failed", "bad_alloc")
OUT_OF_MEMORY = (
    "out of memory: take a coarser mesh, fewer steps or samples, or more ranks on more machines; what a run has "
    "written is kept, and --restart continues it"
)


def check_words(arguments: Sequence[str]) -> None:
    """InputError for words that no shell can give and no file can be called, and for empty names of outputs."""
    for word in arguments:
        if "\0" in word:
            raise InputError(f"{shown(word)} holds the character NUL: leave it out")
    for option, value in zip(arguments, [*arguments[1:], None], strict=True):
        if (option in ("--out", "--csv", "--png") and value == "") or option in ("--out=", "--csv=", "--png="):
            raise InputError(f"{option.rstrip('=')} is empty: give the name of a file or folder, or leave it away")


def told(run: Callable[[], Any]) -> Any:
    """What the call returns; ViContactError of one sentence for errors of memory, files and sizes of numbers."""
    try:
        return run()
    except ViContactError as error:
        if _of_memory(error):
            raise ViContactError(OUT_OF_MEMORY) from error
        raise
    except Exception as error:
        text = _sentence(error)
        if text is None:
            raise
        raise ViContactError(text) from error


def printable(text: str) -> str:
    """The text without what standard output cannot write, as names of files that are no UTF-8."""
    encoding = sys.stdout.encoding or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def _sentence(error: Exception) -> str | None:
    if _of_memory(error):
        return OUT_OF_MEMORY
    if isinstance(error, OSError):
        return sentence(error)
    if isinstance(error, OverflowError | FloatingPointError):
        return f"a number grew beyond those of the machine ({error}): check the sizes and units of what was given"
    return None


def _of_memory(error: BaseException) -> bool:
    """Whether an error, or one it came from, says that there is no memory: Python's, numpy's, HDF5's, PETSc's."""
    return any(
        isinstance(one, MemoryError)
        or getattr(one, "errno", None) == errno.ENOMEM
        or getattr(one, "ierr", None) == PETSC_ERR_MEM
        or (not isinstance(one, ViContactError) and any(word in str(one).lower() for word in _MEMORY))
        for one in _chain(error)
    )


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
