"""docs/guide/extend.md, followed to the letter: its files, its commands, its numbers, the one line
of the registry."""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("dolfinx")

from vi_contact.practice.cli.entry import main

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
GUIDE = (ROOT / "docs" / "guide" / "extend.md").read_text(encoding="utf-8")
# language, file, text
BLOCKS = re.findall(r"^```(\w+)\n(?:# (\S+)\n)?(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL)
FILES = {file: text for _, file, text in BLOCKS if file}
FRAGMENTS = [text for language, file, text in BLOCKS if language == "toml" and not file]


def python(arguments: list[str], folder: Path, path: str) -> str:
    """What Python prints, started in the folder."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a stranger has made the files of the guide."""
    found = tmp_path_factory.mktemp("stranger")
    (found / "mine").mkdir()
    for file, text in FILES.items():
        if "/" not in file or file.startswith("mine/"):
            (found / file).write_text(text, encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def printed(folder: Path) -> dict[str, str]:
    """What its scripts print."""
    scripts = [file for file in FILES if file.endswith(".py") and "/" not in file]
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.chdir(folder)
        for file in scripts:
            with contextlib.redirect_stdout(io.StringIO()) as said:
                runpy.run_path(file, run_name="__main__")
            found[file] = said.getvalue()
    return found


def test_examples_print_what_the_guide_says(printed: dict[str, str]) -> None:
    files = [file for _, file, _ in BLOCKS]
    assert list(printed) == ["scheme.py", "friction.py", "glue.py", "recorder.py", "foam.py"]
    for file, found in printed.items():
        language, _, said = BLOCKS[files.index(file) + 1]
        assert language == "text" and found == said != ""


def test_the_command_computes_the_same(folder: Path, printed: dict[str, str]) -> None:
    (command,) = (text.split() for language, _, text in BLOCKS if language == "sh")
    assert command[:3] == ["PYTHONPATH=.", "vi-contact", "run"]
    assert "run finished: 100 steps" in python(
        ["-m", "vi_contact", *command[2:]], folder, f"{ROOT}:."
    )
    made, python_made = (folder / "results" / name / "history.csv" for name in ("case", "scheme"))
    assert made.read_bytes() == python_made.read_bytes()


def test_law_and_recorder_stand_in_a_case_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the tables of the guide; a run that is stopped and restarted sums up what one run does."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(folder)
    law, recorders = (text for language, file, text in BLOCKS if language == "toml" and not file)
    given = (
        FILES["wall.toml"].replace('[friction]\ntype = "Coulomb"\nmu = 0.5\n', law)
        + "\n"
        + recorders
    )
    assert law in given
    Path("all.toml").write_text(given, encoding="utf-8")
    for out, steps, more in (("whole", 60, []), ("parts", 40, []), ("parts", 60, ["--restart"])):
        assert (
            main(
                [
                    "run",
                    "all.toml",
                    "--allow",
                    "mine",
                    "--quiet",
                    "--out",
                    out,
                    "--set",
                    f"run.steps={steps}",
                    *more,
                ]
            )
            == 0
        )
    whole, parts = (Path(out, "history.csv").read_text("utf-8") for out in ("whole", "parts"))
    assert whole == parts and whole.splitlines()[0].endswith(",impulse")
    assert float(whole.splitlines()[-1].split(",")[-1]) > 0.0


def test_a_scheme_is_one_file_and_one_registry_line(tmp_path: Path) -> None:
    """In a copy of the package every reader of the registry knows it."""
    shutil.copytree(
        ROOT / "vi_contact", tmp_path / "vi_contact", ignore=shutil.ignore_patterns("__pycache__")
    )
    schemes = tmp_path / "vi_contact" / "schemes"
    (schemes / "backward_euler.py").write_text(FILES["mine/backward_euler.py"], encoding="utf-8")
    registry = schemes / "__init__.pyi"
    line = FILES["vi_contact/schemes/__init__.pyi"]
    registry.write_text(registry.read_text("utf-8") + line, "utf-8")
    asked = """
import vi_contact as vc
from vi_contact.core.step import Scheme
from vi_contact.practice.studies.cases.vocabulary import list_names
name = "BackwardEuler"
print(vc.BackwardEuler(), name in vc.__all__, name in list_names(Scheme), vc.__file__)
"""
    assert python(["-c", asked], tmp_path, str(tmp_path)).startswith(
        f"BackwardEuler() True True {tmp_path}"
    )
