"""Check that a state belongs to a problem: its time, and sizes and kinds of its arrays on every rank."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .checks import instance, number, refuse, shown, whole
from .problem import ContactProblem
from .step import State


def check_problem_given(owner: str, value: Any) -> None:
    """InputError unless it is a contact problem."""
    instance(owner, "problem", value, ContactProblem, "give a ContactProblem(system, surface, …)")


def start_time(owner: str, state: Any) -> float:
    """The time of a state [s], 0 of None; InputError for anything else."""
    if state is None:
        return 0.0
    instance(owner, "state", state, State, "give a state, of static_equilibrium or of a run, or None")
    whole(owner, "k of the state", state.k)
    return number(owner, "t of the state", state.t, unit="s")


def check_sizes(owner: str, problem: ContactProblem, state: Any) -> None:
    """InputError, on all ranks, for a state of another problem. Collective."""
    start_time(owner, state)
    instance(owner, "state", state, State, "give a state, of static_equilibrium or of a run")
    refuse((f"{owner}: {text}" for text in _of_state(problem, state)), problem.surface.comm)


def _of_state(problem: ContactProblem, state: State) -> Iterator[str]:
    """What is wrong with a state on this rank."""
    n, m, d = problem.system.rows, problem.surface.count, problem.system.influence.shape[1]
    shapes: dict[str, tuple[int, ...]] = {"u": (n,), "v": (n,), "r_n": (m,), "active": (m,), "r_t": (m, d - 1)}
    for name, shape in shapes.items():
        value = getattr(state, name)
        if name == "r_t" and value is None:
            continue
        kinds, wanted = ("b", "True or False") if name == "active" else ("iuf", "finite real numbers")
        if not isinstance(value, np.ndarray) or value.shape != shape:
            yield f"the state has {name} of shape {np.shape(value)} and the problem needs {shape}: give one of its own"
        elif value.dtype.kind not in kinds or not np.all(np.isfinite(value)):
            yield f"{name} of the state is {shown(value)}: give {wanted}"
