"""What a case file and its command refuse: missing meshes, misspelt groups and demands, absurd
tables, empty paths."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact import ground_motion
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.gmsh_session import session, write
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import IDA, read_case, run_ida
from vi_contact.practice.studies.ida.runs import read_row
from vi_contact.run.files.reading import read_run

pytestmark = pytest.mark.serial

CASE = """format = 1
[mesh]
type = "read_mesh"
path = "meshes/block.msh"
[material.soil]
E = 2.0e7
nu = 0.3
rho = 2000.0
[system]
fixed = "bottom"
[[contact]]
facets = "top"
obstacle = {type = "HalfSpace", point = [0.0, 2.0], normal = [0.0, -1.0]}
[[excitation]]
type = "GroundMotion"
record = {path = "motion.at2"}
[run]
dt = 0.01
steps = 2
out = "out"
[[record]]
type = "Probe"
points = {top = [0.0, 1.0]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A case beside its mesh and its record; what is run is run from elsewhere."""
    (tmp_path / "case" / "meshes").mkdir(parents=True)
    write(BlockMesh(divisions=(4, 8)), tmp_path / "case" / "meshes" / "block.msh")
    motion = ground_motion.synthetic(ground_motion.KanaiTajimi(s0=0.01), 0.1, 0.01, seed=1)
    ground_motion.write_at2(motion, tmp_path / "case" / "motion.at2", "g")
    return tmp_path / "case"


def case(folder: Path, *changes: tuple[str, str]) -> str:
    text = CASE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def said(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> str:
    """The one sentence of a command that fails."""
    assert main(arguments) == 1
    captured = capsys.readouterr()
    assert (
        captured.out == ""
        and captured.err.startswith("vi-contact: ")
        and captured.err.count("\n") == 1
    )
    return captured.err


@pytest.mark.long
def test_every_path_is_relative_to_the_case_file(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Mesh, source of a cut, record and run folder."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    # changes nothing
    cut = (
        'type = "read_mesh"\npath = "meshes/block.msh"',
        'type = "Welded"\nsource = "meshes/block.msh"\nfirst = "left"\nsecond = "left"',
    )
    assert main(["run", case(folder, cut), "--quiet"]) == 0
    assert (folder / "out" / "history.csv").is_file() and not list(
        (tmp_path / "elsewhere").iterdir()
    )
    capsys.readouterr()
    assert main(["run", case(folder), "--check"]) == 0 and "in order" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("meshes/block.msh", "meshes/none.msh", "none.msh does not exist"),
        (
            'fixed = "bottom"',
            'fixed = "botom"',
            "[system] fixed is 'botom', but the mesh has no group 'botom'",
        ),
        ('facets = "top"', 'facets = "topp"', "[contact[1]] facets is 'topp'"),
        (
            'facets = "top"',
            'facets = "block"',
            "is 'block', a cell group: give the name of a boundary group",
        ),
        ("motion.at2", "none.at2", "none.at2: there is no such file"),
        ("motion.at2", "", "path is empty: give the path of a file or folder"),
        ("motion.at2", "a\\u0000b", "contains the character NUL"),
        ('"out"', '" "', "[run] out is empty"),
        ("format = 1", "format = 2", "format is 2, and this version of vi_contact reads format 1"),
        ("format = 1", 'format = "new"', "format is 'new'"),
        ("format = 1", "format = true", "format is True"),
        ("dt = 0.01", "dt = nan", "run.dt is nan: give a number"),
        (
            "points = {top = [0.0, 1.0]}",
            "points = {top = [0.0, nan]}",
            "record.1.points.top.2 is nan",
        ),
        ("points = {top = [0.0, 1.0]}", "points = {}", "points"),
        ("dt = 0.01", f"dt = 1{'0' * 400}", "whole number beyond 64 bits"),
        ("dt = 0.01", f"dt = 1{'0' * 5000}", "whole number beyond 64 bits"),
        ("dt = 0.01", f"dt = 0x{'f' * 5000}", "whole number beyond 64 bits"),
        ("dt = 0.01", f"dt = {'[' * 3000}", "nested too deep"),
        ("dt = 0.01", f"dt = {'[' * 30}{']' * 30}", "nested too deep"),
        ("dt = 0.01", f"{'a.' * 3000}b = 1\ndt = 0.01", "nested too deep"),
        ("dt = 0.01", f"{'a.' * 1_000_000}b = 1\ndt = 0.01", "nested too deep"),
    ],
    ids=range(21),
)
def test_check_tells_every_mistake(
    folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, words: str
) -> None:
    assert words in said(capsys, ["run", case(folder, (old, new)), "--check"])


@pytest.mark.parametrize(
    "setting",
    [f"run.dt={'[' * 3000}", f"{'a.' * 3000}b=1", f"run.dt=1{'0' * 5000}", "run.dt=nan"],
    ids=range(4),
)
def test_settings_are_read_as_carefully(
    folder: Path, capsys: pytest.CaptureFixture[str], setting: str
) -> None:
    assert len(said(capsys, ["run", case(folder), "--check", "--set", setting])) < 400


def test_a_boundary_saved_without_its_body(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A .geo with Physical Curves and no Physical Surface leaves a mesh of lines, whose groups are
    of cells."""
    with session() as gmsh:
        geo = gmsh.model.geo
        line = geo.addLine(geo.addPoint(0.0, 0.0, 0.0, 0.5), geo.addPoint(1.0, 0.0, 0.0, 0.5))
        geo.synchronize()
        gmsh.model.setPhysicalName(1, gmsh.model.addPhysicalGroup(1, [line]), "bottom")
        gmsh.model.mesh.generate(1)
        gmsh.write(str(folder / "meshes" / "block.msh"))
    sentence = said(capsys, ["run", case(folder), "--check"])
    assert (
        "a cell group: give the name of a boundary group, or, if it bounds the body, the mesh has "
        "no 2D cells: add a Physical Surface in Gmsh" in sentence
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "CASE", "--out", ""],
        ["run", "CASE", "--out="],
        ["report", "CASE", "--out", ""],
        ["run", "wall", "--out", "", "--steps", "1"],
        ["run", "a\0b"],
        ["motion", "info", "a\0b"],
    ],
)
def test_empty_names_and_nul_are_refused(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    sentence = said(capsys, [case(folder) if word == "CASE" else word for word in arguments])
    assert "is empty: give the name" in sentence or "NUL" in sentence
    assert not list((tmp_path / "here").iterdir())


@pytest.mark.parametrize("words", [["--steps", "0"], ["--set", "run.steps=0"]])
def test_no_steps_are_the_state_at_the_start(tmp_path: Path, words: list[str]) -> None:
    """As simulate(steps=0): one row, however the number is given."""
    assert main(["run", "wall", *words, "--quiet", "--out", str(tmp_path / "run")]) == 0
    assert len(read_run(tmp_path / "run").history["t"]) == 1


# Incremental dynamic analysis
# ---------------------------------------------------------------------------------------


def test_a_misspelt_demand_is_told_before_the_first_run(folder: Path, tmp_path: Path) -> None:
    study = IDA(read_case(case(folder)), [folder / "motion.at2"], ["u_x_topp:max"], scales=(1.0,))
    with pytest.raises(
        InputError, match="demand 'u_x_topp': the runs record no such column: did you mean u_x_top"
    ):
        run_ida(study, tmp_path / "ida", say=lambda line: None)
    assert not list((tmp_path / "ida").glob("runs/*"))


def test_the_columns_are_those_of_a_run(folder: Path) -> None:
    one = read_case(case(folder))
    written = one.run(MPI.COMM_SELF, out=folder / "out", progress=False)
    assert one.columns(MPI.COMM_SELF) == {
        name for name, values in written.history.items() if values.ndim == 1
    }


def test_no_run_that_finished_is_a_failure(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    row = {"status": "failed", "reason": "no luck"}
    monkeypatch.setattr("vi_contact.practice.studies.ida.ida.run_ida", lambda *_, **__: [row, row])
    monkeypatch.setattr("signal.signal", lambda *_: None)
    given = [
        "ida",
        case(folder),
        "--motions",
        str(folder / "motion.at2"),
        "--edp",
        "u_x_top",
        "--scales",
        "1",
        "--out",
        str(tmp_path / "ida"),
    ]
    assert "2 of 2 runs have failed, the first because: no luck" in said(capsys, given)
    assert "--launch" in said(capsys, [*given, "--launch", "'"])


@pytest.mark.parametrize(
    "text",
    ["[1]", "[" * 3000, "{}", '{"record": 1}', "\udcff", '{"record": "a", "status": "b"}'],
    ids=range(6),
)
def test_rows_and_studies_that_are_damaged(folder: Path, tmp_path: Path, text: str) -> None:
    (tmp_path / "ida").mkdir()
    for name in ("row.json", "ida/ida.json"):
        (tmp_path / name).write_bytes(text.encode("utf-8", "surrogateescape"))
    assert read_row(tmp_path / "row.json") is None
    study = IDA(read_case(case(folder)), [folder / "motion.at2"], ["u_y_topp"], scales=(1.0,))
    with pytest.raises(InputError, match="is damaged|record no such column"):
        run_ida(study, tmp_path / "ida", say=lambda line: None)


# Memory
# --------------------------------------------------------------------------------------------------


class Petsc(RuntimeError):
    ierr = 55


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        MemoryError("Unable to allocate 7.3 TiB for an array"),
        OSError(12, os.strerror(12)),
        RuntimeError("Unable to create dataset (memory allocation failed)"),
        Petsc("error code 55"),
    ],
)
def test_out_of_memory_is_one_sentence(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(options: object) -> str:
        raise error

    monkeypatch.setattr("vi_contact.practice.cli.motion._describe_files", fails)
    assert "out of memory: take a coarser mesh" in said(capsys, ["motion", "info", "file"])


def test_other_errors_keep_their_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    """A defect is not hidden."""

    def fails(options: object) -> str:
        raise KeyError(json.dumps("defect"))

    monkeypatch.setattr("vi_contact.practice.cli.motion._describe_files", fails)
    with pytest.raises(KeyError):
        main(["motion", "info", "file"])
