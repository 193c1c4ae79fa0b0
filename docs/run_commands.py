#!/usr/bin/env python3
"""Run the commands that the documents print, as a reader would, and tell which of them fail.

    python3 docs/run_commands.py                                      all pages
    python3 docs/run_commands.py --only docs/guide/check.md README.md these alone
    python3 docs/run_commands.py --list                               what runs each command; runs none

A command is a line of a ``sh`` block, an indented line that begins with the name of a program, or a
span of code that does. Each page has a folder of its own, which looks like a clone: what the page's
blocks say is in files there, and so are records under the names of the page. What is not run here
is in ELSEWHERE, with what runs it or why nothing does. Where a page shows in a ``text`` block or a
table what its commands print, the lines are compared. Without ``--only`` the snippets of Python run
too, in the length that the pages say. A run takes about an hour.

docs/commands_run.txt keeps the commands that succeeded, with their seconds and a key of the files
and commands of the page that they need. A command that fails loses its row. The suite does not
trust this list: tests/house/test_commands.py runs each command of ``vi-contact`` in a short form,
and looks for the tests that DEMOS, BENCHMARKS and SHORTER name for the others.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
NOTE = ROOT / "docs" / "commands_run.txt"
LIMIT = 900  # s
# pages of the site that stand above docs/
ABOVE = ("README", "CONTRIBUTING", "CHANGELOG", "SUPPORT", "SECURITY")
NAME, BEGINNING = "the name of a command", "the beginning of a command"
PROGRAM = (
    r"(?:[A-Z_]+=\S+ "
    r")*(?:(?:bash|vi-contact|python3|mpirun|srun|sbatch|git|pip|sudo|apt|apt-get|docker|podman|"
    r"apptainer|export|cd|\.venv/\S+|venv/\S+|\. venv/\S+)(?= )|/usr/bin/python3 )"
)
JOINED = re.compile(r"\s*\\\n\s*")  # lines that end with a backslash
FENCE = re.compile(r"^```(\S*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)

ELSEWHERE = {  # what fits the whole command: what runs it, or why nothing here does
    # other programs of the project run these
    r"bash demos/run\.sh "
    r"\w+": "docs/gallery/make.py runs every demo and compares what it prints with its page; DEMOS",
    r"(VI_CONTACT_RANKS=1 )?bash tests/run\.sh.*|bash tests/(?:lint|coverage)\.sh|bash "
    r"\.ci/run": ".ci/run runs them",
    r"bash docs/build\.sh|bash install/\w+\.sh": ".ci/run builds the site and installs its tools",
    r"python3 "
    r"docs/make_schema\.py": "tests/studies/test_schema.py::test_the_schema_is_that_of_the_signatures",
    r"python3 "
    r"docs/make_glossary\.py": "tests/house/test_glossary.py::test_entries_are_in_order_and_tables_are_those_of_the_entries",
    r"python3 docs/gallery/make\.py( --index| --only NAME)?": "docs/build.sh runs it",
    r"python3 "
    r"docs/notebooks/run\.py": "tests/house/test_notebooks.py::test_a_notebook_runs_in_jupyter",
    r"PYTHONPATH=\. vi-contact run wall\.toml --allow mine "
    r".*": "tests/house/test_extend.py::test_the_command_computes_the_same",
    r"git (diff|tag|archive) .*": "a step of a release",
    r"python3 docs/run_commands\.py.*": "this program",
    r"bash tests/fuzz\.sh .*": "as many runs of fuzz tests as asked for; "
    "tests/house/test_fuzz_support.py::test_the_script_asks_for_a_seed",
    r"\.venv/lint/bin/griffe .*|pip install "
    r"'dolfinx-solver-real.*": "asks a package index",
    # these need what a test has not
    r"git clone ADDRESS .*|cd "
    r"vi_contact": "the address is the reader's own; done by hand in fresh trees",
    r"python3 -m venv .*|pip install (--no-deps )?\.|venv/bin/pip install \.|venv/bin/vi-contact "
    r".*|"
    r"\. venv/bin/activate": "tests/house/test_install.py::test_pip_installs_the_command",
    r"pip install (h5py|pyvista|\"vi-contact\[report\]\")|\.venv/site/bin/pip "
    r".*": "asks a package index",
    r"\.venv/site/bin/jupyter notebook .*": "stays open, with a browser",
    r"\.venv/report/bin/python .*|\.venv/site/bin/jupytext "
    r".*": "needs what install/report.sh or install/site.sh makes",
    r"(srun|sbatch) "
    r".*|.*\$SLURM_\w+.*": (
        "needs Slurm; without it: tests/run/test_wall_time.py::test_the_batch_script_of_the_guide"
    ),
    r"mpirun -n 64 .*|XDG_CACHE_HOME=\$HOME/forms .*": "needs a cluster",
    r"(docker|apptainer) .*": "needs a container program",
    r"vi-contact report \S+ --out \S+\.html": "needs what install/report.sh brings; "
    "tests/plots/test_web_page.py::test_every_text_is_escaped_and_nothing_is_loaded",
    r"bash demos/run\.sh|python3 -m|pip install|mpirun -n|mpirun --mca \S+ \S+": BEGINNING,
    # too long or too large
    r"bash benchmarks/peers/run\.sh.*": "installs other programs; tests/benchmarks/test_peers.py::"
    "test_our_rows_are_measured, tests/benchmarks/test_peers.py::"
    "test_a_peer_that_is_not_there_becomes_rows_that_say_so",
    r"python3 benchmarks/(peers/)?(?!wall_schemes)\w+\.py.*": "minutes to hours; BENCHMARKS",
    r"bash demos/run\.sh (-n 2 )?raft --size "
    r".*": "minutes and up to 30 GB; docs/gallery/make.py runs the small one",
    r"vi-contact ida wall\.toml --motions records "
    r".*": (
        "hours; the page's small one: "
        "tests/studies/test_ida.py::test_the_example_gives_a_tidy_table"
    ),
}
NAMES = (  # commands of ours that are named on a page and not given there
    r"vi-contact (run|new|report|film|ida|post|plot|post checks|run --check|run CASE "
    r"--solver|report --refine|"
    r"ida --fragility COLUMN:WAY=LIMIT|motion info|motion spectrum|(new|motion) \w+(\|\w+)+)"
)
# the test that runs a demo in its short form, main(quick=True), on two ranks too where it is not
# serial
DEMOS = {
    "wall": "house/test_demos.py::test_the_wall_demo",
    "channel": "house/test_demos_channel.py::test_the_channel_demo",
    "raft": "house/test_demo_raft.py::test_the_raft_demo",
    "tower_on_soil": "house/test_demo_tower_on_soil.py::test_the_tower_on_soil_demo",
    "bouncing_bar": "house/test_demos.py::test_the_bouncing_bar_demo",
    "rocking_block": "models/test_rocking_block_model.py::test_demo",
    "hertz_impact": "house/test_demos.py::test_the_hertz_impact_demo",
    "tennis_ball": "validation/test_tennis_ball.py::test_the_tennis_ball_demo",
    "square": "validation/test_pressed_square.py::test_the_square_demo",
    "concrete_on_steel": "validation/test_concrete_on_steel.py::test_the_concrete_demo",
    "concrete_in_concrete": "validation/test_concrete_in_concrete.py::test_the_embedded_demo",
    "boundary_elements": "house/test_demo_boundary_elements.py::test_the_boundary_elements_demo",
    "structures": "house/test_demo_structures.py::test_the_demo_of_structures",
    "warming": "house/test_demo_warming.py::test_warming",
    "obstacle": "house/test_demos_bounds.py::test_the_membrane_over_a_ball",
    "torsion": "house/test_demos_bounds.py::test_torsion",
    "crack": "house/test_demos_bounds.py::test_the_bar_that_cracks",
    "timoshenko_beam": "house/test_demos_beam.py::test_the_timoshenko_beam_demo",
    "beam_statements": "beam/test_beam_statements.py::test_the_demo",
    "particle_layer": "house/test_demos_layer.py::test_the_particle_demo",
    "rigid_body_layer": "house/test_demos_layer.py::test_the_rigid_body_demo",
    "contact_layer": "house/test_demos_layer.py::test_the_contact_layer_demo",
}
BENCHMARKS = {  # the test that runs a benchmark, or one of its rows, with small sizes
    "obstacle": "vi/test_plain_snesvi.py::test_units_and_warm_starts",
    "load_steps": "vi/test_load_steps.py::test_beside_snes",
    "scale": "validation/test_scale_ratios.py::test_counts_are_those_of_the_table",
    "long_steps": "validation/test_long_steps.py::test_the_scheme_of_the_warning_creates_none",
    "bem_multiplier": "bem/test_multiplier_mesh.py::test_the_benchmark",
    "wall_schemes": "house/test_snippets.py::test_the_schemes_of_the_first_wall",
    "peers/figure": "benchmarks/test_peers.py::test_the_figure_is_drawn_from_the_stored_run",
    "peers/compare": "benchmarks/test_peers.py::test_page_says_what_was_measured",
    "peers/thrown_reference": "benchmarks/test_peers.py::test_thrown_reference_is_its_command_s",
}
SMALL = "benchmarks/test_small.py::test_a_benchmark_runs_with_small_sizes"  # the others
# commands that run here and take longer than a test may: a test that gives them, or less of the
# same
SHORTER = {
    r"mpirun -n 3 python3 "
    r".*": "house/test_documents.py::test_first_example_prints_what_readme_says",
    r"mpirun -n 3 vi-contact run .*": "house/test_commands.py::test_a_run_on_several_ranks",
    r"bash demos/run\.sh -n 3 wall --case b": "house/test_demos.py::test_the_wall_demo",
    r"bash demos/run\.sh wall --case b "
    r".*": "house/test_demos.py::test_the_command_line_of_the_wall_demo",
    r"bash demos/run\.sh channel --.*": "models/test_channel.py::test_the_command",
    r"bash demos/run\.sh beam_statements --json": "beam/test_beam_statements.py::test_the_demo",
    r"python3 form\.py": "house/test_ten_minutes.py::test_your_form",
    r"python3 docs/notebooks/run\.py "
    r"bouncing_bar": "house/test_notebooks.py::test_the_quick_ones_run_as_programs",
    r"python3 docs/theory/figures\.py step "
    r".*": "house/test_commands.py::test_a_figure_of_the_theory",
    r"python3 meshes .*|vi-contact run demos/cases/raft\.toml "
    r".*": "house/test_demo_raft.py::test_the_case_of_the_raft",
    r"vi-contact ida wall\.toml --motions motion_1.at2 "
    r".*": "studies/test_ida.py::test_the_example_gives_a_tidy_table",
    r"vi-contact report (\S+)": "plots/test_report.py::test_commands",
    r"vi-contact report (\S+) "
    r"--refine": "studies/test_refinement.py::test_both_columns_and_their_difference",
    r"vi-contact run pounding/pounding\.toml.*": "studies/test_starters.py::test_two_frames_pound",
    r"vi-contact run "
    r"pier/pier\.toml": "studies/test_practice.py::test_from_new_to_report_in_four_commands",
    r"vi-contact run (wall/wall|dam)\.toml "
    r"--check": "studies/test_practice.py::test_starter_is_written_and_checked",
    r"vi-contact run channel "
    r"--check": "studies/test_description.py::test_the_page_shows_what_the_command_tells",
}
TEMPLATES = {
    "post checks DIR": "post checks results/checks",
    "DIR": "results/run",
    "CASE": "wall",
    "FILE": "elcentro.at2",
    " [COLUMN…]": "",
}
RUN = "vi-contact run wall --steps 100 --quiet --out results/run"
CHECKED = [
    "vi-contact new pier",
    "mv pier checked",
    "vi-contact run checked/pier.toml --quiet --out results/checks",
]
# page -> name -> (language, number of the block, page if another)
FILES: dict[str, dict[str, tuple[Any, ...]]] = {
    "README.md": {"first.py": ("python", 0)},
    "docs/start/install.md": {"script.py": ("python", 0, "README.md")},
    "docs/guide/checks.md": {"layer.toml": ("toml", 0)},
    "docs/guide/stages.md": {"house.toml": ("toml", 0)},
    "docs/guide/studies.md": {
        "wall.toml": ("toml", 0),
        "make.py": ("python", 0),
        "dam.toml": ("toml", 1),
        "dam.geo": ("c++", 0),
    },
    "docs/start/ten_minutes_wall.md": {"wall.toml": ("toml", 0), "wall.geo": ("c++", 0)},
    "docs/start/ten_minutes_form.md": {"form.py": ("python", 0)},
}
BEFORE = {  # page -> what a reader has done there, or on another page, before its commands
    "docs/guide/clusters.md": ["vi-contact new dam", "cp dam/* ."],
    "docs/guide/studies.md": ["python3 make.py", *CHECKED],
    "docs/guide/checks.md": ["vi-contact run layer.toml --quiet --out results/checks"],
    "docs/guide/report.md": [
        "vi-contact new wall",
        "mv wall own",
        "vi-contact run own/wall.toml --quiet --out results/run",
    ],
    "docs/guide/practice.md": [
        f"vi-contact {words}"
        for name in ("dam", "pier")
        for words in (f"new {name}", f"run {name}/{name}.toml --quiet")
    ],
    "docs/start/ten_minutes_wall.md": ["vi-contact run wall.toml --quiet --out results/higher"],
    "docs/guide/outputs.md": ["python3 outputs.py", *CHECKED],
}
COMPARED = (  # their text is what commands print
    "docs/guide/check.md",
    "docs/guide/checks.md",
    "docs/start/ten_minutes_wall.md",
)


def pages() -> list[Path]:
    """Return all pages of the site."""
    return [*(ROOT / f"{name}.md" for name in ABOVE), *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(text: str, language: str) -> list[str]:
    """Return the fenced blocks of a language."""
    return [body for name, body in FENCE.findall(text) if name == language]


@functools.cache
def commands(page: Path) -> tuple[str, ...]:
    """Return the commands of a page in their order, each once, without comments and on one line."""
    text = page.read_text(encoding="utf-8")
    fenced = [line for body in blocks(text, "sh") for line in JOINED.sub(" ", body).splitlines()]
    rest = FENCE.sub("", text)
    lines = [line.strip() for line in JOINED.sub(" ", rest).splitlines() if line.startswith("    ")]
    indented = [line for line in lines if re.match(PROGRAM, line)]
    prose = "\n".join(line for line in rest.splitlines() if not line.startswith("    "))
    parts = re.split(r"\n\s*\n|\n(?=- |\|)", prose)
    spans = [" ".join(span.split()) for part in parts for span in re.findall(r"`([^`]+)`", part)]
    lines = [*fenced, *indented, *(span for span in spans if re.match(PROGRAM, span))]
    found = (" ".join(re.sub(r"\s+#.*|   .*", "", line).split()) for line in lines)
    return tuple(dict.fromkeys(one for one in found if one))


def elsewhere(command: str) -> str | None:
    """Return what runs a command instead of this program, or why nothing does; None if this program
    runs it."""
    if re.fullmatch(NAMES, command):
        return NAME
    return next((why for form, why in ELSEWHERE.items() if re.fullmatch(form, command)), None)


def shorter(command: str) -> str | None:
    """Return the test that gives a command, or less of the same; None if there is no such test."""
    if found := re.fullmatch(r"bash demos/run\.sh (?:-n 2 )?(\w+)", command):
        return DEMOS[found[1]]
    if found := re.match(r"python3 benchmarks/([\w/]+)\.py", command):
        return BENCHMARKS.get(found[1], SMALL)
    return next((test for form, test in SHORTER.items() if re.fullmatch(form, command)), None)


def key(command: str) -> str:
    """Return a hash of the command and of what the pages with this command have in their folders
    before it."""
    told = hashlib.sha256(to_run(command).encode())
    for page in pages():
        name = page.relative_to(ROOT).as_posix()
        if (name in FILES or name in BEFORE) and command in commands(page):
            told.update("\n".join([*contents(page).values(), *BEFORE.get(name, [])]).encode())
    return told.hexdigest()[:8]


def environment(bin_folder: Path, tree: Path) -> dict[str, str]:
    """Return the environment of install/setup.sh, in which ``vi-contact`` is the command of the
    tree."""
    asked = ["bash", "-c", '. "$0/install/setup.sh"; vi_setup >&2; env -0', str(tree)]
    said = subprocess.run(asked, capture_output=True, check=True)
    found = dict(one.split("=", 1) for one in said.stdout.decode().split("\0") if "=" in one)
    bin_folder.mkdir()
    for name, does in (("vi-contact", '-m vi_contact "$@"'), ("python3", '"$@"')):
        (bin_folder / name).write_text(
            f"#!/bin/bash\nexec /usr/bin/python3 {does}\n", encoding="utf-8"
        )
        (bin_folder / name).chmod(0o755)
    return found | {
        "PATH": f"{bin_folder}:{found['PATH']}",
        "PYTHONPATH": str(tree),
        "PYTHONIOENCODING": "utf-8",
    }


def furnish(folder: Path, page: Path, tree: Path) -> None:
    """Make the folder of a page: links to what is in a clone, records, and files of what its blocks
    say."""
    folder.mkdir(parents=True)
    for one in tree.iterdir():
        if one.name not in ("results", "build"):  # of commands that write into the clone
            (folder / one.name).symlink_to(one)
    samples = "\n".join(f"{0.03 * (-1) ** (k // 5) * (1 - k / 100):.4f}" for k in range(100))
    beside = (
        [f"{tree}/demos/cases/{one}.at2" for one in ("E", "N", "UP")]
        if page.name == "raft.md"
        else []
    )
    for name in ("elcentro.at2", "h.at2", "v.at2", *beside):
        (folder / name).write_text(
            f"A motion\nunits of g\nNPTS= 100, DT= .01000 SEC\n{samples}\n", encoding="utf-8"
        )
    for file, text in contents(page).items():
        (folder / file).write_text(text, encoding="utf-8")
    if page.name == "outputs.md":  # it continues the example of README.md
        (first,) = blocks((ROOT / "README.md").read_text(encoding="utf-8"), "python")
        text = page.read_text(encoding="utf-8")
        ready = first[: first.index("solution = ")] + blocks(text, "python")[0].replace(
            'out="results/engineering"', 'out="results/run", fields=fem.XDMF(every=10)'
        )
        (folder / "outputs.py").write_text(ready, encoding="utf-8")


def contents(page: Path) -> dict[str, str]:
    """Return file -> text of what a reader of the page has copied from blocks."""
    found = {}
    for file, (language, number, *other) in FILES.get(
        page.relative_to(ROOT).as_posix(), {}
    ).items():
        there = ROOT / other[0] if other else page
        found[file] = blocks(there.read_text(encoding="utf-8"), language)[number]
    return found


def to_run(command: str) -> str:
    """Return a command with the words that stand for a reader's own replaced."""
    for word, given in TEMPLATES.items():
        command = re.sub(rf"(?<![A-Z_]){re.escape(word)}(?![A-Z])", given, command)
    return command.replace("h.smc,v.smc", "h.at2,v.at2")


def run(
    page: Path, folder: Path, tree: Path, env: dict[str, str]
) -> tuple[dict[str, float | None], list[str]]:
    """Run the commands of a page: (seconds of each that succeeded, None for the others; what
    failed)."""
    name, wrong, printed = page.relative_to(ROOT).as_posix(), [], [""]
    told: dict[str, float | None] = {}
    asked = [one for one in commands(page) if elsewhere(one) is None]
    if not asked:
        return told, wrong
    furnish(folder, page, tree)
    before = BEFORE.get(name, [])
    if (
        any("results/run" in to_run(one) for one in asked)
        and not any("results/run" in one for one in before)
        and (name != "docs/guide/outputs.md")
    ):
        before = [*before, RUN]
    for command in [*before, *asked]:
        start, given = time.monotonic(), to_run(command)
        if not shutil.which("ffmpeg"):
            given = given.replace(".mp4", ".gif")  # as the page says
        try:
            done = subprocess.run(
                ["bash", "-c", given],
                cwd=folder,
                env=env,
                stdin=subprocess.DEVNULL,
                check=False,
                capture_output=True,
                encoding="utf-8",
                timeout=LIMIT,
            )
            status, said = done.returncode, done.stderr or done.stdout
            printed += done.stdout.splitlines()
        except subprocess.TimeoutExpired:
            status, said = -1, f"longer than {LIMIT} s"
        seconds = time.monotonic() - start
        print(f"{name}: {seconds:6.1f} s  {'' if status == 0 else 'FAILED '}{command}", flush=True)
        if status:
            wrong.append(f"{name}: {command}\n{said.strip()[-600:]}")
        if command in asked:
            told[command] = None if status else seconds
    return told, wrong + [f"{name}: no command printed: {line}" for line in missing(page, printed)]


def missing(page: Path, printed: Sequence[str]) -> list[str]:
    """Return the lines of a page that its commands should have printed and did not."""
    text = page.read_text(encoding="utf-8")
    said = [line for block in blocks(text, "text") for line in block.splitlines() if line.strip()]
    if page.relative_to(ROOT).as_posix() not in COMPARED:
        said = []
    # benchmarks/wall_schemes.py has run
    if any(line.startswith("| `Trapezoidal` |") for line in printed):
        said += re.findall(
            r"^\| `[^|]*\| -[\d.]+ to [^|]*\| -[\d.]+ to .* %.*\|$", text, re.MULTILINE
        )
    sys.path.insert(0, str(ROOT / "docs" / "gallery"))
    from make import agree  # type: ignore[import-not-found]

    return [
        line
        for line in said
        if "wall time per step" not in line and not any(agree(line, one) for one in printed)
    ]


def run_snippets(env: dict[str, str]) -> list[str]:
    """Run what tests/house/test_snippets.py runs of Python, in its whole length; return what
    failed."""
    command = [
        "/usr/bin/python3",
        "-m",
        "pytest",
        "-q",
        "tests/house/test_snippets.py",
        "-k",
        "a_snippet_runs",
    ]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=env | {"VI_CONTACT_WHOLE": "1"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    print(f"snippets in their whole length: {done.stdout.strip().splitlines()[-1]}", flush=True)
    return [done.stdout[-3000:]] if done.returncode else []


def recorded() -> dict[str, tuple[str, str]]:
    """Return command -> (seconds, key) of the list that is kept."""
    lines = NOTE.read_text(encoding="utf-8").splitlines() if NOTE.is_file() else []
    rows = (line.split(maxsplit=2) for line in lines if line[:1] != "#")
    return {command: (seconds, made) for seconds, made, command in rows}


def keep(told: dict[str, float | None]) -> None:
    """Write the list: what succeeded when it was last run, of the commands that pages still
    have."""
    now = {one for page in pages() for one in commands(page) if elsewhere(one) is None}
    every = recorded()
    for command, seconds in told.items():
        every.pop(command, None)
        if seconds is not None:
            every[command] = f"{seconds:.0f}", key(command)
    lines = [
        "# seconds, key and command, of all that docs/run_commands.py has run on a busy machine"
    ]
    lines += [f"{every[one][0]:>4} {every[one][1]} {one}" for one in sorted(now & set(every))]
    NOTE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> int:
    """Do what the command line says."""
    options = argparse.ArgumentParser(
        prog="run_commands.py", description=(__doc__ or "").splitlines()[0]
    )
    options.add_argument("--only", nargs="+", metavar="PAGE", help="these pages alone")
    options.add_argument("--list", action="store_true", help="what runs each command; runs none")
    given = options.parse_args()
    chosen = [
        page
        for page in pages()
        if not given.only or page.relative_to(ROOT).as_posix() in given.only
    ]
    if given.list:
        for page in chosen:
            for command in commands(page):
                test = shorter(command)
                print(
                    f"{page.relative_to(ROOT)}: {command}\n    {elsewhere(command) or 'run here'}"
                    + (f"\n    tests/{test}" if test else "")
                )
        return 0
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch) / "tree"
        tree.mkdir()
        files = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, capture_output=True, encoding="utf-8", check=True
        ).stdout
        for name in files.splitlines():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        env = environment(Path(scratch) / "bin", tree)
        for page in chosen:
            folder = (
                Path(scratch) / "pages" / "_".join(page.relative_to(ROOT).with_suffix("").parts)
            )
            told, failed = run(page, folder, tree, env)
            wrong += failed
            keep(told)
        if not given.only:
            wrong += run_snippets(env)
    print("\n\n".join(wrong), file=sys.stderr)
    print(f"{len(wrong)} commands or lines failed")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
