"""Step several runs with one effective matrix together.

Vectors are rows (k, n), and matrices are read once for all.

The scheme steps the rows as it steps one state, and the solver answers them together
(``solve_many``); certificates, impacts and reports are a run's own. A step that is not answered at
once with a certificate far below the tolerance is solved alone; who then has to escalate, or fails,
goes on alone.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..core.errors import InputError, ViContactError
from ..core.products import freeze
from ..core.step import Balance, Report, State, StepProblem, StepResult
from ..core.verify import kkt_residuals
from ..solvers.certified import NEAR, CertifiedSolver
from .march import March, after_impact
from .method import Method
from .rows import Each, RowReport, joined, loads_of, own_states, own_step
from .time_steps import StepPlan


class Together(March):
    """March one of several runs: what ``March`` yields, made with others as long as it can be."""

    def __init__(
        self, method: Method, step_plan: StepPlan, state: State, base: int = 0, halved: int = 0
    ) -> None:
        super().__init__(method, step_plan, state, base, halved)
        self.group: Group | None = None
        self.waiting: deque[tuple[float, Report]] = deque()  # made, and not handed out yet

    def __iter__(self) -> Iterator[tuple[State, Report]]:
        for report in self.reports():
            yield report.new, report

    def reports(self) -> Iterator[Report]:
        """Yield the report of every step: what nobody reads in it is not made."""
        steps = self.step_plan.steps
        while self.base < steps:
            if not self.waiting and self.group is not None:
                self.group.advance()
            if not self.waiting:
                break
            self.dt, report = self.waiting.popleft()
            self.base += 1
            yield report
        if self.base < steps:
            self.dt = float("nan")  # the scheme starts anew
            for _, report in super().__iter__():
                yield report

    def leave(self) -> None:
        """Let the others go on without it."""
        if self.group is not None:
            self.group.without([self])


def group_runs(runs: Sequence[Together]) -> None:
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
            if found is not None and _ways(first) == _ways(run):
                run.method = replace(run.method, problem=found)
                group.append(run)
                break
        else:
            groups.append([run])
    for group in groups:
        Group(group)


def _ways(run: Together) -> tuple[Any, ...]:
    """Where a run is, and how it goes on."""
    return (
        run.state.t,
        run.state.k,
        run.base,
        run.method.scheme,
        *run.method.solvers,
        run.method.tolerance,
    )


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
        self._runs = runs if len(runs) > 1 else []
        for run, state in zip(runs, states, strict=True):
            run.group, run.state = (self if self._runs else None), state
        if self._runs:
            self._problems = [run.method.problem for run in runs]
            self._problem = replace(first := self._problems[0])
            self._problem.__dict__["equations"] = first.unshaken.loaded(loads_of(self._problems))
            self._many, self._states = joined(states), Each(states.__getitem__)

    def without(self, leaving: Sequence[Together]) -> None:
        """Let these runs go on alone from where they are."""
        for row, run in enumerate(self._runs):
            run.group, run.state = None, self._states[row]
        left = [run for run in self._runs if run not in leaving]
        self._chosen(left, [run.state for run in left])
        if self._runs and self._dt == self._dt:
            self._A = self._scheme.effective_matrix(self._problem, self._dt).factorised_as(self._A)

    def advance(self) -> None:
        """Make the next step of all runs; those that cannot make it together leave."""
        while self._runs:
            plans = [(run, run.step_plan) for run in self._runs]
            dt, ended = (
                plans[0][1].dt(self._base),
                [run for run, plan in plans if plan.steps == self._base],
            )
            try:
                leaving = (
                    ended
                    or [run for run, plan in plans if plan.dt(self._base) != dt]
                    or self._step(dt)
                )
            except ViContactError:  # of one of them, which meets it again alone
                leaving = self._runs
            if not leaving:
                self._base += 1
                return
            self.without(leaving)

    def _step(self, dt: float) -> list[Together]:
        """Make a step and hand out its reports, or the runs that cannot make it.

        Where there are such runs none is made.
        """
        runs, scheme, problem = self._runs, self._scheme, self._problem
        if dt != self._dt:
            states = [
                scheme.start(one, self._states[row], dt) for row, one in enumerate(self._problems)
            ]
            self._many, self._states = joined(states), Each(states.__getitem__)
            self._dt, self._A, self._solver = dt, scheme.effective_matrix(problem, dt), None
        many = scheme.step(problem, self._many, self._A, dt)
        if not np.isfinite(many.b.sum()) and len(
            wrong := np.flatnonzero(~np.isfinite(many.b).all(axis=-1))
        ):
            return [runs[row] for row in wrong]
        try:
            problem.surface.refuse_driven(many.t)
        except InputError:
            return list(runs)  # each says so alone
        if self._solver is None:
            method = runs[0].method
            self._solver = CertifiedSolver(
                problem, self._A, many.scale, method.solvers, self._tolerance
            )
        problems, together = self._problems, self._solver.first
        steps = Each(lambda row: own_step(problems[row], many, row))
        answers = (
            together.solve_many(many, steps.__getitem__)
            if hasattr(together, "solve_many")
            else None
        )
        if answers is None:
            return list(runs)
        for run in () if dt in runs[0].prepared else runs:
            run.prepared = {dt: (self._A, self._solver)}
        parts, leaving = {"step": steps, "result": Each(answers.own)}, list(answers.failed)
        if not leaving:
            result, leaving = self._judged(many, answers.rows, parts)
        if not leaving:
            self._finish(many, result, parts)
        return [runs[row] for row in leaving]

    def _judged(
        self, many: StepProblem, rows: StepResult, parts: dict[str, Any]
    ) -> tuple[StepResult, list[int]]:
        """Return the answers as rows, and the rows of runs that have to escalate, or fail.

        Answers that are not good at once are found alone.
        """
        steps, results, leaving = parts["step"], parts["result"], []
        certificates = kkt_residuals(many, rows, lambda row: (steps[row], results[row]))
        doubtful = [
            row for row, one in enumerate(certificates) if not one.worst <= NEAR * self._tolerance
        ]
        for row in doubtful:
            escalated = True
            with suppress(ViContactError):
                results[row], certificates[row], escalated = self._solver.solve(steps[row])
            leaving += [row] if escalated else []
        if doubtful and not leaving:
            names = ("x", "r_n", "active") if rows.r_t is None else ("x", "r_n", "active", "r_t")
            each = [results[row] for row in range(len(certificates))]
            rows = replace(
                rows, **{name: np.stack([getattr(one, name) for one in each]) for name in names}
            )
        parts["certificate"] = certificates
        return rows, leaving

    def _finish(self, many: StepProblem, result: StepResult, parts: dict[str, Any]) -> None:
        """States, impacts and reports at the end of a step."""
        problems, scheme, dt, old = self._problems, self._scheme, self._dt, self._states
        rows = scheme.finish(self._problem, self._many, many, result, dt)
        for vector in (rows.u, rows.v, *rows.memory.values()):
            freeze(vector)  # what is known of them stays true
        free = own_states(self._problem, problems, rows)
        self._many, self._states = self._struck(rows, free)
        system, loads = (
            self._problem.equations,
            [("load", t, t) for t in self._problem.equations.times],
        )

        def averages(row: int) -> Callable[[], Balance]:
            problems[row].equations.know_rows(system, row, *loads)
            return partial(scheme.balance, problems[row], old[row], free[row], dt)

        parts |= {
            "problem": problems,
            "old": old,
            "new": self._states,
            "v_minus": Each(lambda row: free[row].v),
            "averages": Each(averages),
            "escalated": Each(lambda row: False),
        }
        for row, run in enumerate(self._runs):
            run.waiting.append((dt, RowReport(parts=parts, row=row)))

    def _struck(self, rows: State, free: Each) -> tuple[State, Each]:
        """Return the states after the impact law, as rows and one by one.

        They are as they were where nothing was struck.
        """
        problem, scheme, old, dt = self._problem, self._scheme, self._states, self._dt
        closed = rows.active & problem.surface.rigid
        if problem.impact is None or not closed.any():
            return rows, free
        if getattr(problem.impact, "by_rows", False) and not rows.memory:
            new = after_impact(problem, scheme, self._many, rows, dt)
            struck, problems = (freeze(new.v) != rows.v).any(axis=1), self._problems

            def moved(row: int) -> State:
                if not struck[row]:
                    return free[row]
                problems[row].equations.know_rows(
                    problem.equations, row, ("M", v := new.v[row], new.v)
                )
                return free[row].with_velocity(v)

            return new, Each(moved)
        own = [
            after_impact(one, scheme, old[row], free[row], dt) if closed[row].any() else free[row]
            for row, one in enumerate(self._problems)
        ]
        return replace(joined(own), u=rows.u), Each(own.__getitem__)
