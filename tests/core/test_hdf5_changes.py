"""Changes of HDF5 files: whenever a process is killed or the disk is full, nothing is lost."""

from __future__ import annotations

import errno
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from vi_contact.core import hdf5_changes
from vi_contact.core.files import hdf5_atomically, write_all
from vi_contact.core.hdf5_changes import change_hdf5, name_undo, undo_broken_change

pytestmark = pytest.mark.serial
ROWS = 700  # of an addition: some pages


def start(path: Path) -> None:
    """A file with a growing array, and one of whole numbers that shares its pages."""

    def fill(file: Any) -> None:
        file.create_dataset("x", data=np.zeros((0, 3)), maxshape=(None, 3), chunks=(ROWS, 3))
        file.create_dataset("k", data=np.zeros(0, int), maxshape=(None,), chunks=(64,))
        file.attrs["count"] = np.int64(0)

    hdf5_atomically(path, fill)


def add(file: Any) -> None:
    """One more block."""
    count = len(file["k"])
    file["x"].resize((count + 1) * ROWS, axis=0)
    file["x"][count * ROWS :] = count + np.arange(3.0 * ROWS).reshape(ROWS, 3)
    file["k"].resize(count + 1, axis=0)
    file["k"][count] = count
    file.attrs.modify("count", np.int64(count + 1))


def blocks(path: Path) -> int:
    """How many blocks are in the file, each of which must be whole."""
    with h5py.File(path, "r") as file:
        count = int(file.attrs["count"])
        assert file["k"][()].tolist() == list(range(count)) and len(file["x"]) == count * ROWS
        for k in range(count):
            rows = file["x"][k * ROWS : (k + 1) * ROWS]
            assert np.array_equal(rows, k + np.arange(3.0 * ROWS).reshape(ROWS, 3))
        return count


def test_additions_are_those_of_hdf5(tmp_path: Path) -> None:
    """Twenty blocks, more than a node of HDF5's index holds, are what HDF5 itself writes."""
    path = tmp_path / "a.h5"
    start(path)
    for count in range(20):
        assert blocks(path) == count
        change_hdf5(path, add)
    assert blocks(path) == 20 and [p.name for p in tmp_path.iterdir()] == ["a.h5"]


def test_killed_at_any_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before each write of an addition the folder is kept as a kill would leave it: what is undone
    there has the blocks from before or, after the last write, the new one."""
    folder = tmp_path / "run"
    folder.mkdir()
    path = folder / "a.h5"
    start(path)
    for _ in range(3):
        change_hdf5(path, add)
    kept: list[Path] = []

    def watched(file: Any, data: Any) -> None:
        for half in (len(data) // 2, 0):  # a write may be torn, too
            if half:
                place = file.tell()
                write_all(file, bytes(data)[:half])
            kept.append(tmp_path / f"kept{len(kept)}")
            shutil.copytree(folder, kept[-1])
            if half:
                file.seek(place)
        write_all(file, data)

    monkeypatch.setattr(hdf5_changes, "write_all", watched)
    change_hdf5(path, add)
    monkeypatch.undo()
    undone = 0
    for copy in kept:
        undone += name_undo(copy / "a.h5").exists()
        undo_broken_change(copy / "a.h5")
        assert blocks(copy / "a.h5") == 3
        change_hdf5(copy / "a.h5", add)  # and it goes on
        assert blocks(copy / "a.h5") == 4
    assert blocks(path) == 4 and 0 < undone < len(kept)


def test_full_disk_at_any_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the file, whose bytes are what they were; then there is room again."""
    path = tmp_path / "a.h5"
    start(path)
    for _ in range(3):
        change_hdf5(path, add)
    before = path.read_bytes()
    room = 0
    while True:
        left = room

        def limited(file: Any, data: Any) -> None:
            nonlocal left
            if left == 0:
                file.write(bytes(data)[: len(data) // 2])
                left = -1
                raise OSError(errno.ENOSPC, "No space left on device")
            left -= 1 if left > 0 else 0
            write_all(file, data)

        monkeypatch.setattr(hdf5_changes, "write_all", limited)
        try:
            change_hdf5(path, add)
        except OSError as error:
            assert error.errno == errno.ENOSPC and error.filename == str(path)
            assert path.read_bytes() == before
            assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]
            room += 1
            continue
        break
    monkeypatch.undo()
    assert room > 3 and blocks(path) == 4


def test_other_names_keep_their_content(tmp_path: Path) -> None:
    """A hard link of the file is not written through."""
    path = tmp_path / "a.h5"
    start(path)
    (tmp_path / "b.h5").hardlink_to(path)
    change_hdf5(path, add)
    assert blocks(path) == 1 and blocks(tmp_path / "b.h5") == 0


def test_errors_of_the_change_undo_it(tmp_path: Path) -> None:
    """What the caller raises in between leaves the file as it was."""
    path = tmp_path / "a.h5"
    start(path)
    before = path.read_bytes()

    def broken(file: Any) -> None:
        add(file)
        raise ZeroDivisionError("a defect")

    with pytest.raises(ZeroDivisionError, match="a defect"):
        change_hdf5(path, broken)
    assert path.read_bytes() == before
