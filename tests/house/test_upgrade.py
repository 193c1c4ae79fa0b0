"""From version 0.1: old names, words, commands, case files, run folders and page addresses lead to the new ones.

What tests/support/version_0_1 holds was written for version 0.1, and its run folder by it.
"""

from __future__ import annotations

import json
import os
import re
import runpy
import shlex
import shutil
import sys
import tomllib
from importlib import import_module
from importlib.util import find_spec
from inspect import signature
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import ground_motion, soil
from vi_contact.cli import main
from vi_contact.core import obstacles, protocols, step
from vi_contact.engineering import peaks
from vi_contact.laws import materials
from vi_contact.solvers import ActiveSet
from vi_contact.solvers.volume import ReducedNewton
from vi_contact.studies import read_case
from vi_contact.studies.cases.library import located
from vi_contact.studies.cases.parsing import nearest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "reference" / "upgrade.md").read_text(encoding="utf-8")
OLD = ROOT / "tests" / "support" / "version_0_1"
TABLE: dict[str, dict[str, str]] = tomllib.loads((ROOT / "vi_contact/core/retired.toml").read_text(encoding="utf-8"))
NAMES = [(package, old, new) for package, names in TABLE.items() if package != "words" for old, new in names.items()]
sys.path.insert(0, str(OLD))
from interface import interface  # noqa: E402

INTERFACE: dict[str, dict[str, dict[str, list[str]]]] = json.loads((OLD / "interface.json").read_text(encoding="utf-8"))
PAGES = {  # docs/*.md of 0.1
    "api", "beam", "bem", "boundary_layer", "channel", "faq", "install", "limitations", "model", "output",
    "outputs_engineering", "petsc", "records", "rocking_block", "schemes", "seed003", "soil_boundaries", "solvers",
    "sources", "studies", "verification", "wall",
}


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def found(path: str) -> Any:
    """What a dotted path leads to: a module, or a name in one or in its class."""
    module, rest = path, list[str]()
    while module:
        try:
            there = import_module(module)
            break
        except ModuleNotFoundError as error:
            if not module.startswith(str(error.name)):
                raise
            module, _, last = module.rpartition(".")
            rest.insert(0, last)
    for name in rest:
        there = getattr(there, name)
    return there


def test_new_names_are_there() -> None:
    """Every name and module that the page gives, imported; modules of tests/support stand on pytest's path."""
    rows = re.findall(r"^\| (`.*?) \| (.*) \|$", PAGE, re.MULTILINE)
    assert len(rows) > 400
    for old, new in rows:
        given = re.findall(r"\b(?:vi_contact|demos|tests\.support)\.[\w.]*\w", new)
        if re.fullmatch(r"`(vc|[a-z_]+)\.\w+`", old):
            assert given or new.startswith(("gone", "`meshes.")), old
        for path in given:
            assert found(path.removeprefix("tests.support.")) is not None


def table(heading: str) -> list[tuple[str, str]]:
    """The rows of the last table under a heading of the page."""
    under = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"^\| (.*?) \| (.*) \|$", under, re.MULTILINE)


@pytest.mark.parametrize("package", INTERFACE)
def test_every_public_name_of_before_is_there_or_in_the_table(package: str) -> None:
    """Its arguments and members too: there, or on the left of the table of arguments and methods."""
    changed = [old for old, _ in table("Arguments and methods that have changed")]
    retired, unanswered = TABLE.get(package, {}), []
    for name, was in INTERFACE[package].items():
        new = retired.get(name, f"{package}.{name}")
        if name not in retired:
            assert name in import_module(package).__all__, name
        elif new.startswith("gone"):
            continue
        there = found(new.removeprefix("tests.support."))
        assert not isinstance(there, ModuleType), name
        now = interface(there)
        for kind, members in was.items():
            told = " ".join(row for row in changed if re.search(rf"\b{name}\b", row, re.IGNORECASE))
            unanswered += [f"{name}: {one}" for one in set(members) - set(now.get(kind, ()))
                           if not one.startswith("_") and not re.search(rf"\b{one}\b", told)]
    assert unanswered == []


def test_every_module_of_before_is_there_or_in_the_table() -> None:
    """A package stays a package, and a module stays a module or becomes a package that hands its names on."""
    moved = dict(table("Modules that moved"))
    for name in (OLD / "modules.txt").read_text(encoding="utf-8").split():
        path = ROOT / name.replace(".", "/")
        there = path.is_dir() or path.with_suffix(".py").is_file()
        assert there or f"`{name.removeprefix('vi_contact.')}`" in moved, name


def test_arguments_that_the_page_names_are_there() -> None:
    for law in (vc.Inelastic, vc.Newton, vc.Elastic):
        assert "update" in signature(law).parameters and "reading" not in signature(law).parameters
    assert "target" in signature(ground_motion.scaled_to_pga).parameters
    assert set(signature(ground_motion.tapered).parameters) == {"record", "fraction"}
    assert list(signature(soil.base_motion).parameters) == ["excitation"]
    assert {"dt", "scheme"} & set(signature(soil.FreeField).parameters) == set()
    assert vc.Volume() == vc.Volume(ReducedNewton())
    q = ActiveSet().prepare(np.eye(2), np.zeros(2, bool)).solve(np.array([-1.0, 1.0]))
    assert np.allclose(q.r, [1.0, 0.0]) or np.allclose(q.r, [0.0, 1.0])


@pytest.mark.parametrize("package", [one for one in TABLE if one != "words"])
def test_old_names_are_gone_with_an_answer(package: str) -> None:
    if find_spec(package) is None:  # a package that is gone as a whole: Python says so
        assert package == "vi_contact.beam" and "beam" in TABLE["vi_contact"]
        return
    for old, new in TABLE[package].items():
        with pytest.raises(AttributeError) as told:
            getattr(import_module(package), old)
        assert str(told.value) == f"module '{package}' has no attribute '{old}': since 0.2.0 it is {new}"
    with pytest.raises(AttributeError, match="no attribute 'nonsense'$"):
        getattr(import_module(package), "nonsense")  # noqa: B009


def test_the_page_has_every_row_of_the_table() -> None:
    for package, old, new in NAMES:
        short = "vc" if package == "vi_contact" else package.removeprefix("vi_contact.")
        assert f"| `{short}.{old}` | {new if new.startswith('gone') else f'`{new}`'} |\n" in PAGE
    for old, new in TABLE["words"].items():
        assert f"| `{old}` | {new if new.startswith('gone') else f'`{new}`'} |\n" in PAGE
        if not new.startswith("gone"):  # where nobody knows the new word, the old one says nothing of it
            assert nearest(old, ["any"]).endswith("Known: any")
        assert nearest(old, ["any", new]) == f"since 0.2.0 it is {new}"


def test_the_program_of_before_stops_and_with_the_lines_of_the_page_it_prints_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AttributeError, match="since 0.2.0 it is vi_contact.ground_motion.KanaiTajimi"):
        runpy.run_path(str(OLD / "program.py"))
    program = (OLD / "program.py").read_text(encoding="utf-8")
    (lines,) = blocks("diff")
    changes = re.findall(r"^-(.*\n)((?:\+.*\n)+)", lines, re.MULTILINE)
    assert sum(1 + new.count("\n") for _, new in changes) == lines.count("\n")
    for old, new in changes:
        assert program.count(old) == 1, old
        program = program.replace(old, re.sub(r"^\+", "", new, flags=re.MULTILINE))
    Path("program.py").write_text(program, encoding="utf-8")
    runpy.run_path("program.py")
    assert capsys.readouterr().out == blocks("text")[0]


def test_classes_of_before_need_no_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program with three of them, and the methods of every protocol, none added and none with other arguments."""
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(OLD / "own_classes.py"))
    assert capsys.readouterr().out == blocks("text")[1]
    lines = (OLD / "protocols.txt").read_text(encoding="utf-8").splitlines()
    before = {name: given for name, *given in map(str.split, lines)}
    homes = {name: one for home in (step, protocols, obstacles, materials) for name, one in vars(home).items()}
    now = {}
    for name in {line.partition(".")[0] for line in before}:
        for method, function in vars(homes[name]).items():
            if isinstance(function, property | FunctionType) and (method == "__call__" or not method.startswith("_")):
                function = function.fget if isinstance(function, property) else function
                now[f"{name}.{method}"] = list(signature(function).parameters)
    assert now == before


WORDS = {
    "wall": "[impact] has the unknown key 'reading' for Inelastic: since 0.2.0 it is update",
    "wall_model": "[model] case was of the model Wall, which is retired: give contact.points, contact.held or contact",
    "channel": "[model] shape was of the model Channel, which is retired: give [mesh] of the case 'channel'",
}


@pytest.mark.parametrize("name", WORDS)
def test_old_case_files_are_answered_and_those_of_the_page_are_read(name: str, tmp_path: Path) -> None:
    """The page's fragments before and after, one in the place of the other; the impulse of the channel, too."""
    text = (OLD / f"{name}.toml").read_text(encoding="utf-8")
    with pytest.raises(vc.InputError, match=re.escape(WORDS[name])):
        read_case(OLD / f"{name}.toml")
    fragments = [one.rstrip() for one in blocks("toml")]
    for before, after in zip(fragments[::2], fragments[1::2], strict=True):
        text = text.replace(before, after)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    case = read_case(tmp_path / "case.toml")
    assert "model" not in case.tables and "reading" not in text
    assert len(np.atleast_1d(case.tables["contact"])) == (3 if name == "channel" else 1)


@pytest.mark.parametrize(("command", "said"), [
    ("wall", "give vi-contact run wall (see"), ("channel", "give vi-contact run channel (see"),
    ("beam", "demos/run.sh timoshenko_beam"), ("layer", "demos/run.sh particle_layer"),
    ("run wall --scheme zwt --check", "it is ZienkiewiczWoodTaylor"),
])
def test_old_commands_answer(command: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(command.split()) == 1
    assert said in capsys.readouterr().err


def settings(cell: str) -> list[str]:
    """Every KEY=VALUE after a --set in a cell of a table."""
    words = [word for given in re.findall(r"`(--set .*?)`", cell) for word in shlex.split(given)]
    return [word for word in words if word != "--set"]


def test_options_of_before_have_settings_that_serve() -> None:
    """Every --set of the page's table is read; those that go together make a wall and a channel."""
    rows = dict(table("Commands"))
    assert len(rows) > 25
    for name, other in (("wall", "channel"), ("channel", "wall")):
        for old, new in rows.items():
            for given in re.findall(r"`--set .*?`", new):
                if not (old.startswith(other) or "KEY" in given or "record" in given):
                    read_case(located(name), settings(given)).check()
    wall = [rows[f"wall: `{old}`"] for old in ("--gravity", "--case face --divisions 4 6", "--projection")]
    made = read_case(located("wall"), settings(" ".join(wall))).problem(MPI.COMM_WORLD)
    assert made.surface.total == 6
    channel = [rows[f"channel: `{old}`"] for old in ("--contact coulomb --mu 0.5", "--damping 0.05 2 8")]
    made = read_case(located("channel"), [*settings(" ".join(channel)), "mesh.size=1.0"]).problem(MPI.COMM_WORLD)
    assert made.friction == vc.Coulomb(mu=0.5)


def test_options_of_records_have_settings_that_serve(tmp_path: Path) -> None:
    file = tmp_path / "motion.txt"
    file.write_text("".join(f"{0.01 * k} {(-1) ** k * 0.1}\n" for k in range(9)), encoding="utf-8")
    shaken = f'excitation=[{{type = "GroundMotion", record = {{path = "{file}"}}, direction = [1.0, 0.0]}}]'
    row = dict(table("Commands"))["`--units g`, `--pga 3.0`, `--resample 0.005`, each beside `--motion`"]
    (shaking,) = read_case(located("wall"), [shaken, *settings(row)]).excitations()
    assert isinstance(shaking, vc.GroundMotion) and shaking.record.dt == 0.005
    assert np.abs(shaking.record.acceleration).max() == pytest.approx(3.0)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the run folder of version 0.1."""
    return Path(shutil.copytree(OLD / "run", tmp_path / "run"))


def test_an_old_run_folder_is_read(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = vc.read_run(folder)
    assert run.facts["versions"]["vi_contact"] == "0.1.0" and run.facts["status"] == "finished"
    assert run.history["k"].tolist() == list(range(13)) and run.history["pressure"].shape == (13, 3)
    assert run.contact is not None and run.contact.points[:, 1].tolist() == [3.0, 6.0, 9.0]
    lowest = {one.name: one.min for one in peaks(run.history, run.columns)}["u_x_top"]
    assert lowest == run.history["u_x_top"].min() < -1e-4
    assert main(["post", "peaks", str(folder)]) == 0
    assert "u_x_top" in capsys.readouterr().out and (folder / "peaks.csv").is_file()


def test_an_old_run_is_continued_only_by_name(folder: Path, tmp_path: Path) -> None:
    """The page's sentence; with changed=True to the numbers of a straight run."""
    text = (OLD / "wall.toml").read_text(encoding="utf-8").replace(*(one.rstrip() for one in blocks("toml")[:2]))
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    case = read_case(tmp_path / "case.toml", settings=["run.steps=20"])
    with pytest.raises(vc.InputError) as told:
        case.run(MPI.COMM_WORLD, out=folder, restart=True)
    assert str(told.value).replace(str(folder), "run") + "\n" == blocks("text")[2]
    case.run(MPI.COMM_WORLD, out=folder, restart=True, changed=True)
    case.run(MPI.COMM_WORLD, out=tmp_path / "straight")
    whole, straight = vc.read_run(folder).history, vc.read_run(tmp_path / "straight").history
    for column in ("u_x_top", "u_y_top", "contact_resultant", "energy_strain"):
        assert len(whole[column]) == 21
        assert np.allclose(whole[column], straight[column], rtol=0.0, atol=1e-11 * np.abs(straight[column]).max())


def test_page_addresses_of_before_lead_to_pages() -> None:
    rows = dict(table("Pages"))
    lines = (ROOT / "docs" / "redirects.txt").read_text(encoding="utf-8").splitlines()
    moved = dict(line.split() for line in lines if not line.startswith("#"))
    assert {f"docs/{page}" for page in PAGES} <= set(moved)
    for old, new in moved.items():
        page = ((ROOT / old).parent / new).with_suffix(".md")
        assert page.is_file(), old
        if old.startswith("docs/"):
            assert f"]({Path(os.path.relpath(page, ROOT / 'docs' / 'reference')).as_posix()})" in rows[f"`{old}.md`"]
