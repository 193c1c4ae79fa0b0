"""Hold what several runs have in one step as rows.

That of one run is made when somebody asks for it.

A step of a small system costs as much as the objects that tell of it: those that nobody reads are
not made. What was made stays as it is, whatever the runs do later: every step has arrays of its
own, and nobody writes to them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.problem import ContactProblem
from ..core.products import freeze
from ..core.step import Report, State, StepProblem
from ..core.system import Load, history_value


class Each(dict[int, Any]):
    """Hold something of every run by its row, made when somebody asks for it."""

    def __init__(self, make: Callable[[int], Any]) -> None:
        self._make = make

    def __missing__(self, row: int) -> Any:
        self[row] = made = self._make(row)
        return made


class RowReport(Report):
    """Report the step of one run; ``parts`` have those of every run, by the names of a report's."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        parts: Mapping[str, Any] = self.__dict__.get("parts", {})
        if name not in parts:
            raise AttributeError(f"Report has no {name}")
        self.__dict__[name] = made = parts[name][self.row]
        return made


def joined(states: Sequence[State]) -> State:
    """Return the state of all runs, read-only.

    Of a memory's arrays only the vectors differ from run to run.
    """
    first, rubs = states[0], next((0.0 * one.r_t for one in states if one.r_t is not None), None)
    u, v, r_n, active = (
        np.stack([getattr(one, name) for one in states]) for name in ("u", "v", "r_n", "active")
    )
    memory = {
        name: freeze(np.stack([one.memory[name] for one in states]))
        if value.shape == first.u.shape
        else value
        for name, value in first.memory.items()
        if all(name in one.memory for one in states)
    }
    r_t = (
        None if rubs is None else np.stack([rubs if one.r_t is None else one.r_t for one in states])
    )
    return State(first.t, first.k, freeze(u), freeze(v), r_n, active, memory, r_t)


def own_states(problem: ContactProblem, problems: Sequence[ContactProblem], many: State) -> Each:
    """Return the states of runs whose rows are those of ``problem``.

    Their problems get to know the products of the rows.
    """
    viscous = () if problem.equations.C is None else ("C",)

    def made(row: int) -> State:
        memory = {
            name: value[row] if value.ndim == 2 else value for name, value in many.memory.items()
        }
        r_t, u, v = None if many.r_t is None else many.r_t[row], many.u[row], many.v[row]
        pairs = ("M", v, many.v), ("K", u, many.u), *((name, u, many.u) for name in viscous)
        problems[row].equations.know_rows(problem.equations, row, *pairs)
        return State(many.t, many.k, u, v, many.r_n[row], many.active[row], memory, r_t)

    return Each(made)


def own_step(problem: ContactProblem, many: StepProblem, row: int) -> StepProblem:
    """Return the step of one run."""
    slip0 = None if many.slip0 is None else many.slip0[row]
    return StepProblem(
        many.A,
        many.b[row],
        many.bound,
        many.surface,
        many.scale,
        many.guess[row],
        many.active[row],
        many.t,
        many.k,
        problem.friction,
        slip0,
        many.rate_factor,
    )


@dataclass(frozen=True)
class Loads(Load):
    """Hold the loads of several runs of one body, a row for each: ``rows(t)``."""

    rows: Any = None

    def __call__(self, t: float) -> Array:
        """Return the loads of all runs at time t, as rows [N]."""
        return np.asarray(self.rows(t))


def loads_of(problems: Sequence[ContactProblem]) -> Loads:
    """Return the loads of problems on one system.

    They differ in what shakes them, by few vectors times histories.
    """
    body = problems[0].unshaken.load
    shaken = [
        (run, *pair)
        for run, one in enumerate(problems)
        for pair in one.equations.load.separable[len(body.separable) :]
    ]
    vectors = {force.tobytes(): force for _, force, _ in shaken}
    order, forces = (
        list(vectors),
        np.array(list(vectors.values())).reshape(len(vectors), len(body.constant)),
    )
    places = [(run, order.index(force.tobytes()), history) for run, force, history in shaken]

    def rows(t: float) -> Array:
        factors = np.zeros((len(problems), len(forces)))
        for run, place, history in places:
            factors[run, place] += history_value(history, t)
        return np.asarray(body(t) + factors @ forces)

    return Loads(body.constant, rows=rows)
