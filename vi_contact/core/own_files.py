"""Open the files of a run folder: regular files of that very folder, never what a link points at.

Every file that a run, a report or a study reads or writes in a run folder is opened here (HDF5
files: ``core.hdf5``).

- What is read or continued must be a regular file. A link, a pipe, a device or a folder of its name
  is refused.
- What is written anew takes the place of whatever has its name: that name is removed, and a new
  file is made. So what a link, hard or symbolic, led to keeps its content.
- A folder inside a run folder must be a folder itself. The run folder may be reached by links: it
  is the user's choice.
- Nothing is deleted but by name, one file at a time, and never through a link.
"""

import os
import shutil
import stat
from pathlib import Path
from typing import Any

from .errors import InputError

_KINDS = (
    (stat.S_ISLNK, "a link"),
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
# Nonblocking, as opening a pipe would wait for its other end.
_SAFE = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
TRIES = 10  # to make a file anew, while somebody else makes one of that name
# Folders of the streams that users name as outputs.
DEVICES = (Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd"))


def is_own(path: Path) -> bool:
    """Return whether there is a regular file of this name.

    Raises:
        InputError: there is anything else of this name.
    """
    mode = _mode(path)
    if mode is not None and not stat.S_ISREG(mode):
        raise _foreign(path, mode, "file")
    return mode is not None


def inner_folder(folder: Path, *names: str) -> Path:
    """Return a folder inside a run folder, which need not exist.

    Raises:
        InputError: it, or one above it, is a link.
    """
    for name in names:
        folder = folder / name
        mode = _mode(folder)
        if mode is not None and not stat.S_ISDIR(mode):
            raise _foreign(folder, mode, "folder")
    return folder


def make_inner_folder(folder: Path, *names: str) -> Path:
    """Make a folder inside a run folder, and those above it; InputError as of ``inner_folder``."""
    for name in names:
        folder = inner_folder(folder, name)
        folder.mkdir(exist_ok=True)
    return folder


def open_to_read(path: Path) -> Any:
    """Open a regular file, buffered.

    Raises:
        InputError: there is anything else of this name.
        OSError: names the file.
    """
    return os.fdopen(_open_descriptor(path, os.O_RDONLY), "rb")


def open_to_append(path: Path, *, make: bool = False) -> Any:
    """Open a regular file, unbuffered, to read it and to write at its end.

    A file that has another name too (a hard link) stays as it is under that name: this one gets a
    copy.

    Args:
        path: the file.
        make: whether to make it where there is none.

    Raises:
        InputError: there is anything but a regular file of this name.
        OSError: names the file.
    """
    flags = os.O_RDWR | os.O_APPEND
    if make:
        flags |= os.O_CREAT
    return _open_sole(path, flags, "ab+")


def open_to_change(path: Path) -> Any:
    """Open a regular file, unbuffered, to read it and to write anywhere in it.

    One that has another name too is copied, as by ``open_to_append``.

    Raises:
        InputError: there is anything but a regular file of this name.
        OSError: names the file.
    """
    return _open_sole(path, os.O_RDWR, "rb+")


def _open_sole(path: Path, flags: int, mode: str) -> Any:
    """Open a file that has no other name, or a copy of one that has."""
    file = _wrap_unbuffered(_open_descriptor(path, flags), path, mode)
    if count_names(file) > 1:
        file.close()
        _replace_by_copy(path)
        file = _wrap_unbuffered(_open_descriptor(path, flags), path, mode)
    return file


def open_lock(path: Path) -> Any:
    """Open a regular file that processes lock, unbuffered, and make it where there is none.

    Raises:
        InputError: there is anything else of this name.
    """
    return _wrap_unbuffered(_open_descriptor(path, os.O_RDWR | os.O_CREAT), path, "rb+")


def count_names(file: Any) -> int:
    """Return how many names an open file has: more with hard links, 0 when it was removed."""
    return os.fstat(file.fileno()).st_nlink


def open_new(path: Path) -> Any:
    """Make a file anew, unbuffered, in the place of whatever has its name, but for a folder.

    Raises:
        OSError: names the file.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | _SAFE
    for _ in range(TRIES):
        try:
            return _wrap_unbuffered(os.open(path, flags, 0o666), path, "wb+")
        except FileExistsError:
            remove(path)
    raise OSError(f"another program makes '{path}' again and again")


def read_bytes(path: Path) -> bytes:
    """Return the content of a regular file.

    Raises:
        InputError: there is anything else of this name.
        OSError: names the file.
    """
    with open_to_read(path) as file:
        return bytes(file.read())


def read_text(path: Path) -> str:
    """Return the text of a regular file.

    Raises:
        InputError: there is anything else of this name.
        OSError: names the file.
        ValueError: it is not UTF-8.
    """
    return read_bytes(path).decode("utf-8")


def remove(path: Path) -> None:
    """Remove a name, if there is one: of a link the link alone.

    Raises:
        OSError: it is a folder, which stays.
    """
    path.unlink(missing_ok=True)


def is_stream(path: Path) -> bool:
    """Return whether a user has named a stream, such as /dev/stdout; these are never replaced."""
    path = Path(os.path.abspath(path))
    return path.parent in DEVICES and os.path.lexists(path)


def same_file(path: Path, file: Any) -> bool:
    """Return whether an open file is still the one of that name."""
    try:
        return os.path.samestat(os.lstat(path), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def _mode(path: Path) -> int | None:
    """Return the mode of what has this name itself; None where there is nothing."""
    try:
        return os.lstat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _open_descriptor(path: Path, flags: int) -> int:
    """Open a regular file, and return its descriptor."""
    # The first check says what it is. A link that is made after it is not followed either, and what
    # was opened is looked at once more.
    is_own(path)
    descriptor = os.open(path, flags | _SAFE, 0o666)
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        raise _foreign(path, mode, "file")
    return descriptor


def _replace_by_copy(path: Path) -> None:
    """Put a copy of a file in its place."""
    copy = name_temporary(path)
    with open_to_read(path) as old, open_new(copy) as new:
        shutil.copyfileobj(old, new)
    os.replace(copy, path)


def name_temporary(path: Path) -> Path:
    """Return the name under which this process makes a file that is to replace another."""
    return path.with_name(f".{path.name}.{os.getpid()}.tmp")


def _wrap_unbuffered(descriptor: int, path: Path, mode: str) -> Any:
    """Return an unbuffered file object, which knows its name, for a descriptor."""
    return open(path, mode, buffering=0, opener=lambda *_: descriptor)


def _foreign(path: Path, mode: int, wanted: str) -> InputError:
    """Return the error about what is no file, or no folder, of the run's own.

    Args:
        path: its name.
        mode: what ``os.lstat`` says of it.
        wanted: "file" or "folder".
    """
    other = "a file" if wanted == "folder" else "no file"
    kind = next((name for is_kind, name in _KINDS if is_kind(mode)), other)
    return InputError(
        f"'{path}' is {kind}, and a run reads and writes only files of its own folder: put a "
        f"{wanted} in its place, remove it, or choose another folder"
    )
