"""A function called after every step sees what march yields, in its order, and may end a run with
nothing lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from fem_problems import WALL_DT, shaken_wall

import vi_contact as vc

RUN = {"scheme": vc.ZienkiewiczWoodTaylor(), "dt": WALL_DT, "progress": False}
SCHEMES = [
    vc.Trapezoidal(),
    vc.ZienkiewiczWoodTaylor(),
    vc.GeneralisedAlpha.spectral_radius(0.8),
    vc.HHT(),
    vc.Houbolt(),
    vc.MoreauJean(),
    vc.ContactStabilisedNewmark(),
    vc.SS22(),
    vc.LinearMultistep.newmark(),
    vc.Midpoint(),
    vc.Newmark(),
]


class Seen(list):
    """A callback that keeps what it sees, and does something at a step."""

    def __init__(self, k: int = -1, do: Any = None) -> None:
        self.k, self.do = k, do

    def __call__(self, state: vc.State, report: vc.Report) -> Any:
        assert report.new is state
        self.append(state)
        return self.do() if state.k == self.k and self.do else None


def fail() -> None:
    raise ValueError("too large")


@pytest.mark.parametrize("dt", [WALL_DT, vc.HalvedAtImpact(WALL_DT, 2)], ids=["constant", "halved"])
def test_it_sees_every_step_of_march_in_order(comm: Any, dt: Any) -> None:
    """The parts of halved steps too; and the run is the one without it."""
    problem, seen = shaken_wall(comm), Seen()
    solution = vc.simulate(problem, **(RUN | {"dt": dt}), steps=25, callback=seen)
    marched = [state for state, _ in vc.march(problem, scheme=RUN["scheme"], dt=dt, steps=25)]
    assert [one.k for one in seen] == [one.k for one in marched] == list(range(1, len(marched) + 1))
    assert len(marched) > 25 or dt == WALL_DT
    for ours, theirs in zip(seen, marched, strict=True):
        assert (
            ours.t == theirs.t
            and np.array_equal(ours.u, theirs.u)
            and np.array_equal(ours.active, theirs.active)
        )
    assert (
        np.array_equal(solution.history["t"][1:], [one.t for one in seen])
        and solution.facts["reason"] == ""
    )


@pytest.mark.serial
@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda one: type(one).__name__)
def test_arrays_are_read_only_and_no_scheme_minds(scheme: Any) -> None:
    """Nobody writes into a state that was handed out, not even the scheme into its memory."""
    problem = chain_problem(5, gap=1e-3, excitation=vc.Harmonic(-30.0, 3.0, direction=(1.0,)))
    seen = Seen()
    ours = vc.simulate(problem, scheme=scheme, dt=5e-3, steps=60, callback=seen, progress=False)
    theirs = vc.simulate(problem, scheme=scheme, dt=5e-3, steps=60, progress=False)
    assert np.array_equal(ours.state.u, theirs.state.u) and ours.history["contact_active"].any()
    for array in (seen[-1].u, seen[-1].v, seen[-1].r_n, seen[-1].active, *seen[-1].memory.values()):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0


def test_reports_are_read_only_and_the_problem_stays_as_it_was(comm: Any) -> None:
    """The bound of a step is the gap of the problem itself: written into, later runs would have
    another one."""
    problem, met = shaken_wall(comm), []
    before = vc.simulate(problem, **RUN, steps=5)

    def write(_: vc.State, report: vc.Report) -> None:
        step, result = report.step, report.result
        ours = step.bound, step.b, step.guess, step.active, result.x, result.r_n
        for array in (*ours, report.v_minus, report.old.r_n):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0
            met.append(array)

    during, after = (
        vc.simulate(problem, **RUN, steps=5, callback=write),
        vc.simulate(problem, **RUN, steps=5),
    )
    assert len(met) == 40 and np.array_equal(before.state.u, during.state.u)
    assert np.array_equal(before.state.u, after.state.u)
    assert problem.surface.gap0.flags.writeable == shaken_wall(comm).surface.gap0.flags.writeable


def test_true_ends_the_run_and_a_restart_goes_on(comm: Any, shared_tmp: Path) -> None:
    """Asked by one rank alone, in the middle of a halved step: the base step is ended, all is
    written."""
    problem, dt = shaken_wall(comm), vc.HalvedAtImpact(WALL_DT, 2)
    whole = vc.simulate(problem, **(RUN | {"dt": dt}), steps=30)
    parts = np.flatnonzero(np.diff(whole.history["t"]) < 0.9 * WALL_DT)
    first = int(parts[0]) + 1  # the first part of a step that was halved
    seen = Seen(first, lambda: comm.rank == comm.size - 1)
    stopped = vc.simulate(problem, **(RUN | {"dt": dt}), steps=30, out=shared_tmp, callback=seen)
    assert first < stopped.state.k < whole.state.k and len(seen) == stopped.state.k
    assert stopped.facts["status"] == "stopped" and "run stopped: " in stopped.summary()
    assert (
        stopped.facts["reason"]
        == f"the callback ended the run after step {first}, t = {seen[first - 1].t:.6g} s"
    )
    seen = Seen()
    solution = vc.simulate(
        problem, **(RUN | {"dt": dt}), steps=30, out=shared_tmp, callback=seen, restart=True
    )
    assert [one.k for one in seen] == list(range(stopped.state.k + 1, whole.state.k + 1))
    assert solution.facts["status"] == "finished" and len(solution.history["t"]) == len(
        whole.history["t"]
    )
    size = comm.allreduce(float(np.abs(whole.state.u).max(initial=0.0)), op=max)
    assert np.abs(solution.state.u - whole.state.u).max(initial=0.0) <= 1e-12 * size


def test_what_it_raises_ends_the_run_on_all_ranks(comm: Any, shared_tmp: Path) -> None:
    """On one rank only: rows, checkpoint and the reason are in the folder, on any number of
    ranks."""
    problem = shaken_wall(comm)
    seen = Seen(7, lambda: fail() if comm.rank == comm.size - 1 else None)
    words = (
        r"the callback after step 7, t = 0\.0125 s: it ended in ValueError: too large "
        r"\(test_callback\.py, line \d"
    )
    with pytest.raises(vc.InputError, match=words):
        vc.simulate(problem, **RUN, steps=30, out=shared_tmp, callback=seen)
    comm.Barrier()  # rank 0 writes the summary last
    run = vc.read_run(shared_tmp)
    assert (
        run.history["k"][-1] == 7
        and run.facts["status"] == "failed"
        and "the callback" in run.facts["reason"]
    )
    seen = Seen()
    vc.simulate(problem, **RUN, steps=9, out=shared_tmp, callback=seen, restart=True)
    assert [one.k for one in seen] == [8, 9]


def test_of_many_runs_each_has_its_own(comm: Any) -> None:
    """One fails, one stops, one goes on: in one group of rows on one rank, one by one on
    several."""
    base = shaken_wall(comm)
    problems = [
        replace(base, excitation=replace(base.excitation, amplitude=a)) for a in (3.0, 2.0, 1.0)
    ]
    calls = [Seen(4, fail), Seen(6, lambda: True), Seen()]
    runs = [
        {"problem": one, **RUN, "steps": 9, "callback": call}
        for one, call in zip(problems, calls, strict=True)
    ]
    found = dict(vc.simulate_many(runs))
    assert [len(one) for one in calls] == [4, 6, 9]
    assert isinstance(found[0], vc.InputError) and "the callback after step 4" in str(found[0])
    assert [found[i].facts["status"] for i in (1, 2)] == ["stopped", "finished"]


@pytest.mark.serial
def test_what_is_no_function_is_refused() -> None:
    for wrong in (3, Seen):
        with pytest.raises(vc.InputError, match="simulate: callback is"):
            vc.simulate(chain_problem(3), dt=1e-3, steps=1, callback=wrong)
