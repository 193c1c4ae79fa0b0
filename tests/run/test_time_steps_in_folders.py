"""Runs with changing dt in folders: what they count, checkpoints, restarts to the last bit, on any
number of ranks."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from at_step import AtStep, failing
from marched_chain import chain, difference, equal_files, round_off, run_wall, wall
from marched_chain import run as run_chain

from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.run.march import March
from vi_contact.run.method import Method
from vi_contact.run.recorders import Energy
from vi_contact.run.time_steps import HalvedAtImpact, Schedule, plan_steps
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

serial = pytest.mark.serial
HALF, NEWMARK, DISSIPATIVE = (
    ZienkiewiczWoodTaylor(),
    LinearMultistep.newmark(),
    LinearMultistep.newmark(0.3025, 0.6),
)
THREE = Schedule(((4e-3, 0.2), (1e-3, 0.3), (2.5e-3, inf)))


@pytest.mark.long
@serial
def test_what_a_run_counts(tmp_path: Path):
    """Base steps in steps and t_end, accepted steps in rows and k, attempts thrown away on their
    own."""
    plan = HalvedAtImpact(5e-3, 3)
    solution = run_chain(tmp_path, 300, dt=plan)
    facts, rows = solution.facts, len(solution.history["t"]) - 1
    assert facts["base_steps"] == 300 and facts["steps"] == rows == solution.state.k > 300
    assert facts["halved_steps"] == rows - 300 > 10  # every attempt thrown away makes one step more
    assert solution.history["k"].tolist() == list(range(rows + 1))
    assert facts["dt"] == repr(plan) and facts["t_end"] == pytest.approx(1.5, rel=1e-12)
    assert facts["seconds_per_step"] > facts["seconds_per_linear_step"] > 0.0
    text, log = solution.summary(), (tmp_path / "run.log").read_text()
    assert f"{rows} steps (300 base steps of HalvedAtImpact(dt=0.005, halvings=3))" in text
    assert any(line.split() == ["halved", "steps", str(rows - 300)] for line in text.splitlines())
    assert "300 of 300 steps" in log and log.count(" left") == 10 and "300 steps to do" in log
    assert difference(run_chain(None, None, t_end=1.5, dt=plan).state, solution.state) == 0.0
    plain = run_chain(None, 300)
    assert (
        plain.facts["halved_steps"] == 0
        and plain.facts["base_steps"] == 300
        and "halved" not in plain.summary()
    )


PLANS = [
    THREE,
    HalvedAtImpact(5e-3, 3),
    HalvedAtImpact(Schedule(((5e-3, 0.31), (2.5e-3, 0.4), (4e-3, inf))), 2),
]


@pytest.mark.slow
@serial
@pytest.mark.parametrize(
    "scheme, plan", [*zip((HALF, NEWMARK, DISSIPATIVE), PLANS, strict=True)], ids=repr
)
def test_restart_with_a_plan_to_the_last_bit(tmp_path: Path, scheme: Any, plan: Any):
    """From checkpoints here and there, also right after halved steps: state and files of the
    straight run."""
    straight = run_chain(tmp_path / "straight", 200, scheme=scheme, dt=plan)
    method = Method(chain(), scheme, [Condensed()], plan, tolerance=1e-9)
    loop = March(method, plan_steps(plan, 199, None), initial_state(chain()))
    halved = [
        loop.base
        for _ in loop
        if loop.ended and loop.dt < plan_steps(plan, 199, None).dt(loop.base - 1)
    ]
    assert bool(halved) == isinstance(plan, HalvedAtImpact)
    stops = sorted({50, 101, *halved[:2]})
    for stop in stops:
        run_chain(tmp_path / "parts", stop, scheme=scheme, dt=plan, restart=stop != stops[0])
    parts = run_chain(tmp_path / "parts", 200, scheme=scheme, dt=plan, restart=True)
    assert difference(parts.state, straight.state) == 0.0
    assert equal_files(tmp_path / "parts", tmp_path / "straight")
    for name in ("base_steps", "halved_steps", "steps"):
        assert parts.facts[name] == straight.facts[name]


class Stop(Exception):
    """The end of a run by force."""


@pytest.mark.long
@serial
@pytest.mark.parametrize("scheme", [HALF, DISSIPATIVE], ids=repr)
def test_a_run_that_stops_inside_a_halved_step_goes_on_from_the_base_step_before(
    tmp_path: Path, scheme: Any
):
    """Rows of the unfinished base step are in history.csv, and are computed again, to the last
    bit."""
    plan = HalvedAtImpact(5e-3, 3)

    def go(folder: str, k: int, **more: Any) -> Any:
        record = [Energy(), AtStep(k, failing(Stop()))]
        return run_chain(tmp_path / folder, 150, scheme=scheme, dt=plan, record=record, **more)

    straight = go("straight", -1)
    sizes = np.diff(straight.history["t"])
    inside = int(np.flatnonzero(sizes < 0.9 * sizes[-1])[2]) + 2  # row after the third short step
    first = int(np.flatnonzero(sizes < 0.9 * sizes[-1])[0])  # steps before the first halved one
    with pytest.raises(Stop):
        go("parts", inside)
    rows = (tmp_path / "parts" / "history.csv").read_bytes().count(b"\n") - 1
    assert rows == inside > first + 1
    resumed = go("parts", -1, restart=True)
    assert resumed.facts["restarted_from_step"] == first
    assert difference(resumed.state, straight.state) == 0.0
    assert equal_files(tmp_path / "parts", tmp_path / "straight")
    assert resumed.facts["halved_steps"] == straight.facts["halved_steps"]


@serial
def test_checkpoints_are_of_base_steps_only(tmp_path: Path):
    """One after every tenth base step, and the last; none in between."""
    solution = run_chain(tmp_path, 60, dt=HalvedAtImpact(5e-3, 3), checkpoint_every=10)
    lines = [
        line
        for line in (tmp_path / "run.log").read_text().splitlines()
        if "checkpoint of step" in line
    ]
    steps = [int(line.rsplit(" ", 1)[1]) for line in lines]
    ends = [int(np.argmin(np.abs(solution.history["t"] - 0.05 * i))) for i in range(1, 7)]
    assert steps == ends and steps[-1] > 60


@serial
def test_another_plan_is_refused(tmp_path: Path):
    plan = HalvedAtImpact(5e-3, 3)
    run_chain(tmp_path, 60, dt=plan)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    wrong: list[tuple[Any, str]] = [
        (
            5e-3,
            r"of a run with dt = HalvedAtImpact\(dt=0.005, halvings=3\) but this one has 0.005: "
            r"restart the same",
        ),
        (
            HalvedAtImpact(5e-3, 2),
            r"but this one has HalvedAtImpact\(dt=0.005, halvings=2\): restart the same run",
        ),
        (
            Schedule(((5e-3, inf),)),
            r"this one has Schedule\(pieces=\(\(0.005, inf\),\)\): restart the same run",
        ),
    ]
    for other, words in wrong:
        with pytest.raises(InputError, match=words):
            run_chain(tmp_path, dt=other, restart=True)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


# any number of ranks


@pytest.mark.long
@pytest.mark.parametrize("solver", ["condensed", pytest.param("volume", marks=pytest.mark.slow)])
def test_halved_wall_on_any_number_of_ranks(comm: Any, shared_tmp: Path, solver: str):
    """All ranks halve the same steps; the restart is the straight run, with factors of four dts."""
    pytest.importorskip("dolfinx")
    from vi_contact.solvers.volume.route import Volume

    more = {
        "dt": HalvedAtImpact(Schedule(((1.0 / 280.0, 0.1), (1.0 / 560.0, inf))), 2),
        "scheme": HALF,
    }
    more["solver"] = Condensed() if solver == "condensed" else Volume()
    problem = wall(comm)
    straight = run_wall(comm, shared_tmp / "straight", 60, problem=problem, **more)
    assert straight.facts["halved_steps"] > 0 and straight.facts["worst_certificate"] <= 1e-9
    assert straight.facts["energy_defect"] < 1e-10
    run_wall(comm, shared_tmp / "parts", 33, problem=problem, **more)
    parts = run_wall(comm, shared_tmp / "parts", 60, problem=problem, restart=True, **more)
    if solver == "condensed":
        assert difference(parts.state, straight.state) <= round_off(comm)
    assert parts.facts["halved_steps"] == straight.facts["halved_steps"]
