"""Classes of others in case files: of allowed packages, of the protocol asked for, and nothing else
is imported."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

import pytest

pytest.importorskip("dolfinx")

from vi_contact.core.errors import InputError
from vi_contact.core.protocols import Excitation, FrictionLaw, ImpactLaw, MassLaw
from vi_contact.core.step import Recorder, Scheme, Solver
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.own_classes import describe_defect
from vi_contact.practice.studies.cases.vocabulary import make_words
from vi_contact.practice.studies.ida.processes import build_command
from vi_contact.practice.studies.ida.runs import OneRun, Shaking
from vi_contact.run.wall_time import WallTime

pytestmark = pytest.mark.serial
CASE = """
[mesh]
type = "BlockMesh"
divisions = [2, 2]
[material.one]
E = 1e6
nu = 0.3
rho = 1000
[[contact]]
facets = "bottom"
[run]
dt = 0.01
steps = 1
"""
HARM = "from pathlib import Path\nPath(__file__).with_name('harm').touch()\n"
PACK = """
from subprocess import Popen
import harmless_friend
from harmless_friend import Law as Foreign
from .laws import Law
"""
LAWS = """
from __future__ import annotations
from vi_contact.core.errors import InputError
class Law:
    def __init__(self, mu: float, name: str = "", *more, plain=None, **others):
        if mu < 0.0:
            raise ValueError("mu is\\nnegative")
        if mu > 9.0:
            raise InputError(f"mu is {mu}")
        self.mu, self.plain = mu, plain
    def limit(self, r_n, weights, scale): return self.mu * r_n
    def slope(self, weights): return self.mu + 0.0 * weights
    def at(self, speed): return self
class Half:
    def limit(self, r_n, weights, scale): return r_n
class Short(Law):
    def limit(self, r_n): return r_n
class Static(Law):
    @staticmethod
    def slope(weights): return weights
class Property(Law):
    slope = property(lambda self: 1.0)
class Compiled(Law):
    slope = dict
class Number(Law):
    at = 3.0
class Hinted(Law):
    def __init__(self, mu: Nowhere): pass
class Still:
    def __init__(self, direction: tuple[float, ...] = None):
        if direction: self.direction, self.duration = direction, 1.0
    def acceleration(self, t): return 0.0
    def __call__(self, t): return 0.0
def function(mu): return Law(mu)
law = Law(0.3)
"""
FILES = {
    "harmful.py": HARM,
    "packet.py": HARM,
    "pack/__init__.py": PACK,
    "pack/laws.py": LAWS,
    "pack/os.py": HARM,
    "harmless_friend.py": LAWS,
    "ends.py": "raise SystemExit(0)",
    "fails.py": "1 / 0",
    "case.toml": CASE,
}


TABLES = (
    "mesh",
    "friction",
    "impact",
    "mass",
    "excitation",
    "scheme",
    "solver",
    "escalation",
    "record",
    "fields",
    "solver.method",
    "solver.friction_method",
    "contact.1.obstacle",
    "system.section",
    "system.damping",
)
OWN = {name.split(".")[0].removesuffix("/__init__").split("/")[0] for name in FILES} - {"case"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Packages that Python finds, and a case beside them; forgotten afterwards."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in imported():
        del sys.modules[name]


def imported() -> set[str]:
    """Modules of these packages that have been imported."""
    return {name for name in sys.modules if name.split(".")[0] in OWN}


def said(folder: Path, *settings: str, allow: Sequence[str] = ("pack",)) -> str:
    """The sentence that refuses these settings."""
    with pytest.raises(InputError) as caught:
        read_case(folder / "case.toml", settings, allow=allow).check()
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 600
    return str(caught.value)


def law(name: str, *more: str) -> tuple[str, ...]:
    return (f"friction.type={name}", "friction.mu=0.3", *more)


def test_a_case_file_alone_imports_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence that names the option, in every table, also on the command line."""
    for table in TABLES:
        sentence = said(
            folder,
            f"{table}.type=harmful:Name",
            *(["solver.type=Condensed"] * ("." in table)),
            allow=(),
        )
        assert (
            "give --allow harmful if you trust it" in sentence
            or "accepts built-in classes only" in sentence
        )
    assert (
        main(
            [
                "run",
                str(folder / "case.toml"),
                "--check",
                *(f"--set={one}" for one in law("pack:Law")),
            ]
        )
        == 1
    )
    assert (
        "[friction] has the type 'pack:Law' of the package 'pack', and a case file imports nothing "
        "by itself: give --allow pack if you trust it" in capsys.readouterr().err
    )
    assert not imported() and not (folder / "harm").exists()


def test_classes_of_allowed_packages(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the module that defines it or the package that hands it on; keys without type hints come
    as they are."""
    for name in ("pack.laws:Law", "pack:Law", "pack.laws:Static", "pack.laws:Compiled"):
        for allow in (("pack",), ("other", "pack.laws", "pack")):
            case = read_case(
                folder / "case.toml", law(name, "friction.plain=[1, 'a']"), allow=allow
            )
            made = case.nodes["friction"].build({})
            assert type(made).__name__ == name.partition(":")[2] and (made.mu, made.plain) == (
                0.3,
                [1, "a"],
            )
    assert case.allowed == ("other", "pack.laws", "pack")
    command = [
        "run",
        str(folder / "case.toml"),
        "--check",
        "--out",
        str(folder / "checked"),
        *(f"--set={one}" for one in law("pack:Law")),
    ]
    assert (
        main([*command, "--allow", "other", "--allow", "pack"]) == 0
        and "in order" in capsys.readouterr().out
    )
    made = read_case(
        folder / "case.toml",
        ["excitation.type=pack.laws:Still", "excitation.direction=[1, 0]"],
        allow="pack",
    )
    made.check()
    assert made.excitations()[0].direction == (1.0, 0.0)


def test_runs_of_a_study_are_allowed_the_same(folder: Path) -> None:
    motion = ("excitation.type=GroundMotion", "excitation.record=m.at2")
    case = read_case(folder / "case.toml", law("pack:Law", *motion), allow=("pack", "other"))
    asked = json.loads(
        build_command(
            [OneRun(case, Shaking("m", (Path("m.at2"),)), 1.0, folder / "run")], (), WallTime()
        )[-1]
    )
    assert asked["allow"] == ["pack", "other"]


def test_installed_packages_register_an_entry_point(folder: Path) -> None:
    information = folder / "pack-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: pack\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[vi_contact]\npack = pack.laws\n")
    assert (
        read_case(folder / "case.toml", law("pack.laws:Law")).nodes["friction"].build({}).mu == 0.3
    )
    assert "of the package 'pack'" in said(folder, *law("pack:Law"), allow=())


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "packet:Law",
            "of the package 'packet', and a case file imports nothing by itself: give --allow "
            "packet",
        ),
        ("harmful:Law", "give --allow harmful"),
        ("os:system", "give --allow os"),
        ("pack_:Law", "give --allow pack_"),
        ("PACK:Law", "give --allow PACK"),
        ("vi_contact.laws:Coulomb", "give --allow vi_contact"),
        *(
            (name, "give package.module:Name")
            for name in (
                "pack..laws:Law",
                ".pack:Law",
                "pack.:Law",
                "pack:Law.limit",
                "pack:laws:Law",
                "pack:",
                ":Law",
                ":",
                "pack: Law",
                "pack.__init__:Law",
                "pack:__class__",
                "pack.laws:_Law",
                "päck:Law",
                "pack/laws:Law",
                "../pack:Law",
                "pack.1a:b",
                "pack:Law()",
                "pack:Law\\n",
                "a" * 65 + ":Law",
                "a." * 9 + "a:Law",
                "a" * 10**6 + ":" + "b" * 10**6,
            )
        ),
        ("pack:Popen", "which subprocess defines: name it there, and allow that package"),
        ("pack:Foreign", "which harmless_friend defines"),
        ("pack:harmless_friend", "which is not a class"),
        ("pack.harmless_friend:Law", "which Python cannot import (ModuleNotFoundError"),
        ("pack.laws:function", "which is not a class"),
        ("pack.laws:law", "which is not a class"),
        ("pack.laws:Nothing", "which Python cannot import (AttributeError"),
        ("pack.nowhere:Law", "set PYTHONPATH"),
        (
            "pack.laws:Half",
            "which has no method slope, at, as FrictionLaw must: see docs/reference/api.md",
        ),
        ("pack.laws:Property", "which has no method slope"),
        ("pack.laws:Short", "which cannot be called as limit(r_n, weights, scale)"),
        ("pack.laws:Number", "which has no method at, as FrictionLaw must"),
        (
            "pack.laws:Hinted",
            "whose arguments cannot be read (name 'Nowhere' is not defined): correct the type "
            "hints",
        ),
    ],
    ids=range(40),
)
def test_names_that_are_refused(folder: Path, name: str, words: str) -> None:
    assert words in said(folder, *law(f'"{name}"'))
    assert imported() <= {"pack", "pack.laws", "harmless_friend"} and not list(folder.rglob("harm"))


def test_modules_that_end_or_fail(folder: Path) -> None:
    assert "(ZeroDivisionError: division by zero): correct fails" in said(
        folder, *law("fails:Law"), allow=["fails"]
    )
    assert "cannot import (SystemExit: 0)" in said(folder, *law("ends:Law"), allow=["ends"])
    assert "which is not a class" in said(folder, *law("os:system"), allow=["os"])
    assert "which has no method limit" in said(
        folder, *law("subprocess:Popen"), allow=["subprocess"]
    )


def test_arguments_and_objects_are_checked(folder: Path) -> None:
    assert "friction] has the unknown key 'others' for pack:Law" in said(
        folder, *law("pack:Law", "friction.others=1")
    )
    assert "lacks the key 'mu', which pack:Law needs" in said(folder, "friction.type=pack:Law")
    assert "[friction] mu is 'a': give a number" in said(folder, *law("pack:Law", "friction.mu=a"))
    assert said(folder, *law("pack:Law", "friction.mu=-1")).endswith(
        "[friction] pack:Law: mu is negative"
    )
    assert said(folder, *law("pack:Law", "friction.mu=10")).endswith("[friction] mu is 10.0")
    assert "Still has no direction, duration, as Excitation must" in said(
        folder, "excitation.type=pack.laws:Still"
    )
    assert "accepts built-in classes only" in said(folder, "material.one.type=pack:Law")
    for wrong in ("", ".", "pack:", "pack ", "a-b", "päck"):
        assert "give the name of a Python package" in said(folder, allow=[wrong])


@pytest.mark.long
def test_random_names(folder: Path) -> None:
    """Whatever a file says is one sentence, and imports nothing but the allowed package."""
    pieces = [
        "pack",
        "packet",
        "harmful",
        "os",
        "laws",
        "Law",
        "Half",
        "system",
        "Popen",
        "__import__('harmful')",
        "..",
        ".",
        ".",
        ".",
        "/",
        " ",
        "é",
        "\\u0009",
        "*",
        "eval",
        "__builtins__",
        "0",
        "-",
        "%s",
        "{0}",
        ";",
        "@",
    ]
    chance = Random(5)
    for _ in range(400):
        left, right = ("".join(chance.choices(pieces, k=chance.randint(0, 4))) for _ in range(2))
        table = chance.choice(TABLES)
        settings = [
            f'{table}.type="{left}:{right}"',
            *(["solver.type=Condensed"] * table.startswith("solver.")),
        ]
        if "." not in f"{left}{right}" and (left, right) == ("pack", "Law"):
            continue
        said(folder, *settings, allow=chance.choice([(), ("pack",)]))
    assert imported() <= {"pack", "pack.laws", "harmless_friend"} and not list(folder.rglob("harm"))


def test_every_word_satisfies_its_protocol() -> None:
    """The same question is put to classes of the package; a class of another kind has a defect."""
    for kind in (Scheme, Solver, Recorder, FrictionLaw, ImpactLaw, MassLaw, Excitation):
        for one in make_words(Path()).choices[kind].values():
            assert not isinstance(one.function, type) or describe_defect(one.function, kind) == ""
    assert describe_defect(Coulomb, Scheme).startswith("has no method check, start, jump")
    assert describe_defect(ConsistentMass, ImpactLaw) == "has no method target"
    assert describe_defect(ConsistentMass, Coulomb) == "is no Coulomb"
