"""The benchmarks that pages give and no other test runs, with small sizes: they end and print their
rows.

Times are not looked at here.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from site_pages import ROOT, loaded

from vi_contact.run.stepper import Stepper

pytest.importorskip("dolfinx")
pytestmark = [pytest.mark.slow, pytest.mark.serial]
FOLDER = ROOT / "benchmarks"


def first_step(benchmark: Any) -> Any:
    """What benchmarks/small_systems.py runs in a process of its own, once and in this one."""

    def start_up(rounds: int) -> tuple[float, list[float]]:
        printed = io.StringIO()
        with (
            patch.object(Stepper, "_attempt", Stepper._attempt),
            patch("os._exit", side_effect=SystemExit),
            patch.object(sys, "argv", ["-c", "run"]),
            contextlib.redirect_stdout(printed),
            pytest.raises(SystemExit),
        ):
            exec(benchmark.FIRST_STEP, {})
        return float(printed.getvalue()), [1.0]

    return start_up


def once(study: Any) -> Any:
    """What computes a study, for the runs that have a process each: the others take its rows."""
    rows: list[Any] = []

    def run(asked: Any, folder: Path, **more: Any) -> Any:
        if not rows:
            rows.append(study(asked, folder.with_name("apart"), **more))
        return rows[0]

    return run


def at_most(measured: Any, size: float) -> Any:
    """The function with no larger box than this: it is computed once."""
    small = cache(measured)
    return lambda *given: small(
        *(min(one, size) if isinstance(one, float) else one for one in given)
    )


# name -> its words, what it prints, smaller parts of it
SMALL: Mapping[str, tuple[str, str, Mapping[str, Any]]] = {
    "beam_steps": ("--elements 20 --repeat 1", r"^ +20( +\d\.\d{3}){4}$", {"STEPS": 20}),
    "bem": ("--one 3 18 1", r'"pulse P": 0\.1.*"step": 0\.0.*"march": ', {}),
    "bem_convolution": ("--one convolution 3", r'"pulse P": 0\.0.*"Uzawa": \d', {}),
    "bem_error_of_forms": (
        "--levels 2 4 8 --examples square --supports rollers",
        r"^square, rollers +unsymmetric +4 .*\n.* 8 ",
        {},
    ),
    "bem_forms": (
        "--sides 3 --laws none",
        r"form unsymmetric, impulse 4\.7.*negative_eigenvalues 0",
        {},
    ),
    "bem_tractions": ("--elements 4 --cells 8", r"^ +4 +8 Coulomb 0.5  shear ", {}),
    "contact_in_space": (
        "--hertz 2 --mindlin --torsion",
        r"^plane +2 ",
        {"PROBLEMS": lambda one: {"hertz": one.PROBLEMS["hertz"][:1]}},
    ),
    "friction_cost": ("--sizes 5e2 --steps 2", r"^ +560 +20 FixedPoint, Anderson ", {}),
    "ida": (
        "--records 1 --scales 1 --duration 0.1 --mesh 2 3",
        r"^worst_difference +0$",
        {"run_ida": lambda one: once(one.run_ida)},
    ),
    "ledger": (
        "--steps 3 --only Midpoint() --json",
        r'^ +"defect, thrown": \d',
        {"DIVISIONS": (4, 2)},
    ),
    "raft": (
        "--sizes 2e4 --steps 2 --no-gravity",
        r"^  steps +2\n  worst +\d",
        {"raft.SIZES": lambda one: {"2e4": 2.0}},
    ),
    "raft --halving": (
        "--halving",
        r"^  worst certificate ",
        {"HALVED": [(2.0, 1e-2)], "raft.T_END": 0.05},
    ),
    "schemes": (
        "--elements 8 --bounces 1 --blocks 50 --only GeneralisedAlpha",
        r"^\| GeneralisedAlpha, rho 0.8 \| 50 ",
        {},
    ),
    "second_order": (
        "--bending 2 --hertz 2 --impact 4",
        r"^bending, plane stress +2 P2 (?s:.*)^impact +4 P2 ",
        {
            "SECTIONS": lambda one: {"plane stress": one.SECTIONS["plane stress"]},
            "ELEMENTS": lambda one: {name: one.ELEMENTS[name] for name in ("Q2", "P2")},
        },
    ),
    "small_systems": (
        "--steps 5 --rounds 1",
        r"^ +216 +11  simulate (?s:.*)^start-up: \d",
        {"start_up": first_step},
    ),
    "soil_boundaries": ("--only dashpots --angles 45 --cells 6", r"^\| 45° \| 0\.00394 \|", {}),
    "soil_boundaries --only boxes": (
        "--only boxes",
        r"^tied sides 3 depths away: 0 %$(?s:.*) 4 depths wide, free: ",
        {
            "shaken_box_in_space": lambda one: at_most(one.shaken_box_in_space, 4.0),
            "level_box": lambda one: at_most(one.level_box, 4.0),
        },
    ),
    "soil_boundaries --only sides": (
        "--only sides",
        r"^\| free field \|( \S+ % \|){4} 0 % \|$",
        {"STEPS": 3, "shaken_box": lambda one: at_most(one.shaken_box, 5.0 * one.DEPTH)},
    ),
    "step_cost": (
        "--problems wall --sizes 5e2 --steps 2",
        r"^ +560 +20 +\d+ +wall Coulomb\(mu=0.4\)",
        {},
    ),
}


@pytest.mark.parametrize("name", SMALL)
def test_a_benchmark_runs_with_small_sizes(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From its command line to its last row."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(FOLDER))
    words, printed, smaller = SMALL[name]
    path = FOLDER / f"{name.split()[0]}.py"
    benchmark = loaded(path)
    for part, value in smaller.items():
        *where, last = part.split(".")
        owner = getattr(benchmark, where[0]) if where else benchmark
        monkeypatch.setattr(owner, last, value(benchmark) if callable(value) else value)
    monkeypatch.setattr(sys, "argv", [str(path), *words.split()])
    benchmark.main()
    assert re.search(printed, capsys.readouterr().out, re.MULTILINE), name
