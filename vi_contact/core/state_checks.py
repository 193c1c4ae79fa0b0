"""Make the state that a run begins with, and check that a state belongs to a problem."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .algebra import max_abs
from .checks import instance, number, quote, refuse, whole
from .errors import InputError
from .internal import remembers, select_memory
from .joints import RAISED, read_committed
from .obstacles import PRESS_FIT
from .problem import ContactProblem
from .step import State

# Of the largest displacement or gap: how far round-off may put a body into its obstacle.
OVERLAP = 1e-9
# Friction at corners makes another surface, whose unknowns are others (core.corners).
ON_TRACES = "make both problems on surface.with_own_laws()"


def check_problem_given(owner: str, value: Any) -> None:
    """Raise InputError unless it is a contact problem."""
    instance(owner, "problem", value, ContactProblem, "give a ContactProblem(system, surface, …)")


def read_start_time(owner: str, state: Any) -> float:
    """Return the time of a state [s], 0 for None; InputError for anything else."""
    if state is None:
        return 0.0
    instance(
        owner, "state", state, State, "give a state, of static_equilibrium or of a run, or None"
    )
    whole(owner, "k of the state", state.k)
    return number(owner, "t of the state", state.t, unit="s")


def check_sizes(owner: str, problem: ContactProblem, state: Any) -> None:
    """Raise InputError, on all ranks, for a state of another problem. Collective.

    Args:
        owner: class or function that asks, the first word of the sentence.
        problem: the problem.
        state: the state, which may be anything on any rank.
    """
    read_start_time(owner, state)
    instance(owner, "state", state, State, "give a state, of static_equilibrium or of a run")
    defects = _find_defects_of_state(problem, state)
    refuse((f"{owner}: {text}" for text in defects), problem.surface.comm)


def _find_defects_of_state(problem: ContactProblem, state: State) -> Iterator[str]:
    """Yield a sentence for each wrong array of a state on this rank.

    Its memory is for its scheme, and only what materials and joints remember is looked at.
    """
    if state.turned not in (None, problem.surface.turned):
        yield (
            f"the unknowns of the state are {describe_frames(turned=not problem.surface.turned)} "
            f"and those of the problem {describe_frames(turned=problem.surface.turned)}: "
            f"{ON_TRACES}"
        )
    yield from _find_defects_of_material(problem, state)
    yield from _find_defects_of_joint(problem, state)
    n = problem.system.rows
    m = problem.surface.count
    d = problem.system.influence.shape[1]
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
        if not isinstance(value, np.ndarray) or value.shape != shape:
            yield (
                f"the state has {name} of shape {np.shape(value)} and the problem needs {shape}: "
                "give its own state"
            )
            continue
        kinds = "b" if name == "active" else "iuf"
        if value.dtype.kind not in kinds or not np.all(np.isfinite(value)):
            wanted = "True or False" if name == "active" else "finite real numbers"
            yield f"{name} of the state is {quote(value)}: give {wanted}"


def _find_defects_of_material(problem: ContactProblem, state: State) -> Iterator[str]:
    """Yield a sentence where materials that remember cannot go on from a state on this rank."""
    internal: Any = problem.system.internal
    if not remembers(internal):
        return
    memory = select_memory(state.memory)
    if memory and not internal.fits(memory):
        yield "the state remembers other materials or another mesh: give a state of this problem"
    elif not memory and np.any(state.u):
        yield (
            "the state is deformed and remembers no stress of the body, which yields: give the "
            "state that a static stage or a run of this problem has returned"
        )


def _find_defects_of_joint(problem: ContactProblem, state: State) -> Iterator[str]:
    """Yield a sentence where a joint cannot go on from what a state has gone through on this rank.

    A state without a joint's arrays starts unbroken.
    """
    if problem.joint is None:
        return
    needed = {name: np.shape(x) for name, x in problem.joint.start(problem.surface.count).items()}
    found = {name: np.shape(x) for name, x in read_committed(problem, state).items()}
    found.pop(RAISED, None)
    if found != needed:
        yield (
            f"the state is of another joint law (it has {_list_shapes(found)}, and "
            f"{type(problem.joint).__name__} needs {_list_shapes(needed)}): give a state of this "
            "problem"
        )


def _list_shapes(shapes: dict[str, tuple[int, ...]]) -> str:
    """Return names and shapes of arrays as words."""
    return ", ".join(f"{name} {shapes[name]}" for name in sorted(shapes)) or "nothing"


def describe_frames(*, turned: bool) -> str:
    """Return the words for the unknowns of a surface (``ContactSurface.turned``)."""
    return "in frames of contact nodes" if turned else "along the axes, as where corners rub"


def initial_state(problem: ContactProblem, t: float = 0.0) -> State:
    """Return u0 and v0 of the system in the rotated basis, without reaction. Collective.

    Args:
        problem: the problem.
        t: time [s] of the state, and of the place of a moving obstacle.

    Raises:
        InputError: u0 is in the obstacle.
    """
    system = problem.equations
    surface = problem.surface
    # Only rigid supports bound u0: springs may be pressed. Round-off is relative to the largest
    # displacement and gap of all ranks.
    gap = np.where(surface.rigid, surface.gap(t) - surface.normal_values(system.u0), np.inf)
    overlap = np.max(-gap, initial=-np.inf)
    gap0 = np.max(surface.gap0, initial=0.0)
    overlap, *sizes = surface.comm.max(np.array([overlap, max_abs(system.u0), gap0]))
    if overlap > OVERLAP * max(sizes):
        raise InputError(
            f"the initial displacement penetrates the obstacle by {overlap:.3g} m: reduce it, "
            f"enlarge the gap, or {PRESS_FIT}"
        )
    none = np.zeros(surface.count)
    return State(
        t,
        0,
        system.u0.copy(),
        system.v0.copy(),
        none,
        surface.bilateral.copy(),
        turned=surface.turned,
    )
