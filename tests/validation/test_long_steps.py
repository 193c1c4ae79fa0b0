"""Energy in long time steps: the table of docs/guide/schemes.md, and that the warning names a
scheme that helps."""

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
SPEC = spec_from_file_location("benchmark_long_steps", ROOT / "benchmarks" / "long_steps.py")
assert SPEC and SPEC.loader
BENCHMARK: Any = module_from_spec(SPEC)
SPEC.loader.exec_module(BENCHMARK)
DT, T_END = BENCHMARK.STEPS[0], 3.0  # s


@cache
def run(scheme: Any, dt: Any = DT) -> vc.Solution:
    return BENCHMARK.run(scheme, dt, T_END)


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
def test_the_table_of_the_page(name: str) -> None:
    """Its first column, steps of 10 ms, in classes: what grows is chaotic, and whether it grows is
    not."""
    page = (ROOT / "docs" / "guide" / "schemes.md").read_text(encoding="utf-8")
    row = re.search(
        rf"^\| {re.escape(name)} \| ([^|]+) \|", page[page.index("| 10 ms (67) |") :], re.MULTILINE
    )
    assert row and row[1] == BENCHMARK.told(run(BENCHMARK.SCHEMES[name]).facts["energy_created"])
