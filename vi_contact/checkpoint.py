"""Checkpoints: the state of a run in numbers that do not depend on the ranks, so that any number of them can go on.

``checkpoint.npz`` holds t, k, u, v, the reactions, active and the scheme's memory, vectors in the order of
``space.ids`` (the rotated basis has the same numbers as the system's own), the base steps done, and a description of
the run that must not change. It is of the end of a base step, never from inside a halved one, so that a restart takes
the steps of the straight run. The file is replaced as a whole: after a crash it is the last complete one.
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .errors import InputError
from .output import CHECKPOINT, on_root, write_atomically
from .step import ContactProblem, Scheme, State
from .time_steps import TimeSteps, described

Arrays = dict[str, Any]


@dataclass(frozen=True)
class Place:
    """The end of a base step, where a run can be left and continued.

    t_start, k_start: of the state the whole run began with; ``steps`` and ``t_end`` of a restart count from there.
    base: base steps done since then; halved: attempts thrown away since then.
    """

    state: State
    t_start: float
    k_start: int
    base: int = 0
    halved: int = 0

    @classmethod
    def first(cls, state: State) -> Place:
        """The beginning of a run."""
        return cls(state, state.t, state.k)

    @property
    def number(self) -> int:
        """Number of the base step, counted on from the k of the first state."""
        return self.k_start + self.base


def describe(problem: ContactProblem, scheme: Scheme, dt: TimeSteps) -> dict[str, Any]:
    """What a restart must have in common with the run it continues."""
    return {
        "unknowns": problem.system.space.unknowns,
        "contact points": problem.surface.count,
        "dt": described(dt),
        "scheme": repr(scheme),
        "mass": repr(problem.mass),
    }


def write_checkpoint(folder: Path, problem: ContactProblem, place: Place, *, scheme: Scheme, dt: TimeSteps) -> None:
    """Replaces the checkpoint in the folder. Collective; ViContactError on all ranks when the disk refuses it."""
    state = place.state
    vectors, same = _split(problem, state)
    gathered = problem.system.algebra.comm.gather((problem.system.space.ids, vectors))
    about = json.dumps(
        {"run": describe(problem, scheme, dt), "vectors": sorted(vectors), "t": state.t, "k": state.k,
         "t_start": place.t_start, "k_start": place.k_start, "base": place.base, "halved": place.halved}
    )  # json keeps floats to the last bit

    def write() -> None:
        parts = gathered or []
        order = np.argsort(np.concatenate([ids for ids, _ in parts]))
        whole = {name: np.concatenate([found[name] for _, found in parts])[order] for name in vectors}
        buffer = io.BytesIO()
        np.savez(buffer, about=np.array(about), **whole, **same)
        write_atomically(folder / CHECKPOINT, buffer.getvalue())

    on_root(problem.system.algebra.comm, write)


def _split(problem: ContactProblem, state: State) -> tuple[Arrays, Arrays]:
    """(arrays of owned unknowns, arrays that are the same on every rank)."""
    comm = problem.system.algebra.comm
    vectors: Arrays = {"u": state.u, "v": state.v}
    same: Arrays = {"r_n": state.r_n, "active": state.active} | ({} if state.r_t is None else {"r_t": state.r_t})
    for name in sorted(state.memory):
        array = np.asarray(state.memory[name])
        foreign = float(array.shape != state.u.shape)
        kind = same if comm.max(np.array([foreign]))[0] else vectors
        kind[f"memory_{name}"] = array
    return vectors, same


def read_checkpoint(folder: Path, problem: ContactProblem, *, scheme: Scheme, dt: TimeSteps) -> Place:
    """Where a run was left, with the state on the ranks of this one. Collective.

    InputError when the checkpoint is missing, damaged, or of another problem, dt (or plan of them) or scheme.
    """
    file = folder / CHECKPOINT
    comm = problem.system.algebra.comm
    wanted = describe(problem, scheme, dt)
    about, arrays = comm.bcast(on_root(comm, lambda: _read(file, wanted)))
    mine = _places(problem)
    for name in about["vectors"]:
        arrays[name] = arrays[name][mine]
    prefix = "memory_"
    memory = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
    contact = {name: arrays.get(name) for name in ("r_n", "active", "r_t")}
    state = State(about["t"], about["k"], arrays["u"], arrays["v"], memory=memory, **contact)
    return Place(state, about["t_start"], about["k_start"], about["base"], about["halved"])


def _places(problem: ContactProblem) -> Any:
    """Positions of the owned unknowns among all, in the order of their numbers."""
    ids = problem.system.space.ids
    comm = problem.system.algebra.comm
    everyone = np.sort(np.concatenate(comm.bcast(comm.gather(ids))))
    return np.searchsorted(everyone, ids)


def _read(file: Path, wanted: dict[str, Any]) -> tuple[dict[str, Any], Arrays]:
    """Description and whole arrays of a checkpoint that fits the run."""
    if not file.is_file():
        raise InputError(f"there is no checkpoint '{file}' to restart from: give the folder of a run")
    try:
        with np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        about = json.loads(str(arrays.pop("about")))
        run, _ = about["run"], about["base"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"the checkpoint '{file}' is damaged ({error}): start a new run") from error
    for name, value in wanted.items():
        if run.get(name) != value:
            raise InputError(
                f"the checkpoint '{file}' is of a run with {name} = {run.get(name)} but this one has {value}: "
                "restart the same run, or start a new one"
            )
    return about, arrays
