"""The floors of the house: imports point down, foreign packages stay where they belong.

The one table of rooms and floors is in CONTRIBUTING.md; these tests read it from there.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

import vi_contact

pytestmark = pytest.mark.serial
PACKAGE = Path(vi_contact.__file__).parent
SOURCES = {  # module, as "solvers.normal.lcp" -> its text
    path.relative_to(PACKAGE).with_suffix("").as_posix().replace("/", "."): path.read_text(
        encoding="utf-8"
    )
    for path in sorted(PACKAGE.rglob("*.py"))
}
ROOT_MODULES = {"__init__", "__main__"}
ROW = re.compile(
    r"^\| (?P<floor>\d) \| `(?P<room>\w+)/` \| [^|]+ \|(?P<foreign>[^|]*)\|$", re.MULTILINE
)


@dataclass(frozen=True)
class Room:
    """A row of the table: its floor, and foreign package -> whether only functions may import
    it."""

    floor: int
    foreign: Mapping[str, bool]


def rooms() -> dict[str, Room]:
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = {}
    for row in ROW.finditer(text):
        names = [name.split() for name in row["foreign"].split(",") if name.strip()]
        found[row["room"]] = Room(
            int(row["floor"]), {name[0]: name[1:] == ["late"] for name in names}
        )
    return found


ROOMS = rooms()


@dataclass(frozen=True)
class Import:
    """``target`` in module ``source``: a module of the package, or a foreign package; ``late``:
    inside a function."""

    source: str
    target: str
    late: bool
    own: bool


@cache
def imports(source: str, text: str) -> tuple[Import, ...]:
    """All imports of a module; every text is parsed once for all tests."""
    return tuple(_imports(source, ast.parse(text)))


def _imports(source: str, tree: ast.Module) -> Iterator[Import]:
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    late = {id(inner) for function in functions for inner in ast.walk(function)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _one(source, alias.name, "", id(node) in late)
        elif isinstance(node, ast.ImportFrom):
            base = ["vi_contact", *source.split(".")][: -node.level] if node.level else []
            start = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield from _one(source, start, alias.name, id(node) in late)


def _one(source: str, start: str, name: str, late: bool) -> Iterator[Import]:
    own = start.split(".")[0] == "vi_contact"
    if not own:
        yield Import(source, start.split(".")[0], late, own=False)
        return
    inside = start.removeprefix("vi_contact").lstrip(".")
    deeper = f"{inside}.{name}".lstrip(".")
    found = [
        one
        for one in (deeper, f"{deeper}.__init__", inside, f"{inside}.__init__")
        if one in SOURCES
    ]
    yield Import(source, found[0] if found else "__init__", late, own=True)


def every_import(sources: Mapping[str, str]) -> list[Import]:
    return [one for source, text in sources.items() for one in imports(source, text)]


def room_of(module: str) -> str:
    return module.split(".")[0]


def upward(found: list[Import]) -> list[str]:
    """Imports of a room on the same floor or above."""
    wrong = []
    for one in found:
        here, there = room_of(one.source), room_of(one.target)
        if not one.own or here == there or here in ROOT_MODULES:
            continue
        if there in ROOT_MODULES or ROOMS[there].floor >= ROOMS[here].floor:
            wrong.append(f"{one.source} imports {one.target}")
    return wrong


def circles(found: list[Import]) -> list[str]:
    """Modules that import each other, directly or not."""
    below: dict[str, set[str]] = {}
    for one in found:
        if one.own and one.source != one.target:
            below.setdefault(one.source, set()).add(one.target)
    while leaves := [
        module for module, targets in below.items() if not any(one in below for one in targets)
    ]:
        for module in leaves:
            del below[module]
    roots = [module for module in below if any(module in targets for targets in below.values())]
    return sorted(roots)


def test_every_room_has_its_row_and_nothing_lies_at_the_root():
    assert set(ROOMS) == {room_of(module) for module in SOURCES} - ROOT_MODULES
    loose = {path.name for path in PACKAGE.iterdir() if path.is_file()}
    assert loose <= {"__init__.py", "__init__.pyi", "__main__.py", "py.typed"}


def test_imports_point_down():
    assert not upward(every_import(SOURCES))


def test_what_is_imported_by_name_stands_below_too():
    """But for ``Solution.plot``: a notebook asks a run for its figure, and no run needs one."""
    asked = re.compile(r"import_module\(f?\"vi_contact\.(\w+)")
    found = {(source, room) for source, text in SOURCES.items() for room in asked.findall(text)}
    assert found == {("run.solution", "plots")}


def test_one_upward_import_is_found():
    """The rule has teeth: any single import of a room on the same floor or above makes it fail."""
    for here, there in (
        ("core.errors", "laws.friction"),
        ("solvers.condensed", "run.march"),
        ("fem.mesh", "solvers"),
        ("schemes.newmark", "cli.entry"),
        ("laws.mass", "ground_motion.record"),
    ):
        text = (
            SOURCES[here] + f"\ndef late() -> None:\n    from vi_contact.{there} import anything\n"
        )
        found = upward(every_import(SOURCES | {here: text}))
        assert len(found) == 1 and found[0].startswith(f"{here} imports {there}"), found


def test_no_circles():
    assert not circles(every_import(SOURCES))
    looped = SOURCES | {"core.errors": SOURCES["core.errors"] + "\nfrom .checks import number\n"}
    assert {"core.errors", "core.checks"} <= set(circles(every_import(looped)))


def test_foreign_packages_stay_at_home():
    own = set(sys.stdlib_module_names) | {"__future__", "numpy", "scipy"}
    wrong = []
    for one in every_import(SOURCES):
        if one.own or one.target in own:
            continue
        allowed = ROOMS[room_of(one.source)].foreign if room_of(one.source) in ROOMS else {}
        if one.target not in allowed or (allowed[one.target] and not one.late):
            wrong.append(f"{one.source} imports {one.target}")
    assert not wrong


def test_petsc_in_the_solvers_stays_in_the_volume_routes():
    found = every_import(SOURCES)
    direct = {
        one.source
        for one in found
        if one.target == "petsc4py" and one.source.startswith("solvers.")
    }
    assert direct == {"solvers.petsc"}  # which imports MPI first
    users = {one.source for one in found if one.own and one.target.startswith("solvers.petsc")}
    assert users and all(
        module.startswith(("solvers.volume.", "solvers.iterative.")) for module in users
    )


SMALL_RUN = """
import sys
import vi_contact.fem
import vi_contact as vc
sys.path.insert(0, SUPPORT)
from shaken import shaken
for scheme in (vc.ZienkiewiczWoodTaylor(), vc.SS22(), vc.LinearMultistep.newmark()):
    for method in (ActiveSet(), Hildreth()):
        problem = shaken(vc.Inelastic())
        for state, report in vc.march(problem, scheme=scheme, solver=vc.Condensed(method), dt=5e-3, steps=9):
            pass
        assert report.new.active.all() and report.certificate.worst < 1e-12
K, points = [[2.0, -1.0], [-1.0, 1.0]], [[0.0], [1.0]]
system = vc.system_from_arrays([1.0, 2.0], None, K, coordinates=points, load=[0.0, 1.0])
problem = vc.ContactProblem(system, vc.contact_points(system, [1], [1.0]), mass=vc.ConsistentMass())
*_, (state, _) = vc.march(problem, scheme=vc.MoreauJean(), dt=1e-2, steps=9)
assert state.r_n[0] > 0.0 and vi_contact.fem.XDMF(every=2).every == 2
print(sorted({"petsc4py", "dolfinx", "ufl", "basix", "mpi4py", "gmsh", "matplotlib", "h5py"} & set(sys.modules)))
"""
METHODS = """from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth
"""


def _python(script: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        cwd=PACKAGE.parent,
        check=False,
        env=dict(os.environ),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_core_runs_without_finite_elements():
    """``import vi_contact``, schemes, condensed solver and impact laws import none of the heavy
    packages."""
    support = Path(__file__).parents[1] / "support"
    assert _python(METHODS + SMALL_RUN.replace("SUPPORT", repr(str(support)))) == "[]"


def test_table_of_contents_is_complete_and_true():
    """Every public name can be imported (``vi_contact.core.lazy``), and nothing else pretends to be
    there."""
    assert len(vi_contact.__all__) == len(set(vi_contact.__all__)) > 40
    assert set(dir(vi_contact)) == set(vi_contact.__all__)
    for public in vi_contact.__all__:
        assert getattr(vi_contact, public) is not None, public
    with pytest.raises(AttributeError, match="no attribute 'Nonsense'"):
        _ = vi_contact.Nonsense
