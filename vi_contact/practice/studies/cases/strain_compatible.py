"""Run a case until its soil is strain-compatible.

The table [strain_compatible] has the arguments of ``soil.strain_compatible``.

    [strain_compatible]
    curves = [["sand", {type = "SoilCurves.vucetic_dobry", plasticity = 15}]]

Every run is a whole one, in DIR, all stages with the same soil; those before the last one, or all
where none ends it, are in DIR/iterations/1, 2, …, and DIR/strain_compatible.json has the largest
relative change of G or xi after each.
"""

import os
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from ....core.errors import InputError, ViContactError
from ....core.files import on_root, to_json, write_atomically
from ....core.own_files import inner_folder, make_inner_folder
from ....fem.mesh.communicators import MpiComm
from ....run.files.folder import lock_folder, move_run, remove_if_empty, remove_run, run_folder
from ....run.recorders import Contact, Energy
from ....run.simulate import Solution
from ...soil.strain_compatible import strain_compatible
from .table_calls import Call, build, make_callee, walk_nodes

PLACE = "iterations"  # in the run folder
# [strain_compatible] as the arguments of the function: ``iterate`` adds mesh, materials and runs.
CALL = replace(
    make_callee(strain_compatible, only=("curves", "ratio", "tolerance", "most"), supplied=()),
    function=dict,
)


def iterate(
    case: Any, comm: Any, folder: Path | None, *, restart: bool | str | Path, **options: Any
) -> Solution:
    """Run a case with [strain_compatible] until its soil is so; collective.

    Args:
        case: a ``Case``.
        comm: the ranks.
        folder: of the run; None: without.
        restart: as of ``Case.run``; only False will do.
        options: other arguments of ``Case.run``.

    Returns:
        The solution of the last run.

    Raises:
        InputError: for a restart, another damping than ``DampingRatio``, and a last stage that is
            static.
    """
    system = case.nodes["system"]
    refuse_unfit(case, restart)
    ranks = MpiComm(comm)
    numbers = count()  # of the runs that have begun
    mesh, tags = case.meshed(comm)

    def run(material: Any, strain: Any) -> Any:
        """Compute the whole case with these materials, and record the strains of the last stage."""
        if folder is not None:
            on_root(ranks, partial(_set_aside, folder, next(numbers)))
        stages = []
        for stage in case.stages:
            recorders = (strain,) if stage is case.stages[-1] else ()
            inner = _soften(stage.case, material, recorders, (mesh, tags))
            stages.append(replace(stage, case=inner))
        softened = _soften(case, material, (strain,), (mesh, tags))
        return replace(softened, stages=tuple(stages)).run(comm, out=folder, **options)

    material = build(system.arguments.get("material", ()), {"tags": tags})
    arguments = build(case.nodes["strain_compatible"], {"tags": tags})
    with lock_folder(ranks, None if folder is None else run_folder(ranks, folder)):
        try:
            iteration = strain_compatible(mesh, material, run=run, **arguments)
        except ViContactError:
            # DIR shall not look like the run that was asked for.
            number = 0 if folder is None else next(numbers)
            if folder is not None and number > 0:
                on_root(ranks, partial(_set_aside, folder, number))
            raise
        if folder is not None:
            changes = to_json({"changes": iteration.changes}).encode()
            on_root(ranks, partial(write_atomically, folder / "strain_compatible.json", changes))
        return iteration.solution


def refuse_unfit(case: Any, restart: bool | str | Path = False) -> None:
    """Raise InputError where strains cannot be iterated; ``restart``: as of ``iterate``."""
    spot = f"{case.path}: [strain_compatible]"
    if restart:
        raise InputError(
            f"{spot} begins with the soil at small strains and cannot be continued: run it from "
            "the start"
        )
    damping = case.nodes["system"].arguments.get("damping")
    if not isinstance(damping, Call) or damping.callee.name != "DampingRatio":
        raise InputError(
            f"{spot} gives every cell its damping ratio: give [system.damping] type = "
            '"DampingRatio"'
        )
    if case.stages and case.stages[-1].static:
        raise InputError(
            f"{spot} uses the strains of the last stage, which is static: give a dynamic one"
        )


def _soften(case: Any, material: Any, strain: tuple[Any, ...], ready: tuple[Any, Any]) -> Any:
    """Return a case with other materials and more recorders.

    Args:
        case: the whole one, or that of a stage.
        material: the softened materials.
        strain: recorders of strains.
        ready: mesh and groups.
    """
    system = case.nodes["system"]
    recorders = case.nodes.get("record", (Energy(), Contact()))
    if not isinstance(recorders, tuple):
        recorders = (recorders,)
    nodes = {name: node for name, node in case.nodes.items() if name != "strain_compatible"}
    nodes["system"] = replace(system, arguments=system.arguments | {"material": material})
    nodes["record"] = (*recorders, *strain)
    return replace(case, nodes=nodes, ready=ready)


def with_known_damping(system: Call) -> Call:
    """Return the call of [system] without its damping if ratios are unknown.

    That is where no material has a ratio, as curves give them, run by run.
    """
    calls = [node for node in walk_nodes(system) if isinstance(node, Call)]
    if any(call.arguments.get("xi") for call in calls):
        return system
    arguments = {name: node for name, node in system.arguments.items() if name != "damping"}
    return replace(system, arguments=arguments)


def _set_aside(folder: Path, number: int) -> None:
    """Move the run in this folder into one inside of it.

    Before the first run, runs of an earlier time there are removed. Files of others stay where they
    are.

    Args:
        folder: of the run.
        number: of runs that have been made; 0 before the first one.
    """
    if number == 0:
        _remove_earlier(inner_folder(folder, PLACE))
    else:
        move_run(folder, make_inner_folder(folder, PLACE, str(number)))


def _remove_earlier(place: Path) -> None:
    """Remove the runs in the folders 1, 2, … of this one."""
    for name in sorted(os.listdir(place)) if place.is_dir() else ():
        if name.isdecimal():
            remove_run(inner_folder(place, name))
    remove_if_empty(place)
