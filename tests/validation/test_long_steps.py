"""Energy in long time steps and in many: tables of docs/guide/schemes.md, and that the warning
names a scheme that helps."""

from __future__ import annotations

import logging
import re
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

import vi_contact as vc

ROOT = Path(__file__).resolve().parents[2]


def load(name: str) -> Any:
    """Return a benchmark, which is no module of a package."""
    spec = spec_from_file_location(f"benchmark_{name}", ROOT / "benchmarks" / f"{name}.py")
    assert spec and spec.loader
    benchmark = module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    return benchmark


BENCHMARK, LEDGER = load("long_steps"), load("ledger")
DT, T_END = BENCHMARK.STEPS[0], 3.0  # s


@cache
def run(scheme: Any, dt: Any = DT) -> vc.Solution:
    return BENCHMARK.run(scheme, dt, T_END)


@pytest.mark.serial  # ranks: tests/schemes has it on them
def test_the_scheme_of_the_warning_creates_none(caplog: pytest.LogCaptureFixture) -> None:
    """Where the default, HHT and halved steps warn, certified step by step, the scheme of the
    sentence creates none."""
    for scheme, dt in (
        (vc.Trapezoidal(), DT),
        (vc.HHT(), DT),
        (vc.Trapezoidal(), vc.HalvedAtImpact(DT)),
    ):
        with caplog.at_level(logging.WARNING, "vi_contact"):
            gained = run(scheme, dt)
        assert gained.facts["energy_created"] > 0.5 and gained.facts["worst_certificate"] < 1e-9
        told = " ".join(gained.summary().split())
        found = re.search(
            r"WARNING: contact and time scheme created .* (\w+)\(\), which creates none", told
        )
        assert found, told
        safe = run(getattr(vc, found[1])())
        energy, work = safe.facts["energy"]["energy_max"], safe.history["work_input"].max()
        assert safe.facts["energy_created"] < 1e-12 and "time scheme created" not in safe.summary()
        assert 0.0 < energy <= work and energy < 0.1 * gained.facts["energy"]["energy_max"]


@pytest.mark.parametrize("name", BENCHMARK.SCHEMES)
@pytest.mark.promise("guide/schemes.md", "Certificates stay below 1e-9 in all these runs")
def test_the_table_of_the_page(name: str) -> None:
    """Its first column, steps of 10 ms, in classes: what grows is chaotic, and whether it grows is
    not."""
    page = (ROOT / "docs" / "guide" / "schemes.md").read_text(encoding="utf-8")
    row = re.search(
        rf"^\| {re.escape(name)} \| ([^|]+) \|", page[page.index("| 10 ms (67) |") :], re.MULTILINE
    )
    facts = run(BENCHMARK.SCHEMES[name]).facts
    assert row and row[1] == BENCHMARK.told(facts["energy_created"])
    assert 0.0 < facts["worst_certificate"] < 1e-9


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.promise(
    "guide/schemes.md", "`Volume()` close the ledger to 1e-12 of the largest energy"
)
@pytest.mark.promise(
    "guide/schemes.md", "that the [ledger](../start/model.md#energy-ledger) has no"
)
@pytest.mark.promise("start/model.md", "In 1000 steps it is below 1e-12 with `Condensed()`")
@pytest.mark.promise("README.md", "that closes to rounding and the tolerance of the solver")
@pytest.mark.parametrize("scheme", [vc.Trapezoidal(), vc.MoreauJean()], ids=repr)
def test_the_ledger_closes_in_a_thousand_steps(scheme: Any) -> None:
    """V9.7: a block swings freely, and another one is thrown on a plane and rubs on it. Measured
    6e-15 and 1e-14."""
    found = LEDGER.measured(scheme, vc.Condensed(), 1000)
    assert 0.0 < found["defect, free"] < 1e-12 and 0.0 < found["defect, thrown"] < 1e-12


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.promise("guide/schemes.md", "The value 0.4 keeps the force within 0.1 %")
@pytest.mark.parametrize("courant", [1.0, 0.5, 0.1])
def test_the_mass_of_the_default_scheme_keeps_the_force(courant: float) -> None:
    """V1.1: measured 0.04 %, of a bar of 100 elements."""
    bars = load("schemes")
    assert 0.0 < bars.oscillation(100, courant, vc.Trapezoidal(), None) < 1e-3
