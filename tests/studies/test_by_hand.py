"""The cases of docs/guide/by_hand.md: statics of a run are those of the calculation by hand, and
the page is that of the calculations and of stored results."""

from __future__ import annotations

import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")

from vi_contact.practice.cli.entry import main

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
# the cases of demos/cases; the larger ones take some seconds
OWN = [
    "quay",
    "buttress",
    "monument",
    pytest.param("cantilever", marks=pytest.mark.slow),
    pytest.param("two_towers", marks=pytest.mark.slow),
]
# rest is the first row of any run
STATICS = ["run.steps=1", "run.t_end=", "fields="]


def load(name: str) -> ModuleType:
    """A script of the documents, as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for their types
    spec.loader.exec_module(module)
    return module


BY_HAND = load("make_by_hand")


def test_the_page_is_that_of_calculations_and_runs() -> None:
    """After a change of docs/by_hand: python3 docs/make_by_hand.py. Every number that a run has is
    stored, and one beyond its accuracy has its reason."""
    calculations = [BY_HAND.read_calculation(name) for name in BY_HAND.NAMES]
    found = BY_HAND.read_found()
    assert BY_HAND.PAGE.read_text(encoding="utf-8") == BY_HAND.written()
    assert list(BY_HAND.find_unexplained(calculations, found)) == []
    compared = {
        (calculation.name, line.symbol)
        for calculation in calculations
        for line in calculation.lines
        if line.is_compared
    }
    assert compared == set(found)


def test_case_is_in_order(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One of them by the command; the statics below run all."""
    case = str(ROOT / "demos" / "cases" / "quay.toml")
    assert main(["run", case, "--check", "--out", str(tmp_path / "checked")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"rigid motions that are left +0\n", said)
    assert "the file is in order" in said


@pytest.mark.long
@pytest.mark.parametrize("name", OWN)
def test_statics_are_those_of_the_calculation(name: str, tmp_path: Path) -> None:
    """Weights, thrusts, uplifts and eccentricities, in closed form: N to 1e-8, e to 1e-7."""
    calculation = BY_HAND.read_calculation(name)
    exact = [line for line in calculation.lines if line.is_exact and line.at == "rest"]
    assert len(exact) >= 2
    found = BY_HAND.run_case(calculation, exact, out=tmp_path / "run", settings=STATICS)
    for line in exact:
        assert calculation.agrees(line, found[line.symbol]), line.symbol


@pytest.mark.slow
@pytest.mark.parametrize(("name", "symbol"), [("buttress", "D"), ("monument", "theta")])
def test_motion_is_that_of_a_rigid_block(name: str, symbol: str, tmp_path: Path) -> None:
    """Newmark's block under a jolt, and Housner's, in closed form."""
    calculation = BY_HAND.read_calculation(name)
    (line,) = (line for line in calculation.lines if line.symbol == symbol)
    found = BY_HAND.run_case(calculation, [line], out=tmp_path / "run", settings=["fields="])
    assert calculation.agrees(line, found[symbol])


def test_a_wrong_number_does_not_agree() -> None:
    """Neither one off by more than its accuracy, nor one on the wrong side of a bound."""
    calculation = BY_HAND.read_calculation("wall")
    lines = {line.symbol: line for line in calculation.lines}
    values = calculation.values
    for symbol, factor in (("W", 1.0 + 1e-7), ("W_f", 1.16), ("E_0", 1.001), ("p_toe", 0.999)):
        assert calculation.agrees(lines[symbol], values[symbol])
        assert not calculation.agrees(lines[symbol], factor * values[symbol])
    assert not calculation.agrees(lines["X"], 1e-7 * values["W"])  # relative to the weight
    found = {("wall", "W_f"): 1.16 * values["W_f"]}
    assert list(BY_HAND.find_unexplained([calculation], found)) == ["wall: W_f: 291787"]
    heavier = [replace(lines["W"], formula="1.001*rho_c*g*(B*slab + stem*(H - slab))")]
    assert not replace(calculation, lines=heavier).agrees(lines["W"], values["W"])


def test_columns_are_picked_at_their_rows() -> None:
    line = BY_HAND.Line(symbol="X", what="", formula="0", unit="N", basis="", sheet="-a_x + abs(b)")
    history = {"a_x": np.array([1.0, 2.0, -7.0]), "b": np.array([-3.0, np.nan, 1.0])}
    picked = [BY_HAND.pick(replace(line, at=at), history) for at in ("rest", "largest", "change")]
    assert picked == [2.0, 8.0, 6.0]


def test_a_peak_lasts_as_long_as_its_steps() -> None:
    lasts = load("make_wall_steps").lasts
    t = 0.01 * np.arange(7)
    assert lasts(t, np.array([0.0, 1.0, 8.9, 10.0, 9.5, 1.0, 9.9])) == pytest.approx(0.02)
    assert lasts(t, np.array([0.0, 0.0, 5.0, 0.0, 4.6, 0.0, 0.0])) == pytest.approx(0.01)
