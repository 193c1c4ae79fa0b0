"""Runs that are simulated together leave the folders that they leave alone. On several ranks they
go one by one."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import dataclass, replace

import numpy as np
import pytest
from at_step import AtStep, failing
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.wall import Wall, build
from vi_contact.core.packages import petsc_has

MODEL = build(Wall(divisions=(4, 6)), MPI.COMM_WORLD)
DT = MODEL.time_step()
BASE = MODEL.problem("face")
SHAKEN = [
    replace(BASE, excitation=replace(BASE.excitation, amplitude=amplitude))
    for amplitude in (1.0, 0.3, 2.5)
]
RECORDER = vc.Energy()
COLUMNS = (
    "t",
    "energy_kinetic",
    "energy_strain",
    "work_input",
    "loss_contact",
    "loss_impact",
    "contact_resultant",
    "contact_y",
    "contact_uplift",
)


def runs(path, problems=SHAKEN, steps=40, **settings):
    """Return the arguments of runs that write beside each other."""
    return [
        {"problem": one, "dt": DT, "steps": steps, "out": path / f"run{number}"} | settings
        for number, one in enumerate(problems)
    ]


def alike(ours, theirs):
    """Say whether two histories are the same to round-off."""
    return all(
        np.allclose(
            *(np.nan_to_num(one[name]) for one in (ours, theirs)),
            rtol=0.0,
            atol=1e-10 * np.nan_to_num(np.abs(theirs[name])).max(),
        )
        for name in COLUMNS
    )


@pytest.mark.long
def test_every_run_leaves_what_it_leaves_alone(shared_tmp):
    """Histories, summaries and logs are each run's own, also where one ends before the others."""
    asked = runs(shared_tmp / "many")
    asked[1]["steps"] = 15
    shares = []
    found = dict(vc.simulate_many(asked, tell=shares.append))
    assert sorted(found) == [0, 1, 2] and shares == sorted(shares) and shares[-1] == 1.0
    for number, one in enumerate(asked):
        alone = vc.simulate(**(one | {"out": shared_tmp / f"alone{number}"}))
        assert alike(found[number].history, alone.history)
        if MPI.COMM_WORLD.rank == 0:
            stored = vc.read_run(one["out"])
            assert alike(stored.history, found[number].history)
            log = (one["out"] / "run.log").read_text()
            assert (
                log.count("INFO scheme:") == log.count(f"finished after {one['steps']} steps") == 1
            )
            assert log.count(" steps to do") == 1


def test_a_run_that_cannot_begin_or_go_on_leaves_the_others(shared_tmp):
    """The one is told before any step, the other when it fails; its folder says so and keeps its
    rows."""
    asked = runs(shared_tmp, [*SHAKEN, BASE])
    asked[1]["record"] = [vc.Contact(), AtStep(7, failing(vc.InputError("enough")))]
    asked[3]["state"] = replace(
        vc.simulate(BASE, dt=DT, steps=1, progress=False).state, u=np.full(3, np.nan)
    )
    ends = list(vc.simulate_many(asked))
    # what shares no factor of CHOLMOD, which is of one rank, goes one run after the other
    together = MPI.COMM_WORLD.size == 1 and petsc_has("cholmod")
    assert [number for number, _ in ends] == ([3, 1, 0, 2] if together else [3, 0, 1, 2])
    found = dict(ends)
    assert isinstance(found[3], vc.InputError) and str(found[1]) == "enough"
    assert alike(found[2].history, vc.simulate(SHAKEN[2], dt=DT, steps=40, progress=False).history)
    if MPI.COMM_WORLD.rank == 0:
        summary = json.loads((shared_tmp / "run1" / "summary.json").read_text())
        assert (summary["status"], summary["reason"]) == ("failed", "enough")
        assert len(vc.read_run(shared_tmp / "run1").history["t"]) == 7


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_all_and_a_restart_goes_on(shared_tmp, number):
    """Every run that has begun has its checkpoint; continued they are the runs that nobody
    stopped."""
    asked = runs(shared_tmp)

    def recorded(k):
        return [
            vc.Energy(),
            vc.Contact(),
            AtStep(k, lambda: MPI.COMM_WORLD.rank or os.kill(os.getpid(), number)),
        ]

    before = signal.signal(
        number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
    )
    first = [one | {"record": recorded(-1 if place else 20)} for place, one in enumerate(asked)]
    with pytest.raises(vc.Interrupted, match=f"{number.name} ended the run after step 2"):
        list(vc.simulate_many(first))
    signal.signal(number, before)
    if MPI.COMM_WORLD.size == 1:
        assert all(
            json.loads((one["out"] / "summary.json").read_text())["status"] == "interrupted"
            for one in asked
        )
    begun = [
        one | {"restart": MPI.COMM_WORLD.size == 1 or place == 0, "record": recorded(-1)}
        for place, one in enumerate(asked)
    ]
    found = dict(vc.simulate_many(begun))
    for place, problem in enumerate(SHAKEN):
        assert alike(
            found[place].history, vc.simulate(problem, dt=DT, steps=40, progress=False).history
        )
    assert found[0].facts["restarted_from_step"] == 20


@pytest.mark.slow
def test_who_no_longer_waits_leaves_checkpoints(shared_tmp):
    """A loop that ends after the first result closes the others, which can be continued (one rank)
    or begun anew."""
    asked = runs(shared_tmp, steps=30)
    asked[0]["steps"] = 10
    for number, _ in vc.simulate_many(asked):
        assert number == 0
        break
    if MPI.COMM_WORLD.size == 1:
        for one, problem in zip(asked[1:], SHAKEN[1:], strict=True):
            found = vc.simulate(**one, restart=True, progress=False)
            assert found.facts["restarted_from_step"] == 11
            assert alike(
                found.history, vc.simulate(problem, dt=DT, steps=30, progress=False).history
            )


@pytest.mark.two_ranks
def test_runs_with_other_schemes_and_solvers_are_the_runs_alone(shared_tmp):
    """What differs in more than its excitation is not stepped with the first one's scheme or
    tolerance."""
    asked = runs(shared_tmp)
    asked[0] |= {"scheme": vc.Newmark()}
    asked[1] |= {"solver": vc.Condensed(), "tolerance": 1e-7}
    found = dict(vc.simulate_many(asked))
    for number, one in enumerate(asked):
        facts = found[number].facts
        alone = vc.simulate(**(one | {"out": None}), progress=False)
        assert (
            facts["scheme"] == alone.facts["scheme"]
            and facts["tolerance"] == alone.facts["tolerance"]
        )
        assert alike(found[number].history, alone.history)


@dataclass(frozen=True)
class Raises:
    """Shake until 12 steps are done, and refuse to go on."""

    direction: tuple[float, float] = (1.0, 0.0)
    duration: float = np.inf

    def acceleration(self, t: float) -> float:
        if t > 12.0 * DT:
            raise vc.InputError("no record any more")
        return np.sin(t)


@pytest.mark.two_ranks
def test_an_error_in_what_is_made_for_all_is_of_the_guilty_run_alone():
    """The load of one raises while those of all are made: the others are the runs that they are
    alone."""
    problems = [SHAKEN[0], replace(BASE, excitation=Raises()), SHAKEN[2]]
    found = dict(vc.simulate_many([{"problem": one, "dt": DT, "steps": 30} for one in problems]))
    assert isinstance(found[1], vc.InputError) and "no record any more" in str(found[1])
    for number in (0, 2):
        assert alike(
            found[number].history,
            vc.simulate(problems[number], dt=DT, steps=30, progress=False).history,
        )
    ends = dict(vc.march_many(problems, dt=DT, steps=30))
    assert [getattr(ends[number], "new", BASE) is not BASE for number in range(3)] == [
        True,
        False,
        True,
    ]


@pytest.mark.two_ranks
def test_states_of_other_schemes_go_together():
    """What only some states have in mind is left out: the scheme that marches them did not ask for
    it."""
    light = replace(BASE, impact=None, mass=None)
    other = replace(
        vc.simulate(light, scheme=vc.HHT(), dt=DT, steps=1, progress=False).state, t=0.0, k=0
    )
    assert other.memory
    found = dict(
        vc.simulate_many(
            [{"problem": BASE, "dt": DT, "steps": 20, "state": one} for one in (other, None)]
        )
    )
    for number, state in enumerate((other, None)):
        assert alike(
            found[number].history,
            vc.simulate(BASE, dt=DT, steps=20, state=state, progress=False).history,
        )


@pytest.mark.two_ranks
def test_wrong_arguments_are_told(tmp_path):
    with pytest.raises(
        vc.InputError, match="simulate_many: got an unexpected keyword argument 'step'"
    ):
        vc.simulate_many([{"problem": BASE, "dt": DT, "step": 3}])
    with pytest.raises(vc.InputError, match="simulate_many: missing a required argument: 'dt'"):
        vc.simulate_many([{"problem": BASE}])
    with pytest.raises(vc.InputError, match="two runs have one recorder"):
        vc.simulate_many([{"problem": BASE, "dt": DT, "steps": 1, "record": (RECORDER,)}] * 2)
    with pytest.raises(vc.InputError, match="two runs have one folder"):
        vc.simulate_many(
            [{"problem": BASE, "dt": DT, "out": one} for one in (tmp_path, str(tmp_path / "."))]
        )
    (end,) = vc.simulate_many([{"problem": BASE, "dt": DT, "steps": 1, "record": 5}])
    assert "record is 5" in str(end[1])
    with pytest.raises(vc.InputError, match="simulate_many: runs is"):
        vc.simulate_many({"problem": BASE, "dt": DT})
