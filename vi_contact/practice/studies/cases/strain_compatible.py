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
from .table_calls import Call, build, callee, nodes_in

PLACE = "iterations"  # in the run folder
CALL = replace(
    callee(strain_compatible, only=("curves", "ratio", "tolerance", "most"), given=()),
    function=dict,
)


def iterate(
    case: Any, comm: Any, folder: Path | None, *, restart: bool | str | Path, **options: Any
) -> Solution:
    """Run a case with [strain_compatible] until it is; the solution of the last run. Collective."""
    spot, ranks, numbers, given = (
        f"{case.path}: [strain_compatible]",
        MpiComm(comm),
        count(),
        case.nodes["system"],
    )
    if restart:
        raise InputError(
            f"{spot} begins with the soil at small strains and cannot be continued: run it from "
            "the start"
        )
    damping = given.arguments.get("damping")
    if not isinstance(damping, Call) or damping.callee.name != "DampingRatio":
        raise InputError(
            f"{spot} gives every cell its damping ratio: give [system.damping] type = "
            '"DampingRatio"'
        )
    if case.stages and case.stages[-1].static:
        raise InputError(
            f"{spot} uses the strains of the last stage, which is static: give a dynamic one"
        )
    mesh, tags = case.meshed(comm)

    def softened(one: Any, material: Any, *strain: Any) -> Any:
        own = one.nodes.get("record", (Energy(), Contact()))
        nodes = {name: node for name, node in one.nodes.items() if name != "strain_compatible"}
        nodes["system"] = replace(
            nodes["system"], arguments=nodes["system"].arguments | {"material": material}
        )
        nodes["record"] = (*(own if isinstance(own, tuple) else (own,)), *strain)
        return replace(one, nodes=nodes, ready=(mesh, tags))

    def run(material: Any, strain: Any) -> Any:
        if folder is not None:
            on_root(ranks, partial(_set_aside, folder, next(numbers)))
        stages = tuple(
            replace(
                stage,
                case=softened(stage.case, material, *[strain][stage is not case.stages[-1] :]),
            )
            for stage in case.stages
        )
        return replace(softened(case, material, strain), stages=stages).run(
            comm, out=folder, **options
        )

    material = build(given.arguments.get("material", ()), {"tags": tags})
    asked = build(case.nodes["strain_compatible"], {"tags": tags})
    with lock_folder(ranks, None if folder is None else run_folder(ranks, folder)):
        try:
            found = strain_compatible(mesh, material, run=run, **asked)
        except ViContactError:  # DIR shall not look like the run that was asked for
            if folder is not None and (number := next(numbers)):
                on_root(ranks, partial(_set_aside, folder, number))
            raise
        if folder is not None:
            told = to_json({"changes": found.changes}).encode()
            on_root(ranks, partial(write_atomically, folder / "strain_compatible.json", told))
        return found.solution


def with_known_damping(system: Call) -> Call:
    """Return the call of [system] without its damping if ratios are unknown.

    That is where no material has a ratio, as curves give them, run by run.
    """
    ratios = [one for one in nodes_in(system) if isinstance(one, Call) and one.arguments.get("xi")]
    known = {name: node for name, node in system.arguments.items() if name != "damping" or ratios}
    return replace(system, arguments=known)


def _set_aside(folder: Path, number: int) -> None:
    """Move the run in this folder into one inside of it.

    Before the first run, runs of an earlier time there are removed.

    Files of others stay where they are.
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
