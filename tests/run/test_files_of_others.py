"""A run touches no file that is not its own: neither what links in its folder lead to, nor others
beside its own."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from drawn_run import drawn_run
from marched_chain import chain, run
from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.core.files import FIELDS
from vi_contact.fem.output.fields import XDMF
from vi_contact.fem.output.functions import read_function
from vi_contact.practice.cli.entry import main
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.run.files.folder import COPY, FILES, LOCK, MODEL, remove_run
from vi_contact.run.files.reading import read_run
from vi_contact.run.simulate import simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial
NOTES = "what somebody has written\n" * 20
WRITTEN = [*FILES, LOCK]


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    """A file of somebody's, outside the run folder."""
    path = tmp_path / "notes"
    path.write_text(NOTES)
    return path


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with frames, to be copied."""
    folder = tmp_path_factory.mktemp("drawn") / "run"
    drawn_run(MPI.COMM_WORLD, folder)
    return folder


def with_fields(folder: Path, steps: int = 4, **more: Any) -> Any:
    """A run of a chain with frames, two in a file."""
    fields = XDMF(every=1, frames_per_file=2)
    return simulate(
        chain(),
        scheme=ZienkiewiczWoodTaylor(),
        dt=5e-3,
        steps=steps,
        out=folder,
        fields=fields,
        progress=False,
        **more,
    )


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("earlier", [False, True])
def test_links_in_the_folder_are_not_followed(
    tmp_path: Path, notes: Path, name: str, hard: bool, earlier: bool
) -> None:
    """A link at any name that a run writes: refused, or replaced by a file; a hard link
    likewise."""
    folder = tmp_path / "run"
    if earlier:
        run(folder, 5)
        (folder / name).unlink(missing_ok=True)
    folder.mkdir(exist_ok=True)
    if hard:
        os.link(notes, folder / name)
    else:
        (folder / name).symlink_to(notes)
    try:
        run(folder, 7)
    except InputError as error:
        assert f"{folder / name}' is " in str(error)
    else:
        assert (folder / "history.csv").is_file() and not (folder / "history.csv").is_symlink()
    assert notes.read_text() == NOTES


@pytest.mark.parametrize(
    "name", ["history.csv", "history.journal", "history.h5", "run.log", "checkpoint.npz", LOCK]
)
def test_links_are_not_followed_by_a_restart(tmp_path: Path, notes: Path, name: str) -> None:
    """What a restart reads, and what it writes on, is a file of the folder."""
    folder = tmp_path / "run"
    run(folder, 5)
    moved = tmp_path / "moved"
    if (folder / name).exists():
        os.replace(folder / name, moved)
    else:
        moved.write_text(NOTES)
    before = moved.read_bytes()
    (folder / name).symlink_to(moved)
    try:
        run(folder, 9, restart=True)
    except InputError as error:
        assert f"{folder / name}' is a link" in str(error)
    assert moved.read_bytes() == before


def test_a_snapshot_by_hard_links_stays(tmp_path: Path) -> None:
    """cp -al keeps a run as it is, also when it is continued afterwards."""
    folder, kept = tmp_path / "run", tmp_path / "kept"
    run(folder, 5)
    kept.mkdir()
    for path in folder.iterdir():
        os.link(path, kept / path.name)
    before = {path.name: path.read_bytes() for path in kept.iterdir()}
    run(folder, 9, restart=True)
    assert {path.name: path.read_bytes() for path in kept.iterdir()} == before
    assert len(read_run(folder).history["t"]) == 10 and len(read_run(kept).history["t"]) == 6


def test_a_link_to_a_folder_is_no_folder_of_fields(tmp_path: Path) -> None:
    others = tmp_path / "others"
    others.mkdir()
    for name in ("mydata.h5", "frame_000001.h5", "mesh.h5"):
        (others / name).write_text(NOTES)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / FIELDS).symlink_to(others)
    for call in (lambda: run(tmp_path / "run", 5), lambda: with_fields(tmp_path / "run")):
        with pytest.raises(InputError, match="fields' is a link"):
            call()
    assert {path.read_text() for path in others.iterdir()} == {NOTES} and len(
        list(others.iterdir())
    ) == 3


def test_files_of_others_stay(tmp_path: Path) -> None:
    """Beside the run, among its frames, and with names that only look like ours; through a second
    and a shorter run."""
    folder = tmp_path / "run"
    (folder / FIELDS).mkdir(parents=True)
    theirs = [
        "mydata.h5",
        "frames.h5",
        "frame_1.h5",
        "frame_00001x.h5",
        ".mine.h5.12.tmp",
        "frame_000001.h5.bak",
    ]
    files = [
        *(folder / FIELDS / name for name in theirs),
        folder / ".notes.12.tmp",
        folder / "summary.json.bak",
    ]
    for path in files:
        path.write_text(NOTES)
    for steps in (5, 2):
        with_fields(folder, steps)
        assert all(path.read_text() == NOTES for path in files)
        assert json.loads((folder / "summary.json").read_text())["steps"] == steps
        frames = read_frames(folder)
        assert len(frames.t) == steps + 1


@pytest.mark.parametrize(
    "name", [*FILES[1:], "fields/mesh.h5", "fields/frame_000000.h5", "fields/frames_000000.h5"]
)
def test_a_folder_with_files_of_others_is_refused(tmp_path: Path, name: str) -> None:
    """Without the mark of a run they are not replaced: told before any work is done."""
    assert FILES[0] == "format.json"  # this one is the mark
    path = tmp_path / "run" / name
    path.parent.mkdir(parents=True)
    path.write_text(NOTES)
    with pytest.raises(
        InputError, match=rf"{path.name}' is not of a run of vi_contact .* choose another output"
    ):
        run(tmp_path / "run", 5)
    assert (
        path.read_text() == NOTES
        and not (tmp_path / "run" / "run.log").exists()
        or name == "run.log"
    )
    path.rename(tmp_path / "moved")  # the remedy
    run(tmp_path / "run", 5)


def test_a_run_that_was_killed_early_is_known(tmp_path: Path) -> None:
    """Its mark is there before its other files; a history without a mark, of which files were
    copied, is known too."""
    run(tmp_path, 5)
    (tmp_path / "format.json").unlink()
    assert len(run(tmp_path, 9, restart=True).history["t"]) == 10
    (tmp_path / "format.json").unlink()
    run(tmp_path, 3)
    for name in FILES:
        if name != "format.json":
            (tmp_path / name).unlink(missing_ok=True)
    run(tmp_path, 3)


def test_only_the_files_of_a_run_are_removed_with_it(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with_fields(folder)
    (folder / "notes").write_text(NOTES)
    (folder / FIELDS / "notes").write_text(NOTES)
    remove_run(folder)
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob("*")) == [
        "fields",
        "fields/notes",
        "notes",
    ]
    remove_run(folder)  # without the mark nothing is touched
    (folder / "history.h5").write_text(NOTES)
    remove_run(folder)
    assert (folder / "history.h5").read_text() == NOTES
    with_fields(tmp_path / "alone")
    remove_run(tmp_path / "alone")
    assert not (tmp_path / "alone").exists()


PICTURES = (
    "deformed.png",
    "film.gif",
    "report.pdf",
    "report.html",
    "peaks.csv",
    "model.png",
    "page.pdf",
    "table.csv",
)


@pytest.mark.long
def test_reports_and_pictures_replace_links(
    comm: Any, tmp_path: Path, notes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By plot, film, report and post: a file takes the place of the link."""
    pytest.importorskip("matplotlib")
    folder = tmp_path / "run"
    drawn_run(comm, folder, 2)
    for name in PICTURES:
        (folder / name).symlink_to(notes)
    given, out = str(folder), "--out"
    for words in (
        ["plot", given],
        ["film", given],
        ["report", given, out, str(folder / "page.pdf")],
        ["report", given],
        ["post", "peaks", given, out, str(folder / "table.csv")],
    ):
        assert main(words) == 0, capsys.readouterr().err
    assert notes.read_text() == NOTES
    for name in ("deformed.png", "film.gif", "report.pdf", "peaks.csv", "page.pdf", "table.csv"):
        assert (folder / name).is_file() and not (folder / name).is_symlink(), name


@pytest.mark.parametrize(
    "name",
    [
        "history.csv",
        "history.h5",
        "columns.json",
        "summary.json",
        "format.json",
        MODEL,
        COPY,
        "fields/mesh.h5",
        "fields/frame_000000.h5",
        "fields",
    ],
)
def test_links_are_not_followed_by_readers(
    drawn: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """report, plot, film and post of somebody's folder: a sentence that names the link."""
    pytest.importorskip("matplotlib")
    folder = tmp_path / "run"
    shutil.copytree(drawn, folder)
    if name in (MODEL, COPY):
        (folder / name).write_text("{}" if name == MODEL else "")
    os.replace(folder / name, tmp_path / "moved")
    (folder / name).symlink_to(tmp_path / "moved")
    commands = [["report"], ["film"] if name.startswith("fields") else ["post", "peaks"]]
    for words in commands[: 1 if name == MODEL else 2]:
        if name == COPY and words == ["post", "peaks"]:
            words = ["post", "checks"]
        assert main([*words, str(folder)]) == 1
        said = capsys.readouterr().err
        assert (
            f"{folder / name}' is a link, and a run reads and writes only files of its own folder"
            in said
        )


@pytest.mark.parametrize("link", ["external", "soft"])
def test_frames_elsewhere_are_not_drawn(
    drawn: Path, tmp_path: Path, link: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, other = tmp_path / "run", tmp_path / "other.h5"
    shutil.copytree(drawn, folder)
    with h5py.File(other, "w") as file:
        file["u"] = np.ones((13, 3))
    with h5py.File(folder / FIELDS / "frame_000006.h5", "a") as file:
        del file["u"]
        file["u"] = (
            h5py.ExternalLink(str(other), "u") if link == "external" else h5py.SoftLink("/v")
        )
    frames = read_frames(folder)
    assert frames.at(0.0)[1].shape == frames.points.shape
    with pytest.raises(InputError, match="frame_000006.h5' is damaged: /u lies in another file"):
        frames.at(0.006)
    for command in ("plot", "film", "report"):
        assert main([command, str(folder)]) == 1
        assert "frame_000006.h5' is damaged: /u lies in another file" in capsys.readouterr().err


def test_an_index_that_leads_elsewhere_is_not_followed(comm: Any, tmp_path: Path) -> None:
    """fields.xdmf names files; only the frames of this folder are read."""
    problem, folder = drawn_run(comm, tmp_path / "run").problem, tmp_path / "run"
    shutil.copyfile(folder / FIELDS / "frame_000002.h5", tmp_path / "other.h5")
    assert read_function(problem, folder, "u", frame=1).name == "u"
    index = (folder / "fields.xdmf").read_text()
    (folder / "fields.xdmf").write_text(index.replace("fields/frame_000002.h5", "../other.h5"))
    with pytest.raises(
        InputError, match=r"the fields in '.*' are incomplete or damaged \('../other.h5'\)"
    ):
        read_function(problem, folder, "u", frame=1)
