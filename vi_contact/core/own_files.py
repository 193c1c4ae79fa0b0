"""Open the files of a run folder.

These are regular files of that very folder, never what a link there points at.

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
# nonblocking: to open a pipe would wait for its other end
_SAFE = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
TRIES = 10  # to make a file anew, while somebody else makes one of that name
# where users name a stream as an output
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

    InputError for anything else of this name; OSError names the file.
    """
    return os.fdopen(_opened(path, os.O_RDONLY), "rb")


def open_to_append(path: Path, *, make: bool = False) -> Any:
    """Open a regular file, unbuffered, to read it and to write at its end.

    ``make`` it where there is none.

    A file that has another name too (a hard link) stays as it is under that name: this one gets a
    copy. InputError for anything but a regular file; OSError names the file.
    """
    flags = os.O_RDWR | os.O_APPEND | (os.O_CREAT if make else 0)
    file = _unbuffered(_opened(path, flags), path, "ab+")
    if names(file) > 1:
        file.close()
        _copied(path)
        file = _unbuffered(_opened(path, flags), path, "ab+")
    return file


def open_lock(path: Path) -> Any:
    """Open a regular file that processes lock, unbuffered, and make it where there is none.

    Raises:
        InputError: there is anything else of this name.
    """
    return _unbuffered(_opened(path, os.O_RDWR | os.O_CREAT), path, "rb+")


def names(file: Any) -> int:
    """Return how many names an open file has.

    There are more than one where there are hard links, and 0 when it was removed.
    """
    return os.fstat(file.fileno()).st_nlink


def open_new(path: Path) -> Any:
    """Make a file anew, unbuffered, in the place of whatever has its name, but for a folder.

    OSError names the file.
    """
    for _ in range(TRIES):
        try:
            return _unbuffered(
                os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | _SAFE, 0o666), path, "wb+"
            )
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

    It raises what ``read_bytes`` raises, and further:

    Raises:
        ValueError: it is not UTF-8.
    """
    return read_bytes(path).decode("utf-8")


def remove(path: Path) -> None:
    """Remove a name, if there is one: of a link the link alone.

    OSError for a folder, which
    stays.
    """
    path.unlink(missing_ok=True)


def is_stream(path: Path) -> bool:
    """Return whether a user has named a stream, such as /dev/stdout, as the place of an output.

    Never replace these.
    """
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


def _opened(path: Path, flags: int) -> int:
    """Return the descriptor of a regular file."""
    # the sentence says what it is; a link that is made after this is not followed either
    is_own(path)
    descriptor = os.open(path, flags | _SAFE, 0o666)
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        raise _foreign(path, mode, "file")
    return descriptor


def _copied(path: Path) -> None:
    """Put a copy of a file in its place."""
    copy = temporary_of(path)
    with open_to_read(path) as old, open_new(copy) as new:
        shutil.copyfileobj(old, new)
    os.replace(copy, path)


def temporary_of(path: Path) -> Path:
    """Return the name under which this process makes a file that is to replace another."""
    return path.with_name(f".{path.name}.{os.getpid()}.tmp")


def _unbuffered(descriptor: int, path: Path, mode: str) -> Any:
    """Return a file object that knows its name."""
    return open(path, mode, buffering=0, opener=lambda *_: descriptor)


def _foreign(path: Path, mode: int, wanted: str) -> InputError:
    kind = next(
        (name for test, name in _KINDS if test(mode)), "a file" if wanted == "folder" else "no file"
    )
    return InputError(
        f"'{path}' is {kind}, and a run reads and writes only files of its own folder: put a "
        f"{wanted} in its place, remove it, or choose another folder"
    )
