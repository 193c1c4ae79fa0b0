"""Checkpoint and restart: the straight run to the last bit on one rank, to round-off on as many, to
1e-10 on others."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from marched_chain import (
    NEWMARK,
    chain,
    difference,
    equal_files,
    round_off,
    rubbing_box,
    run,
    run_wall,
    wall,
)

from vi_contact.core.errors import InputError, ViContactError
from vi_contact.core.surfaces import ContactSurface
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import simulate
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers import Iterative


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize(
    ("scheme", "impact"),
    [
        (ZienkiewiczWoodTaylor(0.5), Inelastic()),
        (SS22(), Inelastic(ImpulseUpdate())),
        (NEWMARK, Inelastic()),
        (NEWMARK, Inelastic(ImpulseUpdate())),
    ],
    ids=repr,
)
def test_restart_to_the_last_bit(tmp_path: Path, scheme: Any, impact: Any) -> None:
    """A run continued from its checkpoint has the state and the histories of the straight run, byte
    for byte."""
    problem = chain(impact=impact)
    straight = run(tmp_path / "straight", problem=problem, scheme=scheme)
    run(tmp_path / "parts", 130, problem=problem, scheme=scheme)
    parts = run(tmp_path / "parts", problem=problem, scheme=scheme, restart=True)
    assert difference(parts.state, straight.state) == 0.0
    assert equal_files(tmp_path / "parts", tmp_path / "straight")
    assert straight.history["loss_impact"][-1] != 0.0 and straight.history["loss_contact"][-1] > 0.0


@pytest.mark.long
@pytest.mark.serial
def test_restart_from_before_the_last_row(tmp_path: Path) -> None:
    """Steps after the checkpoint are dropped and computed again."""
    run(tmp_path, 100)
    kept = (tmp_path / "checkpoint.npz").read_bytes()
    run(tmp_path, 130, restart=True)
    (tmp_path / "checkpoint.npz").write_bytes(kept)
    run(tmp_path, restart=True)
    run(tmp_path / "straight")
    assert equal_files(tmp_path, tmp_path / "straight")


@pytest.mark.long
@pytest.mark.serial
def test_restart_into_another_folder(tmp_path: Path) -> None:
    """The old folder stays as it was, the new one holds the whole history; so does a solution
    without a folder."""
    run(tmp_path / "old", 120)
    before = {path: path.read_bytes() for path in (tmp_path / "old").iterdir()}
    run(tmp_path / "new", restart=tmp_path / "old")
    alone = run(None, restart=str(tmp_path / "old" / "checkpoint.npz"))
    straight = run(tmp_path / "straight")
    assert {path: path.read_bytes() for path in (tmp_path / "old").iterdir()} == before
    assert equal_files(tmp_path / "new", tmp_path / "straight")
    assert difference(alone.state, straight.state) == 0.0 and len(alone.history["t"]) == 251


@pytest.mark.long
@pytest.mark.serial
def test_restart_of_a_finished_run(tmp_path: Path) -> None:
    """Nothing is left to do: the same solution. t_end counts from the start of the whole run, to
    the step."""
    done = run(tmp_path, 400)
    again = run(tmp_path, None, t_end=400 * 5e-3, restart=True)
    assert again.state.k == 400 and difference(again.state, done.state) == 0.0
    longer = run(tmp_path, None, t_end=410 * 5e-3, restart=True)
    assert longer.state.k == 410 and len(longer.history["t"]) == 411


@pytest.mark.long
@pytest.mark.serial
def test_start_with_a_step_number(tmp_path: Path) -> None:
    """A run that began at another step and time restarts like any other."""
    start = replace(run(None, 20).state, memory={})
    straight = run(None, 100, state=start)
    run(tmp_path, 60, state=start)
    parts = run(tmp_path, 100, restart=True)
    assert parts.state.k == 120 and difference(parts.state, straight.state) == 0.0


@pytest.mark.serial
def test_what_cannot_be_continued_is_told(tmp_path: Path) -> None:
    """Another dt, scheme or problem, other recorders, no checkpoint: one sentence, and nothing is
    touched."""
    run(tmp_path, 60)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("dt = 0.005 but this one has 0.01", {"dt": 1e-2}),
        ("scheme = ZienkiewiczWoodTaylor.phi=0.5. but", {"scheme": SS22()}),
        ("contact points = 2 but this one has 1", {"problem": chain(left_gap=None)}),
        ("holds other columns", {"record": [Energy()]}),
    ]
    for words, arguments in wrong:
        with pytest.raises(InputError, match=words):
            run(tmp_path, restart=True, **arguments)
    with pytest.raises(
        InputError, match="there is no checkpoint '.*nowhere/checkpoint.npz' to restart from"
    ):
        run(tmp_path, restart=tmp_path / "nowhere")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.serial
@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "other"])
def test_damaged_checkpoint_is_told(tmp_path: Path, damage: str) -> None:
    """Cut, with a flipped bit, empty, or not a checkpoint: one sentence."""
    run(tmp_path, 60)
    path = tmp_path / "checkpoint.npz"
    data = bytearray(path.read_bytes())
    if damage == "flipped":
        place = data.find(run(tmp_path, 60, restart=True).state.u.tobytes())
        data[place] ^= 1
    path.write_bytes(
        {"cut": data[: len(data) // 2], "flipped": data, "empty": b"", "other": b"not a zip"}[
            damage
        ]
    )
    with pytest.raises(
        InputError, match=r"the checkpoint '.*checkpoint.npz' is damaged \(.*\): start a new run"
    ):
        run(tmp_path, restart=True)


KILLED = """
import sys
sys.path.insert(0, {tests!r})
from marched_chain import run
from pathlib import Path
run(Path({out!r}), 10**6, checkpoint_every=10)
"""


@pytest.mark.long
@pytest.mark.serial
def test_kill_9(tmp_path: Path) -> None:
    """kill -9 in full flight: every row written is whole, the checkpoint is, and the run goes on to
    the last bit."""
    tests, package = str(Path(__file__).parents[1] / "support"), str(Path(__file__).parents[2])
    code = KILLED.format(tests=tests, out=str(tmp_path / "killed"))
    child = subprocess.Popen([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": package})
    csv, deadline = tmp_path / "killed" / "history.csv", time.monotonic() + 600
    while not csv.is_file() or csv.read_bytes().count(b"\n") < 150:
        assert child.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    child.wait()
    rows = np.genfromtxt(csv, delimiter=",", names=True)
    assert rows["k"].tolist() == list(range(len(rows))) and len(rows) > 140
    steps = len(rows) + 20
    run(tmp_path / "killed", steps, restart=True)
    run(tmp_path / "straight", steps)
    assert equal_files(tmp_path / "killed", tmp_path / "straight")


# Any number of ranks
# --------------------------------------------------------------------------------------------------


@pytest.mark.promise("guide/go_on.md", "all numbers agree to the last bit")
@pytest.mark.promise("guide/go_on.md", "On several ranks they agree to round-off")
def test_restart_on_the_same_ranks(comm: Any, shared_tmp: Path) -> None:
    """The restart is the straight run: on one rank to the last bit, on several to round-off."""
    pytest.importorskip("dolfinx")
    problem = wall(comm)
    straight = run_wall(comm, shared_tmp / "straight", 60, problem=problem)
    run_wall(comm, shared_tmp / "parts", 33, problem=problem)
    parts = run_wall(comm, shared_tmp / "parts", 60, problem=problem, restart=True)
    assert straight.history["contact_active"].max() > 0
    for name, values in straight.history.items():
        if comm.size == 1:
            assert np.array_equal(parts.history[name], values, equal_nan=values.dtype != bool), name
        elif name not in ("certificate", "energy_defect", "loss_algorithmic"):
            # round-off themselves
            size = np.nanmax(np.abs(values)) or 1.0
            assert np.allclose(
                parts.history[name], values, rtol=0.0, atol=1e-12 * size, equal_nan=True
            ), name
    assert difference(parts.state, straight.state) <= round_off(comm)


FRICTIONAL = {"impulses": (MoreauJean(), ConsistentMass()), "massless": (Trapezoidal(), None)}


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "mass"), FRICTIONAL.values(), ids=FRICTIONAL.keys())
def test_restart_with_friction_on_the_same_ranks(
    comm: Any, shared_tmp: Path, scheme: Any, mass: Any
) -> None:
    """A box that lands, rubs and begins to lift; reactions and slips too go on as in the straight
    run."""
    pytest.importorskip("dolfinx")
    problem = rubbing_box(comm, mass)
    settings: dict[str, Any] = {"scheme": scheme, "dt": 2e-3, "record": [Energy(), Contact()]}
    straight = simulate(problem, steps=32, out=shared_tmp / "straight", **settings)
    for until in (17, 30, 32):
        parts = simulate(
            problem, steps=until, out=shared_tmp / "parts", restart=until > 17, **settings
        )
    closed = straight.history["contact_active"]
    assert closed[0] == 0 < closed[17] and np.ptp(closed[17:]) > 0
    assert straight.state.r_t is not None and problem.surface.some(straight.state.r_t != 0.0)
    assert difference(parts.state, straight.state) <= round_off(comm)
    assert comm.size > 1 or equal_files(shared_tmp / "parts", shared_tmp / "straight")


@pytest.mark.long
def test_arrays_of_many_points_are_gathered_on_one_rank(
    comm: Any, shared_tmp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a default run nothing else is, checkpoint and restart included; every rank reads the same
    from the file."""
    pytest.importorskip("dolfinx")
    straight = run_wall(comm, None, 27)

    def refuse(*_: Any) -> None:
        raise AssertionError("gathered on every rank")

    monkeypatch.setattr(ContactSurface, "everywhere", refuse)
    monkeypatch.setattr("vi_contact.core.sizes.OWN_CONDITIONS", 0)
    monkeypatch.setattr("vi_contact.run.files.table.SHARED", 1)
    problem, solver = wall(comm), Iterative(tolerance=1e-12)
    alone = run_wall(comm, None, 27, problem=problem, solver=solver)
    run_wall(comm, shared_tmp, 22, problem=problem, solver=solver)
    kept = run_wall(comm, shared_tmp, 27, problem=problem, solver=solver, restart=True)
    assert straight.history["active"].any()
    for name in ("pressure", "gap", "active"):
        values = straight.history[name]
        for found in (kept.history, *([alone.history] if comm.rank == 0 else [])):
            assert np.allclose(found[name], values, rtol=0.0, atol=1e-8 * np.abs(values).max()), (
                name
            )
        if comm.rank:
            with pytest.raises(
                ViContactError,
                match=f"'{name}' of more than 1 points is on rank 0 only: give the run",
            ):
                alone.history[name]


def test_restart_with_another_mass_matrix_is_refused(comm: Any, shared_tmp: Path) -> None:
    """The default scheme on its own mass matrix does not go on with the consistent one; the
    sentence names both."""
    pytest.importorskip("dolfinx")
    box = rubbing_box(comm, None)
    settings: dict[str, Any] = {"scheme": Trapezoidal(), "dt": 1e-3, "out": shared_tmp}
    simulate(box, steps=3, **settings)
    words = (
        r"a run with mass = Redistributed\(lumping=0.4\) but this one has ConsistentMass\(\): "
        r"restart the same"
    )
    with pytest.raises(InputError, match=words):
        simulate(replace(box, mass=ConsistentMass()), steps=6, restart=True, **settings)
    assert (
        simulate(replace(box, mass=Redistributed()), steps=6, restart=True, **settings).state.k == 6
    )


@pytest.mark.long
@pytest.mark.promise("guide/clusters.md", "Results then agree to round-off")
def test_restart_on_another_number_of_ranks(comm: Any, shared_tmp: Path) -> None:
    """A checkpoint of one rank goes on on all of them, and one of all of them on one: the histories
    agree to 1e-10."""
    pytest.importorskip("dolfinx")
    from mpi4py import MPI

    alone = run_wall(MPI.COMM_SELF, shared_tmp / "alone" if comm.rank == 0 else None, 60)
    if comm.rank == 0:
        run_wall(MPI.COMM_SELF, shared_tmp / "one", 31)
    comm.Barrier()
    spread = run_wall(comm, shared_tmp / "one", 60, restart=True)
    run_wall(comm, shared_tmp / "all", 31)
    gathered = run_wall(MPI.COMM_SELF, None, 60, restart=shared_tmp / "all")
    for name, values in alone.history.items():
        if name in ("certificate", "energy_defect", "loss_algorithmic"):
            continue  # round-off themselves
        size = np.nanmax(np.abs(values)) or 1.0
        for other in (spread, gathered):
            assert np.allclose(
                other.history[name], values, rtol=0.0, atol=1e-10 * size, equal_nan=True
            ), name
    if comm.rank == 0:  # points and their order are those of one rank
        with (
            h5py.File(shared_tmp / "alone" / "history.h5") as one,
            h5py.File(shared_tmp / "all" / "history.h5") as two,
        ):
            assert len(one["contact/points"]) == len(one["pressure"][0]) > 1
            assert np.array_equal(one["contact/points"], two["contact/points"])
            assert np.allclose(one["contact/weights"], two["contact/weights"], rtol=1e-12, atol=0.0)
