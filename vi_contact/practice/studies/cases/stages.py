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
from ....core.errors import InputError
from ....core.files import on_root, write_atomically
from ....core.own_files import inner_folder, is_own, make_inner_folder, read_text
from ....core.problem import ContactProblem
from ....core.state_checks import initial_state
from ....core.step import State
from ....fem.body.released_supports import begin_from, find_removed_support, release, same_supports
from ....fem.mesh.communicators import MpiComm
from ....run.files.checkpoint import state_checksum
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
    """Hold what so many stages leave.

    They leave mesh and groups, problem and state of the last one, which is at rest or not, the
    force of all supports released so far [N], and the problems of the stages before it.
    """

    number: int
    meshed: tuple[Any, Any]
    problem: ContactProblem | None = None
    state: State | None = None
    static: bool = True
    force: Array | float = 0.0
    earlier: tuple[ContactProblem, ...] = ()


def leading(case: Any, comm: Any) -> tuple[Reached | None, Parts, State | None]:
    """Return what runs of a case share that differ in their excitations.

    It is (what the static stages leave that come before all others but the last; parts of the next
    stage; its first state, None to be found). Collective.
    """
    if not case.stages:
        return None, case.parts(comm), None
    reached = Reached(0, case.meshed(comm))
    while reached.number < len(case.stages) - 1 and case.stages[reached.number].static:
        reached, _ = _made(
            case.stages[reached.number], reached, comm, None, {"progress": False, "fields": None}
        )
    return reached, *_entered(case.stages[reached.number], reached, comm)[1:]


def run_stages(
    case: Any,
    comm: Any,
    out: Path | None,
    *,
    restart: bool | str | Path,
    reached: Reached | None,
    **options: Any,
) -> Solution:
    """Run those stages of a case that are not reached yet; the solution of the last one.

    Collective.
    """
    ranks, stages, reached = MpiComm(comm), case.stages, reached or Reached(0, case.meshed(comm))
    inner = [
        Path(STAGES) / f"{number}_{one.name}" for number, one in enumerate(stages[:-1], start=1)
    ] + [Path()]
    source, before = out if restart is True else Path(restart) if restart else None, ""
    with lock_folder(ranks, None if out is None else run_folder(ranks, out)):
        if (place := source or out) is not None:
            on_root(ranks, partial(_tidy, place, inner, keep=source is not None))
        for stage, folder in list(zip(stages, inner, strict=True))[reached.number :]:
            again = None if source is None else source / folder
            found = ranks.bcast(on_root(ranks, partial(_follows, again, before)))
            if before and out is not None and not found:
                on_root(ranks, partial(_begin, out, folder, before))
            more = {"restart": again if found or stage is stages[0] and again else False}
            reached, solution = _made(
                stage, reached, comm, None if out is None else out / folder, options | more
            )
            place = out or (source if found else None)
            left = (
                None if place is None else on_root(ranks, partial(state_checksum, place / folder))
            )
            before += f"{left} {solution.state.k}\n"
    return solution


def _tidy(out: Path, stages: list[Path], *, keep: bool) -> None:
    """Clear the folders of a new run.

    Runs in the folders of stages that are none any more are removed; with ``keep``, they are
    refused. Folders and files that no run has made are left alone.
    """
    place = inner_folder(out, STAGES)
    names = sorted(os.listdir(place)) if place.is_dir() else []
    found = [Path(STAGES) / name for name in names if name[0].isdecimal() and "_" in name]
    old = [one for one in found if one not in stages and is_marked(inner_folder(out, *one.parts))]
    if keep and old:
        raise InputError(
            f"'{out / old[0]}' belongs to no stage of the case: give stages their old names and "
            "order, or start a new run, which removes it"
        )
    for folder in () if keep else old:
        remove_run(out / folder)
    for folder in () if keep else stages:
        clear(inner_folder(out, *folder.parts))


def _follows(folder: Path | None, before: str) -> bool:
    """Return whether there is a checkpoint to continue from.

    Its stage has to have begun where those before it now end.
    """
    if folder is None or not is_own(folder / CHECKPOINT):
        return False
    return not before or is_own(folder / FOLLOWS) and read_text(folder / FOLLOWS) == before


def _begin(out: Path, folder: Path, before: str) -> None:
    """Note what a stage that is made anew follows from, in its empty folder."""
    place = make_inner_folder(out, *folder.parts)
    take(place)
    clear(place)
    write_atomically(place / FOLLOWS, before.encode())


def _made(
    stage: Stage, reached: Reached, comm: Any, folder: Path | None, options: dict[str, Any]
) -> tuple[Reached, Solution]:
    """Run a stage, or go on with it."""
    reached, parts, state = _entered(stage, reached, comm)
    if stage.static and options.get("restart"):  # it has been solved
        state = initial_state(stage.case.problem(comm, parts))
    with stage.case.call(parts, folder, state) as call:
        stage.case.keep_model(comm, parts, folder)
        solution = simulate(**call | options | ({"state": None} if options.get("restart") else {}))
    earlier = reached.earlier if reached.problem is None else (*reached.earlier, reached.problem)
    return replace(
        reached,
        number=reached.number + 1,
        problem=call["problem"],
        state=solution.state,
        static=stage.static,
        earlier=earlier,
    ), solution


def _entered(stage: Stage, reached: Reached, comm: Any) -> tuple[Reached, Parts, State | None]:
    """Return (reached, parts, first state) of a stage.

    ``reached`` has the force of all released supports; the parts begin where the stages before have
    left the body; the first state is None if it has to be found.
    """
    before, state = reached.problem, reached.state
    parts: Parts = replace(stage.case, ready=reached.meshed).parts(comm)
    parts = replace(parts, weighted=True, moved=True) if stage.static else parts
    if before is None or state is None:
        return reached, parts, None
    problem: ContactProblem = stage.case.problem(comm, parts)
    try:
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
        name, newtons = find_removed_support(before, begun, np.asarray(force))
        if name and not stage.release:
            raise InputError(
                f"it removes the support '{name}', which carries {newtons:.4g} N: give release = "
                "true, which holds its reaction as a force, or keep the support"
            )
    except InputError as error:
        raise InputError(f"{stage.label}: {error}") from error
    return (
        replace(reached, force=force),
        replace(parts, system=begun.system),
        None if stage.static else first,
    )
