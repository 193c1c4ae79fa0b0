"""Make the state a run begins with; check that a state belongs to a problem.

The check looks at its time and its arrays on every rank.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .algebra import max_abs
from .checks import instance, number, refuse, shown, whole
from .errors import InputError
from .problem import ContactProblem
from .step import State


def check_problem_given(owner: str, value: Any) -> None:
    """Raise InputError unless it is a contact problem."""
    instance(owner, "problem", value, ContactProblem, "give a ContactProblem(system, surface, …)")


def start_time(owner: str, state: Any) -> float:
    """Return the time of a state [s], 0 for None; InputError for anything else."""
    if state is None:
        return 0.0
    instance(
        owner, "state", state, State, "give a state, of static_equilibrium or of a run, or None"
    )
    whole(owner, "k of the state", state.k)
    return number(owner, "t of the state", state.t, unit="s")


def check_sizes(owner: str, problem: ContactProblem, state: Any) -> None:
    """Raise InputError, on all ranks, for a state of another problem. Collective."""
    start_time(owner, state)
    instance(owner, "state", state, State, "give a state, of static_equilibrium or of a run")
    refuse((f"{owner}: {text}" for text in _of_state(problem, state)), problem.surface.comm)


def _of_state(problem: ContactProblem, state: State) -> Iterator[str]:
    """Say what is wrong with a state on this rank."""
    n, m, d = problem.system.rows, problem.surface.count, problem.system.influence.shape[1]
    shapes: dict[str, tuple[int, ...]] = {
        "u": (n,),
        "v": (n,),
        "r_n": (m,),
        "active": (m,),
        "r_t": (m, d - 1),
    }
    for name, shape in shapes.items():
        value = getattr(state, name)
        if name == "r_t" and value is None:
            continue
        kinds, wanted = (
            ("b", "True or False") if name == "active" else ("iuf", "finite real numbers")
        )
        if not isinstance(value, np.ndarray) or value.shape != shape:
            yield (
                f"the state has {name} of shape {np.shape(value)} and the problem needs {shape}: "
                "give its own state"
            )
        elif value.dtype.kind not in kinds or not np.all(np.isfinite(value)):
            yield f"{name} of the state is {shown(value)}: give {wanted}"


def initial_state(problem: ContactProblem, t: float = 0.0) -> State:
    """Return u0 and v0 of the system in the rotated basis, without reaction.

    Raises:
        InputError: u0 is in the obstacle.
    """
    system, surface = problem.equations, problem.surface
    gap = np.where(surface.rigid, surface.gap(t) - surface.normal_values(system.u0), np.inf)
    sizes = np.array(
        [np.max(-gap, initial=-np.inf), max_abs(system.u0), np.max(surface.gap0, initial=0.0)]
    )
    behind, *size = surface.comm.max(sizes)
    if behind > 1e-9 * max(size):
        raise InputError(
            f"the initial displacement penetrates the obstacle by {behind:.3g} m: reduce it or "
            "enlarge the gap; a press fit begins in touch, and quasi_static closes it on a surface "
            "that moves, surface.moving(towards=…)"
        )
    none = np.zeros(surface.count)
    return State(t, 0, system.u0.copy(), system.v0.copy(), none, surface.bilateral.copy())
