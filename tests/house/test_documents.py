"""The documents: examples run and print what they say, commands exist, links resolve, names and ids
are complete."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

import vi_contact
from vi_contact.practice.cli.entry import build_parser

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def blocks(document: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(
        rf"^```{language}\n(.*?)^```$",
        document.read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )


def run(code: str, folder: Path) -> str:
    """What the code prints, run by itself in the folder as a user would."""
    (folder / "example.py").write_text(code, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        [sys.executable, "example.py"],
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder in which README's first example has run, and what it printed."""
    folder = tmp_path_factory.mktemp("readme")
    (code,) = blocks(ROOT / "README.md", "python")
    return folder, run(code, folder)


def test_first_example_prints_what_readme_says(first: tuple[Path, str]) -> None:
    (printed,) = blocks(ROOT / "README.md", "text")
    assert first[1] == printed


def test_reading_examples_run_on_its_output(first: tuple[Path, str]) -> None:
    """reference/files.md: rows of 400 steps and the initial state, the same minimum as README
    prints, a picture."""
    page = ROOT / "docs" / "reference" / "files.md"
    table, arrays, picture = run("\nprint('---')\n".join(blocks(page, "python")), first[0]).split(
        "---\n"
    )
    lowest = re.search(r"top of the wall: (\S+) to", first[1])
    words = re.fullmatch(r"401 rows, u_x_top in m: (\S+)\n", table)
    assert lowest and words and f"{1e6 * float(words[1]):.1f}" == lowest[1]
    assert arrays == "Pa (401, 12) largest at 9 m\n"
    assert picture == "" and (first[0] / "frame.png").stat().st_size > 5000


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_commands_exist(document: Path) -> None:
    """Every script that a document calls is there and bash can read it; every demo too."""
    text = document.read_text(encoding="utf-8")
    for script in set(re.findall(r"\bbash ([\w./-]+)", text)):
        subprocess.run(["bash", "-n", str(ROOT / script)], check=True)
    for demo in set(re.findall(r"\bdemos/run\.sh (?:-n \d+ )?([a-z]\w*)", text)):
        assert (ROOT / "demos" / f"{demo}.py").is_file(), demo
    for script in set(
        re.findall(r"\bpython3 ((?:meshes|demos|benchmarks|docs)/[\w./]+\.py)", text)
    ):
        assert (ROOT / script).is_file(), script
    for wanted in set(re.findall(r"\btests/run\.sh -k (test_\w+)", text)):
        assert any(
            f"{wanted}(" in file.read_text(encoding="utf-8") or wanted == file.stem
            for file in (ROOT / "tests").rglob("test_*.py")
        ), wanted


commands = cache(build_parser)  # read only
COMMAND = r"\b(vi-contact|demos/run\.sh(?: -n \d+)? (?:wall|channel)(?= --)) ((?:\\\n|[^`\n#])+)"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_options_exist(document: Path) -> None:
    """Every option that a document gives to a command is one of its parser."""
    for start, line in re.findall(COMMAND, document.read_text(encoding="utf-8")):
        demo = start != "vi-contact"  # it takes the options of run, and one of its own
        words, command = ["run"] * demo + line.split(), commands()
        for word in words:
            below = next(
                (one for one in command._actions if isinstance(one, argparse._SubParsersAction)),
                None,
            )
            if below is None or word not in below.choices:
                break
            command = below.choices[word]
        given = {word for word in words if re.fullmatch(r"--[a-z][a-z-]*", word)} - (
            {"--case"} if demo else set()
        )
        assert given - set(command._option_string_actions) == set(), line


@cache
def anchors(document: Path) -> set[str]:
    """Anchors of the headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_relative_links_resolve(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        there = (document.parent / path).resolve() if path else document
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


def test_figures_are_small_and_used() -> None:
    text = "".join(document.read_text(encoding="utf-8") for document in DOCUMENTS)
    for figure in (ROOT / "docs" / "figures").iterdir():
        assert figure.suffix == ".png" and figure.stat().st_size <= 300_000, figure.name
        assert figure.name in text


@pytest.mark.parametrize(
    "hidden", [("dolfinx",), ("h5py", "petsc4py", "dolfinx", "mpi4py", "matplotlib", "tqdm")]
)
def test_import_needs_numpy_and_scipy_only(hidden: tuple[str, ...]) -> None:
    """With packages hidden, ``import vi_contact`` and the names that need no finite elements are
    there."""
    names = "vc.Condensed, vc.Trapezoidal, vc.march"
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({hidden!r})); import vi_contact as vc; "
        f"{names}"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, encoding="utf-8", timeout=600
    )
    assert done.returncode == 0, done.stderr


PACKAGE = ROOT / "vi_contact"
ROOMS = {  # name -> folder
    stub.parent.name: stub.parent
    for stub in [*PACKAGE.glob("*/__init__.pyi"), *PACKAGE.glob("practice/*/__init__.pyi")]
    if stub.parent.name not in ("laws", "vi", "cli", "run", "exact")  # words, files, variables
}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_names_are_public(document: Path) -> None:
    """Every ``vc.name`` and ``room.name`` that a document writes; the files that it names are
    there."""
    if document.name in ("CHANGELOG.md", "extend.md"):  # old names; its reader's: test_extend
        return
    # tables and keys of a case: others check them
    text = document.read_text(encoding="utf-8")
    text = re.sub(r"--set \S+|^\[[\w.]+\]", "", text, flags=re.MULTILINE)
    unknown = set(re.findall(r"\bvc\.(\w+)", text)) - set(vi_contact.__all__)
    for room, folder in ROOMS.items():
        written = set(re.findall(rf"(?<![\w./]){room}\.([A-Za-z]\w*)", text))
        modules = {path.stem for path in folder.iterdir()}
        path = ".".join(folder.relative_to(ROOT).parts)
        public = set(import_module(path).__all__)
        endings = {"md", "py", "csv", "toml"}
        unknown |= {f"{room}.{name}" for name in written - modules - public - endings}
    assert not unknown
    files = set(re.findall(r"`((?:\w+/)+\w+\.(?:py|toml))`", text))
    tops = (ROOT, PACKAGE, PACKAGE / "practice", ROOT / "tests")
    assert [name for name in files if not any((top / name).exists() for top in tops)] == []


def test_import_alone_is_quick() -> None:
    """It imports nothing outside the standard library, so it costs less than numpy and scipy do."""
    code = "import sys, vi_contact; print({'numpy', 'scipy'} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, encoding="utf-8", timeout=600
    )
    assert done.stdout == "set()\n", done.stderr


IDS = {"reference/verification.md": r"\bV\d+\.\d+[a-z]?\b", "reference/petsc.md": r"\bP[1-9]\d?\b"}


@pytest.mark.parametrize("document", IDS)
def test_every_cited_id_is_explained(document: str) -> None:
    """What code and tests cite is in the table of ids."""
    files = [
        path
        for folder in ("vi_contact", "tests", "demos")
        for path in (ROOT / folder).rglob("*.py")
    ]
    text = "".join(
        path.read_text(encoding="utf-8") for path in files if path.name != Path(__file__).name
    )
    explained = (ROOT / "docs" / document).read_text(encoding="utf-8")
    assert set(re.findall(IDS[document], text)) - set(re.findall(IDS[document], explained)) == set()


def test_supported_versions_are_the_same_everywhere() -> None:
    """README's table, that of install.md and that of releases.md, which gives the first numbers
    only."""
    pages = [
        ROOT / "README.md",
        ROOT / "docs" / "start" / "install.md",
        ROOT / "docs" / "reference" / "releases.md",
    ]
    readme, install, releases = (page.read_text(encoding="utf-8") for page in pages)
    named = re.findall(r"^\| (?:12|13|sid) \| (\S+) \| (\S+) \| (\S+) \|", releases, re.MULTILINE)
    rows = ("DOLFINx", "PETSc, petsc4py (real numbers)", "Python")
    for what, column in zip(rows, zip(*named, strict=True), strict=True):
        for text in (readme, install):
            (row,) = re.findall(rf"^\| {re.escape(what)} \| (.*) \|$", text, re.MULTILINE)
            assert [".".join(one.split(".")[:2]) for one in row.split(" | ")] == list(column), what


def test_version_is_the_same_everywhere() -> None:
    version = vi_contact.__version__
    assert re.search(
        rf'^version = "{re.escape(version)}"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE
    )
    assert re.search(
        rf"^version: {re.escape(version)}$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE
    )
    newest = re.search(r"^## (\S+) \((\S+)\)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert (
        newest
        and newest[1] == version
        and f'date-released: "{newest[2]}"' in (ROOT / "CITATION.cff").read_text()
    )
    for page in ("README.md", "docs/index.md", "docs/reference/releases.md", "SECURITY.md"):
        assert re.search(rf"\b{re.escape(version)}\b", (ROOT / page).read_text(encoding="utf-8")), (
            page
        )
