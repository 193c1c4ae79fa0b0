"""Add to an HDF5 file so that a crash, or a full disk, leaves what was in it.

HDF5 writes new numbers behind the end of a file, and changes some pages in it that say what is
where. New numbers go to the disk at once: nothing refers to them. Changed pages wait in memory
until HDF5 has closed the file. Then their former content is written into a second file, NAME.undo,
and they take their places. Who finds NAME.undo puts the former content back.
"""

import os
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from .files import write_all, write_atomically
from .own_files import is_own, open_to_change, read_bytes, remove

PAGE = 4096  # bytes of the file that are kept together
_HEAD = struct.Struct("<QQ")  # length of the file, number of pages
_PLACE = struct.Struct("<QQ")  # where a page begins, and how many bytes it has


def name_undo(path: Path) -> Path:
    """Return the name of the file with the former content of another."""
    return path.with_name(f"{path.name}.undo")


def undo_broken_change(path: Path) -> None:
    """Put back what a change of an HDF5 file that was not finished has overwritten.

    Args:
        path: the HDF5 file, which need not exist.

    Raises:
        OSError: names the file.
    """
    undo = name_undo(path)
    if not is_own(undo):
        return
    if is_own(path):
        data = read_bytes(undo)
        length, count = _HEAD.unpack_from(data)
        place = _HEAD.size
        with open_to_change(path) as file:
            for _ in range(count):
                first, size = _PLACE.unpack_from(data, place)
                place += _PLACE.size
                file.seek(first)
                write_all(file, data[place : place + size])
                place += size
            file.truncate(length)
            os.fsync(file.fileno())
    remove(undo)


def change_hdf5(path: Path, change: Callable[[Any], None]) -> None:
    """Change an HDF5 file as a whole or not at all.

    Args:
        path: the file, which nobody else writes.
        change: is called with the open file, and adds to it.

    Raises:
        OSError: names the file.
    """
    import h5py  # late: the package is imported without it

    try:
        with open_to_change(path) as raw:
            held = _HeldFile(raw)
            try:
                with h5py.File(held, "r+", driver="fileobj") as file:
                    change(file)
                if held.error is not None:
                    raise held.error
                os.fsync(raw.fileno())
                _overwrite(path, held)
            except BaseException:
                with suppress(OSError):  # what is behind the old end is nobody's
                    raw.truncate(held.length)
                raise
    except OSError as error:
        with suppress(OSError):
            undo_broken_change(path)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def _overwrite(path: Path, held: "_HeldFile") -> None:
    """Let the changed pages take their places, once their former content is on the medium.

    Args:
        path: the HDF5 file.
        held: that file, closed by HDF5.
    """
    former = [_HEAD.pack(held.length, len(held.pages))]
    for number in held.pages:
        old = held.read_page(number)
        former += [_PLACE.pack(number * PAGE, len(old)), old]
    write_atomically(name_undo(path), b"".join(former))
    _push_names(path.parent)
    for number, page in held.pages.items():
        held.raw.seek(number * PAGE)
        write_all(held.raw, bytes(page))
    os.fsync(held.raw.fileno())
    remove(name_undo(path))


def _push_names(folder: Path) -> None:
    """Push the names in a folder onto the medium, where the file system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


class _HeldFile:
    """Hold a file for HDF5: what lies in it is changed in memory alone.

    The first error of the disk is kept, and what is written after it is dropped: HDF5 does not
    survive one.

    Attributes:
        raw: the file on the disk.
        length: of it before the change [bytes].
        pages: number -> changed content.
        error: the first one of the disk.
    """

    def __init__(self, raw: Any) -> None:
        """Hold an open file.

        Args:
            raw: it, unbuffered, open to be read and written.
        """
        self.raw = raw
        self.length = raw.seek(0, os.SEEK_END)
        self.pages: dict[int, bytearray] = {}
        self.error: OSError | None = None
        self._end = self.length
        self._place = 0

    def read_page(self, number: int) -> bytes:
        """Return a page as it is on the disk; the last one of the former file may be shorter."""
        self.raw.seek(number * PAGE)
        return bytes(self.raw.read(min(PAGE, self.length - number * PAGE)))

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self._end}[whence]
        self._place = start + offset
        return self._place

    def tell(self) -> int:
        """Return the place."""
        return self._place

    def flush(self) -> None:
        """Do nothing: the changes wait."""

    def truncate(self, size: int) -> int:
        """Take note of the new end; the former content stays on the disk."""
        self._end = max(size, self.length)
        return self._end

    def read(self, size: int) -> bytes:
        """Return bytes of the changed file."""
        self.raw.seek(self._place)
        data = bytearray(self.raw.read(size))
        stop = self._place + len(data)
        if self.pages:
            for number in range(self._place // PAGE, (stop + PAGE - 1) // PAGE):
                if number in self.pages:
                    self._copy_page(number, data)
        self._place = stop
        return bytes(data)

    def _copy_page(self, number: int, data: bytearray) -> None:
        """Copy what a changed page has of the bytes from the place on."""
        page = self.pages[number]
        shift = number * PAGE - self._place
        first, stop = max(shift, 0), min(shift + len(page), len(data))
        data[first:stop] = page[first - shift : stop - shift]

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with bytes of the changed file."""
        view = memoryview(buffer).cast("B")
        data = self.read(len(view))
        view[: len(data)] = data
        return len(data)

    def write(self, data: Any) -> int:
        """Write bytes: those behind the former end to the disk, all others into pages."""
        view = memoryview(data).cast("B")
        count = len(view)
        inside = min(count, max(0, self.length - self._place))
        done = 0
        while done < inside:
            number, first = divmod(self._place + done, PAGE)
            if number not in self.pages:
                self.pages[number] = bytearray(self.read_page(number))
            page = self.pages[number]
            size = min(inside - done, len(page) - first)
            page[first : first + size] = view[done : done + size]
            done += size
        if inside < count and self.error is None:
            try:
                self.raw.seek(self._place + inside)
                write_all(self.raw, view[inside:])
            except OSError as error:
                self.error = error
        self._place += count
        self._end = max(self._end, self._place)
        return count
