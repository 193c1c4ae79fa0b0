"""Run the stages of a case one after the other, each from where the one before has left the body.

A static stage finds the equilibrium under its loads with contact, a dynamic one marches. What passes on: displacements
and with them stresses, velocities after a dynamic stage, contact forces and the points where friction has brought the
body, and the reactions of released supports as forces. Every stage begins at t = 0 with its own excitations. Each has a
run folder, DIR/stages/1_NAME, the last one DIR itself; a static stage a folder of one row.
"""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError
from ...core.files import on_root
from ...core.problem import ContactProblem
from ...core.state_checks import initial_state
from ...core.step import State
from ...fem.communicators import MpiComm
from ...fem.released_supports import release, removed_support, same_supports, started
from ...run.files.folder import CHECKPOINT, clear, locked, run_folder
from ...run.simulate import Solution, simulate
from .stage_tables import Stage
from .vocabulary import Parts


@dataclass(frozen=True)
class Reached:
    """Hold what so many stages leave: mesh and groups, problem and state of the last one, which is at rest or not, the
    force of all supports released so far [N], and the problems of the stages before it."""

    number: int
    meshed: tuple[Any, Any]
    problem: ContactProblem | None = None
    state: State | None = None
    static: bool = True
    force: Array | float = 0.0
    earlier: tuple[ContactProblem, ...] = ()


def leading(case: Any, comm: Any) -> tuple[Reached | None, Parts, State | None]:
    """Return what runs of a case share that differ in their excitations: (what the static stages leave that come before
    all others but the last; parts of the next stage; its first state, None to be found). Collective."""
    if not case.stages:
        return None, case.parts(comm), None
    reached = Reached(0, case.meshed(comm))
    while reached.number < len(case.stages) - 1 and case.stages[reached.number].static:
        reached, _ = _made(case.stages[reached.number], reached, comm, None, {"progress": False, "fields": None})
    return reached, *_entered(case.stages[reached.number], reached, comm)[1:]


def run_stages(
    case: Any, comm: Any, out: Path | None, *, restart: bool | str | Path, reached: Reached | None, **options: Any
) -> Solution:
    """Run those stages of a case that are not reached yet; the solution of the last one. Collective."""
    ranks, stages, reached = MpiComm(comm), case.stages, reached or Reached(0, case.meshed(comm))
    inner = [Path("stages") / f"{number}_{one.name}" for number, one in enumerate(stages[:-1], start=1)] + [Path()]
    source = out if restart is True else Path(restart) if restart else None
    with locked(ranks, None if out is None else run_folder(ranks, out)):
        for folder in inner if source is None and out is not None else ():
            on_root(ranks, partial(clear, out / folder))  # type: ignore[operator]
        for stage, folder in list(zip(stages, inner, strict=True))[reached.number :]:
            again = None if source is None else source / folder
            found = again is not None and ranks.bcast(on_root(ranks, (again / CHECKPOINT).is_file))
            more = {"restart": again if again is not None and (found or stage is stages[0]) else False}
            reached, solution = _made(stage, reached, comm, None if out is None else out / folder, options | more)
    return solution


def _made(
    stage: Stage, reached: Reached, comm: Any, folder: Path | None, options: dict[str, Any]
) -> tuple[Reached, Solution]:
    """Run a stage, or go on with it."""
    again, changed = bool(options.get("restart")), options.get("changed", False)
    reached, parts, state = _entered(stage, reached, comm)
    if stage.static and again:  # it has been solved
        state = initial_state(stage.case.problem(comm, parts))
    with stage.case.call(parts, folder, state, changed=changed) as call:
        if folder is not None:
            from .description import FEW, describe, write_model  # late: it reads cases

            write_model(MpiComm(comm), describe(stage.case, comm, parts, most=FEW), folder)
        solution = simulate(**call | options | ({"state": None} if again else {}))
    earlier = reached.earlier if reached.problem is None else (*reached.earlier, reached.problem)
    return replace(reached, number=reached.number + 1, problem=call["problem"], state=solution.state,
                   static=stage.static, earlier=earlier), solution


def _entered(stage: Stage, reached: Reached, comm: Any) -> tuple[Reached, Parts, State | None]:
    """(reached, with the force of all released supports; parts that begin where the stages before have left the body;
    its first state, None to be found)."""
    before, state = reached.problem, reached.state
    parts: Parts = replace(stage.case, ready=reached.meshed).parts(comm)
    parts = replace(parts, weighted=True, moved=True) if stage.static else parts
    if before is None or state is None:
        return reached, parts, None
    problem: ContactProblem = stage.case.problem(comm, parts)
    try:
        if same_supports(before, problem) and (stage.static or not reached.static):
            u, v = before.cartesian(state.u), before.cartesian(state.v)
            begun, first = started(problem, u, 0.0 * v if stage.static else v, state, reached.force)
        elif reached.static:
            begun, first = release(before, state, problem, earlier=reached.earlier)
        else:
            raise InputError("it has other supports than the dynamic stage before it: put a static stage with the "
                             "supports of that one between them, or change supports before the motion")
        force = begun.system.load.constant - problem.system.load.constant
        name, newtons = removed_support(before, begun, np.asarray(force))
        if name and not stage.release:
            raise InputError(f"it removes the support '{name}', which carries {newtons:.4g} N: give release = true, "
                             "which holds its reaction as a force, or keep the support")
    except InputError as error:
        raise InputError(f"{stage.label}: {error}") from error
    return replace(reached, force=force), replace(parts, system=begun.system), None if stage.static else first
