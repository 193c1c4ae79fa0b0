"""Every fenced block of the pages has something that runs it, and what no other test runs is run
here, shortened.

VI_CONTACT_WHOLE=1 runs it as the pages say, without shortening; docs/run_commands.py does that
before a release. tests/house/test_commands.py runs the commands of the pages.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from site_pages import DOCS, FENCE, ROOT, blocks, loaded

from vi_contact.cli.entry import main
from vi_contact.core.errors import InputError
from vi_contact.studies import read_case
from vi_contact.studies.cases.own_classes import GROUP

pytestmark = pytest.mark.serial
PAGES = loaded(DOCS / "run_commands.py").pages()
RUN = {  # page, its blocks -> what runs them, or compares them with a run
    "README.md": {
        "python 1, text 1": "house/test_documents.py::test_first_example_prints_what_readme_says"
    },
    "docs/guide/bounds.md": {
        "python 2, text 2": "house/test_documents.py::test_programs_print_what_their_pages_say"
    },
    "docs/guide/bring_your_own.md": {
        "python 12, text 1": "house/test_documents.py::test_programs_print_what_their_pages_say"
    },
    "docs/guide/check.md": {
        "sh 1": "commands",
        "text 1": "studies/test_description.py::test_the_page_shows_what_the_command_tells",
    },
    "docs/guide/checks.md": {
        "toml 1, text 1": "studies/test_case_checks.py::test_the_page_prints_what_it_says"
    },
    "docs/guide/clusters.md": {
        "bash 1": "run/test_wall_time.py::test_the_batch_script_of_the_guide",
        "toml 1": "house/test_snippets.py::test_tables_of_the_guides_stand_in_case_files",
        "dockerfile 1": "house/test_commands.py::test_the_container_runs_scripts",
    },
    "docs/guide/extend.md": {"python 7, toml 4, text 3, sh 1": "house/test_extend.py::folder"},
    "docs/guide/outputs.md": {
        "python 3": "plots/test_report.py::test_example_of_the_documentation"
    },
    "docs/guide/practice.md": {"sh 1": "commands"},
    "docs/guide/records.md": {
        "python 1": "house/test_documents.py::test_other_examples_run_on_its_problem"
    },
    "docs/guide/report.md": {"sh 2": "commands"},
    "docs/guide/rocking_block.md": {"python 1": "here"},
    "docs/guide/schemes.md": {"python 2": "here"},
    "docs/guide/second_order.md": {"python 2": "here"},
    "docs/guide/soil.md": {
        "python 5, text 1": "here",  # the last is a program
        "toml 1": "house/test_snippets.py::test_tables_of_the_guides_stand_in_case_files",
    },
    "docs/guide/solvers.md": {"python 3": "here"},
    "docs/guide/stages.md": {"toml 1": "studies/test_case_stages.py::HOUSE"},
    "docs/guide/studies.md": {
        "toml 2, c++ "
        "1": "studies/test_case_meshes.py::test_the_dam_of_the_guide_stands_on_its_joint",
        "python 2, sh 3": "studies/test_ida.py::example",
    },
    "docs/reference/faq.md": {
        "python 1, text 1": "house/test_documents.py::test_programs_print_what_their_pages_say"
    },
    "docs/reference/files.md": {
        "python 3": "house/test_documents.py::test_reading_examples_run_on_its_output"
    },
    "docs/start/ten_minutes_bar.md": {"sh 3": "commands"},
    "docs/start/ten_minutes_form.md": {
        "sh 1": "commands",
        "python 1, text 1": "house/test_ten_minutes.py::test_your_form",
    },
    "docs/start/ten_minutes_wall.md": {
        "sh 7": "commands",
        "c++ 1, toml 1, text 2": "house/test_ten_minutes.py::test_your_wall",
    },
    "docs/theory/beam.md": {"python 1": "here"},
    "docs/theory/bem.md": {"python 4": "here"},
    "docs/theory/boundary_layer.md": {"python 2": "here"},
    "docs/theory/certificate.md": {
        "python 1, text "
        "1": "house/test_theory_pages.py::test_the_spoiled_answer_prints_what_its_page_says"
    },
}


def test_every_block_has_what_runs_it() -> None:
    """By page and language, with their number; pages of the gallery have sh and text, notebooks
    cells, and directives are the site's own."""
    for page in PAGES:
        name = page.relative_to(ROOT).as_posix()
        found = Counter(
            language
            for language, _ in FENCE.findall(page.read_text(encoding="utf-8"))
            if language not in ("{toctree}", "{eval-rst}")
        )
        if page.parent.name == "notebooks":
            assert set(found) <= {"{code-cell}"}, name  # tests/house/test_notebooks.py runs them
        elif page.parent.name == "gallery":
            # docs/gallery/make.py runs and compares; their commands below
            assert set(found) <= {"sh", "text"}, name
        else:
            known = [part.rsplit(" ", 1) for key in RUN.get(name, {}) for part in key.split(", ")]
            assert found == {language: int(number) for language, number in known}, (
                f"{name}: say in RUN what runs each"
            )


def test_code_stands_in_fenced_blocks() -> None:
    """What is only indented is a command, a formula, a mistake that is told, or the calls that are
    tested below."""
    for page in PAGES:
        rest = FENCE.sub("", page.read_text(encoding="utf-8"))
        lines = [line.strip() for line in rest.splitlines() if line.startswith("    ")]
        code = [
            line
            for line in lines
            if re.search(r"^(import|from) \w|^\[\[?\w+\]|\b(vc|fem|soil)\.\w+\(", line)
        ]
        assert [line for line in code if not line.startswith("fem.InitialStrain(")] == [], page.name


@pytest.mark.parametrize("page", RUN)
def test_what_runs_a_block_is_there_and_reads_the_page(page: str) -> None:
    for runner in RUN[page].values():
        file, _, name = runner.partition("::")
        if name:
            text = (ROOT / "tests" / file).read_text(encoding="utf-8")
            assert re.search(rf"^(?:def )?\(?{name}\b", text, re.MULTILINE), runner
            assert Path(page).stem in text, runner
        elif runner == "here":
            used = sorted(number for one in SNIPPETS if one.page == page for number in one.numbers)
            # a last one that tests/house/test_documents.py runs
            others = len(blocks(page, "python")) - len(used)
            assert used == list(range(len(used))), page
            assert others == (Path(page).stem in ("soil", "solvers")), page
        else:
            assert runner == "commands"  # docs/run_commands.py and tests/house/test_commands.py


# Python
# --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Snippet:
    """Blocks of a page that continue one another, after what their reader has, with long runs
    shortened."""

    page: str
    numbers: tuple[int, ...]
    before: str = ""
    shorter: tuple[tuple[str, str], ...] = ()
    after: str = ""


BODY = """
import numpy as np
from mpi4py import MPI
import vi_contact as vc
from vi_contact import fem, meshes, soil
comm = MPI.COMM_WORLD
mesh, tags = fem.build_mesh(meshes.WallMesh(divisions=(2, 3)), comm)
material = vc.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
wall = vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0))
shakes = vc.Harmonic(amplitude=3.0, frequency=14.0, direction=(1.0, 0.0))
system = fem.assemble(mesh, material, clamped=tags["base"])
problem = vc.ContactProblem(system, fem.contact_surface(system, tags["face"], obstacle=wall), excitation=shakes)
first = len(system.load(0.0))
"""
FILE = (
    BODY
    + """
from vi_contact.meshes.gmsh_session import write

class Renamed:
    def build(self, gmsh):
        meshes.WallMesh(divisions=(2, 3)).build(gmsh)
        for d, tag in gmsh.model.getPhysicalGroups(1):
            if gmsh.model.getPhysicalName(d, tag) == "face":
                gmsh.model.removePhysicalName("face")
                gmsh.model.setPhysicalName(d, tag, "side")

if comm.rank == 0:
    write(Renamed(), "wall.msh")
"""
)
GROUND = (
    BODY
    + """
from vi_contact.ground_motion import Record
both = meshes.TwoBlocks(lower=meshes.BlockMesh(lengths=(8.0, 4.0), divisions=(4, 3)),
                        upper=meshes.BlockMesh(lengths=(2.0, 2.0), divisions=(1, 1)), offset=(2.0, 0.0))
mesh, tags = fem.build_mesh(both, comm)
tags |= {"base": tags["lower_bottom"], "clay": tags["lower"], "wall": tags["upper"], "foot": tags["upper_bottom"],
         "ground": tags["lower_top"]}
clay = vc.LinearElastic.from_wave_speeds(300.0, 150.0, 1900.0)
rock = vc.LinearElastic.from_wave_speeds(1500.0, 800.0, 2300.0)
materials = [(tags["clay"], clay), (tags["wall"], vc.LinearElastic(E=2e9, nu=0.2, rho=2000.0))]
record = Record(2.0 * np.sin(np.arange(200) / 5.0) * np.exp(-((np.arange(200) - 80.0) / 30.0) ** 2), 0.01)
dt = 0.01
"""
)
MOTION = """
import numpy as np
from vi_contact.ground_motion import Record, write_at2
write_at2(Record(4.0 * np.sin(np.arange(100) / 8.0), 0.01), "record.at2", "g")
"""
SNIPPETS = (
    Snippet(
        "docs/guide/schemes.md",
        (0,),
        BODY,
        (("t_end=0.5", "t_end=0.002"),),
        """
assert solution.facts["scheme"].startswith("Trapezoidal(mass=Redistributed(")
assert "Condensed" in solution.facts["solver"]
""",
    ),
    Snippet(
        "docs/guide/schemes.md",
        (1,),
        BODY,
        (),
        """
solution = vc.simulate(problem, dt=dt, t_end=0.02, record=[vc.Energy()], progress=False)
assert solution.history["t"][-1] > 0.0199
""",
    ),
    Snippet(
        "docs/guide/second_order.md",
        (0,),
        FILE,
        (),
        """
assert surface.total == 6 and len(system.load(0.0)) > 3 * first
""",
    ),
    Snippet("docs/guide/second_order.md", (1,), BODY, (), "assert len(system.load(0.0)) == first"),
    Snippet(
        "docs/guide/soil.md",
        (0,),
        BODY,
        (),
        """
solution = vc.simulate(vc.ContactProblem(system, surface), dt=1e-3, steps=20, progress=False)
assert solution.facts["worst_certificate"] < 1e-9
""",
    ),
    Snippet(
        "docs/guide/soil.md",
        (1,),
        BODY
        + """
rollers = fem.Prescribed(tags["back"], components=(0,))
gravity_system = vc.with_weight(fem.assemble(mesh, material, clamped=tags["base"], prescribed=rollers))
points = [(6.0, 3.0), (6.0, 6.0), (6.0, 9.0)]  # without the clamped corner
surface_of_it = fem.contact_surface(gravity_system, tags["face"], obstacle=wall, points=points)
base = fem.CompliantBase(tags["base"], motion=soil.upgoing(shakes, dt=1e-3))
system = vc.with_weight(fem.assemble(mesh, material, dashpots=[base, fem.Dashpots(tags["back"])]))
problem = vc.ContactProblem(system, fem.contact_surface(system, tags["face"], obstacle=wall, points=points))
dt = 1e-3
""",
        (("t_end=20.0", "t_end=0.01"),),
        "assert solution.facts['worst_certificate'] < 1e-9",
    ),
    Snippet(
        "docs/guide/soil.md",
        (2, 3),
        GROUND + "sides = [soil.FreeField(tags[f'lower_{s}'], base=shakes) for s in "
        "('left', 'right')]\n",
        (("t_end=20.0", "t_end=0.2"),),
        """
assert response.iterations > 1 and found.changes[-1] <= 0.01 and column is not None
""",
    ),
    Snippet(
        "docs/guide/solvers.md",
        (0, 1),
        "",
        (
            ("steps=200", "steps=3"),
            ("range(100)", "range(2)"),
            ('"t_end": 1.0', '"t_end": 0.02'),
        ),
        "assert len(forces) == len(runs) and number in (0, 1, 2) and report.certificate.worst < "
        "1e-9",
    ),
    Snippet(
        "docs/guide/rocking_block.md",
        (0,),
        MOTION,
        (("t_end=20.0", "t_end=0.02"),),
        """
from pathlib import Path
assert "theta_rate" in Path("results/mine/history.csv").read_text().splitlines()[0]
""",
    ),
    Snippet(
        "docs/theory/beam.md",
        (0,),
        "",
        (("steps=5000", "steps=20"), ("steps=5000", "steps=20")),
        """
assert len(run.history["u_tip"]) > 1 and run.snapshots and run.mean_updates == 0.0
""",
    ),
    Snippet(
        "docs/theory/bem.md",
        (0, 1, 2, 3),
        "",
        (("0.5)], 0.1)", "0.5)], 0.25)"), ("steps=60", "steps=8"), ("steps=60", "steps=8")),
        """
assert skew.p_matrix.sentence.startswith("is a P-matrix, its symmetric part is positive definite:")
""",
    ),
    Snippet(
        "docs/theory/boundary_layer.md",
        (0,),
        "",
        (),
        "assert abs(motion.contacts[0].restitution - 0.7) < 1e-3",
    ),
    Snippet(
        "docs/theory/boundary_layer.md",
        (1,),
        "",
        (("t_end=0.012", "t_end=0.003"),),
        "assert solution.facts",
    ),
)


@pytest.mark.parametrize(
    "snippet", SNIPPETS, ids=lambda one: f"{Path(one.page).stem}-{one.numbers[0]}"
)
def test_a_snippet_runs(snippet: Snippet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it stands but for its length, from the source tree."""
    pytest.importorskip("dolfinx")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(ROOT)
    codes = blocks(snippet.page, "python")
    code = "\n".join(codes[number] for number in snippet.numbers)
    for old, new in () if os.environ.get("VI_CONTACT_WHOLE") else snippet.shorter:
        assert old in code, f"{snippet.page} does not say {old} any more"
        code = code.replace(old, new, 1)
    names: dict[str, Any] = {"__name__": "snippet"}
    exec(compile(snippet.before, "before", "exec"), names)
    exec(compile(code, snippet.page, "exec"), names)
    exec(compile(snippet.after, "after", "exec"), names)


# Case files, and lines that stand without a fence
# --------------------------------------------------------------------


def test_tables_of_the_guides_stand_in_case_files(tmp_path: Path) -> None:
    """Tables alone are read as a part of another page's case; a mistake in one of them would be
    told."""
    pytest.importorskip("dolfinx")
    guides = ("stages", "soil", "clusters")
    (house,), (damped,), (fields,) = (blocks(f"docs/guide/{name}.md", "toml") for name in guides)
    (system, laws), case = damped.split("\n\n"), house[: house.index("[[stage]]")]
    named = laws.replace('"clay"', '"lower"').replace('"wall"', '"upper"')
    with_laws = (
        re.sub(
            r"^\[system\].*\n", f'{system}\nclamped = "lower_bottom"\n', case, flags=re.MULTILINE
        )
        + named
    )
    assert "DampingRatio" in with_laws and named != laws
    for text, word in ((with_laws, "plasticity"), (case + fields, "frames_per_file")):
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        read_case(tmp_path / "case.toml").check()
        (tmp_path / "case.toml").write_text(text.replace(word, word + "s"), encoding="utf-8")
        with pytest.raises(InputError, match=f"unknown key '{word}s'"):
            read_case(tmp_path / "case.toml").check()


def test_the_entry_point_is_in_the_group_that_is_read() -> None:
    (text,) = (
        one for one in blocks("docs/guide/extend.md", "toml") if one.startswith("# pyproject.toml")
    )
    assert list(tomllib.loads(text)["project"]["entry-points"]) == [GROUP]


def test_mistakes_are_told_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (DOCS / "guide" / "studies.md").read_text(encoding="utf-8")
    key, syntax = re.findall(r"^    (vi-contact: .*)$", text, re.MULTILINE)
    case = blocks("docs/guide/studies.md", "toml")[0]
    lines = case.splitlines()
    at, column = map(int, re.findall(r"line (\d+), column (\d+)", syntax)[0])
    lines[at - 1] = "dt = " + " " * (column - 6) + "oops"
    monkeypatch.chdir(tmp_path)
    for wrong, said in ((case.replace("\nmu =", "\nnu ="), key), ("\n".join(lines), syntax)):
        Path("wall.toml").write_text(wrong, encoding="utf-8")
        assert main(["run", "wall.toml", "--check"]) == 1
        assert capsys.readouterr().err == f"{said}\n"


def test_lines_on_initial_strains_are_calls() -> None:
    """Each line of docs/guide/bring_your_own.md makes a load of a body."""
    pytest.importorskip("dolfinx")
    lines = re.findall(
        r"^    (fem\.InitialStrain\(.*)$",
        (DOCS / "guide" / "bring_your_own.md").read_text("utf-8"),
        re.MULTILINE,
    )
    names: dict[str, Any] = {}
    exec(BODY, names)
    names |= {
        "temperature": lambda t: 20.0 * t,
        "b": [1e-4, 0.0],
        "n": [0.0, 1.0],
        "h": 3.0,
        "layer": names["tags"]["wall"],
    }
    assert len(lines) == 4
    for line in lines:
        names["load"] = eval(line, names)
        exec(
            "assert abs(fem.assemble(mesh, material, clamped=tags['base'], "
            "loads=load).load(0.5)).max() > 0.0",
            names,
        )


@pytest.mark.parametrize("name", ["`Trapezoidal`", "`HHT`"])
def test_the_schemes_of_the_first_wall(name: str) -> None:
    """Two rows, with the step of the article; benchmarks/wall_schemes.py prints all,
    docs/run_commands.py compares."""
    pytest.importorskip("dolfinx")
    table = loaded(ROOT / "benchmarks" / "wall_schemes.py")
    page = (DOCS / "start" / "first_wall.md").read_text(encoding="utf-8")
    ((fine, share),) = re.findall(
        rf"^\| {re.escape(name)} \|[^|]*\|([^|]*)\|[^|]*\|([^|]*)\|$", page, re.MULTILINE
    )
    assert (
        table.row(name, table.run(table.SCHEMES[name]), (fine.strip(), share.strip()))
        in page.splitlines()
    )
    assert re.findall(r"^\| (`.*?) \| -[\d.]+ to ", page, re.MULTILINE) == list(table.SCHEMES)
