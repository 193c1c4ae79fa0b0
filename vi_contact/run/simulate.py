"""Simulate: march, listen with recorders, and keep everything in a folder.

A crash cannot spoil the folder.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from ..core.algebra import Comm
from ..core.arguments import check
from ..core.checks import flag, function, optional, provides, several, whole
from ..core.collective import Parts, agree, together, users
from ..core.errors import InputError
from ..core.files import on_root
from ..core.problem import ContactProblem
from ..core.quantities import Unit
from ..core.state_checks import check_problem_given, initial_state
from ..core.step import Columns, Recorder, Report, Row, Scheme, Solver, State
from ..solvers.certified import TOLERANCE
from .files.checkpoint import RestartPoint, read_checkpoint
from .files.folder import HISTORY_H5, locked, run_folder
from .files.stored_rows import StoredRows
from .files.table import Block, Table
from .files.writer import FieldWriter, Writer
from .method import checked_method, with_defaults
from .recorders import Contact, Energy, Steps
from .session import Comparison, Session
from .solution import Solution
from .time_steps import TimeSteps, step_plan
from .wall_time import WallTime

__all__ = ["Solution", "simulate"]


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
    cross_check: Comparison | None = None,
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
        dt: time step [s], or a plan: Schedule, HalvedAtImpact. ``steps``, t_end and
            checkpoint_every count base steps.
        t_end: the time [s] until which is marched; give it or ``steps``.
        steps: the number of base steps.
        record: recorders; None means (Energy(), Contact()). Time, iterations and certificate are
            always recorded.
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
    with opened(**locals()) as (session, writer):
        return session.go(writer)


@contextmanager
def opened(
    problem: ContactProblem,
    scheme: Scheme | None,
    solver: Solver | None,
    dt: TimeSteps,
    t_end: float | None,
    steps: int | None,
    record: Sequence[Recorder] | None,
    out: str | Path | None,
    state: State | None,
    escalation: Sequence[Solver],
    tolerance: float,
    checkpoint_every: int,
    restart: bool | str | Path,
    changed: bool,
    progress: bool,
    fields: FieldWriter | None,
    cross_check: Comparison | None,
    wall_time: str | None,
    callback: Callable[[State, Report], Any] | None,
    others: Sequence[ContactProblem] = (),
    runs: int = 1,
) -> Iterator[tuple[Session, Writer]]:
    """Check the arguments of ``simulate`` and set a run up, in its locked folder.

    ``others``: problems that lend their matrices and factors to it, if they are its own. ``runs``:
    how many take turns. Collective.
    """
    check_problem_given("simulate", problem)
    comm = problem.system.algebra.comm
    agree(
        comm,
        "simulate",
        {
            "scheme": scheme,
            "solver": solver,
            "dt": dt,
            "t_end": t_end,
            "steps": steps,
            "record": _kinds(record),
            "out": None if out is None else str(out),
            "state": Parts(state),
            "escalation": escalation,
            "tolerance": tolerance,
            "checkpoint_every": checkpoint_every,
            "restart": restart,
            "changed": changed,
            "fields": fields,
            "cross_check": cross_check,
            "wall_time": wall_time,
            "callback": callback,
        },
    )
    _check_outputs(record, out, restart, checkpoint_every, (progress, changed), fields, cross_check)
    optional(
        function,
        "simulate",
        "callback",
        callback,
        "give a function of a state and a report, or None",
    )
    if wall_time is not None and out is None:
        raise InputError("wall_time needs a folder from which the run continues: give out")
    if changed and restart is False:
        raise InputError(
            "changed=True is for a run that is continued, and this one begins anew: give restart "
            "too, or leave it out"
        )
    end = WallTime(wall_time, runs)
    problem, scheme = with_defaults(problem, scheme, others)
    method = checked_method(
        "simulate",
        problem,
        scheme,
        (solver, escalation),
        dt,
        steps=steps,
        t_end=t_end,
        state=state,
        tolerance=tolerance,
    )
    source = _source(restart, folder := None if out is None else run_folder(comm, out))
    recorders: list[Recorder] = [Steps(), *((Energy(), Contact()) if record is None else record)]
    with locked(comm, folder):
        if source is None:
            with together(comm):
                begin = initial_state(method.problem) if state is None else state
            place, checksum = RestartPoint(begin, begin.t, begin.k), ""
        else:
            place, checksum = read_checkpoint(
                source, method.problem, scheme=method.scheme, dt=dt, changed=changed
            )
        plan = step_plan(dt, steps, t_end, place.t_start)
        with together(comm):
            place = replace(
                place, state=method.scheme.start(problem, place.state, plan.dt(place.base))
            )
        table = Table(
            *_started(problem, recorders, place.state),
            None if folder is None else folder / HISTORY_H5,
            comm,
        )
        stored = None if source is None else StoredRows(source, table, place.state.k, checksum)
        if stored is not None:
            _started(problem, recorders, place.state, _restored(table, stored, comm))
        session = Session(
            method,
            recorders,
            table,
            plan,
            place,
            checkpoint_every,
            cross_check,
            progress,
            end,
            resumed_from=None if stored is None else stored.k,
            callback=callback,
        )
        yield session, Writer(problem, folder, fields, table, stored)


def _check_outputs(
    record: Any,
    out: Any,
    restart: Any,
    checkpoint_every: Any,
    flags: tuple[Any, Any],
    fields: Any,
    cross_check: Any,
) -> None:
    """Raise InputError for outputs that are none.

    This is what is no recorder, folder, number of steps, writer of fields or cross-check.
    """
    owner = "simulate"
    for one in (
        ()
        if record is None
        else several(owner, "record", record, "give a list of recorders, or None")
    ):
        provides(
            owner,
            "a recorder",
            one,
            ("columns", "start", "row"),
            "give Energy(), Contact(), Probe(…) or another",
        )
    check(owner, "out", out, str | Path | None)
    check(owner, "restart", restart, bool | str | Path)
    whole(owner, "checkpoint_every", checkpoint_every, least=1)
    for meaning, value in zip(("progress", "changed"), flags, strict=True):
        flag(owner, meaning, value)
    if fields is not None:
        if out is None:
            raise InputError("fields need an output folder: give out, or leave out fields")
        provides(owner, "fields", fields, ("open",), "give fem.XDMF(every=10), or None")
    optional(
        provides,
        owner,
        "cross_check",
        cross_check,
        ("report",),
        "give a CrossChecked solver, or None",
    )


def _source(restart: bool | str | Path, folder: Path | None) -> Path | None:
    """Return the folder of the run to continue."""
    if isinstance(restart, bool):
        if restart and folder is None:
            raise InputError("restart=True needs the folder of the run: give out")
        return folder if restart else None
    path = Path(restart)
    return path.parent if path.suffix == ".npz" else path


def _started(
    problem: ContactProblem,
    recorders: Sequence[Recorder],
    state: State,
    resumed: Mapping[str, Any] | None = None,
) -> tuple[Columns, Row]:
    """Start the recorders: their columns, and the row of the state.

    InputError when two record the same column.
    """
    row: dict[str, Any] = {}
    nothing: Row = {}
    columns: dict[str, tuple[str, str]] = {}
    comm = problem.system.algebra.comm
    with together(comm):  # a recorder of the user's may fail on one rank
        for recorder in recorders:
            name = f"the recorder {type(recorder).__name__} at the start"
            call: Callable[[], Row] = partial(recorder.start, problem, state, resumed)
            row |= users(name, call, nothing, as_it_is=True)
    with together(comm):
        for recorder in recorders:
            twice = sorted(set(columns) & set(recorder.columns()))
            if twice:
                raise InputError(
                    f"two recorders have the column '{twice[0]}': leave one of them out"
                )
            columns |= recorder.columns()
    agree(comm, "simulate", {"the list of recorded columns": list(columns)})
    return columns, row


def _kinds(record: Any) -> Any:
    """Return what is compared over ranks of recorders.

    This is kinds, and settings of those of the package, as each rank may hold its part of what is
    recorded.
    """
    if not isinstance(record, list | tuple):
        return record
    return [
        Parts(one) if type(one).__module__.startswith("vi_contact.") else type(one)
        for one in record
    ]


def _restored(table: Table, stored: StoredRows, comm: Comm) -> Row:
    """Put the rows of an earlier run into the table, arrays on rank 0 only; the last of them.

    Collective.
    """
    blocks = stored.blocks()
    last: Row = {}
    while True:
        whole = on_root(comm, lambda: next(blocks, None))
        block: Block | None = comm.bcast(whole and {name: whole[name] for name in table.numbers})
        if block is None:
            return last
        table.restore(whole or block)
        last = {name: values[-1] for name, values in block.items()}
