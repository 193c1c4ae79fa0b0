"""Command lines that are wrong by construction end with a status and one sentence: no traceback, no
hang, no work done.

All in one process. A sentence is that of ``main`` or, for words that the parser refuses, its last
line.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random

import pytest
from chain import chain_problem
from fuzz import Fuzz

pytest.importorskip("dolfinx")
pytest.importorskip("matplotlib")

import vi_contact as vc
from vi_contact import ground_motion
from vi_contact.practice.cli.entry import build_parser, main
from vi_contact.practice.cli.errors import escape_unprintable

pytestmark = pytest.mark.serial
SHAKING = """[[excitation]]
type = "GroundMotion"
record = {path = "motion.at2", units = "g"}
direction = [1.0, 0.0]
"""
COUNT = 120
NUMBER = ["nan", "x", "", "1e400e", "1_0x", "--", "\0"]  # no number at all
POSITIVE = ["0", "-1", "inf", "1e400", *NUMBER]
COUNTED = ["0", "-3", "2.5", "1e3", "1" * 5000, "nan", "x", ""]
PLACES = ["nowhere/x", "x\0y", "", "."]
READING = {
    "--units": ["furlong", "m/s2", ""],
    "--dt": [*POSITIVE, "0.5"],
    "--channel": [*COUNTED, "1"],
    "--largest": ["x", "0", "-1g", "nan", "1e-9g", "g"],
    "--trim": ["2 1", "-1 1", "nan 1", "0 99", "x 1", "0 0"],
    "--pad": ["1e12 0", "0 1e300", "-1 0", "nan 0", "0 inf"],
    "--taper": ["0", "0.9", "-1", "nan", "inf"],
    "--low": [*POSITIVE, "1e9", "1e-300"],
    "--high": [*POSITIVE, "1e9"],
    "--resample": [*POSITIVE, "1e-12", "1e12"],
    "--order": [],
    "--baseline": ["99", "-1", "x", "2.5"],
    "--scale": ["inf", "1e400", *NUMBER],
    "--pga": ["0", "-1", "x", "1e999", "1furlong"],
    "--arias": POSITIVE,
    "--psa": ["0.5g 0", "x 1", "1 nan", "0 1"],
}
PERIODS = [
    "0.1 1 1e12",
    "1 0.1 5",
    "0.1 1 2.5",
    "nan 1 5",
    "0.1 inf 5",
    "1e-300 1 5",
    "0.1 1 1",
    "0.1 1 nan",
    "0 1 5",
]
STEP = {
    "--steps": ["-1", "x", "1" * 5000],
    "--dt": [*POSITIVE, "1e-300"],
    "--solver": ["foo", ""],
    "--scheme": ["foo"],
    "--motion": [*PLACES, "a,b,c", ","],
    "--scale": ["inf", "nan", "x"],
    "--out": [""],
    "--set": [
        "impact.type=foo",
        "impact.e=2",
        "fields.every=-1",
        "fields.every=x",
        "excitation=3",
        "model=3",
        "run=",
        "solver=3",
    ],
}
SET = [value for value in POSITIVE if value]  # an empty one takes the key away
# command -> option -> values; an option "" stands for more words
WRONG: dict[str, dict[str, list[str]]] = {
    "motion info FILE": READING | {"": ["x.at2", "--nosuch", "FOLDER"]},
    "motion plot FILE": {
        "--out": ["x.nosuch", "nowhere/x.png", "", "FILE"],
        "--out-units": ["furlong", ""],
    },
    "motion convert FILE out.txt": {"--to": ["x"], "--out-units": ["furlong"], "--low": ["nan"]},
    "motion convert FILE": {"": ["nowhere/x", "FILE", ".", "a\0b"]},
    "motion spectrum FILE": {
        "--periods": PERIODS,
        "--damping": ["1", "-1", "nan", "2", "0.05 0.05"],
        "--ec8": ["B", "Z --ag 1"],
        "--ag": ["1", "x"],
        "--csv": ["", "nowhere/x", "x.png --png x.png", "FILE"],
        "--out-units": ["furlong"],
    },
    "run CASE --check --set": {
        "": [
            "run.dt=-1",
            "run.dt=nan",
            "run.dt=x",
            "run.steps=-1",
            "run.steps=1.5",
            "friction.mu=-1",
            "friction.type=X",
            "scheme.phi=x",
            "mesh.divisions=[0,1]",
            "mesh.divisions=[1000000,1000000]",
            "mesh.height=inf",
            "x.y=1",
            "x",
            "=1",
            "material.concrete.nu=0.7",
            "material.concrete.E=1" + "0" * 400,
            "excitation.1.frequency=nan",
            "system.fixed='x'",
            "friction.type=os:system",
            "friction.type=subprocess:Popen",
            "scheme.type=..:x",
            "record.1.type=:",
            "solver.type=x:y",
            "excitation.9.scale=1",
            "mesh.path='x'",
            "format=2",
            "run=1",
            "mesh=[]",
            "record.1.points={}",
            "contact=3",
        ]
    },
    "run CASE --check --allow": {
        "": [
            "",
            ".",
            "a-b",
            "os --set friction.type=os:system",
            "os --set friction.type=osx:system",
            "subprocess --set friction.type=subprocess:Popen",
            "vi_contact --set friction.type=vi_contact.laws:Tresca",
        ]
    },
    "run": {"": ["x.toml", "FOLDER", "FILE", "CASE --out \0", "CASE --check --out=", ""]},
    "ida SHAKEN --motions FILE --edp u_x_top --out study --scales": {
        "": ["nan", "", "-1", "x", "1,1", "0", "inf"]
    },
    "ida SHAKEN --motions FILE --edp u_x_top --out study --levels": {"": ["nan", "0", "-1", "1,x"]},
    "ida SHAKEN --motions FILE --out study --scales 1 --edp": {"": [":max", "a:b", "a:max:b"]},
    "ida SHAKEN --motions FILE --edp u_x_top --out study --scales 1": {
        "--im": ["foo", "sa", "sa:0", "sa:nan", "sa:x", "pga:1"],
        "--jobs": ["0", "-1", "x"],
        "--part": ["0/1", "5/2", "x", "1"],
        "--launch": ["'"],
        "--motions": ["FILE FILE", "FILE,FILE", ",", ""],
        "--levels": ["1"],
        "--set": ["x"],
    },
    "run wall": STEP
    | {
        "--set mesh.divisions= --set mesh.size=": [*SET, "1e-9"],
        "--set mesh.divisions=": ["[0,1]", "[1.5,1]", "[1000000,1000000]"],
        "--set contact.points=": ["foo", "3", "[[1]]", "[[7,1]]"],
        "--set contact.roller=": ["3"],
    },
    "run channel": STEP
    | {
        "--set system.prescribed=": ["foo", '{type="foo"}'],
        "--set gravity.cells=": ["foo", "3"],
        "--set mesh.size=": SET,
        "--set material.soil=": ["{E=1,nu=0.6,rho=1}", "3"],
        "--set friction.mu=": ["0.3"],
        "--set friction.type=Coulomb --set friction.mu=": ["-1", "x", "nan"],
        "--set system.damping=": [
            '{type="Rayleigh",alpha=-1}',
            '{type="Rayleigh.from_frequencies",f1=nan}',
        ],
    },
    "report": {
        "": [
            "nowhere",
            "FILE",
            "FOLDER",
            "RUN --out x.docx",
            "RUN --show nosuch",
            "RUN --show t,u_x_end",
            "RUN --refine",
        ]
    },
    "plot": {
        "": ["nowhere", "FOLDER", "RUN", "RUN --times x", "RUN --out nowhere", "RUN --magnify 0"]
    },
    "film": {
        "": [
            "nowhere",
            "FOLDER",
            "RUN",
            "RUN --between 1",
            "RUN --between 2,1",
            "RUN --out x.avi",
            "RUN --fps 0",
        ]
    },
    "post peaks RUN": {"": ["nosuch", "--out nowhere/x", "--out RUN/history.csv"]},
    "post spectrum RUN": {
        "a_x_end --periods": PERIODS,
        "a_x_end --damping": ["1", "nan", "-1"],
        "": ["u_x_end", "nosuch"],
    },
    "post transfer RUN a_x_end": {
        "": ["nosuch", "u_x_end"],
        "--frequencies": ["0 1 5", "1 99999 5", "1 2 1e12"],
        "--bandwidth": ["nan", "-1", "x"],
    },
    "post loop RUN": {"": ["nosuch u_x_end", "u_x_end", "u_x_end nosuch"]},
    "": {"": ["", "nosuch", "--nosuch", "motion", "post nosuch", "\0", "run"]},
}


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A record, a case, a run folder and an empty folder."""
    folder = tmp_path_factory.mktemp("cli")
    noise = ground_motion.synthetic(ground_motion.KanaiTajimi(s0=0.01), 2.0, 0.01, seed=1)
    motion = ground_motion.scaled_to_pga(noise, 1.0)
    ground_motion.write_at2(motion, folder / "motion.at2", "g")
    case = Path(__file__).resolve().parents[2] / "demos" / "cases" / "wall.toml"
    text = '[friction]\ntype = "Coulomb"\nmu = 0.3\n[[excitation]]'
    (folder / "case.toml").write_text(
        case.read_text("utf-8").replace("[[excitation]]", text, 1), "utf-8"
    )
    problem = chain_problem(
        3, gap=1e-3, excitation=vc.Ricker(3.0, 6.0, direction=(1.0,)), consistent=True
    )
    vc.simulate(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(),
        dt=5e-3,
        steps=20,
        out=folder / "run",
        progress=False,
        record=[vc.Probe({"end": (3.0,)}, acceleration=True)],
    )
    (folder / "empty").mkdir()
    shaken = re.sub(
        r"(?s)\[\[excitation\]\].*?(?=\n\[)",
        SHAKING,
        (folder / "case.toml").read_text("utf-8"),
        count=1,
    )
    (folder / "shaken.toml").write_text(shaken, "utf-8")
    return {
        "FILE": str(folder / "motion.at2"),
        "CASE": str(folder / "case.toml"),
        "RUN": str(folder / "run"),
        "FOLDER": str(folder / "empty"),
        "SHAKEN": str(folder / "shaken.toml"),
    }


FUZZ = Fuzz("command lines", __file__)
RETIRED = ("wall", "channel", "beam", "layer")
# (command, option, value) -> the word that the sentence must have, where it is no word of the line
SPECIAL = {
    ("motion info FILE", "--units", ""): "unit",
    ("run CASE --check --allow", "", ""): "--allow ''",
    ("run", "", ""): "''",
    ("", "", ""): "COMMAND",
    ("", "", "--nosuch"): "COMMAND",
    ("", "", "\0"): "COMMAND",
    ("run", "", "CASE --out \0"): "NUL",
    ("motion convert FILE", "", "a\0b"): "NUL",
    ("run wall", "--set contact.points=", "[[1]]"): "contact point (1.0,)",
    ("run wall", "--set contact.points=", "[[7,1]]"): "contact point (7, 1)",
    ("run channel", "--set material.soil=", "3"): "[material]",
    ("run channel", "--set friction.mu=", "0.3"): "[friction] has no type",
    ("post loop RUN", "", "u_x_end"): "FORCE",
    ("motion spectrum FILE", "--ec8", "Z --ag 1"): "ground 'Z'",
    ("run CASE --check --set", "", "x.y=1"): "[x]",
    (
        "run CASE --check --set",
        "",
        "material.concrete.E=1" + "0" * 400,
    ): "material.concrete.E holds a whole number",
    ("ida SHAKEN --motions FILE --edp u_x_top --out study --scales", "", "1,1"): "[1.0, 1.0]",
    (
        "ida SHAKEN --motions FILE --edp u_x_top --out study --scales 1",
        "--motions",
        "FILE,FILE",
    ): "motion.at2, motion.at2",
    **{(f"run {case}", "--motion", "."): "Is a directory" for case in ("wall", "channel")},
    **{(f"run {case}", "--set", "impact.e=2"): "unknown key 'e'" for case in ("wall", "channel")},
    ("report", "", "RUN --show t,u_x_end"): "columns t, u_x_end",
}


def entries() -> list[list[str]]:
    """[command, option, value] of every wrong line."""
    return [
        [command, option, value]
        for command, options in WRONG.items()
        for option, values in options.items()
        for value in values
    ]


def chosen(dice: Random) -> list[str]:
    """A wrong line; of an option that takes numbers sometimes with a number that nobody has written
    down here."""
    command, option, value = dice.choice(entries())
    if (
        option in ("--low", "--high", "--resample", "--dt", "--arias")
        and command == "motion info FILE"
    ):
        value = dice.choice(
            [
                value,
                f"-{dice.random()}",
                f"{dice.random()}x",
                f"{dice.randint(1, 9)}e{dice.randint(400, 999)}",
            ]
        )
    return [command, option, value]


def faults(command: str, option: str, value: str) -> list[str]:
    """Words of which the sentence must have one: the key or option that was given the wrong value,
    or this value."""
    if (command, option, value) in SPECIAL:
        return [SPECIAL[command, option, value]]
    if command in RETIRED:
        return [f"'{command}'"]
    name = option.split()[-1].rstrip("=") if option else ""
    found = [name.lstrip("-").split(".")[-1]] if name else []
    for word in value.split(" "):
        key, equals, given = word.partition("=")
        found += [key.split(".")[-1], given] if equals else [word]
    return [word for word in found if len(word) > 1 and not word.replace(".", "").isdecimal()] or [
        value
    ]


def words(command: str, option: str, value: str) -> list[str]:
    if option.endswith("="):  # a key of --set
        return [*command.split(), *f"{option}{value}".split(" ")]
    given = value.split(" ") if value else [""]
    if option and len(given) == 1 and " " not in option:
        # a value that begins with a dash is one, too
        return [*command.split(), f"{option}={value}"]
    return [*command.split(), *option.split(), *given]


def placed(word: str, places: dict[str, str]) -> str:
    """The word with the names of places in it replaced."""
    for name, path in places.items():
        word = re.sub(rf"(?<![A-Z]){name}(?![A-Z])", path.replace("\\", "/"), word)
    return word


def answered(line: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """(status, what was said on standard error) of a command line."""
    try:
        code = main(line)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    return code, capsys.readouterr().err


@pytest.fixture
def check(
    places: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Callable[[list[str]], None]:
    """Try a line in an empty folder: one sentence about the very fault that it has. An exception
    that is no SystemExit would be a traceback, and ends the test; so does a warning of numpy."""
    monkeypatch.chdir(tmp_path)
    # made once, not for each line
    monkeypatch.setattr("vi_contact.practice.cli.entry.build_parser", cache(build_parser))
    monkeypatch.setattr("signal.signal", lambda *_: None)  # ida makes Ctrl-C of SIGTERM for good
    warnings.simplefilter("error", RuntimeWarning)

    def tried(entry: list[str]) -> None:
        command, option, value = entry
        line = [placed(word, places) for word in words(command, option, value)]
        code, said = answered(line, capsys)
        assert code in (1, 2), (line, said)
        assert code == 2 or said.startswith("vi-contact: ") and said.count("\n") == 1, (line, said)
        sentence = said.splitlines()[-1]
        assert 0 < len(sentence) < 900, (line, said)
        about = [placed(word, places) for word in faults(command, option, value)]
        assert any(word[:50] in sentence for word in about), (line, about, sentence)

    return tried


@pytest.mark.long
@pytest.mark.fuzz
def test_wrong_command_lines(check: Callable[[list[str]], None], tmp_path: Path) -> None:
    FUZZ.each(COUNT, chosen, check)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.slow
def test_all_wrong_command_lines(check: Callable[[list[str]], None], tmp_path: Path) -> None:
    """Those that are written down here, one after the other."""
    for entry in entries():
        check(entry)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_every_wrong_line_is_about_its_fault(places: dict[str, str]) -> None:
    """The words that sentences must have are words of the fault: none of them is one that every
    sentence has."""
    assert len(entries()) > 400
    for entry in entries():
        about = faults(*entry)
        assert about and not {"vi-contact", "error", "give"} & set(about), entry


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("motion info", "pass --units as one of m/s2"),
        ("run wall --motion", "pass units (--set excitation.1.record.units=UNIT) as one of m/s2"),
        ("motion info --units g --channel 2", "there is no channel '2'"),
        ("motion info --units g --dt 0.5", "--dt 0.5 was passed"),
        ("motion info --units cm/s2 --trim 0.5 9", "start=0.5 and end=9.0"),
    ],
)
def test_sentences_name_options_and_not_arguments(
    command: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "motion.txt").write_text("0 0\n0.1 0.5\n0.2 0\n")
    given = command.split()
    place = given.index("--motion") + 1 if "--motion" in given else 2
    assert main([*given[:place], str(tmp_path / "motion.txt"), *given[place:]]) == 1
    said = capsys.readouterr().err
    assert (
        words in said
        and "units=" not in said.replace("record.units=UNIT", "")
        and "dt=" not in said
    )


@pytest.mark.long
def test_a_dollar_in_a_title_is_no_formula(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Titles come from files, and matplotlib would read a formula between two dollars, or fail."""
    monkeypatch.chdir(tmp_path)
    Path("a$\\frac$.txt").write_text("# $\\frac$ of $x\n0 0\n0.1 0.5\n0.2 0\n0.3 0.1\n")
    for command in ("plot", "spectrum"):
        more = ["--periods", "1", "2", "5"] if command == "spectrum" else []
        assert main(["motion", command, "a$\\frac$.txt", "--units", "m/s2", *more]) == 0


def test_names_that_are_no_text_are_printed() -> None:
    assert escape_unprintable("a\udcff.at2") == "a\\udcff.at2" and escape_unprintable("é") in (
        "é",
        "\\xe9",
    )
