"""Run the loop over certified steps.

Everything that has to happen when it ends, well or badly, is done here. A run goes this way:

    writer.open -> for every step: march, record -> at the end of a base step: frame, checkpoint if
    one is due, signals and wall time -> last checkpoint, summary, Solution

``Session.steps`` is a generator that stops after every base step, so that several runs can take
turns (``simulate_many``). All ranks make the same calls; rank 0 alone writes and logs.
"""

import logging
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from math import isfinite
from signal import Signals
from timeit import repeat
from typing import Any, TypeVar

import numpy as np

from ..core.algebra import Comm, largest, total
from ..core.checks import on_all
from ..core.collective import call_user, together
from ..core.errors import InputError, Interrupted, OutOfTime, StepFailure
from ..core.stage import complete, pose
from ..core.step import Recorder, Report, Row, State, StepResult
from ..core.timing import take_report
from .damping import NOT_COMPUTED, describe_damping
from .files.checkpoint import RestartPoint
from .files.identity import identify
from .files.log import Progress, list_versions
from .files.table import Table
from .files.writer import Writer
from .joint_elements import joint_warning
from .march import March
from .memory import describe_memory, measure_memory
from .method import Method
from .request import RunRequest
from .sampling import sampling_warning
from .solution import Solution, energy_warning
from .stop_signals import StopSignals
from .time_steps import StepPlan, describe_plan, list_pieces
from .wall_time import WallTime

log = logging.getLogger(__name__)
T = TypeVar("T")
TIMED = 10_000  # the last steps, of which seconds_per_step is the median
# why a run ended with an error that has no text of its own
ENDED: dict[type[BaseException], str] = {
    KeyboardInterrupt: "interrupted by the user",
    GeneratorExit: "its steps were not asked for any more",
}
LINEAR_STEPS = 21  # repetitions of the plain linear step that the step is compared with


@dataclass
class Session:
    """Hold a run under way.

    This is what of the arguments of ``simulate`` holds for all of it, and where it is.

    Attributes:
        request: the arguments of ``simulate``.
        method: scheme, solvers and the rest of them, checked and with defaults.
        recorders: the user's, after those of every run.
        table: the rows so far.
        step_plan: the base steps.
        place: the end of the last base step.
        wall_time: when the process has to have ended.
        resumed_from: the step of the checkpoint that it continues, None for a new run.
        loop: its steps, where others have them too.
        stopped: in words, when the callback has asked for the end.
        last: the report of the last step, None before the first.
        dt: the length of the last step [s].
        memory: bytes of this process and of the large matrices, by name.
        halved: attempts that were thrown away.
        seconds: of the last ``TIMED`` steps [s].
        of_joint: a warning where elements at a joint are too long, "" where they are not.
    """

    request: RunRequest
    method: Method
    recorders: Sequence[Recorder]
    table: Table
    step_plan: StepPlan
    place: RestartPoint
    wall_time: WallTime
    resumed_from: int | None = None
    loop: March | None = None
    stopped: str = ""
    last: Report | None = None
    dt: float = float("nan")
    memory: Mapping[str, Any] = field(default_factory=dict)
    halved: int = 0
    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=TIMED))
    of_joint: str = ""

    @property
    def root(self) -> bool:
        """Say whether this is rank 0, the one that speaks."""
        return self._comm.rank == 0

    @property
    def _comm(self) -> Comm:
        """Return the communicator of the ranks that share the run."""
        return self.method.problem.system.algebra.comm

    def settings(self) -> dict[str, Any]:
        """Return what was asked for, for log and summary."""
        method = self.method
        problem = self.method.problem
        solver = method.solvers[0]
        if self.request.cross_check is not None:
            solver = getattr(solver, "primary", solver)
        return {
            "scheme": repr(method.scheme),
            "mass": repr(problem.mass),
            "solver": repr(solver),
            "dt": describe_plan(method.dt),
            "tolerance": method.tolerance,
            "ranks": self._comm.size,
            "unknowns": problem.system.space.unknowns,
            "contact_points": problem.surface.total,
            "boundaries": list(problem.system.notes),
            "damping": describe_damping(problem, unknown=NOT_COMPUTED),
            "sampling": sampling_warning(problem, max(list_pieces(method.dt))[0]) or "",
            "joint_elements": self.of_joint,
        }

    @property
    def left(self) -> int:
        """Return how many base steps are to be done."""
        return max(self.step_plan.steps - self.place.base, 0)

    def go(self, writer: Writer) -> Solution:
        """Make the remaining steps, and write everything before, during and after them."""
        with StopSignals() as signals:
            # None after every base step, the solution in the end.
            return next(filter(None, self.steps(writer, signals)))

    def steps(self, writer: Writer, signals: StopSignals) -> Generator[Solution | None, None, None]:
        """Make the remaining steps; yield None after every base step, the solution in the end.

        Args:
            writer: of the files of the run.
            signals: those that ask for its end.

        Raises:
            Interrupted: a signal came; OutOfTime: the wall time is nearly over; StepFailure, or
                what a function of the user's raised. In all cases what was computed is saved first.
        """
        begin = time.perf_counter()
        self.halved = self.place.halved
        try:
            writer.open(self.place.state)
            self._tell_start()
            yield from self._march(writer, signals)
            self._checkpoint(writer)
            self._measure()
            linear = self._seconds_per_linear_step()
        except BaseException as error:
            # Whatever ends a run, what it has is saved; the error is raised again.
            interrupted = isinstance(error, KeyboardInterrupt | GeneratorExit)
            status = "interrupted" if interrupted else "failed"
            reason = str(error) or ENDED.get(type(error), type(error).__name__)
            seconds = time.perf_counter() - begin
            everywhere = getattr(error, "on_all_ranks", False)
            self._rescue(writer, status, reason, seconds, all_ranks=everywhere)
            # A signal ends all ranks: none of them does before the first has written.
            if isinstance(error, Interrupted):
                self._comm.bcast(None)
            raise

        # The plan has come to its end, or the callback has asked for it.
        status = "stopped" if self.stopped else "finished"
        facts = self._facts(status, self.stopped, time.perf_counter() - begin) | {
            "seconds_per_linear_step": linear
        }
        if facts["steps"] == 0:
            facts |= self._describe_state()
        warning = energy_warning(facts)
        if warning and self.root:
            log.warning("%s", warning)
        writer.close(facts)
        problem = replace(self.method.problem)  # without the matrices made for the run
        yield Solution(
            self.table.history(),
            self.table.columns,
            self.place.state,
            facts,
            problem,
            writer.folder,
        )

    def _march(self, writer: Writer, signals: StopSignals) -> Iterator[None]:
        """Make the steps, record each, and yield after every base step.

        A base step is where a frame, a checkpoint and the end of the run may stand; its halves are
        recorded only. The time of a step, for the summary, counts all that is done for it here.

        Args:
            writer: of the files of the run.
            signals: those that ask for its end.
        """
        place = self.place
        loop = self.loop or March(
            self.method, self.step_plan, place.state, place.base, place.halved
        )
        worst = 0.0
        begin = time.perf_counter()
        self.wall_time.begin()
        with closing(Progress(self.left, shown=self.request.progress and self.root)) as progress:
            for state, report in loop:
                # Every step: a row of the histories.
                self._record(report, writer)
                self.dt = loop.dt
                self.halved = loop.halved
                worst = max(worst, report.certificate.worst)

                # The end of a base step: a place where the run can be left and continued.
                if loop.ended:
                    self.place = RestartPoint(
                        state, place.t_start, place.k_start, loop.base, loop.halved
                    )
                    writer.frame(report, self.place.number)
                    due = self.place.number % self.request.checkpoint_every == 0
                    if due or self.wall_time.unsure:
                        self._checkpoint(writer)
                    if self.root:
                        progress.step(
                            state.k, state.t, iterations=report.result.iterations, worst=worst
                        )
                self.seconds.append(time.perf_counter() - begin)
                if len(self.seconds) == 1:
                    self._measure()  # the first step has made all factors

                # Who asks for the end: the callback, a signal, or the wall time.
                if self.request.callback is not None:
                    self._call(self.request.callback, report, writer)
                if loop.ended and self.stopped:
                    return
                if loop.ended and self.left:
                    self._stop_if_asked(writer, signals)
                if loop.ended:
                    yield
                begin = time.perf_counter()

    def _stop_if_asked(self, writer: Writer, signals: StopSignals) -> None:
        """Raise Interrupted on all ranks, with a checkpoint, when asked to stop. Collective.

        A signal to one rank asks for it, or the end of the time.
        """
        number, late = signals.ask_all(self._comm, self.wall_time.over())
        if not (number or late):
            return
        self._checkpoint(writer)
        self._measure()
        rest = (
            f"ended the run after step {self.place.state.k}, t = {self.place.state.t:.6g} s: "
            f"{writer.rest}"
        )
        if number:
            raise Interrupted(f"{Signals(number).name} {rest}", number)
        raise OutOfTime(f"{self.wall_time.words} {rest}")

    def _call(
        self, callback: Callable[[State, Report], Any], report: Report, writer: Writer
    ) -> None:
        """Show a step to the callback, which may ask for the end of the run or raise, on one rank.

        Collective.

        Args:
            callback: the user's.
            report: of the step; its arrays are made read-only.
            writer: of the checkpoint, when the callback raises.
        """
        state = report.new
        for array in (state.r_n, state.active, state.r_t, *state.memory.values()):
            if array is not None:
                array.setflags(write=False)  # u and v are so
        report = replace(
            report,
            old=_read_only(report.old),
            step=_read_only(report.step),
            result=_read_only(report.result),
        )
        report = _read_only(report)
        place = f"after step {state.k}, t = {state.t:.6g} s"
        try:
            answer = on_all(self._comm, "it", lambda: callback(state, report))
        except InputError as error:
            self._checkpoint(writer)
            raise InputError(f"the callback {place}: {error}") from error
        if largest(self._comm, isinstance(answer, bool | np.bool_) and bool(answer)):
            self.stopped = f"the callback ended the run {place}"

    def _record(self, report: Report, writer: Writer) -> None:
        """Record a step, be it a base step or a part of one. Collective."""
        state = report.new
        if report.escalated and self.root:
            log.warning(
                "step %d, t = %.6g s: escalated to %s", state.k, state.t, report.result.method
            )
        row: dict[str, Any] = {}
        nothing: Row = {}
        # one of the user's may fail on one rank, or record what does not fit there
        with together(self._comm):
            for recorder in self.recorders:
                name = (
                    f"the recorder {type(recorder).__name__} in step {state.k}, t = "
                    f"{state.t:.6g} s,"
                )
                call: Callable[[], Row] = partial(recorder.row, report)
                row.update(call_user(name, call, nothing, as_it_is=True))
            self.table.check(row)
            _refuse_overflow(row)
        writer.append(row)
        self.last = report

    def _measure(self) -> None:
        """Tell how much memory is taken, once all is set up and at the end. Collective."""
        A = None if self.last is None else self.last.step.A
        self.memory = measure_memory(self.method.problem, A)
        if self.root:
            log.info("%s", describe_memory(self.memory))

    def _checkpoint(self, writer: Writer) -> None:
        """Write a checkpoint of the last base step, unless there is one. Collective."""
        with self.wall_time.saving():
            writer.checkpoint(self.place, lambda: self._identity)

    @cached_property
    def _identity(self) -> dict[str, Any]:
        """Return what the run is of, for its checkpoints. Collective."""
        method = self.method
        start = self.place.t_start
        end = start + self.step_plan.length
        # histories of the user's are asked at other times than those of steps
        with together(self._comm):
            run = identify(method.problem, method.scheme, method.dt, start=start, end=end)
        return {"run": run, "span": (start, end)}

    def _rescue(
        self, writer: Writer, status: str, reason: str, seconds: float, *, all_ranks: bool
    ) -> None:
        """Save what there is of a run that ends with an error.

        Args:
            writer: of the files.
            status: "interrupted" or "failed".
            reason: why, in words.
            seconds: since the beginning [s].
            all_ranks: whether all of them raise the same error. Only then, or on one rank, there is
                a checkpoint of the last base step: other ranks might not come to write it.
        """
        # Of any kind: the error that ended the run is the one to tell, and it may keep each of
        # these from working.
        with suppress(Exception):
            writer.flush(alone=True)
        with suppress(Exception):
            if self._comm.size == 1 or all_ranks:
                self._checkpoint(writer)
        facts: dict[str, Any] = {"status": status, "reason": reason, "steps": self.place.state.k}
        with suppress(Exception):
            facts = self._facts(status, reason, seconds)
        writer.rescue(facts)

    def _tell_start(self) -> None:
        """Write into the log what is run, on rank 0. Collective."""
        self.of_joint = joint_warning(self.method.problem) or ""
        if not self.root:
            return
        log.info(
            "versions: %s",
            ", ".join(f"{name} {version}" for name, version in list_versions().items()),
        )
        for name, value in self.settings().items():
            if name not in ("sampling", "joint_elements"):
                log.info("%s: %s", name, value)
            elif value:
                log.warning("%s", value)
        if self.resumed_from is not None:
            log.info("continues from the checkpoint of step %d", self.resumed_from)
        log.info("set up: %s", take_report())
        log.info("%d steps to do", self.left)
        if self.wall_time.text is not None:
            log.info(
                "%.0f s are left of the wall time %s", self.wall_time.left, self.wall_time.text
            )

    def _facts(self, status: str, reason: str, seconds: float) -> dict[str, Any]:
        """Return the content of summary.json.

        Args:
            status: how the run ended, in a word.
            reason: why, in words; "" when it has finished.
            seconds: since the beginning [s].
        """
        cross_check = self.request.cross_check
        seconds_per_step = float(np.median(list(self.seconds))) if self.seconds else float("nan")
        # What a folder is written with counts, and is imported for nothing else.
        needed = () if self.request.out is None else ("h5py",)
        return {
            "status": status,
            "reason": reason,
            "versions": list_versions(*needed),
            **self.settings(),
            "restarted_from_step": self.resumed_from,
            **self.table.facts(),
            "base_steps": self.place.base,
            "halved_steps": self.halved,
            "cross_check": None if cross_check is None else cross_check.report(),
            "seconds": seconds,
            "memory": self.memory,
            "seconds_per_step": seconds_per_step,
            "seconds_per_linear_step": float("nan"),
        }

    def _describe_state(self) -> dict[str, Any]:
        """Return what there is to tell of a run without steps: its one state. Collective."""
        state = self.place.state
        surface = self.method.problem.surface
        gap = surface.gap(state.t) - surface.normal_values(state.u)
        opened = gap[~state.active & np.isfinite(gap)]
        facts: dict[str, Any] = {
            "closed_points": round(total(surface.comm, np.count_nonzero(state.active))),
            "largest_opening": largest(surface.comm, np.max(opened, initial=0.0)),
        }
        if state.certificate is not None:
            facts["worst_certificate"] = state.certificate
        return facts

    def _seconds_per_linear_step(self) -> float:
        """Return the median time [s] of a linear step from the last state.

        It takes a right-hand side, one back-substitution and an update with the same A.
        """
        # none is made for this: it may not fit
        if self.last is None or not self.last.step.A.factorised:
            return float("nan")
        problem = self.method.problem
        scheme = self.method.scheme
        dt = self.dt
        old = self.last.old
        A = self.last.step.A
        none = np.zeros(problem.surface.count)

        def linear_step() -> None:
            """Make a step as if there were no contact."""
            stage = scheme.stage(problem, old, dt)
            step = pose(problem, stage, A)
            result = StepResult(A.factor.solve(step.b), none, none.astype(bool), 0, "linear")
            scheme.finish(problem, old, stage, complete(stage, step, result), dt)

        seconds = repeat(linear_step, number=1, repeat=LINEAR_STEPS + 1)
        return float(np.median(seconds[1:]))  # the first is slower


def _refuse_overflow(row: Row) -> None:
    """Raise StepFailure for a number beyond those of the machine.

    It is infinite, or NaN in the energy ledger.
    """
    for name, value in row.items():
        if not isinstance(value, float) or isfinite(value):
            continue
        if np.isinf(value) or name.startswith(("energy_", "work_", "loss_")):
            raise StepFailure(
                f"step {row['k']} at t = {row['t']:.6g} s: {name} is {value}, too large for the "
                "machine: check the sizes and units of loads, motions and initial data"
            )


def _read_only(value: T) -> T:
    """Return the value with read-only views of its arrays.

    Some of them, such as the gap at rest, belong to the problem.
    """
    instance: Any = value  # a dataclass, which the type does not say
    views: dict[str, Any] = {}
    for field_ in fields(instance):
        array = getattr(instance, field_.name)
        if isinstance(array, np.ndarray):
            views[field_.name] = array.view()
            views[field_.name].setflags(write=False)
    read_only: T = replace(instance, **views)
    return read_only
