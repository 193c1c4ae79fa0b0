"""Sentences about Python calls in the words of case files."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("dolfinx")

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.sentences import write_for_case_files

pytestmark = pytest.mark.serial

# What a room says -> what a case file's reader is told; one of each kind.
SENTENCES = {
    "a law by a keyword": (
        "give the problem mass=ConsistentMass()",
        'give [mass] type = "ConsistentMass"',
    ),
    "a key of a table": (
        "or use matching=DualMortar()",
        'or use matching = {type = "DualMortar"}',
    ),
    "a class in another, without its name": (
        "use Condensed(Lemke()), or Volume()",
        'use [solver] type = "Condensed" and method = {type = "Lemke"}, or [solver] type = '
        '"Volume"',
    ),
    "arguments with and without values": (
        "give Rayleigh(alpha, beta), or LinearElastic(…, xi=0.05)",
        'give [system.damping] type = "Rayleigh" and alpha = … and beta = …, or [material.NAME] '
        'type = "LinearElastic" and xi = 0.05',
    ),
    "a package before a class": (
        "run with fields=fem.XDMF(every=10)",
        'run with [fields] type = "XDMF" and every = 10',
    ),
    "a vector": (
        "HalfSpace(point=(0.0, 1.0))",
        'obstacle = {type = "HalfSpace", point = [0.0, 1.0]}',
    ),
    "keys without values": (
        "a larger feature_angle=, or leave it out (points=)",
        "a larger feature_angle = …, or leave it out (points = …)",
    ),
    "truth and words": (
        "say hinges=True or integration='selective'",
        'say hinges = true or integration = "selective"',
    ),
    "a method of an object": (
        "slide freely (surface.with_frictionless_corners())",
        "slide freely (frictionless_corners = true in every [[contact]])",
    ),
    "a point of a probe": (
        "Probe: points['10']: point (6, 7.5) is 1.5 m away",
        "[record.points] 10: point (6, 7.5) is 1.5 m away",
    ),
    "an argument that is an option": ("allow it (changed=True)", "allow it (--restart-changed)"),
}
# What has signs of equality or brackets and is no call.
OTHERS = (
    "'runs/dt=0.1/a=b' cannot be read",
    "write a^x as exp(x*log(a))",
    "give KEY=VALUE, such as friction.mu=0.5",
    "node (0, 0) is on side 1",
)
# A mesh that is too coarse for the mass of the default scheme: found when the run begins.
CORNER = """
[mesh]
type = "BlockMesh"
divisions = [2, 2]
[material.soil]
E = 2.0e7
nu = 0.3
rho = 2000.0
[[contact]]
facets = "bottom"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}
[[contact]]
facets = "right"
obstacle = {type = "HalfSpace", point = [1.0, 0.0], normal = [-1.0, 0.0]}
[friction]
type = "Coulomb"
mu = 0.3
[run]
dt = 0.01
steps = 1
"""


@pytest.mark.parametrize("kind", SENTENCES)
def test_a_call_is_a_table(kind: str) -> None:
    sentence, words = SENTENCES[kind]
    assert write_for_case_files(sentence) == words
    assert write_for_case_files(words) == words  # once more changes nothing


@pytest.mark.parametrize("sentence", OTHERS)
def test_what_is_no_call_stays(sentence: str) -> None:
    assert write_for_case_files(sentence) == sentence


@pytest.mark.parametrize("words", [[], ["--check"]])
def test_a_run_and_its_check_say_what_to_write(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    case = tmp_path / "case.toml"
    case.write_text(CORNER)
    assert main(["run", str(case), "--out", str(tmp_path / "out"), *words]) == 1
    said = capsys.readouterr().err
    assert '[mass] type = "ConsistentMass"' in said
    assert "()" not in said


def test_a_table_that_cannot_be_made_says_what_to_write(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    broken = 'damping = {type = "DampingRatio", frequency = 5.0}'
    case.write_text(CORNER + f"[system]\n{broken}\n")
    with pytest.raises(InputError, match=r"\[material"):
        read_case(case)


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        (["mesh.divisions=[4, 6]"], "[contact] contact point (6, 2.25) is 0.75 m away"),
        (["mesh.height=6", "contact.points="], "[record.points] 10: point (6, 7.5) is 1.5 m away"),
    ],
)
def test_another_wall_names_the_points_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], settings: list[str], place: str
) -> None:
    """The built-in wall lists points, which the user has not written."""
    words = [word for setting in settings for word in ("--set", setting)]
    assert main(["run", "wall", *words, "--quiet", "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert place in said and "leave" in said


def test_an_unknown_option_is_told_under_the_usage_of_its_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["motion", "info", "record.at2", "--nonsense"])
    said = capsys.readouterr().err
    assert said.startswith("usage: vi-contact motion info")
    assert "unknown option: --nonsense" in said


OLD = CORNER.replace('[[contact]]\nfacets = "right"', '[[contact]]\nheld = true\nfacets = "right"')


def test_old_keys_are_read_with_one_warning_that_names_the_new(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Of tables, of stages and of settings; the case is that of the new keys."""
    stage = '\n[[stage]]\nname = "rest"\ntype = "static"\nsystem = {clamped = "bottom"}\n'
    old = OLD.replace("[run]\ndt = 0.01\nsteps = 1\n", "") + stage
    cases = []
    for text in (old, old.replace("clamped", "fixed").replace("held", "roller")):
        case = tmp_path / "case.toml"
        case.write_text(text)
        cases.append(read_case(case, ["contact.1.held=true"]))
    assert cases[0].tables == cases[1].tables and cases[0].settings == ("contact.1.roller=true",)
    warnings = [record.message.partition(": ")[2] for record in caplog.records]
    assert warnings == [
        "[contact] held is now roller: write that",
        "[system] clamped is now fixed: write that",
        "[contact] held is now roller: write that",
    ]


def test_a_key_under_both_names_is_refused(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    case.write_text(CORNER + '[system]\nclamped = "left"\nfixed = "right"\n')
    with pytest.raises(InputError, match=r"\[system\] has 'fixed' and 'clamped', .* old name"):
        read_case(case)
