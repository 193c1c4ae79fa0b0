"""Read HDF5 files of run folders: numbers stored in that very file, as many as memory can hold.

An HDF5 file may send its reader on: by a soft or external link, by a virtual data set, by external
storage. It may announce an array that no memory holds. Nothing of this is followed. Writing is in
``core.files``.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from .errors import InputError, is_of_machine
from .own_files import open_to_read

DENSEST = 1100  # bytes in memory for one on disk: zeros that are packed
_NUMBERS = "fiub"  # kinds of numpy: floats, whole numbers, truth values


class StoredGroup:
    """Hold a group of an HDF5 file that is open to be read.

    ``group[name]`` is a group or a data set of numbers. It raises KeyError for a name that is not
    there, InputError for what does not lie in this file.
    """

    def __init__(self, path: Path, group: Any, size: int) -> None:
        """Hold an open group.

        Args:
            path: of the file, for sentences.
            group: of h5py.
            size: of the file [bytes].
        """
        self._path = path
        self._group = group
        self._size = size

    def __getitem__(self, name: str) -> Any:
        item: Any = self
        for part in filter(None, name.split("/")):
            if not isinstance(item, StoredGroup):
                raise KeyError(name)
            item = item._member(part)
        return item

    def _member(self, name: str) -> Any:
        """Return a group or data set of this group; its link is checked before it is followed."""
        import h5py  # late: no step needs it

        # The link itself is asked for and not followed: a soft or external one leads elsewhere.
        link = self._group.get(name, getlink=True)
        if link is None:
            raise KeyError(name)
        if not isinstance(link, h5py.HardLink):
            raise self._damage(name, "lies in another file, or elsewhere in this one")
        item = self._group[name]
        if isinstance(item, h5py.Group):
            return StoredGroup(self._path, item, self._size)
        if not isinstance(item, h5py.Dataset):
            raise self._damage(name, "is no array of numbers of this file")

        # Numbers that are stored in other files, or more of them than this file can have packed.
        if item.external is not None or item.is_virtual:
            raise self._damage(name, "lies in another file")
        if item.dtype.kind not in _NUMBERS or item.nbytes > DENSEST * self._size:
            raise self._damage(name, "is no array of numbers of this file")
        return item

    def _damage(self, name: str, defect: str) -> InputError:
        """Return the error about a member that a run would not have written."""
        return InputError(
            f"'{self._path}' is damaged: {self._group.name.rstrip('/')}/{name} {defect}; restore "
            "it, or run again"
        )

    def __contains__(self, name: str) -> bool:
        return name in self._group

    def __iter__(self) -> Iterator[str]:
        return iter(self._group)

    def copy_to(self, target: Any, name: str) -> None:
        """Copy all data sets of this group into the group ``name`` of a file that is written."""
        for member in self:
            self[member]  # refuses what lies elsewhere
        self._group.copy(self._group, target, name=name)


class StoredFile(StoredGroup):
    """Open an HDF5 file of a run folder to be read.

    OSError is raised when it is no HDF5 file, InputError when it is a link.
    """

    def __init__(self, path: Path) -> None:
        import h5py  # late: no step needs it

        # A regular file is opened first; HDF5 opens it once more, by its name, and must meet the
        # same one.
        with open_to_read(path) as raw:
            status = os.fstat(raw.fileno())
            self._file = h5py.File(path, "r")
            status_of_hdf5 = os.fstat(self._file.id.get_vfd_handle())
            if not os.path.samestat(status, status_of_hdf5):
                self._file.close()
                raise OSError(None, "it was replaced while it was opened", str(path))
        super().__init__(path, self._file, status.st_size)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> "StoredFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@contextmanager
def refuse_damage(path: Path, remedy: str) -> Iterator[StoredFile]:
    """Open a file of a run, and say in one sentence when it is missing or damaged.

    What goes wrong while it is read counts as damage: an array that is missing, of another shape
    or of another kind. Errors of the machine, such as a full memory, are raised as they are.

    Args:
        path: the file.
        remedy: what the user can do, the end of the sentence.

    Raises:
        InputError: names the file and the remedy.
    """
    try:
        with StoredFile(path) as file:
            yield file
    except InputError:
        raise
    except (
        OSError,
        KeyError,
        ValueError,
        IndexError,
        TypeError,
        AttributeError,
        RuntimeError,
        ZeroDivisionError,
    ) as error:
        if is_of_machine(error):
            raise
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"'{path}' is missing or damaged ({reason}): {remedy}") from error
