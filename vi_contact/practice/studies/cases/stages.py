"""Run the stages of a case one after the other, each from where the one before has left the body.

A static stage finds the equilibrium under its loads with contact, a dynamic one marches. What
passes on: displacements and with them stresses, velocities after a dynamic stage, contact forces
and the points where friction has brought the body, and the reactions of released supports as
forces. Every stage begins at t = 0 with its own excitations. Each has a run folder,
DIR/stages/1_NAME, the last one DIR itself; a static stage a folder of one row. FOLLOWS in it has
the checksums of what the stages before it left, so that a restart finds out which stages still
follow from one another.
"""

import os
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ....core.algebra import Array
from ....core.errors import InputError, StepFailure
from ....core.files import on_root, write_atomically
from ....core.internal import remembers
from ....core.own_files import inner_folder, is_own, make_inner_folder, read_text
from ....core.problem import ContactProblem
from ....core.state_checks import initial_state
from ....core.step import State
from ....fem.body.placing import adds_or_removes, keep_gaps, place, same_bodies
from ....fem.body.released_supports import (
    begin_from,
    find_internal_force,
    find_removed_support,
    release,
    same_supports,
)
from ....fem.mesh.communicators import MpiComm
from ....run.files.checkpoint import read_state_checksum
from ....run.files.folder import (
    CHECKPOINT,
    FOLLOWS,
    STAGES,
    clear,
    is_marked,
    lock_folder,
    remove_run,
    run_folder,
    take,
)
from ....run.simulate import Solution, simulate
from .stage_tables import Stage
from .vocabulary import Parts


@dataclass(frozen=True)
class Reached:
    """Hold what the stages that have run leave to the next one.

    Attributes:
        number: of the stages that have run.
        meshed: mesh and groups, of all stages.
        problem: of the last one of them; None before the first stage.
        state: in which it ended.
        static: whether it was static, and its state is at rest.
        force: of all supports released so far [N].
        earlier: the problems of the stages before it.
    """

    number: int
    meshed: tuple[Any, Any]
    problem: ContactProblem | None = None
    state: State | None = None
    static: bool = True
    force: Array | float = 0.0
    earlier: tuple[ContactProblem, ...] = ()


def run_leading_stages(case: Any, comm: Any) -> tuple[Reached | None, Parts, State | None]:
    """Run the stages that runs of a case share when they differ in their excitations.

    These are the static stages that come before all others, but for the last stage. Collective.

    Returns:
        What they leave, None without stages; the parts of the next stage; its first state, None to
        be found.
    """
    if not case.stages:
        return None, case.parts(comm), None
    options = {"progress": False, "fields": None}
    reached = Reached(0, case.meshed(comm))
    while reached.number < len(case.stages) - 1 and case.stages[reached.number].static:
        reached, _ = _run_stage(case.stages[reached.number], reached, comm, None, options)
    _, parts, state = _enter(case.stages[reached.number], reached, comm)
    return reached, parts, state


def rehearse_stages(case: Any, comm: Any, folder: Path, *, solve: bool) -> None:
    """Do what the stages of a case do before their first steps; collective.

    Static stages that come first are solved, as what they leave decides what may follow them. The
    stages after a dynamic one begin in the displacements at the start here.

    Args:
        case: a ``Case`` with stages.
        comm: the ranks.
        folder: which the run would have.
        solve: whether static stages are solved.

    Raises:
        InputError: whatever the run refuses before the first step of a stage.
    """
    known = 0
    if solve:
        reached, parts, state = run_leading_stages(case, comm)
        known = 0 if reached is None else reached.number
        case.stages[known].case.rehearse(parts, folder, state=state)
        known += 1
    for stage in case.stages[known:]:
        parts = replace(stage.case, ready=case.meshed(comm)).parts(comm)
        if stage.static:
            parts = replace(parts, moved=True)
        first = initial_state(stage.case.problem(comm, parts))
        stage.case.rehearse(parts, folder, state=first)


def run_stages(
    case: Any,
    comm: Any,
    out: Path | None,
    *,
    restart: bool | str | Path,
    reached: Reached | None,
    **options: Any,
) -> Solution:
    """Run those stages of a case that are not reached yet; collective.

    Args:
        case: a ``Case`` with stages.
        comm: the ranks.
        out: the run folder; None: without.
        restart: True to go on in the run folder, or the folder of another run of the case.
        reached: what the first stages have left; None: run all.
        options: other arguments of ``simulate``.

    Returns:
        The solution of the last stage.

    Raises:
        InputError: and others, as ``simulate``.
    """
    ranks = MpiComm(comm)
    reached = reached or Reached(0, case.meshed(comm))
    numbered = enumerate(case.stages[:-1], start=1)
    folders = [*(Path(STAGES) / f"{number}_{stage.name}" for number, stage in numbered), Path()]
    source = _find_source(out, restart)
    with lock_folder(ranks, None if out is None else run_folder(ranks, out)):
        place = source or out
        if place is not None:
            on_root(ranks, partial(_tidy, place, folders, keep=source is not None))

        # ``before`` has a line for each stage so far: checksum and steps of what it left.
        before = ""
        for stage, folder in list(zip(case.stages, folders, strict=True))[reached.number :]:
            # A stage that began where those before it now end goes on; any other begins anew, but
            # for the first one, of which ``simulate`` says what is wrong with its folder.
            again = None if source is None else source / folder
            follows = ranks.bcast(on_root(ranks, partial(_follows, again, before)))
            if before and out is not None and not follows:
                on_root(ranks, partial(_begin, out, folder, before))
            goes_on = follows or (stage is case.stages[0] and again is not None)
            stage_options = options | {"restart": again if goes_on else False}
            stage_out = None if out is None else out / folder
            reached, solution = _run_stage(stage, reached, comm, stage_out, stage_options)

            # What it left, for the stages after it.
            place = out or (source if follows else None)
            checksum = None
            if place is not None:
                checksum = on_root(ranks, partial(read_state_checksum, place / folder))
            before += f"{checksum} {solution.state.k}\n"
    return solution


def _find_source(out: Path | None, restart: bool | str | Path) -> Path | None:
    """Return the folder of the run to go on with; None for a new run."""
    if restart is True:
        return out
    return Path(restart) if restart else None


def _tidy(out: Path, stages: list[Path], *, keep: bool) -> None:
    """Clear the folders of a new run, or refuse those that do not fit to one that goes on.

    Folders and files that no run has made are left alone.

    Args:
        out: the run folder.
        stages: the folders of the stages in it.
        keep: whether the run goes on.

    Raises:
        InputError: with ``keep``, for runs in the folders of stages that are none any more. Without
            it they are removed.
    """
    place = inner_folder(out, STAGES)
    names = sorted(os.listdir(place)) if place.is_dir() else []
    folders = [Path(STAGES) / name for name in names if name[0].isdecimal() and "_" in name]
    others = [folder for folder in folders if folder not in stages]
    old = [folder for folder in others if is_marked(inner_folder(out, *folder.parts))]
    if keep:
        if old:
            raise InputError(
                f"'{out / old[0]}' belongs to no stage of the case: give stages their old names "
                "and order, or start a new run, which removes it"
            )
        return
    for folder in old:
        remove_run(out / folder)
    for folder in stages:
        clear(inner_folder(out, *folder.parts))


def _follows(folder: Path | None, before: str) -> bool:
    """Return whether there is a checkpoint to continue from.

    Its stage has to have begun where those before it now end.
    """
    if folder is None or not is_own(folder / CHECKPOINT):
        return False
    if not before:
        return True
    return is_own(folder / FOLLOWS) and read_text(folder / FOLLOWS) == before


def _begin(out: Path, folder: Path, before: str) -> None:
    """Note what a stage that is made anew follows from, in its empty folder."""
    place = make_inner_folder(out, *folder.parts)
    take(place)
    clear(place)
    write_atomically(place / FOLLOWS, before.encode())


def _run_stage(
    stage: Stage, reached: Reached, comm: Any, folder: Path | None, options: dict[str, Any]
) -> tuple[Reached, Solution]:
    """Run a stage, or go on with it.

    Args:
        stage: the next one.
        reached: what the stages before it leave.
        comm: the ranks.
        folder: of its run; None: without.
        options: arguments of ``simulate`` that come before those of the case.

    Returns:
        What the stages including this one leave, and its solution.
    """
    reached, parts, state = _enter(stage, reached, comm)
    restart = options.get("restart")
    if stage.static and restart:  # it has been solved
        state = initial_state(stage.case.problem(comm, parts))
    try:
        with stage.case.call(parts, folder, state) as call:
            stage.case.keep_model(comm, parts, folder)
            arguments = call | options
            if restart:
                arguments["state"] = None  # the checkpoint has it
            solution = simulate(**arguments)
    except StepFailure as error:
        raise StepFailure(f"{stage.label}: {error}") from error
    earlier = reached.earlier
    if stage.changes:  # it is in equilibrium on its own supports alone
        earlier = ()
    elif reached.problem is not None:
        earlier = (*earlier, reached.problem)
    after = replace(
        reached,
        number=reached.number + 1,
        problem=call["problem"],
        state=solution.state,
        static=stage.static,
        earlier=earlier,
    )
    return after, solution


def _enter(stage: Stage, reached: Reached, comm: Any) -> tuple[Reached, Parts, State | None]:
    """Find where a stage begins; collective.

    Returns:
        ``reached``, with the force of all released supports; the parts of the stage, which begin
        where the stages before have left the body; its first state, None if it has to be found.

    Raises:
        InputError: where other supports need a static stage before, and where a support is removed
            that carries something.
    """
    before = reached.problem
    state = reached.state
    parts: Parts = replace(stage.case, ready=reached.meshed).parts(comm)
    if stage.static:
        parts = replace(parts, weighted=True, moved=True)
    if before is None or state is None:
        return reached, parts, None
    problem: ContactProblem = stage.case.problem(comm, parts)
    try:
        if not same_bodies(before, problem):
            begun, first = place(before, state, problem)
            placed = replace(parts, system=begun.system, surface=begun.surface, begins=first)
            return replace(reached, force=0.0), placed, None
        if adds_or_removes(problem):
            surface = keep_gaps(before.surface, problem.surface, problem.system.u0)
            parts = replace(parts, surface=surface)
            problem = stage.case.problem(comm, parts)
        if same_supports(before, problem) and (stage.static or not reached.static):
            u, v = before.cartesian(state.u), before.cartesian(state.v)
            begun, first = begin_from(
                problem, u, 0.0 * v if stage.static else v, state, reached.force
            )
        elif reached.static:
            begun, first = release(before, state, problem, earlier=reached.earlier)
        else:
            raise InputError(
                "it has other supports than the dynamic stage before it: put a static stage with "
                "the supports of that one between them, or change supports before the motion"
            )
        force = begun.system.load.constant - problem.system.load.constant
        elastic = find_internal_force(begun, first, begun.system.u0)
        name, newtons = find_removed_support(before, begun, np.asarray(force), elastic)
        if name and not stage.release:
            raise InputError(
                f"it removes the support '{name}', which carries {newtons:.4g} N: give release = "
                "true, which holds its reaction as a force, or keep the support"
            )
    except InputError as error:
        raise InputError(f"{stage.label}: {error}") from error
    # Materials that remember go on from there; a linear body is found from its displacements.
    begins = first if remembers(begun.system.internal) else None
    begun_parts = replace(parts, system=begun.system, begins=begins)
    return replace(reached, force=force), begun_parts, None if stage.static else first
