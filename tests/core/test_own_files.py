"""Files of a run folder: regular files of that folder alone; what a link leads to is neither read
nor changed."""

from __future__ import annotations

import os
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from vi_contact.core import own_files
from vi_contact.core.errors import InputError
from vi_contact.core.files import (
    copy_start,
    hdf5_atomically,
    list_frames,
    open_hdf5,
    push,
    write_atomically,
    write_csv,
    write_output,
)

pytestmark = pytest.mark.serial
NOTES = b"what somebody has written"


def linked(path: Path, notes: Path) -> None:
    path.symlink_to(notes)


def hanging(path: Path, notes: Path) -> None:
    path.symlink_to(notes.with_name("nowhere"))


def piped(path: Path, notes: Path) -> None:
    os.mkfifo(path)


def device(path: Path, notes: Path) -> None:
    path.symlink_to("/dev/zero")


def foldered(path: Path, notes: Path) -> None:
    path.mkdir()


def listening(path: Path, notes: Path) -> None:
    with tempfile.TemporaryDirectory() as short:  # a name of a socket has 107 characters at most
        place = Path(short) / "s"
        with socket.socket(socket.AF_UNIX) as one:
            one.bind(str(place))
            os.replace(place, path)


FOREIGN = {
    "a link": linked,
    "a link to nothing": hanging,
    "a pipe": piped,
    "a link to a device": device,
    "a folder": foldered,
    "a socket": listening,
}
READERS: dict[str, Callable[[Path], Any]] = {
    "is_own": own_files.is_own,
    "open_to_read": own_files.open_to_read,
    "read_bytes": own_files.read_bytes,
    "read_text": own_files.read_text,
    "open_to_append": own_files.open_to_append,
    "open_lock": own_files.open_lock,
    "open_hdf5": open_hdf5,
    "push": push,
    "copy_start": lambda path: copy_start(path, path.with_name("copy"), 3),
}


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    """A file that is none of ours."""
    path = tmp_path / "notes"
    path.write_bytes(NOTES)
    return path


@pytest.mark.parametrize("kind", FOREIGN)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_read_or_continued_is_a_regular_file(
    tmp_path: Path, notes: Path, kind: str, reader: str
) -> None:
    path = tmp_path / "history.csv"
    FOREIGN[kind](path, notes)
    with pytest.raises(
        InputError,
        match=rf"history.csv' is {kind.split(' to ')[0]}, and a run reads and writes only",
    ):
        READERS[reader](path)
    assert notes.read_bytes() == NOTES and not notes.with_name("nowhere").exists()


@pytest.mark.parametrize("kind", [kind for kind in FOREIGN if kind != "a folder"])
def test_what_is_made_anew_takes_the_place_of_a_name(
    tmp_path: Path, notes: Path, kind: str
) -> None:
    """The link goes, and not what it leads to; the temporary file beside it is made in the same
    way."""
    path = tmp_path / "history.csv"
    writers: dict[str, Callable[[], Any]] = {
        "new": lambda: own_files.open_new(path).close(),
        "whole": lambda: write_atomically(path, b"x"),
        "output": lambda: write_output(path, b"x"),
        "table": lambda: write_csv(path, ["a"], [[1]]),
        "hdf5": lambda: hdf5_atomically(path, lambda file: file.update({"x": 1})),
    }
    for name, write in writers.items():
        for place in (path, own_files.name_temporary(path)):
            own_files.remove(place)
            FOREIGN[kind](place, notes)
        write()
        assert path.is_file() and not path.is_symlink(), name
        own_files.remove(own_files.name_temporary(path))
    assert notes.read_bytes() == NOTES and not notes.with_name("nowhere").exists()


def test_hard_links_are_parted(tmp_path: Path, notes: Path) -> None:
    """What is continued is copied first, what is made anew is another file."""
    for name, write in (("continued", own_files.open_to_append), ("new", own_files.open_new)):
        path = tmp_path / name
        os.link(notes, path)
        with write(path) as file:
            assert own_files.count_names(file) == 1
            file.write(b", and more")
        assert path.read_bytes() == (NOTES if name == "continued" else b"") + b", and more"
    assert notes.read_bytes() == NOTES


def test_folders_inside_are_folders(tmp_path: Path) -> None:
    (tmp_path / "other" / "deep").mkdir(parents=True)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "fields").symlink_to(tmp_path / "other")
    for call in (own_files.inner_folder, own_files.make_inner_folder):
        for names in (("fields",), ("fields", "deep")):
            with pytest.raises(InputError, match="fields' is a link, .* put a folder in its place"):
                call(tmp_path / "run", *names)
    with pytest.raises(InputError, match="fields' is a link"):
        list_frames(tmp_path / "run")
    assert own_files.make_inner_folder(tmp_path / "run", "a", "b").is_dir()
    (tmp_path / "run" / "file").write_text("")
    with pytest.raises(InputError, match="file' is a file, "):
        own_files.inner_folder(tmp_path / "run", "file")


def test_streams_are_written_as_they_are(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """/dev/stdout is no file that could be replaced, also where it leads to one."""
    assert own_files.is_stream(Path("/dev/stdout")) and not own_files.is_stream(tmp_path / "stdout")
    assert own_files.is_stream(Path("/dev/shm/../stdout"))
    write_output("/dev/stdout", b"to the stream\n")
    assert capfd.readouterr().out == "to the stream\n" and Path("/dev/stdout").is_symlink()


def test_a_file_that_was_removed_is_another(tmp_path: Path) -> None:
    with own_files.open_lock(tmp_path / "lock") as file:
        assert own_files.same_file(tmp_path / "lock", file)
        (tmp_path / "lock").unlink()
        assert not own_files.same_file(tmp_path / "lock", file) and own_files.count_names(file) == 0
        (tmp_path / "lock").write_text("")
        assert not own_files.same_file(tmp_path / "lock", file)


# HDF5
# --------------------------------------------------------------------------------------------------


def external_link(group: Any, other: Path, raw: Path) -> None:
    group["u"] = h5py.ExternalLink(str(other), "u")


def soft_link(group: Any, other: Path, raw: Path) -> None:
    group["u"] = h5py.SoftLink("/sound")


def virtual(group: Any, other: Path, raw: Path) -> None:
    layout = h5py.VirtualLayout((4, 3), "f8")
    layout[:] = h5py.VirtualSource(str(other), "u", (4, 3))
    group.create_virtual_dataset("u", layout)


def external_storage(group: Any, other: Path, raw: Path) -> None:
    group.create_dataset("u", (4, 3), "f8", external=[(str(raw), 0, h5py.h5f.UNLIMITED)])


def vast(group: Any, other: Path, raw: Path) -> None:
    group.create_dataset("u", (10**12, 3), "f8", chunks=(1000, 3))


def texts(group: Any, other: Path, raw: Path) -> None:
    group.create_dataset(
        "u", data=np.array(["x"] * 12, dtype=object).reshape(4, 3), dtype=h5py.string_dtype()
    )


def named_type(group: Any, other: Path, raw: Path) -> None:
    group["u"] = np.dtype("f8")


@pytest.mark.parametrize(
    "kind", [external_link, soft_link, virtual, external_storage, vast, texts, named_type]
)
@pytest.mark.parametrize("place", ["/", "/000010"])
def test_numbers_lie_in_the_very_file(
    tmp_path: Path, kind: Callable[[Any, Path, Path], None], place: str
) -> None:
    other, raw, path = tmp_path / "other.h5", tmp_path / "raw", tmp_path / "frame.h5"
    raw.write_bytes(bytes(200))
    with h5py.File(other, "w") as file:
        file["u"] = np.ones((4, 3))
    with h5py.File(path, "w") as file:
        file["sound"] = np.ones((4, 3))
        kind(file.require_group(place), other, raw)
    with open_hdf5(path) as file:
        assert file["sound"][()].sum() == 12.0 and "u" in file[place] and "v" not in file[place]
        with pytest.raises(
            InputError, match="/u (lies in another file|is no array of numbers of this file)"
        ):
            file[f"{place}/u"]
        with h5py.File(tmp_path / "copy.h5", "w") as copy, pytest.raises(InputError, match="/u "):
            file[place].copy_to(copy, "again")


def test_a_group_elsewhere_is_not_entered(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["frame/u"] = np.ones(3)
    with h5py.File(tmp_path / "frames.h5", "w") as file:
        file["000010"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/frame")
        file["u"] = 1.0
    with open_hdf5(tmp_path / "frames.h5") as file:
        assert sorted(file) == ["000010", "u"]
        with pytest.raises(InputError, match="/000010 lies in another file"):
            file["/000010/u"]
        for name in ("u/x", "nothing", "nothing/u"):
            with pytest.raises(KeyError):
                file[name]


def test_a_file_that_is_exchanged_while_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 opens a name: what it has opened must be the regular file that was looked at."""
    for name in ("one.h5", "other.h5"):
        with h5py.File(tmp_path / name, "w") as file:
            file["u"] = 1.0
    opened = h5py.File
    monkeypatch.setattr(h5py, "File", lambda path, mode: opened(tmp_path / "other.h5", mode))
    with pytest.raises(OSError, match="replaced while it was opened"):
        open_hdf5(tmp_path / "one.h5")
