"""Write files that a crash cannot spoil, on rank 0 alone, with failures told to all ranks.

Which names are opened, and that no link is followed: ``core.own_files``; HDF5 files are read by
``core.hdf5``.
"""

import csv
import errno
import io
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .algebra import Comm
from .errors import ViContactError
from .hdf5 import StoredFile
from .own_files import inner_folder, is_stream, name_temporary, open_new, open_to_read, remove

T = TypeVar("T")

FIELDS = "fields"  # the folder of an XDMF series inside a run folder
FIELDS_INDEX = "fields.xdmf"

STRIDE = 2**20  # bytes that are copied at once
_FULL = (errno.ENOSPC, errno.EDQUOT)
_MANY = (errno.EMFILE, errno.ENFILE)
_REFUSED = (errno.EACCES, errno.EPERM, errno.EROFS)


FRAME = re.compile(r"frame_(\d{6,})\.h5")  # a file of one frame, with the number of its step
FRAMES = re.compile(r"frames_\d{6,}\.h5")  # a file of several frames, each in a group of its step


def list_frames(folder: Path) -> dict[int, tuple[Path, str]]:
    """Return where the frames of an XDMF series in a run folder are.

    Returns:
        Step -> (HDF5 file, group in it).

    Raises:
        InputError: the folder of fields, or a file of frames, is a link.
    """
    fields = inner_folder(folder, FIELDS)
    names = sorted(os.listdir(fields)) if fields.is_dir() else []
    frames = {}
    for name in names:
        match = FRAME.fullmatch(name)
        if match:
            frames[int(match[1])] = (fields / name, "/")
    for name in filter(FRAMES.fullmatch, names):
        with open_hdf5(fields / name) as file:
            for step in filter(str.isdecimal, file):
                frames[int(step)] = (fields / name, f"/{step}")
    return frames


def on_root(comm: Comm, action: Callable[[], T]) -> T | None:
    """Return the action's value on rank 0, None elsewhere. Collective.

    What it raises there is raised on every rank. An OSError becomes a ViContactError of one
    sentence with path and reason.
    """
    value: T | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            value = action()
        except OSError as error:
            failure = ViContactError(describe_os_error(error))
            failure.__cause__ = error
        except Exception as error:  # the other ranks must not wait for this one
            failure = error

    # The others raise the package's own errors alike, and tell of any other.
    message: tuple[type[ViContactError] | None, str] = (None, "")
    if isinstance(failure, ViContactError):
        message = (type(failure), str(failure))
    elif failure is not None:
        message = (ViContactError, f"rank 0: {failure!r}")
    kind, text = comm.bcast(message)
    if failure is not None:
        raise failure
    if kind is not None:
        raise kind(text)
    return value


def describe_os_error(error: OSError) -> str:
    """Return one sentence: what happened to which file, and the remedy."""
    path = "a file" if error.filename is None else f"'{os.fsdecode(error.filename)}'"

    # Causes with a remedy of their own come first.
    if error.errno in _FULL:
        return (
            f"the disk is full: {path} could not be written; what was written before is kept, free "
            "some space and restart from the last checkpoint"
        )
    if error.errno in _REFUSED:
        return (
            f"{path} cannot be opened ({error.strerror}): change its permissions, or choose "
            "another folder"
        )
    if error.errno in _MANY:
        return (
            f"{path} cannot be opened ({error.strerror}): raise the limit of open files (ulimit -n)"
        )
    if isinstance(error, BrokenPipeError):
        return f"what reads {path} has ended before all was written: let it read to the end"
    return (
        f"{path} cannot be read or written ({error.strerror or error}): check it, or choose "
        "another output folder"
    )


def write_atomically(path: Path, data: bytes, *, safe: bool = True) -> None:
    """Write a file as a whole or not at all.

    Args:
        path: the file.
        data: its content.
        safe: whether this must hold even if the power fails, which takes time.

    Raises:
        OSError: names the file.
    """
    with _replace_when_complete(path, safe) as file:
        write_all(file, data)


def write_output(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file that a user has named, as a whole or not at all.

    Data for a stream, such as /dev/stdout, are written as they are. A link of this name is
    replaced, and what it points at stays as it is.

    Raises:
        OSError: names the file.
    """
    if is_stream(Path(path)):
        try:
            with open(path, "ab", buffering=0) as file:
                write_all(file, data)
        except OSError as error:  # of writing: it names no file
            error.filename = error.filename or os.fspath(path)
            raise
    else:
        write_atomically(Path(path), data, safe=False)


def copy_start(source: Path, target: Path, length: int) -> None:
    """Copy the first bytes of a file of a run, as a whole or not at all.

    Args:
        source: the file that is copied.
        target: the copy.
        length: number of bytes; fewer where the file is shorter.

    Raises:
        OSError: names the target.
    """
    with open_to_read(source) as old, _replace_when_complete(target) as new:
        left = length
        while left:
            data = old.read(min(left, STRIDE))
            if not data:
                break
            write_all(new, data)
            left -= len(data)


def push(path: Path) -> None:
    """Push a file, if there is one, onto the medium."""
    with suppress(FileNotFoundError), open_to_read(path) as file:
        os.fsync(file.fileno())


def write_all(file: Any, data: bytes | memoryview) -> None:
    """Write every byte to an unbuffered file: one call may write less when the disk fills up."""
    view = memoryview(data)
    while view:
        written = file.write(view)
        view = view[written:]


def write_csv(path: str | Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> Path:
    """Write a table as a whole: numbers to the last bit, and nothing for None.

    Args:
        path: the file.
        header: names of the columns.
        rows: the rows, each as long as the header.

    Returns:
        The path of the file.

    Raises:
        ViContactError: it cannot be written.
    """
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    try:
        write_output(path, text.getvalue().encode())
    except OSError as error:
        raise ViContactError(describe_os_error(error)) from error
    return Path(path)


def to_json(facts: Mapping[str, Any] | Sequence[Any]) -> str:
    """Return strict JSON of numbers, texts, lists, arrays and mappings.

    NaN and infinity become null.
    """
    return json.dumps(_plain(facts), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    """Return the value in types that JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(member) for key, member in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(member) for member in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


@contextmanager
def _replace_when_complete(path: Path, safe: bool = True) -> Iterator[Any]:
    """Open an unbuffered file beside ``path`` that takes its place at the end.

    A ``safe`` one is pushed onto the medium before, so that it survives a failure of the power.

    Raises:
        OSError: names ``path``.
    """
    temporary = name_temporary(path)
    try:
        with open_new(temporary) as file:
            yield file
            if safe:
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        with suppress(OSError):
            remove(temporary)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def open_hdf5(path: Path) -> StoredFile:
    """Open an HDF5 file of a run folder to be read.

    Raises:
        OSError: it is no HDF5 file.
        InputError: it is a link.
    """
    return StoredFile(path)


def hdf5_atomically(path: Path, fill: Callable[[Any], None]) -> None:
    """Write an HDF5 file as a whole or not at all; it need not fit the memory.

    Args:
        path: the file.
        fill: writes into the open file.

    Raises:
        OSError: names the file.
    """
    import h5py  # late: the package is imported without it

    with _replace_when_complete(path) as raw:
        tolerant = _TolerantFile(raw)
        with h5py.File(tolerant, "w", driver="fileobj") as file:
            fill(file)
        if tolerant.error is not None:
            raise tolerant.error


class _TolerantFile:
    """Hold a file for HDF5, which does not survive a full disk.

    The first error is kept, and what is written after it is dropped.
    """

    def __init__(self, file: Any) -> None:
        self._file = file
        self.error: OSError | None = None
        self.seek = file.seek  # both are asked for all the time
        self.flush = file.flush

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def write(self, data: Any) -> int:
        if self.error is None:
            try:
                write_all(self._file, data)
            except OSError as error:
                self.error = error
        return len(data)
