"""The run folder: formats other programs read, sentences when the disk refuses, whole files at any
moment."""

from __future__ import annotations

import errno
import json
import re
import time
import tracemalloc
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from chain import chain_problem

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError, ViContactError
from vi_contact.core.files import (
    describe_os_error,
    hdf5_atomically,
    on_root,
    to_json,
    write_all,
    write_atomically,
)
from vi_contact.core.step import Row
from vi_contact.laws.excitation import Harmonic
from vi_contact.run.files import history as history_module
from vi_contact.run.files.folder import run_folder
from vi_contact.run.files.history import HistoryFiles
from vi_contact.run.files.reading import read_run
from vi_contact.run.files.stored_rows import StoredRows
from vi_contact.run.files.table import Block, StoredHistory, Table
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.simulate import Solution, simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed


def run(out: Path | None, steps: int = 30, **more: Any) -> Solution:
    """The shaken chain between two walls, with a probe at its end."""
    shake = Harmonic(3.0, 2.0, direction=(1.0,))
    problem = chain_problem(5, gap=1e-3, left_gap=2e-3, excitation=shake, consistent=True)
    settings: dict[str, Any] = {
        "scheme": ZienkiewiczWoodTaylor(),
        "solver": Condensed(),
        "dt": 5e-3,
    }
    record = [Energy(), Contact(), Probe({12: (5.0,)})]
    return simulate(problem, steps=steps, record=record, out=out, **(settings | more))


# What other programs read
# --------------------------------------------------------------------------------------------


@pytest.mark.serial
def test_csv_to_the_last_bit(tmp_path: Path) -> None:
    """history.csv: first column t, a line per step, read by numpy with names, equal to the history
    to the last bit."""
    solution = run(tmp_path / "new" / "folder")
    path = tmp_path / "new" / "folder" / "history.csv"
    header = path.read_text().splitlines()[0].split(",")
    rows = np.genfromtxt(path, delimiter=",", names=True)
    assert header[:2] == ["t", "k"] and header[-1] == "u_x_12" and tuple(header) == rows.dtype.names
    assert len(rows) == 31
    numbers = [name for name, values in solution.history.items() if values.ndim == 1]
    assert header == numbers
    for name in numbers:
        assert np.array_equal(rows[name], solution.history[name], equal_nan=True), name
    assert np.isnan(rows["contact_x"]).any() and not np.isnan(rows["contact_x"]).all()


@pytest.mark.serial
def test_units_are_documented(tmp_path: Path) -> None:
    """Every column has a unit and a meaning, in columns.json and as attributes in history.h5, which
    has arrays too."""
    solution = run(tmp_path)
    columns = json.loads((tmp_path / "columns.json").read_text())
    assert list(columns) == list(solution.columns) and all(
        one["unit"] and one["meaning"] for one in columns.values()
    )
    assert (
        columns["u_x_12"]["unit"] == "m"
        and columns["pressure"]["unit"] == "Pa"
        and columns["t"]["unit"] == "s"
    )
    with h5py.File(tmp_path / "history.h5") as file:
        assert set(file) == set(columns) | {"contact"}
        for name, one in columns.items():
            assert np.array_equal(file[name][()], solution.history[name], equal_nan=True), name
            assert dict(file[name].attrs) == one
        assert file["pressure"].shape == (31, 2) and file["active"].dtype == bool
        assert file["contact/points"][()].tolist() == [[5.0], [1.0]]
        assert file["contact/normals"][()].tolist() == [[1.0], [-1.0]]
        assert file["contact/weights"][()].tolist() == [0.5, 0.5]
        assert file["contact/gap0"][()].tolist() == [1e-3, 2e-3]
    assert not (tmp_path / "history.journal").exists()


@pytest.mark.serial
def test_new_run_replaces_the_old_one(tmp_path: Path) -> None:
    """Nothing of an earlier run in the folder is taken for the new one's, foreign files stay."""
    run(tmp_path, 60, checkpoint_every=10)
    (tmp_path / "mine.txt").write_text("keep")
    solution = run(tmp_path, 5)
    assert len((tmp_path / "history.csv").read_text().splitlines()) == 7
    with h5py.File(tmp_path / "history.h5") as file:
        assert file["k"][()].tolist() == solution.history["k"].tolist()
    assert json.loads((tmp_path / "summary.json").read_text())["steps"] == 5
    assert (tmp_path / "mine.txt").read_text() == "keep"


@pytest.mark.serial
def test_strict_json() -> None:
    """NaN and infinity become null, numpy values plain ones."""
    facts = {
        "a": np.float64(0.1),
        "b": float("nan"),
        "c": {"d": np.inf},
        "e": np.arange(2),
        "f": np.bool_(True),
    }
    text = to_json(facts)
    assert json.loads(text) == {"a": 0.1, "b": None, "c": {"d": None}, "e": [0, 1], "f": True}


# The disk refuses
# --------------------------------------------------------------------------------------------------


def test_every_rank_gets_the_sentence(comm: Any) -> None:
    """What fails on rank 0 is raised on every rank, as one sentence; nobody waits."""
    from vi_contact.fem.mesh.communicators import MpiComm

    ranks = MpiComm(comm)

    def full() -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "history.csv")

    def wrong() -> None:
        raise InputError("the checkpoint is damaged")

    def broken() -> None:
        raise ZeroDivisionError("a defect")

    with pytest.raises(
        ViContactError, match="the disk is full: 'history.csv' could not be written"
    ):
        on_root(ranks, full)
    with pytest.raises(InputError, match="the checkpoint is damaged"):
        on_root(ranks, wrong)
    with pytest.raises(ZeroDivisionError if comm.rank == 0 else ViContactError, match="a defect"):
        on_root(ranks, broken)
    assert on_root(ranks, lambda: 5) == (5 if comm.rank == 0 else None)


@pytest.mark.serial
def test_sentences() -> None:
    """One sentence each: path, reason, remedy."""
    known = (
        (errno.ENOSPC, "the disk is full"),
        (errno.EACCES, "permissions"),
        (errno.EIO, "read or written"),
    )
    for number, words in known:
        text = describe_os_error(OSError(number, "reason", "a/history.csv"))
        assert (
            words in text
            and "'a/history.csv'" in text
            and "\n" not in text
            and not text.endswith(".")
        )


@pytest.mark.serial
def test_unwritable_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Told before any work: not a folder, or one that takes no file (mocked, as root may write
    anywhere)."""
    (tmp_path / "file").write_text("")
    asked: list[int] = []
    monkeypatch.setattr(
        "vi_contact.run.session.March", lambda *_, **__: asked.append(1) or iter(())
    )
    with pytest.raises(
        InputError,
        match=r"output folder '.*file' cannot be written \(File exists\): choose another",
    ):
        run(tmp_path / "file")
    with pytest.raises(
        InputError, match=r"output folder '.*below' cannot be written \(Not a directory\)"
    ):
        run(tmp_path / "file" / "below")

    def refuse(*_: Any) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("vi_contact.core.files.write_all", refuse)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        run(tmp_path / "closed")
    assert asked == []


def no_room_for(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk is full whenever a file of this name is written, by whichever module of the
    package."""

    def full(file: Any, data: bytes) -> None:
        if Path(str(file.name)).name == name:
            raise OSError(errno.ENOSPC, "No space left on device")
        write_all(file, data)

    for module in (
        "vi_contact.core.files",
        "vi_contact.run.files.history",
        "vi_contact.run.files.log",
    ):
        monkeypatch.setattr(f"{module}.write_all", full)


@pytest.mark.serial
def test_full_disk_from_the_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No room for history.csv: one sentence, no traceback of HDF5, nothing computed."""
    no_room_for("history.csv", monkeypatch)
    with pytest.raises(
        ViContactError, match=r"the disk is full: '.*history.csv' could not be written"
    ):
        run(tmp_path)


def test_full_disk_on_all_ranks(comm: Any, shared_tmp: Path) -> None:
    """Every rank stops with the same sentence, whichever file the disk refuses first."""
    pytest.importorskip("dolfinx")
    from fem_problems import shaken_wall

    from vi_contact.fem.output.fields import XDMF

    wall = shaken_wall(comm)
    for name in ("history.csv", "run.log"):
        folder = shared_tmp / f"full {name}"
        refused = pytest.raises(ViContactError, match=f"the disk is full: '.*{name}'")
        with pytest.MonkeyPatch.context() as patch, refused:
            no_room_for(name, patch)
            simulate(
                wall,
                scheme=ZienkiewiczWoodTaylor(),
                solver=Condensed(),
                dt=1e-3,
                steps=5,
                out=folder,
                fields=XDMF(every=1),
            )


@pytest.mark.serial
def test_full_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No room for run.log is told as of any other file."""
    no_room_for("run.log", monkeypatch)
    with pytest.raises(ViContactError, match=r"the disk is full: '.*run.log'"):
        run(tmp_path)
    assert capsys.readouterr().err == ""


class Disk:
    """Room for so many bytes, then ENOSPC after writing what fits; other writes go through."""

    def __init__(self, room: int) -> None:
        self.room = room

    def __call__(self, file: Any, data: bytes) -> None:
        fits = min(len(data), self.room)
        self.room -= fits
        file.write(data[:fits])
        if fits < len(data):
            raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.serial
@pytest.mark.parametrize("room", [9000, 9100, 9200, 12345])
def test_disk_fills_up_during_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    """The run stops with a sentence; every line before is whole, and the restart equals the
    straight run."""
    disk = Disk(room)
    monkeypatch.setattr(history_module, "write_all", disk)
    with pytest.raises(ViContactError, match="the disk is full"):
        run(tmp_path, 200, checkpoint_every=10)
    monkeypatch.setattr(history_module, "write_all", write_all)
    lines = (tmp_path / "history.csv").read_text().splitlines(keepends=True)
    assert 10 < len(lines) < 200
    assert all(line.endswith("\n") and line.count(",") == lines[0].count(",") for line in lines)
    found = json.loads((tmp_path / "summary.json").read_text())
    assert found["status"] == "failed" and "the disk is full" in found["reason"]
    assert found["steps"] == len(lines) - 2
    again, straight = run(tmp_path, 200, restart=True), run(None, 200)
    assert np.array_equal(again.state.u, straight.state.u)
    assert np.array_equal(again.history["pressure"], straight.history["pressure"])


@pytest.mark.serial
def test_whole_files_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An atomic write that fails leaves the old content and no litter."""
    path = tmp_path / "checkpoint.npz"
    write_atomically(path, b"old")
    monkeypatch.setattr("vi_contact.core.files.write_all", Disk(2))
    with pytest.raises(OSError, match="No space left") as caught:
        write_atomically(path, b"new content")
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


@pytest.mark.serial
def test_partial_writes_are_continued() -> None:
    """A raw file may take less than it is given."""

    class Slow:
        taken = b""

        def write(self, data: memoryview) -> int:
            self.taken += bytes(data[:3])
            return len(data[:3])

    file = Slow()
    write_all(file, b"0123456789")
    assert file.taken == b"0123456789"


@pytest.mark.serial
def test_run_folder_leaves_no_trace(tmp_path: Path) -> None:
    """The trial file is gone again."""
    assert list(run_folder(SerialComm(), tmp_path / "a" / "b").iterdir()) == []


# Histories on disk
# --------------------------------------------------------------------------------------------------


COLUMNS = {
    name: ("-", name) for name in ("t", "k", "iterations", "certificate", "escalated", "p", "on")
}


def rows(count: int) -> list[Row]:
    """Rows with the numbers of every run, and two arrays."""
    return [
        {
            "t": 0.1 * k,
            "k": k,
            "iterations": 2,
            "certificate": 1e-12,
            "escalated": 0,
            "p": np.array([k, 1.0 / 3.0]),
            "on": np.array([k % 2 == 0]),
        }
        for k in range(count)
    ]


def written(folder: Path, count: int, *, save_at: int | None = None) -> HistoryFiles:
    """Files of so many rows, still open."""
    made = rows(count)
    files = HistoryFiles(
        folder, Table(COLUMNS, made[0]), {name: np.zeros(2) for name in history_module.GEOMETRY}
    )
    for row in made[1:]:
        files.append(row)
        if row["k"] == save_at:
            files.save()
    return files


def read(folder: Path, k: int) -> list[Block]:
    """Rows up to a step."""
    return list(StoredRows(folder, Table(COLUMNS, rows(1)[0]), k).blocks())


@pytest.mark.serial
@pytest.mark.parametrize("cut", [0, 5])
def test_arrays_survive_in_the_journal(tmp_path: Path, cut: int) -> None:
    """Rows that history.h5 does not have yet come from the journal, but for a record the crash cut
    short."""
    files = written(tmp_path, 8, save_at=3)
    journal = tmp_path / "history.journal"
    journal.write_bytes(journal.read_bytes()[: journal.stat().st_size - cut])
    if cut:
        with pytest.raises(InputError, match="does not hold p, on of step 7"):
            read(tmp_path, 7)
    last = 6 if cut else 7
    (found,) = read(tmp_path, last)
    assert found["k"].tolist() == list(range(last + 1)) and found["on"].dtype == bool
    for k, wanted in enumerate(rows(last + 1)):
        assert found["t"][k] == wanted["t"]
        assert np.array_equal(found["p"][k], wanted["p"]) and np.array_equal(
            found["on"][k], wanted["on"]
        )
    if not cut:
        files.close()
        assert not journal.exists()


@pytest.mark.serial
def test_damaged_histories_are_told(tmp_path: Path) -> None:
    """Missing, other columns, damaged line, lines out of order, too short: one sentence each."""
    written(tmp_path, 5).close()
    path = tmp_path / "history.csv"
    good = path.read_text()
    for text, words in (
        (None, "is missing"),
        (good.replace("t,k", "t,kk"), "holds other columns"),
        (good.replace("0.2,2", "0.2,two"), "line 4 of '.*' is damaged"),
        (good.replace("0.2,2", "0.2,"), "line 4 of '.*' is damaged"),
        (good.replace("0.2,2", "0.2,2,2"), "line 4 of '.*' is damaged"),
        # it would fill the row
        (re.sub(r"(?m)^0\.2,2.*$", "2", good), "line 4 of '.*' is damaged"),
        (good.replace("0.2,2", "0.2,7"), "do not follow each other"),
        (good.replace("0.2,2", "0.2,nan"), "do not follow each other"),
        ("\n".join(good.splitlines()[:4]), "does not reach step 4"),
        ("", "holds other columns"),
    ):
        path.unlink() if text is None else path.write_text(text)
        with pytest.raises(InputError, match=words):
            read(tmp_path, 4)


@pytest.mark.long
@pytest.mark.serial
def test_long_histories_stay_on_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond a number of bytes the memory lets go of rows; histories, facts and restart are the
    same."""
    kept = run(tmp_path / "kept", 300)
    monkeypatch.setattr("vi_contact.run.files.table.KEPT", 10_000)
    long = run(tmp_path / "long", 280)
    assert isinstance(long.history, StoredHistory) and len(long.history) == len(long.columns)
    long = run(tmp_path / "long", 300, restart=True)
    for name, values in kept.history.items():
        assert np.array_equal(long.history[name], values, equal_nan=True), name
    assert "nothing" not in long.history and set(long.history) == set(kept.history)
    alone = run(None, 300)
    assert isinstance(alone.history, dict)
    for name in (
        "steps",
        "iterations_per_step",
        "worst_certificate",
        "energy",
        "steps_in_contact",
        "smallest_gap",
    ):
        assert long.facts[name] == kept.facts[name] == alone.facts[name], name
    run(tmp_path / "long", 5)
    with pytest.raises(
        ViContactError, match="was replaced or is not on this machine: give every run a folder"
    ):
        long.history["t"]


@pytest.mark.serial
def test_memory_does_not_grow_with_steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a folder the bytes of the numbers, some hundred a step; with one nothing beyond what
    is kept at most."""
    monkeypatch.setattr("vi_contact.run.files.table.KEPT", 0)
    made: Any = {"iterations": 2, "certificate": 1e-12, "escalated": 0} | {
        f"c{i}": 1.0 for i in range(35)
    }
    columns = {name: ("-", name) for name in ("t", "k", *made)}
    peaks = {}
    for on_disk in (False, True):
        table = Table(
            columns, {"t": 0.0, "k": 0} | made, tmp_path / "history.h5" if on_disk else None
        )
        tracemalloc.start()
        for k in range(1, 3000):
            table.append({"t": 0.1 * k, "k": k} | made)
            if k == 999:
                begin = tracemalloc.get_traced_memory()[0]
        peaks[on_disk] = (tracemalloc.get_traced_memory()[0] - begin) / 2000
        tracemalloc.stop()
    assert peaks[False] < 1.5 * 8 * len(columns) and peaks[True] < 100.0


@pytest.mark.serial
def test_hdf5_on_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HDF5 goes through to its end, the old file is still there, and the error is the disk's."""
    path = tmp_path / "a.h5"
    hdf5_atomically(path, lambda file: file.create_dataset("x", data=np.arange(1000.0)))
    before = path.read_bytes()
    for room in (0, 100, 2000, 5000):
        monkeypatch.setattr("vi_contact.core.files.write_all", Disk(room))
        with pytest.raises(OSError, match="No space left") as caught:
            hdf5_atomically(path, lambda file: file.create_dataset("x", data=np.arange(2000.0)))
        assert caught.value.filename == str(path)
        assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    with h5py.File(path) as file:
        assert np.array_equal(file["x"][()], np.arange(1000.0))


@pytest.mark.serial
def test_folders_of_another_format(tmp_path: Path) -> None:
    """Folder and checkpoint carry a number; an unknown one is refused, a folder without one is
    read."""
    run(tmp_path, 10)
    about = tmp_path / "format.json"
    assert json.loads(about.read_text())["format"] == 1
    for text, words in (
        (
            '{"format": 2}',
            r"has format 2 and this version of vi_contact reads 1: read it with the version that "
            r"wrote",
        ),
        ('{"format": true}', "has format True"),
        ("[]", "'.*format.json' is damaged"),
    ):
        about.write_text(text)
        for action in (lambda: run(tmp_path, 20, restart=True), lambda: read_run(tmp_path)):
            with pytest.raises(InputError, match=words):
                action()
    about.unlink()
    assert len(read_run(tmp_path).history["t"]) == 11
    assert len(run(tmp_path, 20, restart=True).history["t"]) == 21 and about.exists()


@pytest.mark.serial
def test_rows_wait_for_each_other_but_not_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows are written in blocks: before every checkpoint, and when the next step might make one
    late."""
    monkeypatch.setattr("vi_contact.run.files.writer.LATEST", 1e9)
    path, found = tmp_path / "history.csv", {}

    class Slow:
        """Sees how many rows are in the file while a step is recorded; step 23 takes long."""

        def columns(self) -> dict[str, tuple[str, str]]:
            return {"seen": ("-", "rows in history.csv")}

        def start(self, *_: Any) -> dict[str, float]:
            return {"seen": 0.0}

        def row(self, report: Any) -> dict[str, float]:
            found[report.new.k] = path.read_bytes().count(b"\n") - 1
            if report.new.k == 23:
                time.sleep(0.02)
                monkeypatch.setattr("vi_contact.run.files.writer.LATEST", 0.01)
            if report.new.k == 24:
                monkeypatch.setattr("vi_contact.run.files.writer.LATEST", 1e9)
            return {"seen": 0.0}

    simulate(
        chain_problem(5),
        scheme=ZienkiewiczWoodTaylor(),
        solver=Condensed(),
        dt=5e-3,
        steps=30,
        out=tmp_path,
        record=[Slow()],
        checkpoint_every=10,
    )
    assert (
        found[10] == 1
        and found[11] == found[20] == 11
        and found[21] == found[23] == 21
        and found[24] == 24
    )
    assert path.read_bytes().count(b"\n") == 32
