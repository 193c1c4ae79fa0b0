"""Simulate: march, listen with recorders, and keep everything in a folder.

``simulate`` is one call with many arguments. What becomes of them, in this order:

1. ``RunRequest`` (request.py) checks the arguments by themselves.
2. ``choose_method`` (method.py) checks them against the problem, and fills in scheme and solver.
3. ``open_run``, here, locks the folder, finds the first state, starts the recorders, and takes over
   the rows of a run that is continued.
4. ``Session`` (session.py) makes the steps (march.py), records each, and saves what there is
   however the run ends; ``Writer`` (files/writer.py) writes the files. A crash cannot spoil them.
5. ``Solution`` (solution.py) is what the user gets.

*Base steps* are those of the plan; ``HalvedAtImpact`` may make several steps of one. On several
ranks all of this is called by all of them, and ``with together(comm)`` raises an error of one rank,
as a function of the user's may raise, on all.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

from ..core.algebra import Comm
from ..core.collective import agree, call_user, together
from ..core.errors import InputError
from ..core.files import on_root
from ..core.problem import ContactProblem
from ..core.quantities import Unit
from ..core.state_checks import initial_state
from ..core.step import Columns, Recorder, Report, Row, Scheme, Solver, State
from ..solvers.certified import TOLERANCE
from .files.checkpoint import RestartPoint, read_checkpoint
from .files.folder import HISTORY_H5, lock_folder, run_folder
from .files.stored_rows import StoredRows
from .files.table import Block, Table
from .files.writer import FieldWriter, Writer
from .materials import start_scheme
from .method import Method, choose_method, with_defaults
from .recorders import Contact, Energy, JointEnergy
from .recorders.steps import Steps
from .request import CrossCheck, RunRequest
from .session import Session
from .solution import Solution
from .time_steps import TimeSteps, plan_steps
from .wall_time import WallTime

__all__ = ["Solution", "rehearse", "simulate"]


def simulate(
    problem: ContactProblem,
    *,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    dt: Annotated[TimeSteps, Unit("s")],
    t_end: Annotated[float | None, Unit("s")] = None,
    steps: int | None = None,
    record: Sequence[Recorder] | None = None,
    out: str | Path | None = None,
    state: State | None = None,
    escalation: Sequence[Solver] = (),
    tolerance: float = TOLERANCE,
    checkpoint_every: int = 100,
    restart: bool | str | Path = False,
    changed: bool = False,
    progress: bool = True,
    fields: FieldWriter | None = None,
    cross_check: CrossCheck | None = None,
    wall_time: str | None = None,
    callback: Callable[[State, Report], Any] | None = None,
) -> Solution:
    """Compute steps in time until t_end, or so many steps, and record them.

    Collective; every rank gets the solution. After an error all that was computed is in the folder,
    and summary.json says why the run ended.

    Args:
        problem: what is marched.
        scheme: None means the trapezoidal rule on redistributed mass, or with an impact law the
            Zienkiewicz-Wood-Taylor step. A problem that names no mass matrix gets the one of the
            scheme (``run.method.with_defaults``).
        solver: None means Automatic().
        dt: time step [s], or a plan: Schedule, HalvedAtImpact, ErrorControlled, BySlipRate.
            ``steps``, t_end and checkpoint_every count base steps.
        t_end: the time [s] until which is marched; give it or ``steps``.
        steps: the number of base steps.
        record: recorders; None means Energy(), Contact() and, with a joint, JointEnergy(). Time,
            iterations and certificate are always recorded.
        out: the run folder: history.csv, columns.json, history.h5, summary.json, run.log,
            checkpoint.npz, fields.xdmf. Without it nothing is written. Output of an earlier run in
            the folder is replaced, unless ``restart``.
        state: the initial state, from a gravity stage for example; None means u0 and v0 of the
            system.
        escalation: see ``march``.
        tolerance: see ``march``.
        checkpoint_every: number of base steps between checkpoints.
        restart: True continues the run in ``out`` from its checkpoint; a path continues the run in
            that folder. ``steps`` and ``t_end`` are those of the whole run. The result is that of
            an uninterrupted run: on one rank to the last bit, on several to round-off. InputError
            if problem, dt or scheme differ from the checkpoint.
        changed: True continues even if they differ; after a change of dt, ``steps`` count from the
            checkpoint.
        progress: show a progress line on a terminal.
        fields: fem.XDMF(every=10) writes frames for ParaView.
        cross_check: a solver whose report() goes into the summary.
        wall_time: "11:30:00", as Slurm reads --time, from the start of the process: the run ends
            before it is over.
        callback: it is called as callback(state, report) on all ranks after every accepted step,
            also after a part of a halved step, when its row is recorded; the arrays of the state
            are read-only. If it returns True on some rank, the run ends with this base step, with a
            checkpoint and status "stopped". If it raises an error, the run ends with an InputError
            that says where, on all ranks and with a checkpoint.

    Raises:
        InputError: before anything is computed or overwritten; also when another run writes into
            the folder.
        Interrupted: after the step in which some rank got SIGINT (Ctrl-C), SIGTERM or SIGHUP, with
            a checkpoint.
        OutOfTime: before the wall time is over, with a checkpoint.
        StepFailure: no solver could certify a step.
        ViContactError: the disk refused to read or write.
    """
    request = RunRequest(
        problem=problem,
        scheme=scheme,
        solver=solver,
        dt=dt,
        t_end=t_end,
        steps=steps,
        record=record,
        out=out,
        state=state,
        escalation=escalation,
        tolerance=tolerance,
        checkpoint_every=checkpoint_every,
        restart=restart,
        changed=changed,
        progress=progress,
        fields=fields,
        cross_check=cross_check,
        wall_time=wall_time,
        callback=callback,
    )
    with open_run(request) as (session, writer):
        return session.go(writer)


def rehearse(**arguments: Any) -> None:
    """Do all that ``simulate`` does before its first step, and end there. Collective.

    The folder of the run is made, locked and left as it was.

    Args:
        arguments: those of ``simulate``.

    Raises:
        InputError: whatever ``simulate`` refuses before its first step.
    """
    bound = signature(simulate).bind(**arguments)
    bound.apply_defaults()
    with open_run(RunRequest(**bound.arguments)):
        pass  # all that can be refused has been looked at


@contextmanager
def open_run(
    request: RunRequest, *, others: Sequence[ContactProblem] = (), runs: int = 1
) -> Iterator[tuple[Session, Writer]]:
    """Check a request, and hold its run, set up in its locked folder, until the block ends.

    The folder is made and locked here; files in it are opened, or replaced, when the session
    begins. Collective.

    Args:
        request: the arguments of ``simulate``.
        others: problems that lend their matrices and factors to it, if they are its own.
        runs: how many runs take turns in this process, for its wall time.

    Yields:
        The run before its first step, and what writes its files.

    Raises:
        InputError: before anything is computed or overwritten, as of ``simulate``.
    """
    # What can be refused is refused before anything is computed or the folder is touched.
    request.check()
    wall_time = WallTime(request.wall_time, runs)
    method = _choose_method(request, others)
    comm = request.comm
    folder = None if request.out is None else run_folder(comm, request.out)
    source = _find_source(request.restart, folder)
    recorders = _list_recorders(request.record, method.problem)
    with lock_folder(comm, folder):
        # The first state: that of the checkpoint, of an earlier stage, or at rest. The scheme adds
        # its memory of earlier steps, which depends on the length of the first one.
        place, checksum = _find_start(request, method, source)
        plan = plan_steps(request.dt, request.steps, request.t_end, place.t_start)
        with together(comm):
            dt = plan.dt(place.base)
            first = start_scheme(method.problem, method.scheme, place.state, dt)
        place = replace(place, state=first)

        # The recorders name their columns, which the table needs to read rows of an earlier run;
        # of a run that is continued they start once more, from the last of these rows, where their
        # sums over time go on.
        columns, row = _start_recorders(method.problem, recorders, place.state)
        table = Table(columns, row, None if folder is None else folder / HISTORY_H5, comm)
        stored = None
        if source is not None:
            stored = StoredRows(source, table, place.state.k, checksum)
            last = _restore(table, stored, comm)
            _start_recorders(method.problem, recorders, place.state, last)

        session = Session(
            request=request,
            method=method,
            recorders=recorders,
            table=table,
            step_plan=plan,
            place=place,
            wall_time=wall_time,
            resumed_from=None if stored is None else stored.k,
        )
        yield session, Writer(method.problem, folder, request.fields, table, stored)


def _choose_method(request: RunRequest, others: Sequence[ContactProblem]) -> Method:
    """Return how the run is marched, checked; ``others`` lend their matrices. Collective."""
    problem, scheme = with_defaults(request.problem, request.scheme, others)
    return choose_method(
        "simulate",
        problem,
        scheme,
        (request.solver, request.escalation),
        request.dt,
        steps=request.steps,
        t_end=request.t_end,
        state=request.state,
        tolerance=request.tolerance,
    )


def _find_source(restart: bool | str | Path, folder: Path | None) -> Path | None:
    """Return the folder of the run to continue, None for a new run.

    It is this run's own folder for True; a path may be of another run, whose folder stays as it is.

    Args:
        restart: as of ``simulate``; a path may be that of a folder or of its checkpoint.
        folder: the folder of this run, if it has one.
    """
    if isinstance(restart, bool):
        if restart and folder is None:
            raise InputError("restart=True needs the folder of the run: give out")
        return folder if restart else None
    path = Path(restart)
    return path.parent if path.suffix == ".npz" else path


def _list_recorders(record: Sequence[Recorder] | None, problem: ContactProblem) -> list[Recorder]:
    """Return the recorder of every run, then those that were asked for.

    Args:
        record: asked for; None for those that runs have by themselves.
        problem: of the run, which may have a joint.
    """
    if record is None:
        of_joint = [] if problem.joint is None else [JointEnergy()]
        return [Steps(), Energy(), Contact(), *of_joint]
    return [Steps(), *record]


def _find_start(
    request: RunRequest, method: Method, source: Path | None
) -> tuple[RestartPoint, str]:
    """Return where the run begins: at a checkpoint, in the user's state, or in u0 and v0.

    Collective.

    Args:
        request: the arguments of ``simulate``.
        method: how the run is marched.
        source: the folder of the run to continue, None for a new run.

    Returns:
        The state with the base steps done before it, and the checksum of the rows that belong to
        the checkpoint, "" for a new run.
    """
    if source is not None:
        return read_checkpoint(
            source,
            method.problem,
            scheme=method.scheme,
            dt=request.dt,
            changed=request.changed,
        )
    state = request.state
    if state is None:
        with together(request.comm):  # loads and motions at the start are the user's
            state = initial_state(method.problem)
    return RestartPoint(state, state.t, state.k), ""


def _start_recorders(
    problem: ContactProblem,
    recorders: Sequence[Recorder],
    state: State,
    resumed: Row | None = None,
) -> tuple[Columns, Row]:
    """Return (columns of all recorders, their row of the first state). Collective.

    Args:
        problem: what is marched.
        recorders: those of the run; one of the user's may fail on one rank.
        state: the first state.
        resumed: the last row of the run that is continued, None for a new run.

    Raises:
        InputError: two recorders have the same column, or the columns differ between ranks.
    """
    comm = problem.system.algebra.comm

    # All recorders start before an error of one of them is raised, on all ranks: their calls may be
    # collective.
    row: dict[str, Any] = {}
    with together(comm):
        for recorder in recorders:
            name = f"the recorder {type(recorder).__name__} at the start"
            call: Callable[[], Row] = partial(recorder.start, problem, state, resumed)
            nothing: Row = {}
            row |= call_user(name, call, nothing, as_it_is=True)

    # Only after the start: many recorders do not know their columns before.
    columns: dict[str, tuple[str, str]] = {}
    with together(comm):
        for recorder in recorders:
            own = recorder.columns()
            twice = sorted(set(columns) & set(own))
            if twice:
                raise InputError(
                    f"two recorders have the column '{twice[0]}': leave one of them out"
                )
            columns |= own
    agree(comm, "simulate", {"the list of recorded columns": list(columns)})
    return columns, row


def _restore(table: Table, stored: StoredRows, comm: Comm) -> Row:
    """Put the rows of an earlier run into the table, and return the last of them.

    Arrays stay on rank 0, which reads the file; the numbers go to all ranks. Collective.

    Args:
        table: with the columns of this run.
        stored: the rows of the earlier run.
        comm: of the ranks that share the run.
    """
    blocks = stored.blocks()
    last: Row = {}
    while True:
        # Rank 0 reads a block of rows, and hands out its numbers; None ends it on all ranks.
        whole = on_root(comm, lambda: next(blocks, None))  # None on the other ranks
        numbers = None
        if whole is not None:
            numbers = {name: whole[name] for name in table.numbers}
        block: Block | None = comm.bcast(numbers)
        if block is None:
            return last
        table.restore(block if whole is None else whole)
        last = {name: values[-1] for name, values in block.items()}
