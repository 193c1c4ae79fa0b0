"""Make and lock the folder a run writes into, so that no data are lost and no rank waits for another for ever.

Only rank 0 touches the disk. Whatever it does there goes through ``on_root``: a failure is told to all ranks, which
then raise the same sentence together. Files that must be whole are written beside their name and renamed."""

import fcntl
import json
import logging
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...core.algebra import Comm
from ...core.checks import shown
from ...core.errors import InputError
from ...core.files import FIELDS, FIELDS_INDEX, on_root, write_atomically

log = logging.getLogger(__name__)
FORMAT = 1  # of run folders and checkpoints

ABOUT = "format.json"
CHECKPOINT = "checkpoint.npz"
COLUMNS = "columns.json"
HISTORY_CSV = "history.csv"
HISTORY_H5 = "history.h5"
JOURNAL = "history.journal"
LOCK = ".lock"
LOG = "run.log"
MODEL = "model.json"
SUMMARY = "summary.json"
FILES = (ABOUT, CHECKPOINT, COLUMNS, FIELDS_INDEX, HISTORY_CSV, HISTORY_H5, JOURNAL, LOG, MODEL,
         SUMMARY)  # of a run
_held: dict[Path, int] = {}  # locks that this process has -> the thread that took them


def run_folder(comm: Comm, path: str | Path) -> Path:
    """Make the folder, with parents, and try to write into it, before any work is done; InputError if not."""
    folder = Path(path)
    if find_spec("h5py") is None:
        raise InputError(f"output folder '{folder}' needs h5py, which is missing here: install it, or run without")

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
    """Raise InputError for a file of a format that this version does not know."""
    if found != FORMAT or isinstance(found, bool):
        raise InputError(f"'{file}' has format {shown(found)} and this version of vi_contact reads {FORMAT}: read it "
                         "with the version that wrote it")


def check_folder_format(folder: Path) -> None:
    """Raise InputError likewise for a run folder; one without a number, of which files were copied, is not asked."""
    try:
        found = json.loads((folder / ABOUT).read_text(encoding="utf-8"))["format"]
    except FileNotFoundError:
        return
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(f"'{folder / ABOUT}' is damaged ({error}): restore it or remove it") from error
    check_format(folder, found)


def clear(folder: Path) -> None:
    """Remove what an earlier run left in the folder and a new one could be mistaken for; histories are overwritten."""
    for name in (ABOUT, CHECKPOINT, JOURNAL, HISTORY_H5, SUMMARY, FIELDS_INDEX):
        (folder / name).unlink(missing_ok=True)
    for frame in (folder / FIELDS).glob("*.h5"):
        frame.unlink()


def remove_litter(folder: Path) -> None:
    """Remove what killed processes left of files they were about to replace; with the folder's lock only."""
    for path in [*folder.glob(".*.*[0-9].tmp"), *(folder / FIELDS).glob(".*.*[0-9].tmp")]:
        path.unlink(missing_ok=True)


@contextmanager
def locked(comm: Comm, folder: Path | None, name: str = LOCK) -> Iterator[None]:
    """Refuse other runs that want the folder, or this part of it, while it lasts, on all their ranks. Collective.

    Rank 0 holds a lock (flock) on a file in the folder. What a killed run leaves of it holds nobody up. Within the same
    thread it may be taken again. On a file system that knows no locks there is none, which is logged."""
    mine = None if folder is None else on_root(comm, lambda: _take(folder, name))
    try:
        yield
    finally:
        if mine is not None and folder is not None:  # removed while locked: who opens it meanwhile makes a new one
            _held.pop(folder.resolve() / name, None)
            (folder / name).unlink(missing_ok=True)
            mine.close()


def _take(folder: Path, name: str) -> Any:
    """The open, locked file; None when this thread has the lock already."""
    if _held.get(folder.resolve() / name) == threading.get_ident():
        return None
    while True:
        file = open(folder / name, "a+b", buffering=0)  # noqa: SIM115
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"another run writes into '{folder}' ({_owner(file)}): wait until it has ended, or choose "
                             "another output folder") from None
        except OSError as error:
            log.warning("'%s' is on a file system without locks (%s): make sure that no other run writes there",
                        folder, error.strerror)
        if _is_there(folder / name, file):
            break
        file.close()  # the run that had it has removed it since
    file.truncate(0)
    file.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
    _held[folder.resolve() / name] = threading.get_ident()
    return file


def _owner(file: Any) -> str:
    """Who holds it, as it wrote into the file; closes the file."""
    with file:
        file.seek(0)
        return " ".join(file.read(200).decode(errors="replace").split()) or "it has only begun"


def _is_there(path: Path, file: Any) -> bool:
    """Whether the file that is open is still the one of that name."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False
