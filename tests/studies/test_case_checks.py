"""S4.1, S4.7: tables [[check]] of case files, compared from the run folder alone, printed by
``vi-contact post``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact
from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import comparisons, read_case
from vi_contact.practice.studies.report import remarks

pytestmark = pytest.mark.serial
LAYER = """
[mesh]
type = "BlockMesh"
lengths = [2.0, 1.0]
divisions = [4, 4]

[material.soil]
E = 1e8
nu = 0.25
rho = 2000

[system]
prescribed = [{facets = "bottom", components = [1]}, {facets = "right", components = [0]}]

[gravity]
acceleration = 10.0

[[contact]]
facets = "left"
roller = true

[[record]]
type = "Resultants"
name = "stem"
centre = [0.0, 0.0]

[run]
dt = 0.01
steps = 1

[[check]]
type = "AtRest"
height = 1.0
rho = 2000
gravity = 10.0
nu = 0.25
part = "stem"
"""
RANKINE = (
    '\n[[check]]\ntype = "Rankine"\nheight = 1.0\nrho = 2000\npart = "stem"\nphi = 0.5\nslope '
    "= 0.6\n"
)


def test_checks_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A layer at rest between smooth walls: rho g H²/2 nu/(1-nu) exactly, on any mesh; the other
    does not apply."""
    (tmp_path / "layer.toml").write_text(LAYER + RANKINE, encoding="utf-8")
    out = tmp_path / "out"
    read_case(tmp_path / "layer.toml").run(MPI.COMM_SELF, out=out, progress=False)
    rest, moment, active = comparisons(out)
    assert rest.expected == pytest.approx(1e4 / 3.0, rel=1e-14) and rest.ratio == pytest.approx(
        1.0, rel=1e-9
    )
    # linear over the height, as the cells do not turn: H/3
    assert moment.expected == pytest.approx(rest.expected / 3.0, rel=1e-14)
    assert active.found == rest.found and np.isnan(active.expected) and "steeper" in active.applies
    assert main(["post", "checks", str(out)]) == 0
    said = capsys.readouterr().out
    assert "AtRest: expected 3.333, found 3.333 kN/m, ratio 1\n" in said
    assert "AtRest, moment: expected 1.111, found " in said and said.count("K0 = ν/(1-ν)") == 1
    assert "AtRest; AtRest, moment: the ratio is found over expected, and no judgement" in said
    assert "K0 = ν/(1-ν)" in said
    # the report says the same, once for both
    (told,) = (sentence for sentence in remarks((rest, moment, active)) if "below 1" in sentence)
    assert told.startswith("AtRest; AtRest, moment: the ratio is found over expected")
    assert "Rankine: does not apply: the ground is steeper" in said and "nu = 0.25\n" in said
    assert (out / "checks.csv").read_text(encoding="utf-8").count("\n") == 4


def test_the_old_word_of_the_wedge_is_read_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Up to 0.2 the check was called Coulomb, as the friction law is."""
    old = RANKINE.replace("Rankine", "Coulomb")
    (tmp_path / "layer.toml").write_text(LAYER + old, encoding="utf-8")
    read_case(tmp_path / "layer.toml").check()
    told = [record.getMessage() for record in caplog.records]
    assert any("type 'Coulomb' is now 'CoulombWedge': write that" in one for one in told), told


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("AtRest", "Okabe"), "unknown type 'Okabe'"),
        (("nu = 0.25\npart", "mu = 0.25\npart"), "unknown key 'mu'"),
        (("nu = 0.25\npart", "nu = 0.75\npart"), "nu is 0.75; give one from 0 to 0.5"),
        (("AtRest", "mine.checks:Own"), "accepts built-in classes only"),
    ],
)
def test_wrong_tables_are_refused_before_the_run(
    tmp_path: Path, change: tuple[str, str], words: str
) -> None:
    (tmp_path / "layer.toml").write_text(LAYER.replace(*change), encoding="utf-8")
    with pytest.raises(InputError, match=rf"\[check\[1\].*{words}"):
        read_case(tmp_path / "layer.toml").check()


@pytest.mark.long
def test_the_page_prints_what_it_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """S4.7: the case of docs/guide/checks.md, run from its text."""
    page = (Path(vi_contact.__file__).parents[1] / "docs" / "guide" / "checks.md").read_text(
        encoding="utf-8"
    )
    case, printed = (
        re.findall(rf"```{kind}\n(.*?)```", page, re.DOTALL)[0] for kind in ("toml", "text")
    )
    (tmp_path / "layer.toml").write_text(case, encoding="utf-8")
    read_case(tmp_path / "layer.toml").run(MPI.COMM_SELF, out=tmp_path / "out", progress=False)
    assert main(["post", "checks", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out == f"{printed}table: {tmp_path / 'out' / 'checks.csv'}\n"


def test_a_run_without_checks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "layer.toml").write_text(LAYER[: LAYER.index("[[check]]")], encoding="utf-8")
    read_case(tmp_path / "layer.toml").run(MPI.COMM_SELF, out=tmp_path / "out", progress=False)
    assert comparisons(tmp_path / "out") == ()
    assert main(["post", "checks", str(tmp_path / "out")]) == 1
    assert "has no [[check]]: add one" in capsys.readouterr().err
