"""Make and lock the folder a run writes into.

So no data are lost, and no rank waits for another for ever.

Only rank 0 touches the disk. Whatever it does there goes through ``on_root``: a failure is told to
all ranks, which then raise the same sentence together. Files that must be whole are written beside
their name and renamed.

A run takes a folder by writing ``format.json`` into it. Only in a folder with this mark are files
replaced or deleted that were there before, and of those only the ones with names that runs write.
All others are left alone.
"""

import fcntl
import json
import logging
import os
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...core.algebra import Comm
from ...core.checks import quote
from ...core.errors import InputError
from ...core.files import (
    FIELDS,
    FIELDS_INDEX,
    FRAME,
    FRAMES,
    describe_os_error,
    on_root,
    to_json,
    write_atomically,
)
from ...core.hdf5_changes import name_undo
from ...core.own_files import (
    count_names,
    inner_folder,
    is_own,
    make_inner_folder,
    open_lock,
    open_to_read,
    read_text,
    remove,
    same_file,
)
from ...core.version import __version__
from ...core.vtkhdf import FIELDS_VTKHDF

log = logging.getLogger(__name__)
FIRST = b"t,k,iterations,certificate,escalated"  # how every history.csv begins
FORMAT = 1  # of run folders

ABOUT = "format.json"  # the mark by which a folder belongs to runs
CHECKPOINT = "checkpoint.npz"
COLUMNS = "columns.json"  # units and meanings of the columns of the histories
COPY = "case.toml"  # the case file that a run was made of
FOLLOWS = "follows.txt"  # in a stage: which stage it begins with
HISTORY_CSV = "history.csv"  # numbers, a row for each step
HISTORY_H5 = "history.h5"  # numbers and arrays, up to the last save
JOURNAL = "history.journal"  # arrays of the rows since then
LOCK = ".lock"
LOG = "run.log"
MESH = "mesh.h5"  # in the folder of fields
STAGES = "stages"  # the folder of the runs of stages before the last one
MODEL = "model.json"  # a description of the model
SUMMARY = "summary.json"
UNDO = name_undo(Path(FIELDS_VTKHDF)).name
# the files of a run
FILES = (
    ABOUT,
    CHECKPOINT,
    COLUMNS,
    FIELDS_INDEX,
    FIELDS_VTKHDF,
    UNDO,
    HISTORY_CSV,
    HISTORY_H5,
    JOURNAL,
    LOG,
    MODEL,
    SUMMARY,
)
# beside them, written by cases and studies,
_OF_CASES = (COPY, FOLLOWS, "strain_compatible.json", "row.json", "failure.txt")
# and by reports
_OF_REPORTS = (
    "report.pdf",
    "report.html",
    "peaks.csv",
    "model.png",
    "deformed.png",
    "faces.png",
    "film.gif",
    "film.mp4",
)
_TRIAL = re.compile(r"\.writable-\d+")
_locks: dict[Path, int] = {}  # lock files that this process holds -> the thread that took each


def run_folder(comm: Comm, path: str | Path) -> Path:
    """Make the folder, with parents, and try to write into it, before any work is done.

    Collective.

    Raises:
        InputError: that fails, or files of others have names that a run replaces.
    """
    folder = Path(path)
    if find_spec("h5py") is None:
        raise InputError(
            f"output folder '{folder}' needs h5py, which is missing here: install it, or run "
            "without"
        )

    def make() -> None:
        """Make the folder on rank 0, write a file into it, and remove that."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            trial = folder / f".writable-{os.getpid()}"
            write_atomically(trial, b"vi_contact")
            remove(trial)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(
                f"output folder '{folder}' cannot be written ({reason}): choose another one"
            ) from error
        refuse_files_of_others(folder)

    on_root(comm, make)
    return folder


def is_marked(folder: Path) -> bool:
    """Return whether a run has taken this folder.

    It then has the mark, or a history as only runs write it.
    """
    if is_own(folder / ABOUT):
        return True
    if not is_own(folder / HISTORY_CSV):
        return False
    with open_to_read(folder / HISTORY_CSV) as file:
        return bool(file.read(len(FIRST)) == FIRST)


def refuse_files_of_others(folder: Path) -> None:
    """Raise InputError for a file that a run would replace, in a folder that no run has taken."""
    if is_marked(folder):
        return
    for path in _list_replaced(folder):
        raise InputError(
            f"'{path}' is not of a run of vi_contact (there is no {ABOUT} in '{folder}'), and a "
            "run would replace it: choose another output folder, or move the file"
        )


def take(folder: Path) -> None:
    """Write the mark of runs into a folder, with its lock.

    Raises:
        InputError: as of ``refuse_files_of_others``.
    """
    refuse_files_of_others(folder)
    about = {"format": FORMAT, "vi_contact": __version__}
    write_atomically(folder / ABOUT, (to_json(about) + "\n").encode())


def _list_replaced(folder: Path) -> list[Path]:
    """Return the files in a folder that have names which a run would write.

    A description that ``vi-contact run --check`` wrote is no file of others. The copy of a case is
    left out, as it has a mark of its own.
    """
    paths = [folder / name for name in (*FILES, FOLLOWS)]
    if _is_model(folder / MODEL):
        paths.remove(folder / MODEL)
    paths += _list_frames(inner_folder(folder, FIELDS))
    return [path for path in paths if os.path.lexists(path)]


def _is_model(path: Path) -> bool:
    """Return whether a file describes a model.

    ``vi-contact run --check`` writes it into a folder without a run.
    """
    if not is_own(path):
        return False
    try:
        content = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and {"title", "dimension", "unknowns"} <= set(content)


def _list_frames(fields: Path) -> list[Path]:
    """Return the files in the folder of fields that have names of ours."""
    names_there = sorted(os.listdir(fields)) if fields.is_dir() else []
    return [fields / name for name in names_there if _is_frame(name)]


def _is_frame(name: str) -> bool:
    """Say whether this is the name of a mesh or of frames in the folder of fields."""
    return bool(name == MESH or FRAME.fullmatch(name) or FRAMES.fullmatch(name))


def check_format(file: Path, number: Any, known: int = FORMAT) -> None:
    """Raise InputError for a file whose format has another number than the one that is known."""
    if number != known or isinstance(number, bool):
        raise InputError(
            f"'{file}' has format {quote(number)} and this version of vi_contact reads {known}: "
            "read it with the version that wrote it"
        )


def check_folder_format(folder: Path) -> None:
    """Raise InputError likewise for a run folder.

    One without a number, of which files were copied, is not asked.
    """
    if not is_own(folder / ABOUT):
        return
    try:
        number = json.loads(read_text(folder / ABOUT))["format"]
    except OSError as error:
        raise InputError(describe_os_error(error)) from error
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        # of json, and of what it has read
        raise InputError(
            f"'{folder / ABOUT}' is damaged ({error}): restore it or remove it"
        ) from error
    check_format(folder, number)


def clear(folder: Path) -> None:
    """Remove what an earlier run left in the folder, for which a new one could be mistaken.

    Histories are overwritten. The mark of runs stays, and nothing is removed from a folder without
    it.
    """
    if not is_marked(folder):
        return
    for name in (CHECKPOINT, JOURNAL, HISTORY_H5, SUMMARY, FIELDS_INDEX, UNDO, FIELDS_VTKHDF):
        remove(folder / name)
    for frame in _list_frames(inner_folder(folder, FIELDS)):
        remove(frame)


def remove_run(folder: Path) -> None:
    """Remove the files of a run with its reports, and the folder if nothing else is in it.

    A folder that no run has taken, and all files of others, stay as they are.
    """
    if not is_marked(folder):
        return
    fields = inner_folder(folder, FIELDS)
    stages = inner_folder(folder, STAGES)
    for stage in _list_folders(stages):
        remove_run(stage)
    for frame in _list_frames(fields):
        remove(frame)
    remove_litter(folder)
    for name in (*FILES, *_OF_CASES, *_OF_REPORTS, LOCK):
        if name != ABOUT:
            remove(folder / name)
    remove(folder / ABOUT)  # last: what an interruption leaves is still known as a run's
    for place in (fields, stages, folder):
        remove_if_empty(place)


def move_run(folder: Path, target: Path) -> None:
    """Move the files of a run, with its fields and stages, into another folder.

    Files of others stay.
    """
    fields = inner_folder(folder, FIELDS)
    stages = inner_folder(folder, STAGES)
    for stage in filter(is_marked, _list_folders(stages)):
        os.replace(stage, make_inner_folder(target, STAGES) / stage.name)
    for frame in _list_frames(fields):
        os.replace(frame, make_inner_folder(target, FIELDS) / frame.name)
    others = [name for name in (*FILES, *_OF_CASES, *_OF_REPORTS) if name != ABOUT]
    for name in (*others, ABOUT):  # last: what an interruption leaves is still known as a run's
        if os.path.lexists(folder / name):
            os.replace(folder / name, target / name)
    for place in (fields, stages):
        remove_if_empty(place)


def _list_folders(folder: Path) -> list[Path]:
    """Return the folders inside a folder; no links."""
    if not folder.is_dir():
        return []
    paths = [folder / name for name in sorted(os.listdir(folder))]
    return [path for path in paths if path.is_dir() and not path.is_symlink()]


def remove_if_empty(folder: Path) -> None:
    """Remove a folder with nothing in it; any other stays."""
    if folder.is_dir() and not os.listdir(folder):
        folder.rmdir()


def remove_litter(folder: Path) -> None:
    """Remove what killed processes left of files they were about to replace.

    It is called with the folder's lock only.
    """
    for place in (folder, inner_folder(folder, FIELDS)):
        for name in os.listdir(place) if place.is_dir() else ():
            if _is_temporary(name) or (_TRIAL.fullmatch(name) and place is folder):
                remove(place / name)


def _is_temporary(name: str) -> bool:
    """Return whether this is the name of a file that was to replace one of a run.

    Such names are ".NAME.PROCESS.tmp".
    """
    inside, _, process = name.removesuffix(".tmp").removeprefix(".").rpartition(".")
    return name == f".{inside}.{process}.tmp" and process.isdecimal() and _is_name_of_runs(inside)


def _is_name_of_runs(name: str) -> bool:
    """Say whether runs, cases and reports write files of this name, or try whether they can."""
    if name in (*FILES, *_OF_CASES, *_OF_REPORTS):
        return True
    return _is_frame(name) or bool(_TRIAL.fullmatch(name))


@contextmanager
def lock_folder(comm: Comm, folder: Path | None, name: str = LOCK) -> Iterator[None]:
    """Refuse other runs that want the folder, or this part of it, until the block ends.

    They are refused on all their ranks. Collective.

    Rank 0 holds a lock (flock) on a file in the folder. What a killed run leaves of it holds nobody
    up. Within the same thread it may be taken again. On a file system that knows no locks there is
    none, which is logged.

    Args:
        comm: of the ranks that share the run.
        folder: None for a run without one, which needs no lock.
        name: of the file, which may stand for a part of the folder.
    """
    mine = None if folder is None else on_root(comm, lambda: _take(folder, name))
    try:
        yield
    finally:
        # removed while locked: who opens it meanwhile makes a new one
        if mine is not None and folder is not None:
            _locks.pop(folder.resolve() / name, None)
            remove(folder / name)
            mine.close()


def _take(folder: Path, name: str) -> Any:
    """Return the open file with the lock; None when this thread has the lock already.

    A file that was removed between opening and locking it holds nobody off: it is tried again.
    """
    if _locks.get(folder.resolve() / name) == threading.get_ident():
        return None
    while True:
        file = open_lock(folder / name)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"another run writes into '{folder}' ({_read_owner(file)}): wait until it has "
                "ended, or choose another output folder"
            ) from None
        except OSError as error:
            log.warning(
                "'%s' is on a file system without locks (%s): make sure that no other run writes "
                "there",
                folder,
                error.strerror,
            )
        if count_names(file) > 1 and same_file(folder / name, file):
            remove(folder / name)  # its other name, a hard link, keeps what it holds
        if same_file(folder / name, file):
            break
        file.close()  # it has been removed since, by the run that had it
    file.truncate(0)
    file.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
    _locks[folder.resolve() / name] = threading.get_ident()
    return file


def _read_owner(file: Any) -> str:
    """Return who holds the lock, as it wrote into the file, and close the file."""
    with file:
        file.seek(0)
        return " ".join(file.read(200).decode(errors="replace").split()) or "it has only begun"
