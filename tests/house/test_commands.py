"""Every command that a page prints has run, and runs here, in a short form, or in the test that the
table names.

docs/run_commands.py gives the commands as they stand and keeps a list of those that succeeded. Here
the commands of ``vi-contact`` are given again, page by page and in this process: runs end after two
steps, starters have large cells, and what draws or evaluates a run has one small run for all pages.
"""

from __future__ import annotations

import ast
import logging
import re
import shlex
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from site_pages import DOCS, ROOT, blocks, loaded

from vi_contact.cli.entry import main, parser, split_petsc

serial = pytest.mark.serial
PARSER = parser()
program: Any = loaded(DOCS / "run_commands.py")
DRAWN = "python3 demos/pictures/practice.py results "  # and the name of a starter
SMALL_RUN = """
[mesh]
type = "WallMesh"
divisions = [2, 3]

[material.concrete]
E = 2.0e10
nu = 0.2
rho = 2400.0

[system]
clamped = "base"

[[contact]]
facets = "face"
obstacle = {type = "HalfSpace", point = [6.0, 0.0], normal = [-1.0, 0.0]}

[excitation]
type = "Harmonic"
amplitude = 3.0
frequency = 0.2
direction = [1.0, 0.0]

[run]
dt = 0.1
steps = 65

[fields]
every = 10

[[record]]
type = "Energy"

[[record]]
type = "Contact"

[[record]]
type = "Probe"
points = {top = [6.0, 9.0]}
acceleration = true

[[record]]
type = "Reactions"
name = "base"
facets = "base"
centre = [0.0, 0.0]

[[record]]
type = "Resultants"
name = "wall"
centre = [6.0, 0.0]

[[check]]
type = "AtRest"
height = 9.0
rho = 1900.0
nu = 0.3
"""


def accepted(command: str) -> str:
    """Why a command of ours cannot be given, or nothing: its parser reads it, and scripts know its
    options."""
    words = shlex.split(command, comments=True)
    while words and (re.match(r"[A-Z_]+=", words[0]) or words[0] in ("mpirun", "srun")):
        start = [k for k, word in enumerate(words) if word in ("vi-contact", "python3")]
        words = words[1:] if "=" in words[0] else words[start[0] :] if start else []
    if words and "/bin/" in words[0]:  # of a virtual environment
        words[0] = {"python": "python3"}.get(Path(words[0]).name, Path(words[0]).name)
    if words[:1] == ["vi-contact"] or words[:3] == ["python3", "-m", "vi_contact"]:
        own, _ = split_petsc(words[1 if words[0] == "vi-contact" else 3 :])
        own = own[: own.index(">")] if ">" in own else own
        try:
            PARSER.parse_args(own)
        except SystemExit as end:
            return "" if end.code in (0, None) else f"status {end.code}"
        except Exception as error:
            return str(error)
        return ""
    if words[:1] in (["bash"], ["python3"]) and len(words) > 1 and not words[1].startswith("-"):
        script = ROOT / words[1]
        if not script.exists():
            return "" if "/" not in words[1] else f"{words[1]} is not there"
        sources = [script] if script.is_file() else [*script.rglob("*.py")]
        if words[1] == "demos/run.sh":
            name = next((word for word in words[2:] if re.fullmatch(r"[a-z]\w*", word)), "")
            if not (ROOT / "demos" / f"{name}.py").is_file():
                return f"there is no demo {name}"
            sources.append(ROOT / "demos" / f"{name}.py")
            # their options are those of the command run, and --case
            if name in ("wall", "channel"):
                given = words[words.index(name) + 1 :]
                if "--case" in given:
                    at = given.index("--case")
                    del given[at : at + 2]
                return accepted(shlex.join(["vi-contact", "run", name, *given]))
        if words[1] == "meshes":  # its options are the fields of meshes
            sources += (ROOT / "vi_contact" / "meshes").glob("*.py")
        text = "".join(source.read_text(encoding="utf-8") for source in sources)
        options = [word for word in words[2:] if re.fullmatch(r"--?[a-z][a-z-]*", word)]
        unknown = [
            word
            for word in options
            if not re.search(rf"(?<![\w-]){word}(?![\w-])", text)
            and not (
                words[1] == "meshes"
                and re.search(rf"^    {word[2:].replace('-', '_')}: ", text, re.MULTILINE)
            )
        ]
        return f"{words[1]} does not know {' '.join(unknown)}" if unknown else ""
    return ""


def here(command: str) -> bool:
    """Whether the command is given in this file."""
    ours = command.startswith(("vi-contact ", DRAWN))
    return ours and program.elsewhere(command) is None and not program.shorter(command)


def by_page() -> dict[str, list[str]]:
    """Page -> commands that are given in its folder: each once, but on every page whose own files
    it may need."""
    found: dict[str, list[str]] = {}
    seen: set[str] = set()
    for page in program.pages():
        name = page.relative_to(ROOT).as_posix()
        own = [
            one
            for one in program.commands(page)
            if here(one)
            and (name in program.FILES and ".toml" in one or program.to_run(one) not in seen)
        ]
        seen |= {program.to_run(one) for one in own}
        found |= {name: own} if own else {}
    return found


# What the list and the tables say
# ------------------------------------------------------------------------------------


@serial
def test_every_command_is_known_and_accepted() -> None:
    """It has run by docs/run_commands.py with the files of today, or something else runs it; after
    a change: python3 docs/run_commands.py --only PAGE, which renews its rows of
    docs/commands_run.txt."""
    ran, wrong, seen = program.recorded(), [], 0
    for page in program.pages():
        for command in program.commands(page):
            seen += 1
            why = program.elsewhere(command)
            if why is None and ran.get(command, ("", ""))[1] != program.key(command):
                wrong.append(
                    f"{page.name}: {command}: nothing has run it" + " so" * (command in ran)
                )
            whole = why not in (program.NAME, program.BEGINNING)
            if whole and (said := accepted(program.to_run(command))):
                wrong.append(f"{page.name}: {command}: {said}")
    assert wrong == [] and seen > 150


@serial
def test_what_is_only_named_is_there() -> None:
    """A word of a page such as ``vi-contact run --check`` is a command with this option, or
    several."""
    every = {one for page in program.pages() for one in program.commands(page)}
    named = {one for one in every if program.elsewhere(one) == program.NAME}
    assert len(named) > 10
    for command in named:
        *words, last = command.removeprefix("vi-contact ").split()
        for end in last.split("|"):
            asked = [*words, end, *([] if end.startswith("-") and "=" not in end else ["--help"])]
            with pytest.raises(SystemExit) as ended:
                PARSER.parse_args([*asked, *(["x"] if asked[-1] == "--solver" else []), "--help"])
            assert ended.value.code == 0, command


@serial
def test_what_runs_elsewhere_is_on_a_page_and_there() -> None:
    """No row without a command, and the tests and programs that the rows name exist."""
    every = {command for page in program.pages() for command in program.commands(page)}
    for form, why in [
        *program.ELSEWHERE.items(),
        *((form, f"tests/{why}") for form, why in program.SHORTER.items()),
    ]:
        assert any(re.fullmatch(form, command) for command in every), form
        for name in re.findall(r"[\w/*.]+\.(?:py|sh)\b", why):
            assert (ROOT / name).is_file(), name
        for test in re.findall(r"tests/(\S+\.py::\w+)", why):
            assert source(test), test
    demos = {path.stem for path in (ROOT / "demos").glob("*.py")}
    assert set(program.DEMOS) == demos


@serial
def test_the_tests_of_commands_give_them() -> None:
    """Each command has one place where the suite runs it; a test that is named does what its
    command does."""
    checked = 0
    for command in {one for page in program.pages() for one in program.commands(page)}:
        why, test = program.elsewhere(command), program.shorter(command)
        if why is None and not here(command) and not re.match(r"export |vi-contact ", command):
            assert test, f"{command}: say in SHORTER which test runs it"
        if test:
            assert re.search(needle(command), source(test)), f"{command}: {test}"
            checked += 1
    assert checked > 80
    with pytest.raises(AssertionError):
        source("house/test_demos.py::test_of_nothing")


def needle(command: str) -> str:
    """What the source of a test says that does what the command does."""
    if found := re.match(r"bash demos/run\.sh (?:-n \d )?(\w+)$", command):
        return rf'demo\("{found[1]}"\)(?s:.*)main\(quick=True'
    if found := re.match(r"bash demos/run\.sh (?:-n \d )?(\w+)", command):
        return rf'"{found[1]}(\.py)?"'
    if found := re.match(r"python3 benchmarks/(?:peers/)?(\w+)\.py", command):
        return rf"\b{found[1]}\b"
    if found := re.match(r"(?:mpirun -n 3 )?vi-contact (\w+)", command):
        # by the command new, which tests give again
        printed = {"run": "[01]", "report": "2"}.get(found[1], "")
        return rf'"{found[1]}"|main\(\[?\*?commands\[{printed}\]'
    return ""


def source(test: str) -> str:
    """The function of a test with its decorators, and the functions and constants of its file that
    it needs."""
    file, _, name = test.partition("::")
    text = (ROOT / "tests" / file).read_text(encoding="utf-8")
    parts = {}
    for node in ast.parse(text).body:
        first = min([node.lineno, *(one.lineno for one in getattr(node, "decorator_list", []))])
        whole = "\n".join(text.splitlines()[first - 1 : node.end_lineno])
        if isinstance(node, ast.FunctionDef):
            parts[node.name] = whole
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            parts |= {target.id: whole} if isinstance(target, ast.Name) else {}
    assert name in parts, f"there is no {test}"
    used, new = set[str](), {name}
    while new:
        used |= new
        words = {word for one in new for word in re.findall(r"\w+", parts[one])}
        new = words & set(parts) - used
    return "\n".join(parts[one] for one in sorted(used))


@serial
def test_rows_of_commands_that_fail_are_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kept are rows of commands that pages have and that succeeded when they were last run, with
    today's key."""
    monkeypatch.setattr(program, "NOTE", tmp_path / "list.txt")
    kept, failed = "vi-contact cases", "vi-contact new pier"
    (tmp_path / "list.txt").write_text(
        f"# one\n   1 00000000 {kept}\n   1 00000000 {failed}\n   1 00000000 ls\n"
    )
    program.keep({failed: None, "vi-contact schema": 1.2})
    assert program.recorded() == {
        kept: ("1", "00000000"),
        "vi-contact schema": ("1", program.key("vi-contact schema")),
    }


@serial
def test_a_key_is_that_of_the_files_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another case file, or another command before, is another key; a command without files keeps
    its own."""
    command, other = "vi-contact run layer.toml --out results/layer", "vi-contact cases"
    before, alone = program.key(command), program.key(other)
    monkeypatch.setattr(program, "contents", lambda page: {"layer.toml": "dt = 1.0"})
    assert program.key(command) != before and program.key("vi-contact schema") != alone
    changed = program.key(command)
    monkeypatch.setitem(program.BEFORE, "docs/guide/checks.md", ["vi-contact new wall"])
    assert program.key(command) != changed


@serial
def test_commands_that_do_not_exist_are_found() -> None:
    """The check has teeth, and each kind of line is taken for a command."""
    for command in (
        "vi-contact run wall --stepz 3",
        "vi-contact paint results/wall",
        "bash demos/run.sh wall --stepz 1",
        "bash docs/built.sh",
        "python3 benchmarks/scale.py --wrong",
        "mpirun -n 3 vi-contact run",
        "PYTHONPATH=. vi-contact runs wall.toml",
        "venv/bin/vi-contact --versions",
        "bash tests/run.sh --quik",
    ):
        assert accepted(command), command
    for command in (
        "vi-contact run wall --steps 3",
        "bash demos/run.sh -n 3 wall --case b",
        "bash tests/run.sh -k a",
    ):
        assert not accepted(command), command
    assert program.elsewhere("vi-contact run wall --steps 4") is None


@serial
def test_commands_of_the_gallery_are_those_of_its_list() -> None:
    """What a page prints in sh blocks is what docs/gallery/make.py runs, or the same on two ranks
    or other words that its parser knows."""
    made = loaded(DOCS / "gallery" / "make.py").entries()
    for page in sorted((DOCS / "gallery").glob("*.md")):
        ours = {
            line
            for entry in made.values()
            if entry["page"].partition("#")[0] == page.name
            for line in entry["commands"]
        }
        lines = [
            " ".join(re.sub(r"\s+#.*", "", line).split())
            for block in blocks(f"docs/gallery/{page.name}", "sh")
            for line in block.splitlines()
            if line.strip()
        ]
        assert ours <= set(lines), page.name
        assert [line for line in lines if accepted(line)] == [], page.name
        assert [
            line
            for line in lines
            if line not in ours
            and re.sub(r" -n \d+", "", line) not in ours
            and program.elsewhere(line) is None
            and line not in program.recorded()
        ] == [], page.name


@serial
def test_the_container_runs_scripts() -> None:
    """Of the recipe in docs/guide/clusters.md only the commands can be checked without a container
    program."""
    (recipe,) = blocks("docs/guide/clusters.md", "dockerfile")
    (line,) = re.findall(r"^RUN (.*)$", recipe, re.MULTILINE)
    scripts = [one.strip() for one in line.split("&&")]
    assert [accepted(one) for one in scripts] == [""] * 3 and scripts[0] == "bash demos/run.sh wall"


# What is given here
# --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a run of 6.5 s, with all columns that pages ask for."""
    pytest.importorskip("dolfinx")
    folder = tmp_path_factory.mktemp("small")
    (folder / "case.toml").write_text(SMALL_RUN, encoding="utf-8")
    assert main(["run", str(folder / "case.toml"), "--out", str(folder / "run"), "--quiet"]) == 0
    yield folder / "run"


def short(words: list[str]) -> list[str]:
    """The words of a command as they stand, and what makes its run short."""
    if words[0] != "run" or "--help" in words:
        return words
    case = Path(words[1])
    if case.name == "house.toml":  # has stages
        return [*words, "--quiet", "--set", "stage.3.run.t_end=", "--set", "stage.3.run.steps=2"]
    more = (
        ["--set", "mesh.refine=0"]
        if case.is_file() and "refine =" in case.read_text(encoding="utf-8")
        else []
    )
    return [*words, *more, "--quiet", "--set", "run.t_end=", "--steps", "2"]


@serial
@pytest.mark.slow
@pytest.mark.parametrize("page", by_page())
def test_commands_of_a_page_run(
    page: str,
    small_run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In the order of the page, in a folder as its reader has it. What they write is there."""
    folder = tmp_path / "reader"
    program.furnish(folder, ROOT / page, ROOT)
    monkeypatch.chdir(folder)
    for starter in re.findall(
        r"^vi-contact new (\w+)", "\n".join(program.BEFORE.get(page, [])), re.MULTILINE
    ):
        assert main(["new", starter]) == 0
    if page == "docs/guide/clusters.md":
        shutil.copytree("dam", ".", dirs_exist_ok=True)
    if page == "docs/guide/studies.md":
        exec(
            compile(Path("make.py").read_text(encoding="utf-8"), "make.py", "exec"),
            {"__name__": "__main__"},
        )
    for command in by_page()[page]:
        if command.startswith(DRAWN):
            name = command.removeprefix(DRAWN)
            if not Path(name).exists():
                assert main(["new", name]) == 0 and main(short(["run", f"{name}/{name}.toml"])) == 0
            loaded(ROOT / "demos" / "pictures" / "practice.py").main(Path("results"), name)
            assert Path("results", f"practice_{name}.png").stat().st_size > 5_000
            continue
        words = shlex.split(program.to_run(command))[1:]
        words = words[: words.index(">")] if ">" in words else words
        if words[0] in ("post", "plot", "film"):
            run = Path(next(word for word in words if word.startswith("results/")))
            if not (run / "history.csv").is_file() or words[0] != "post":
                shutil.copytree(small_run, run, dirs_exist_ok=True)
        if words[0] == "film" and not shutil.which("ffmpeg"):
            words = [word.replace(".mp4", ".gif") for word in words]
        if words[0] == "run" and "/" in words[1] and not Path(words[1]).is_file():
            assert main(["new", words[1].partition("/")[0]]) == 0
        capsys.readouterr()
        try:
            status = main(short(words))
        except SystemExit as end:  # of --help and --version
            status = end.code
        said = capsys.readouterr()
        assert status == 0, f"{command}\n{said.err}"
        assert said.out or words[0] == "motion" or "--quiet" in words, command
        for name in re.findall(r"(?:picture|table|output): (\S+)$", said.out, re.MULTILINE):
            assert Path(name).exists(), command


def test_a_run_on_several_ranks(
    comm: Any, shared_tmp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command run, and README's program."""
    pytest.importorskip("dolfinx")
    monkeypatch.chdir(shared_tmp)
    assert main(["run", "wall", "--steps", "2", "--quiet", "--out", "wall"]) == 0
    code = blocks("README.md", "python")[0]
    assert code.count("steps=400") == 1
    exec(
        compile(code.replace("steps=400", "steps=4"), "first.py", "exec"), {"__name__": "__main__"}
    )
    comm.Barrier()
    assert (shared_tmp / "wall" / "history.csv").is_file()


@serial
def test_a_figure_of_the_theory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The one that docs/theory/index.md draws; its page says what it shows."""
    pytest.importorskip("dolfinx")
    command = "python3 docs/theory/figures.py step --out results/theory"
    assert command in program.commands(DOCS / "theory" / "index.md")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", command.split()[1:])
    # the program changes it
    monkeypatch.setattr(logging.getLogger("vi_contact"), "level", logging.WARNING)
    assert loaded(DOCS / "theory" / "figures.py").main() == 0
    assert "step: " in capsys.readouterr().out and Path("results/theory/theory_step.png").is_file()
