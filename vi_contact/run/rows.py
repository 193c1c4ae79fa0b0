"""Hold what several runs have in one step as rows: arrays (k, n) and (k, m) of k runs.

The numerics of ``together`` works on these rows. The objects of one run (its state, its step, its
report) are made when somebody asks for them, as views of the rows: a step of a small system costs
as much as the objects that tell of it, and those that nobody reads are not made. What was made
stays as it is, whatever the runs do later: every step has arrays of its own, and nobody writes to
them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..core.algebra import Array, freeze
from ..core.problem import ContactProblem
from ..core.step import Balance, Report, State, StepProblem
from ..core.system import Load, evaluate_history


class LazyRows(dict[int, Any]):
    """Hold something of every run by its row, made when somebody asks for it, and then kept."""

    def __init__(self, make: Callable[[int], Any]) -> None:
        self._make = make

    def __missing__(self, row: int) -> Any:
        value = self._make(row)
        self[row] = value
        return value


class RowReport(Report):
    """Report the step of one run, whose parts are made when they are read.

    It is made of ``row``, the row of the run, and of ``parts``: name of a part of a report -> what
    has it by the row of every run.
    """

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        parts: Mapping[str, Any] = self.__dict__.get("parts", {})
        if name not in parts:
            raise AttributeError(f"Report has no {name}")
        value = parts[name][self.row]
        self.__dict__[name] = value
        return value

    @cached_property
    def momentum(self) -> Array:
        """Return M v of the velocity before the impact law, a row of that of all runs."""
        return np.asarray(self.parts["momentum"][self.row])

    @cached_property
    def elastic(self) -> Array:
        """Return K u at the end, a row of that of all runs."""
        return np.asarray(self.parts["elastic"][self.row])


def join_states(states: Sequence[State]) -> State:
    """Return the states of all runs as rows of one, read-only.

    Of a memory's arrays only the vectors differ from run to run. What some run has not is left out
    of the memory; tangential reactions that some run has not are zero there.
    """
    first = states[0]
    memory = {}
    for name, value in first.memory.items():
        if not all(name in state.memory for state in states):
            continue
        if value.shape == first.u.shape:
            value = freeze(np.stack([state.memory[name] for state in states]))
        memory[name] = value
    r_t = None
    rubbing = [state.r_t for state in states if state.r_t is not None]
    if rubbing:
        zero = 0.0 * rubbing[0]
        r_t = np.stack([zero if state.r_t is None else state.r_t for state in states])
    return State(
        t=first.t,
        k=first.k,
        u=freeze(np.stack([state.u for state in states])),
        v=freeze(np.stack([state.v for state in states])),
        r_n=np.stack([state.r_n for state in states]),
        active=np.stack([state.active for state in states]),
        memory=memory,
        r_t=r_t,
        turned=first.turned,
    )


def split_states(many: State) -> LazyRows:
    """Return the states of the runs, given as rows, each made when somebody asks for it."""

    def split_state(row: int) -> State:
        """Return the state of one run."""
        u = many.u[row]
        v = many.v[row]
        memory = {
            name: value[row] if value.ndim == 2 else value for name, value in many.memory.items()
        }
        r_t = None if many.r_t is None else many.r_t[row]
        contact = (many.r_n[row], many.active[row], memory, r_t)
        return State(many.t, many.k, u, v, *contact, turned=many.turned)

    return LazyRows(split_state)


def split_step(problem: ContactProblem, many: StepProblem, row: int) -> StepProblem:
    """Return the step of one run.

    Args:
        problem: of the run, which has its law of friction.
        many: the step of all, with rows.
        row: of the run.
    """
    slip0 = None if many.slip0 is None else many.slip0[row]
    return StepProblem(
        A=many.A,
        b=many.b[row],
        bound=many.bound if many.bound.ndim == 1 else many.bound[row],
        surface=many.surface,
        scale=many.scale,
        guess=many.guess[row],
        origin=None if many.origin is None else many.origin[row],
        internal=None if many.internal is None else many.internal[row],
        active=many.active[row],
        t=many.t,
        k=many.k,
        friction=problem.friction,
        slip0=slip0,
        rate_factor=many.rate_factor,
    )


def split_balance(many: Callable[[], Balance], row: int) -> Balance:
    """Return the mean equation of one run.

    Args:
        many: makes that of all runs, with rows.
        row: of the run.
    """
    values: dict[str, Any] = {}
    for name, value in vars(many()).items():
        values[name] = value[row] if isinstance(value, np.ndarray) else value
    return Balance(**values)


@dataclass(frozen=True)
class Loads(Load):
    """Hold the loads of several runs of one body, a row for each: ``rows(t)``."""

    rows: Any = None

    def __call__(self, t: float) -> Array:
        """Return the loads of all runs at time t, as rows [N]."""
        return np.asarray(self.rows(t))


def join_loads(problems: Sequence[ContactProblem]) -> Loads:
    """Return the loads of problems on one system.

    They differ in what shakes them, by few vectors times histories: the load of the body, which all
    share, plus factors (runs, vectors) times vectors (vectors, n).
    """
    body = problems[0].unshaken.load

    # Vectors that are alike, such as -M r of one direction, are kept once: row, vector, history.
    forces: list[Array] = []
    numbers: dict[bytes, int] = {}
    places: list[tuple[int, int, Any]] = []
    for run, problem in enumerate(problems):
        for force, history in problem.equations.load.separable[len(body.separable) :]:
            number = numbers.setdefault(force.tobytes(), len(forces))
            if number == len(forces):
                forces.append(force)
            places.append((run, number, history))
    vectors = np.array(forces).reshape(len(forces), len(body.constant))

    def sum_rows(t: float) -> Array:
        """Return the loads of all runs at time t [s], as rows [N]."""
        factors = np.zeros((len(problems), len(vectors)))
        for run, number, history in places:
            factors[run, number] += evaluate_history(history, t)
        return np.asarray(body(t) + factors @ vectors)

    return Loads(body.constant, rows=sum_rows)
