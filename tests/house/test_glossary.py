"""The glossary: every word that a case file, a summary or the package shows has an entry, in three
languages."""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from vi_contact.practice.cli.entry import build_parser
from vi_contact.run.solution import DEFECT, END, ENERGY, RUN, STATE

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "vi_contact"
PAGE = ROOT / "docs" / "reference" / "glossary.md"
TEXT = PAGE.read_text(encoding="utf-8")
ENTRIES = {one.partition("\n")[0]: one for one in re.split(r"^### ", TEXT, flags=re.MULTILINE)[1:]}
CODE = {word for entry in ENTRIES.values() for word in re.findall(r"`([^`]+)`", entry)}
TABLES = ("system", "contact", "stage", "run")


def shipped() -> list[Path]:
    """The case files of the package and of the demos."""
    folders = (
        PACKAGE / "practice" / "studies" / "starters",
        PACKAGE / "practice" / "studies" / "cases" / "builtin",
        ROOT / "demos" / "cases",
    )
    return sorted(path for folder in folders for path in folder.glob("*.toml"))


def test_tables_of_case_files_are_named() -> None:
    pytest.importorskip("dolfinx")
    from vi_contact.practice.studies.cases.schema import write_schema

    schema = json.loads(write_schema())
    missing = {
        name for name in schema["properties"] if not {name, f"[{name}]", f"[[{name}]]"} & CODE
    }
    assert missing == set()


def test_keys_of_shipped_case_files_are_named() -> None:
    """Those that say where bodies are held, where they touch and how long they move."""
    assert len(shipped()) > 8
    keys = set()
    for path in shipped():
        case = tomllib.loads(path.read_text(encoding="utf-8"))
        for name in TABLES:
            found = case.get(name, [])
            keys |= {
                key for table in (found if isinstance(found, list) else [found]) for key in table
            }
    assert keys - CODE - {"type", "name", "system"} == set()


@pytest.mark.parametrize("command", ["run", "ida"])
def test_options_are_named(command: str) -> None:
    (commands,) = (
        one for one in build_parser()._actions if isinstance(one, argparse._SubParsersAction)
    )
    options = {
        one for one in commands.choices[command]._option_string_actions if one.startswith("--")
    }
    assert len(options) > 10 and options - CODE - {"--help", "--quiet"} == set()


def test_rooms_are_named() -> None:
    files = [*PACKAGE.glob("*/__init__.py"), *PACKAGE.glob("practice/*/__init__.py")]
    rooms = {path.parent.name for path in files}
    assert rooms == set(re.findall(r"`(\w+)`", ENTRIES["room"])) - {"vi_contact"}


def test_lines_of_the_printed_summary_are_named() -> None:
    names = {line.name.strip() for line in (*RUN, *STATE, *ENERGY, *DEFECT, *END)} - {""}
    assert len(names) > 10 and names - CODE == set()


def test_entries_are_in_order_and_tables_are_those_of_the_entries() -> None:
    """After a change of an entry: python3 docs/make_glossary.py."""
    command = [sys.executable, str(ROOT / "docs" / "make_glossary.py"), "--check"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=600)
    assert done.returncode == 0, done.stderr
    plain = [term.casefold() for term in ENTRIES if term.isascii()]
    assert plain == sorted(plain)
    assert len(re.findall(r"^\| .+ \| \[.+\]\(#[^)]+\) \|$", TEXT, re.MULTILINE)) > 2 * len(ENTRIES)
