"""The command line: explains itself, prints what it finds, and says in one sentence what is
wrong."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import vi_contact
from vi_contact.core.errors import InputError, ViContactError
from vi_contact.practice.cli import errors as cli_errors
from vi_contact.practice.cli.entry import main, split_petsc
from vi_contact.practice.cli.errors import explain_errors

pytestmark = pytest.mark.serial
ROOT = Path(vi_contact.__file__).parent.parent


def shell(*arguments: str) -> subprocess.CompletedProcess[str]:
    """python3 -m vi_contact, as a user calls it."""
    command = [sys.executable, "-m", "vi_contact", *arguments]
    # env: without what MPI, started in this process, has put into the C environment; a child that
    # inherits it takes itself for this process, and may end without a word
    return subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, check=False, env=dict(os.environ)
    )


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """Two columns t, a: one period of a 2 m/s² sine at 1 Hz."""
    t = np.arange(101) * 0.01
    path = tmp_path / "sine.txt"
    np.savetxt(path, np.column_stack([t, 2.0 * np.sin(2.0 * np.pi * t)]), fmt="%.10e")
    return path


@pytest.mark.long
def test_help_explains_itself():
    done = shell("--help")
    assert done.returncode == 0 and not done.stderr
    for word in (
        "vi-contact",
        "lift off, bounce and slide",
        "mpirun",
        "run a case",
        "cases",
        "ground motion files",
    ):
        assert word in done.stdout


def test_calls_of_the_compiler_are_not_shown(monkeypatch, caplog, capsys):
    """In a virtual environment of Debian 12 they are lines INFO:root among what a command
    prints."""
    monkeypatch.setattr(logging.getLogger(), "filters", [])
    monkeypatch.setattr(sys, "argv", ["vi-contact", "cases"])
    caplog.set_level(logging.INFO)
    logging.info("before")
    assert main() == 0
    logging.info("running build_ext")
    logging.warning("a compiler that warns")
    logging.getLogger("vi_contact").info("a line of ours")
    assert caplog.messages == ["before", "a compiler that warns", "a line of ours"]


def test_every_command_has_its_own_help():
    for command in (["run"], ["motion"], ["motion", "info"]):
        with pytest.raises(SystemExit) as stopped:
            main([*command, "--help"])
        assert stopped.value.code == 0


@pytest.mark.parametrize(
    ("arguments", "word"),
    [([], "COMMAND"), (["bridge"], "invalid choice: 'bridge'"), (["motion"], "ACTION")],
)
def test_unknown_commands_show_the_usage(arguments, word, capsys):
    with pytest.raises(SystemExit, match="^2$"):
        main(arguments)
    said = capsys.readouterr()
    assert not said.out and said.err.startswith("usage: vi-contact") and word in said.err


def test_version(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out == f"vi-contact {vi_contact.__version__}\n"


@pytest.mark.long
def test_motion_info(record):
    done = shell("motion", "info", str(record), "--units", "m/s2")
    assert done.returncode == 0 and not done.stderr
    lines = {line[:20].strip(): line[20:] for line in done.stdout.splitlines()}
    assert lines["file"] == str(record) and lines["samples"] == "101" and lines["dt"] == "0.01 s"
    assert lines["PGA"].startswith("2 m/s2 = 0.2039 g at t = 0.25 s")
    assert float(lines["PGV"].split()[0]) == pytest.approx(2.0 / np.pi, rel=2e-3)  # (1 - cos) a/w
    assert float(lines["Arias intensity"].split()[0]) == pytest.approx(
        np.pi / (2 * 9.80665) * 2.0, rel=1e-3
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["motion", "info", "nowhere.AT2"], "nowhere.AT2: there is no such file"),
        (["motion", "info", "."], "Is a directory"),
        (
            ["run", "wall", "--set", "contact.points=[[5.0, 3.0]]"],
            "contact point (5, 3) is 1 m away from",
        ),
    ],
)
def test_errors_are_one_sentence(arguments, word):
    if arguments[0] == "run":
        pytest.importorskip("dolfinx")
    done = shell(*arguments)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    said = [line for line in done.stderr.splitlines() if line.startswith("vi-contact: ")]
    assert len(said) == 1 and word in said[0]
    if arguments[0] == "motion":  # MPI starts for the wall, and may have remarks of its own
        assert not done.stdout and done.stderr == said[0] + "\n"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["run", "wall", "--set", "impact.type=Soft"], "unknown type 'Soft'"),
        (
            ["run", "wall", "--set", 'impact={type="Newton", e=1.5}'],
            "restitution coefficient e is 1.5",
        ),
        (["run", "wal"], "there is no built-in case 'wal': did you mean wall?"),
    ],
)
def test_wrong_cases_are_one_sentence(arguments, word, capsys):
    pytest.importorskip("dolfinx")
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert said.startswith("vi-contact: ") and word in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["motion", "convert", "r.at2", "r.at2"], "r.at2 is read by this command"),
        (["motion", "convert", "r.at2", "./link.at2"], "link.at2 is read by this command"),
        (["motion", "plot", "r.at2", "--out", "r.at2"], "a picture ends in .png, .pdf or .svg"),
        (["motion", "plot", "r.at2", "--out", "x.nosuch"], "a picture ends in"),
        (
            ["motion", "plot", "r.at2", "--out", "x" * 300 + ".png"],
            "give the name of a file in a folder that exists",
        ),
        (["motion", "spectrum", "r.at2", "--csv", "r.at2"], "r.at2 is read by this command"),
        (
            ["motion", "spectrum", "r.at2", "--csv", "x.png", "--png", "x.png"],
            "overwritten by its picture",
        ),
        (
            ["post", "spectrum", "run", "a_g_x", "--out", "run/history.csv"],
            "history.csv is read by this command",
        ),
        (
            ["post", "peaks", "run", "--out", "run/../run/checkpoint.npz"],
            "checkpoint.npz is read by this command",
        ),
        (["post", "spectrum", "run", "a_g_x", "--out", "x.png"], "give a name such as x.csv"),
        (["report", "run", "--out", "page.docx"], "is not an .html or .pdf file"),
    ],
)
def test_no_input_is_overwritten(tmp_path, monkeypatch, capsys, arguments, word):
    """An output that the command reads, or that it would write twice, is refused; every file is
    what it was."""
    monkeypatch.chdir(tmp_path)
    Path("r.at2").write_text("A MOTION\nIN UNITS OF G\nNPTS= 4, DT= .01 SEC\n0.0 0.1 -0.1 0.0\n")
    Path("link.at2").symlink_to("r.at2")
    Path("run").mkdir()
    names = "k,t,iterations,certificate,escalated,a_g_x"
    Path("run/history.csv").write_text(
        names + "\n" + "".join(f"{k},{0.01 * k},1,0,0,0.{k}\n" for k in range(9))
    )
    Path("run/columns.json").write_text(
        json.dumps({name: {"unit": "-", "meaning": name} for name in names.split(",")})
    )
    Path("run/checkpoint.npz").write_bytes(b"kept")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert word in said and said.count("\n") == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("error", [InputError("no such thing"), RuntimeError("a defect")])
@pytest.mark.parametrize("others", ["come", "wait"])
def test_a_rank_that_fails_alone_ends_the_others(monkeypatch, capsys, error, others):
    """Rank 1 of 2 fails: when rank 0 does too it is the one that speaks; when not, rank 1 speaks
    and MPI ends both."""

    class World:
        rank, size = 1, 2
        Ibarrier = staticmethod(lambda: SimpleNamespace(Test=lambda: others == "come"))
        Abort = staticmethod(sys.exit)

    def fails(options):
        raise error

    monkeypatch.setitem(sys.modules, "mpi4py.MPI", SimpleNamespace(COMM_WORLD=World))
    monkeypatch.setattr(cli_errors, "PATIENCE", 0.0)
    monkeypatch.setattr(
        "vi_contact.practice.cli.entry.build_parser",
        lambda *_: SimpleNamespace(parse_args=lambda words: SimpleNamespace(run=fails)),
    )
    if others == "wait":
        with pytest.raises(SystemExit, match="1"):
            main(["run"])
        assert (
            "rank 1 of 2 stopped alone" in (said := capsys.readouterr().err) and str(error) in said
        )
    elif isinstance(error, InputError):
        assert main(["run"]) == 1 and not capsys.readouterr().err
    else:
        with pytest.raises(RuntimeError, match="a defect"):
            main(["run"])


def test_units_must_be_said(record, capsys):
    assert main(["motion", "info", str(record)]) == 1
    captured = capsys.readouterr()
    assert not captured.out and "units" in captured.err and captured.err.count("\n") == 1


def test_petsc_options_are_told_from_ours():
    options = ["-vi_contact_volume_snes_monitor", "-vi_contact_volume_snes_rtol", "1e-9"]
    own, petsc = split_petsc(["run", "wall", *options, "--steps", "5", "--dt", "0.1"])
    assert own == ["run", "wall", "--steps", "5", "--dt", "0.1"] and petsc == options
    assert split_petsc(["run", "--out", "x"]) == (["run", "--out", "x"], [])


def test_cases_are_listed(capsys):
    assert main(["cases"]) == 0
    *lines, folder = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["beam", "channel", "layer", "wall"]
    assert (Path(folder.removeprefix("the files: ")) / "wall.toml").is_file()


def test_a_library_that_is_missing_is_named():
    """A Python without DOLFINx: one sentence, not a traceback; a module of the user's own keeps its
    traceback."""

    def missing(name):
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)

    with pytest.raises(
        ViContactError, match=r"^ufl is needed and this Python does not find it: install it"
    ):
        explain_errors(lambda: missing("ufl"), {})
    with pytest.raises(ModuleNotFoundError, match="No module named 'mine'"):
        explain_errors(lambda: missing("mine"), {})
