"""Step several runs with one effective matrix together.

Vectors are rows (k, n), and matrices are read once for all.

The scheme steps the rows as it steps one state, and the solver answers them together
(``solve_many``); certificates, impacts and reports are a run's own. A step that is not answered at
once with a certificate far below the tolerance is solved alone; who then has to escalate, or fails,
goes on alone.

A ``Together`` is one run, and yields what ``March`` yields. When it is asked for a step and has
none, its ``Group`` makes the next step of all runs of it, and each run keeps its report until it is
asked (``waiting``). Who leaves a group goes on as a plain ``March`` from where it is.

So there are two ways to make a step, and a run alone keeps the one of ``Stepper``: as a group of
one it would take 1.54 times as long at 216 unknowns, and 1.13 times at 20 000
(``benchmarks/many_runs.py --group-of-one``).
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from ..core.algebra import freeze
from ..core.errors import InputError, ViContactError
from ..core.stage import Answer, Stage, average, complete, make_matrix, pose
from ..core.step import Balance, Report, State, StepProblem, StepResult
from ..core.verify import kkt_residuals
from ..solvers.certified import NEAR, CertifiedSolver
from .march import March
from .method import Method
from .rows import (
    LazyRows,
    RowReport,
    join_loads,
    join_states,
    split_balance,
    split_states,
    split_step,
)
from .stepper import after_impact
from .time_steps import StepPlan

# Fewest runs that step together: benchmarks/many_runs.py --group-of-one sets 1.
FEWEST = 2


class Together(March):
    """March one of several runs: what ``March`` yields, made with others as long as it can be."""

    def __init__(
        self, method: Method, step_plan: StepPlan, state: State, base: int = 0, halved: int = 0
    ) -> None:
        """Stand before the next step, as ``March`` does, and in no group yet."""
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
            self.group.release([self])


def group_runs(runs: Sequence[Together]) -> None:
    """Put runs into groups that step together: all that can.

    Runs of a group have one body (the first lends its matrices), scheme and solver, and are at the
    same step. Those that several ranks share, that may be halved, that have motions marched beside
    them or a scheme which steps no rows go alone.
    """
    groups: list[list[Together]] = []
    for run in runs:
        problem = run.method.problem
        plan = run.step_plan
        alone = problem.surface.comm.size > 1 or plan.halvings or run.base >= plan.steps
        beside = problem.system.companions or problem.surface.companions
        curved = problem.system.internal is not None or problem.joint is not None
        if alone or beside or curved or not getattr(run.method.scheme, "by_rows", False):
            continue
        for group in groups:
            first = group[0]
            shared = problem.beside(first.method.problem)
            if shared is not None and _describe_place(first) == _describe_place(run):
                run.method = replace(run.method, problem=shared)
                group.append(run)
                break
        else:
            groups.append([run])
    for group in groups:
        Group(group)


def _describe_place(run: Together) -> tuple[Any, ...]:
    """Return where a run is, and how it goes on."""
    return (
        run.state.t,
        run.state.k,
        run.base,
        run.method.scheme,
        *run.method.solvers,
        run.method.tolerance,
    )


class Group:
    """Hold runs of one system, surface, scheme and tolerance that are at the same step.

    ``_runs`` are its members, in the order of the rows, none when it has dissolved. ``_problem`` is
    that of all runs, whose loads are rows; ``_problems`` are their own. The states are there twice:
    ``_many`` as rows, ``_states`` one by one. ``_solver`` is for steps of ``_dt`` [s].
    """

    def __init__(self, runs: Sequence[Together]) -> None:
        method = runs[0].method
        self._scheme = method.scheme
        self._tolerance = method.tolerance
        self._base = runs[0].base
        self._dt: float | None = None  # None before the first step
        self._solver: Any = None  # CertifiedSolver, once there is a step
        self._go_on_with(list(runs), [run.state for run in runs])

    def _go_on_with(self, runs: list[Together], states: list[State]) -> None:
        """Go on with these runs from these states; one run alone is no group."""
        self._runs = runs if len(runs) >= FEWEST else []
        for run, state in zip(runs, states, strict=True):
            run.group = self if self._runs else None
            run.state = state
        if self._runs:
            self._problems = [run.method.problem for run in runs]
            first = self._problems[0]
            self._problem = replace(first)
            self._problem.__dict__["equations"] = first.unshaken.loaded(join_loads(self._problems))
            self._take_states(states)

    def _take_states(self, states: list[State]) -> None:
        """Hold the states of the runs as rows, and one by one."""
        self._many = join_states(states)
        self._states = LazyRows(states.__getitem__)

    def release(self, leaving: Sequence[Together]) -> None:
        """Let these runs go on alone from where they are."""
        for row, run in enumerate(self._runs):
            run.group = None
            run.state = self._states[row]
        left = [run for run in self._runs if run not in leaving]
        self._go_on_with(left, [run.state for run in left])

    def advance(self) -> None:
        """Make the next step of all runs; those that cannot make it together leave."""
        while self._runs:
            dt = self._runs[0].step_plan.dt(self._base)
            try:
                # Those that have ended leave, then those with another time step, then those that
                # cannot make the step together.
                leaving: Sequence[Together] = [
                    run for run in self._runs if run.step_plan.steps == self._base
                ]
                if not leaving:
                    leaving = [run for run in self._runs if run.step_plan.dt(self._base) != dt]
                if not leaving:
                    leaving = self._step(dt)
            except ViContactError:  # of one of them, which meets it again alone
                leaving = self._runs
            if not leaving:
                self._base += 1
                return
            self.release(leaving)

    def _begin(self, dt: float) -> None:
        """Let the scheme begin anew with steps of dt [s]: the first, or one of another length."""
        states = []
        for row, problem in enumerate(self._problems):
            states.append(self._scheme.start(problem, self._states[row], dt))
        self._take_states(states)
        self._dt = dt
        self._solver = None

    def _solve(self, many: StepProblem, steps: LazyRows) -> Any:
        """Return the answers of the first solver to all rows, None if it cannot take them so."""
        first = self._solver.first
        if not hasattr(first, "solve_many"):
            return None
        return first.solve_many(many, steps.__getitem__)

    def _pose(self, dt: float) -> tuple[Stage, StepProblem]:
        """Return the stage of all runs and the step that is posed of it, as rows.

        Args:
            dt: the length of the step [s].
        """
        stage = self._scheme.stage(self._problem, self._many, dt)
        if self._solver is None:
            A = make_matrix(self._problem.equations, stage)
            solvers = self._runs[0].method.solvers
            self._solver = CertifiedSolver(self._problem, A, stage.scale, solvers, self._tolerance)
        return stage, pose(self._problem, stage, self._solver.A)

    def _step(self, dt: float) -> list[Together]:
        """Make a step and hand out its reports, or the runs that cannot make it.

        Where there are such runs none is made.
        """
        runs = self._runs
        problem = self._problem
        if dt != self._dt:
            self._begin(dt)

        # The right-hand sides b of all runs as rows; who has no numbers there, or is driven into
        # its obstacle, meets the error again alone, where it is told.
        stage, many = self._pose(dt)
        if not np.isfinite(many.b.sum()):
            wrong = np.flatnonzero(~np.isfinite(many.b).all(axis=-1))
            if len(wrong):
                return [runs[row] for row in wrong]
        try:
            problem.surface.refuse_driven(many.t)
        except InputError:
            return list(runs)

        # The solver answers all rows at once, if it can.
        problems = self._problems
        steps = LazyRows(lambda row: split_step(problems[row], many, row))
        answers = self._solve(many, steps)
        if answers is None:
            return list(runs)
        if dt not in runs[0].prepared:  # for the steps that a run makes alone
            for run in runs:
                run.prepared = {dt: self._solver}

        # Each answer gets its certificate, then states and reports are made.
        parts = {"step": steps, "result": LazyRows(answers.own)}
        leaving = list(answers.failed)
        if not leaving:
            result, leaving = self._judge(many, answers.rows, parts)
        if not leaving:
            self._finish(stage, many, complete(stage, many, result), parts, dt)
        return [runs[row] for row in leaving]

    def _judge(
        self, many: StepProblem, rows: StepResult, parts: dict[str, Any]
    ) -> tuple[StepResult, list[int]]:
        """Return the answers as rows, and the rows of runs that have to escalate, or fail.

        Answers that are not good at once are found alone.

        Args:
            many: the step of all runs.
            rows: its answers.
            parts: of the reports, steps and results by row; the certificates are added to them.
        """
        steps = parts["step"]
        results = parts["result"]
        certificates = kkt_residuals(many, rows, lambda row: (steps[row], results[row]))
        doubtful = [
            row
            for row, certificate in enumerate(certificates)
            if not certificate.worst <= NEAR * self._tolerance
        ]
        leaving = []
        for row in doubtful:
            escalated = True
            with suppress(ViContactError):
                certified = self._solver.solve(steps[row])
                results[row] = certified.result
                certificates[row] = certified.certificate
                escalated = certified.escalated
            if escalated:
                leaving.append(row)
        if doubtful and not leaving:
            own = [results[row] for row in range(len(certificates))]
            rows = replace(
                rows,
                x=np.stack([result.x for result in own]),
                r_n=np.stack([result.r_n for result in own]),
                active=np.stack([result.active for result in own]),
                r_t=None if rows.r_t is None else np.stack([result.r_t for result in own]),
            )
        parts["certificate"] = certificates
        return rows, leaving

    def _finish(
        self, stage: Stage, many: StepProblem, answer: Answer, parts: dict[str, Any], dt: float
    ) -> None:
        """Make states, impacts and reports at the end of a step.

        Args:
            stage: of all runs.
            many: the step that was posed of it.
            answer: the certified answers, as rows.
            parts: of the reports, by row, to which the rest is added.
            dt: the length of the step [s].
        """
        problems = self._problems
        scheme = self._scheme
        old = self._states
        before = self._many
        rows = scheme.finish(self._problem, before, stage, answer, dt)
        for vector in (rows.u, rows.v, *rows.memory.values()):
            freeze(vector)  # the states of the runs are views of them
        free = split_states(rows)
        self._many, self._states = self._apply_impact(rows, free, dt)
        system = self._problem.equations
        whole = cache(partial(average, self._problem, stage, answer, before, rows))
        momenta = cache(lambda: system.M @ rows.v)
        forces = cache(lambda: system.K @ rows.u)

        def make_averages(row: int) -> Callable[[], Balance]:
            """Return what makes the balance of one run."""
            return partial(split_balance, whole, row)

        parts |= {
            "problem": problems,
            "old": old,
            "new": self._states,
            "v_minus": LazyRows(lambda row: free[row].v),
            "averages": LazyRows(make_averages),
            "momentum": LazyRows(lambda row: momenta()[row]),
            "elastic": LazyRows(lambda row: forces()[row]),
            "escalated": LazyRows(lambda row: False),
        }
        for row, run in enumerate(self._runs):
            run.waiting.append((dt, RowReport(parts=parts, row=row)))

    def _apply_impact(self, rows: State, free: LazyRows, dt: float) -> tuple[State, LazyRows]:
        """Return the states after the impact law, as rows and one by one.

        They are as they were where nothing was struck.

        Args:
            rows: the states after the step, as rows.
            free: the same one by one.
            dt: the length of the step [s].
        """
        problem = self._problem
        scheme = self._scheme
        old = self._states
        closed = rows.active & problem.surface.rigid
        if problem.impact is None or not closed.any():
            return rows, free
        if getattr(problem.impact, "by_rows", False) and not rows.memory:
            # The law takes rows: of all runs at once.
            new = after_impact(problem, scheme, self._many, rows, dt)
            struck = (freeze(new.v) != rows.v).any(axis=1)

            def split_state(row: int) -> State:
                """Return the state of one run, with its velocities after the impact."""
                return free[row].with_velocity(new.v[row]) if struck[row] else free[row]

            return new, LazyRows(split_state)

        # Else run by run, where a point is closed.
        states = []
        for row, own_problem in enumerate(self._problems):
            state = free[row]
            if closed[row].any():
                state = after_impact(own_problem, scheme, old[row], state, dt)
            states.append(state)
        return replace(join_states(states), u=rows.u), LazyRows(states.__getitem__)
