"""Step several runs with one effective matrix together: vectors are rows (k, n), and matrices are read once for all.

The scheme steps the rows as it steps one state, and the solver answers them together (``solve_many``); what differs
from run to run, small problems, judgement, impacts and reports, stays a run's own. A step that is not answered at once
with a certificate far below the tolerance is solved alone; who then has to escalate, or fails, goes on alone.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix
from ..core.certificate import Certificate
from ..core.errors import ViContactError
from ..core.problem import ContactProblem
from ..core.products import frozen
from ..core.step import Answers, Report, State, StepProblem, StepResult
from ..core.system import Load, SemiDiscreteSystem
from ..core.verify import kkt_residuals
from ..solvers.certified import NEAR, CertifiedSolver
from .march import March, after_impact
from .method import Method
from .time_steps import StepPlan


class Together:
    """March one of several runs: what ``March`` yields, made with others as long as it can be.

    Attributes, of the step that was handed out last: as of ``March``.
    """

    def __init__(self, method: Method, step_plan: StepPlan, state: State, base: int = 0, halved: int = 0) -> None:
        self.method, self.step_plan, self.state = method, step_plan, state
        self.base, self.halved, self.ended, self.dt = base, halved, True, float("nan")
        self.group: Group | None = None
        self.prepared: dict[float, tuple[EffectiveMatrix, CertifiedSolver]] = {}
        self.waiting: deque[tuple[float, Report]] = deque()  # made, and not handed out yet

    def __iter__(self) -> Iterator[tuple[State, Report]]:
        steps = self.step_plan.steps
        while self.base < steps:
            if not self.waiting and self.group is not None:
                self.group.advance()
            if not self.waiting:
                break
            self.dt, report = self.waiting.popleft()
            self.base += 1
            yield report.new, report
        if self.base < steps:
            loop = March(self.method, self.step_plan, self.state, self.base, self.halved, self.prepared)
            for state, report in loop:
                self.base, self.halved, self.ended, self.dt = loop.base, loop.halved, loop.ended, loop.dt
                yield state, report

    def leave(self) -> None:
        """Let the others go on without it."""
        if self.group is not None:
            self.group.without([self])


def grouped(runs: Sequence[Together]) -> None:
    """Put runs into groups that step together: all that can."""
    groups: list[list[Together]] = []
    for run in runs:
        problem, plan = run.method.problem, run.step_plan
        alone = problem.surface.comm.size > 1 or plan.halvings or run.base >= plan.steps
        beside = problem.system.companions or problem.surface.companions
        if alone or beside or not getattr(run.method.scheme, "by_rows", False):
            continue
        for group in groups:
            first, found = group[0], problem.beside(group[0].method.problem)
            if found is not None and _place(first) == _place(run) and _way(first.method) == _way(run.method):
                run.method = replace(run.method, problem=found)
                group.append(run)
                break
        else:
            groups.append([run])
    for group in groups:
        Group(group)


def _place(run: Together) -> tuple[float, int, int]:
    return run.state.t, run.state.k, run.base


def _way(method: Method) -> tuple[Any, ...]:
    return method.scheme, *method.solvers, method.tolerance


@dataclass(frozen=True)
class _Loads(Load):
    """The loads of several runs, a row for each."""

    runs: tuple[SemiDiscreteSystem, ...] = ()

    def __call__(self, t: float) -> Array:
        return np.stack([one.load_at(t) for one in self.runs])


class Group:
    """Hold runs of one system, surface, scheme and tolerance that are at the same step."""

    def __init__(self, runs: Sequence[Together]) -> None:
        method = runs[0].method
        self._scheme, self._tolerance = method.scheme, method.tolerance
        self._base, self._dt = runs[0].base, float("nan")
        self._A: Any = None
        self._solver: Any = None  # CertifiedSolver, once there is a step
        self._chosen(list(runs), [run.state for run in runs])

    def _chosen(self, runs: list[Together], states: list[State]) -> None:
        """Go on with these runs, one alone not together."""
        self._runs, self._states = runs, states
        for run, state in zip(runs, states, strict=True):
            run.group, run.state = (self if len(runs) > 1 else None), state
        if len(runs) < 2:
            self._runs = []
            return
        first, systems = runs[0].method.problem, tuple(run.method.problem.equations for run in runs)
        self._problem = replace(first)
        self._problem.__dict__["equations"] = first.unshaken.loaded(_Loads(systems[0].load.constant, runs=systems))
        self._many = _rows(states)

    def without(self, leaving: Sequence[Together]) -> None:
        """Let these runs go on alone from where they are."""
        for run, state in zip(self._runs, self._states, strict=True):
            if run in leaving:
                run.group, run.state = None, state
        left = [row for row, run in enumerate(self._runs) if run not in leaving]
        self._chosen([self._runs[row] for row in left], [self._states[row] for row in left])
        if self._runs and self._dt == self._dt:
            self._A = self._scheme.effective_matrix(self._problem, self._dt).factorised_as(self._A)

    def advance(self) -> None:
        """Make the next step of all runs; those that cannot make it together leave."""
        leaving = [run for run in self._runs if run.step_plan.steps == self._base]
        if leaving:
            self.without(leaving)
        while self._runs:
            dt = self._runs[0].step_plan.dt(self._base)
            leaving = [run for run in self._runs if run.step_plan.dt(self._base) != dt] or self._step(dt)
            if not leaving:
                self._base += 1
                return
            self.without(leaving)

    def _step(self, dt: float) -> list[Together]:
        """Make a step and hand out its reports; the runs that cannot make it, and then none is made."""
        runs, scheme, problem = self._runs, self._scheme, self._problem
        if dt != self._dt:
            self._states = [scheme.start(run.method.problem, state, dt)
                            for run, state in zip(runs, self._states, strict=True)]
            self._many, self._dt = _rows(self._states), dt
            self._A, self._solver = scheme.effective_matrix(problem, dt), None
        many = scheme.step(problem, self._many, self._A, dt)
        wrong = np.flatnonzero(~np.isfinite(many.b.sum(axis=-1)))
        if len(wrong):
            return [runs[row] for row in wrong]
        steps = [_own(run.method.problem, many, row) for row, run in enumerate(runs)]
        if self._solver is None:
            method = runs[0].method
            self._solver = CertifiedSolver(problem, self._A, many.scale, method.solvers, self._tolerance)
        together = getattr(self._solver.first, "solve_many", None)
        answers = None if together is None else together(many, steps.__getitem__)
        if answers is None:
            return list(runs)
        for run in runs:
            run.prepared = {dt: (self._A, self._solver)}
        result, found, leaving = self._judged(many, steps, answers)
        if not leaving:
            self._finish(many, steps, result, found, dt)
        return [runs[row] for row in leaving]

    def _judged(
        self, many: StepProblem, steps: Sequence[StepProblem], answers: Answers
    ) -> tuple[StepResult, list[tuple[StepResult, Certificate]], list[int]]:
        """The answers with their certificates; those that are not good at once are found alone. The rows of runs that
        have to escalate, or fail, last."""
        result, leaving = answers.rows, list(answers.failed)
        results = [answers.own(row) for row in range(len(steps))]
        certificates = [] if leaving else kkt_residuals(many, result, lambda row: (steps[row], results[row]))
        doubtful = [row for row, one in enumerate(certificates) if not one.worst <= NEAR * self._tolerance]
        for row in doubtful:
            escalated = True
            with suppress(ViContactError):
                results[row], certificates[row], escalated = self._solver.solve(steps[row])
            leaving += [row] if escalated else []
        if doubtful and not leaving:
            names = ("x", "r_n", "active") if result.r_t is None else ("x", "r_n", "active", "r_t")
            result = replace(result, **{name: np.stack([getattr(one, name) for one in results]) for name in names})
        return result, list(zip(results, certificates, strict=bool(certificates))), leaving

    def _finish(
        self, many: StepProblem, steps: Sequence[StepProblem], result: StepResult,
        found: Sequence[tuple[StepResult, Certificate]], dt: float,
    ) -> None:
        """States, impacts and reports at the end of a step."""
        runs, scheme, problem, old = self._runs, self._scheme, self._problem, self._states
        free = scheme.finish(problem, self._many, many, result, dt)
        for vector in (free.u, free.v, *free.memory.values()):
            frozen(vector)  # what is known of them stays true
        before = list(_split(free))
        after = list(before)
        closed = free.active & problem.surface.rigid if problem.impact is not None else free.active[:, :0]
        for row in np.flatnonzero(closed.any(axis=1)):
            after[row] = after_impact(runs[row].method.problem, scheme, old[row], before[row], dt)
        if any(one is not other for one, other in zip(before, after, strict=True)):
            free = replace(_rows(after), u=free.u)
        for row, run in enumerate(runs):
            own = run.method.problem
            averages = partial(scheme.balance, own, old[row], before[row], dt)
            report = Report(own, old[row], after[row], before[row].v, steps[row], *found[row], averages, False)
            run.waiting.append((dt, report))
        self._many, self._states = free, after


def _own(problem: ContactProblem, many: StepProblem, row: int) -> StepProblem:
    """The step of one run."""
    slip0 = None if many.slip0 is None else many.slip0[row]
    return StepProblem(many.A, many.b[row], many.bound, many.surface, many.scale, many.guess[row], many.active[row],
                       many.t, many.k, problem.friction, slip0, many.rate_factor)


def _rows(states: Sequence[State]) -> State:
    """The state of all runs, read-only; of a memory's arrays the vectors differ from run to run, the others do not."""
    first, rubs = states[0], next((0.0 * one.r_t for one in states if one.r_t is not None), None)
    u, v, r_n, active = (np.stack([getattr(one, name) for one in states]) for name in ("u", "v", "r_n", "active"))
    memory = {name: frozen(np.stack([one.memory[name] for one in states])) if value.shape == first.u.shape else value
              for name, value in first.memory.items()}
    r_t = None if rubs is None else np.stack([rubs if one.r_t is None else one.r_t for one in states])
    return State(first.t, first.k, frozen(u), frozen(v), r_n, active, memory, r_t)


def _split(many: State) -> Iterator[State]:
    """The states of the runs."""
    memory, r_t = many.memory, [None] * len(many.u) if many.r_t is None else many.r_t
    for row, vectors in enumerate(zip(many.u, many.v, many.r_n, many.active, strict=True)):
        own = {name: value[row] if value.ndim == 2 else value for name, value in memory.items()}
        yield State(many.t, many.k, *vectors, own, r_t[row])
