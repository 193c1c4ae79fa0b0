"""The folder a run writes into, and how several ranks write without losing data or waiting for each other for ever.

Only rank 0 touches the disk. Whatever it does there goes through ``on_root``: a failure is told to all ranks, which
then raise the same sentence together. Files that must be whole are written beside their name and renamed.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from ...core.algebra import Comm
from ...core.checks import shown
from ...core.errors import InputError, ViContactError

T = TypeVar("T")

FORMAT = 1  # of run folders and checkpoints; what was written before there were numbers counts as it

ABOUT = "format.json"
CHECKPOINT = "checkpoint.npz"
COLUMNS = "columns.json"
FIELDS = "fields"
FIELDS_INDEX = "fields.xdmf"
HISTORY_CSV = "history.csv"
HISTORY_H5 = "history.h5"
JOURNAL = "history.journal"
LOG = "run.log"
SUMMARY = "summary.json"
FILES = (ABOUT, CHECKPOINT, COLUMNS, FIELDS_INDEX, HISTORY_CSV, HISTORY_H5, JOURNAL, LOG, SUMMARY)  # of a run

_FULL = (errno.ENOSPC, errno.EDQUOT)
_REFUSED = (errno.EACCES, errno.EPERM, errno.EROFS)


def on_root(comm: Comm, action: Callable[[], T]) -> T | None:
    """The action's value on rank 0, None elsewhere; what it raises there is raised on every rank.

    An OSError becomes a ViContactError of one sentence with path and reason. Collective.
    """
    value: T | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            value = action()
        except OSError as error:
            failure = ViContactError(sentence(error))
            failure.__cause__ = error
        except Exception as error:  # the other ranks must not wait for this one
            failure = error
    told = failure if isinstance(failure, ViContactError) or failure is None else ViContactError(f"rank 0: {failure!r}")
    kind, text = comm.bcast((type(told), str(told)) if told is not None else (None, ""))
    if failure is not None:
        raise failure
    if kind is not None:
        raise kind(text)
    return value


def sentence(error: OSError) -> str:
    """One sentence: what happened to which file, and the remedy."""
    path = error.filename or "the output folder"
    if error.errno in _FULL:
        return (
            f"the disk is full: '{path}' could not be written; what was written before is kept, "
            "free some space and restart from the last checkpoint"
        )
    if error.errno in _REFUSED:
        return f"'{path}' cannot be written ({error.strerror}): choose another output folder or change its permissions"
    return f"'{path}' cannot be read or written ({error.strerror or error}): choose another output folder"


def run_folder(comm: Comm, path: str | Path) -> Path:
    """Makes the folder, with parents, and tries to write into it, before any work is done; InputError if not."""
    folder = Path(path)

    def make() -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            trial = folder / f".writable-{os.getpid()}"
            write_atomically(trial, b"vi_contact")
            trial.unlink()
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"output folder '{folder}' cannot be written ({reason}): choose another one") from error

    on_root(comm, make)
    return folder


def check_format(file: Path, found: Any) -> None:
    """InputError for a file of a format that this version does not know."""
    if found != FORMAT or isinstance(found, bool):
        raise InputError(f"'{file}' has format {shown(found)} and this version of vi_contact reads {FORMAT}: read it "
                         "with the version that wrote it")


def check_folder_format(folder: Path) -> None:
    """The same for a run folder; those of the first version have no number, which is well."""
    try:
        found = json.loads((folder / ABOUT).read_text(encoding="utf-8"))["format"]
    except FileNotFoundError:
        return
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(f"'{folder / ABOUT}' is damaged ({error}): restore it, or remove it") from error
    check_format(folder, found)


def clear(folder: Path) -> None:
    """Removes what an earlier run left in the folder and a new one could be mistaken for; histories are overwritten."""
    for name in (ABOUT, CHECKPOINT, JOURNAL, HISTORY_H5, SUMMARY, FIELDS_INDEX):
        (folder / name).unlink(missing_ok=True)
    for frame in (folder / FIELDS).glob("*.h5"):
        frame.unlink()


def remove_litter(folder: Path) -> None:
    """Removes what killed processes left of files they were about to replace; with the folder's lock only."""
    for path in [*folder.glob(".*.*[0-9].tmp"), *(folder / FIELDS).glob(".*.*[0-9].tmp")]:
        path.unlink(missing_ok=True)


@contextmanager
def _whole_or_not_at_all(path: Path) -> Iterator[Any]:
    """Open an unbuffered file beside ``path`` that takes its place at the end; OSError names ``path``."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "w+b", buffering=0) as file:
            yield file
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def write_atomically(path: Path, data: bytes) -> None:
    """The file has its old content or all of the new one, whatever happens; OSError names it."""
    with _whole_or_not_at_all(path) as file:
        write_all(file, data)


def write_all(file: Any, data: bytes) -> None:
    """Every byte to an unbuffered file: one call may write less when the disk fills up."""
    view = memoryview(data)
    while view:
        view = view[file.write(view) :]


def hdf5_atomically(path: Path, fill: Callable[[h5py.File], None]) -> None:
    """The same for an HDF5 file, which need not fit the memory."""
    with _whole_or_not_at_all(path) as raw:
        kept = _Kept(raw)
        with h5py.File(kept, "w", driver="fileobj") as file:
            fill(file)
        if kept.error is not None:
            raise kept.error


class _Kept:
    """A file for HDF5, which does not survive a full disk: the error is kept, and what comes after it is dropped."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self.error: OSError | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def write(self, data: Any) -> int:
        if self.error is None:
            try:
                write_all(self._file, data)
            except OSError as error:
                self.error = error
        return len(data)


def to_json(facts: Mapping[str, Any]) -> str:
    """Strict JSON of numbers, texts, arrays and mappings; NaN and infinity become null."""
    return json.dumps(_plain(facts), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    """Types that JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
