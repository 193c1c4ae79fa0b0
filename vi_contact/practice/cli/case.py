"""Carry out ``vi-contact run``, ``cases``, ``schema`` and ``new``: options and what they do."""

import argparse
import gc
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import schemes
from ...core import timing
from ...core.errors import InputError
from ..studies.cases.library import FOLDER, copy_starter, list_builtin_cases, list_starters, locate
from ..studies.cases.short_settings import ShortOptions
from ..studies.cases.toml_file import read_toml
from .errors import say, world
from .options import add_command, add_settings

if TYPE_CHECKING:
    from ..studies.cases.case import Case


# Options that steer the steps of a run: their names in the namespace, and as users write them.
OPTIONS = {"restart": "--restart", "changed": "--restart-changed", "wall_time": "--wall-time"}

# Columns of every history, which tell of steps and not of what was recorded.
OF_STEPS = {"t", "k", "iterations", "certificate", "escalated"}


def add_case_commands(commands: Any) -> None:
    """Add ``run``, ``cases``, ``schema`` and ``new`` to the commands of the top parser."""
    run = add_command(
        commands,
        "run",
        _run,
        help="run a case: one that ships with the package, or a TOML file",
        description=(
            "Run a case. The short options and --set replace values of the case. "
            "'vi-contact cases' lists the cases of the package. 'vi-contact "
            "report DIR' draws the results of the run."
        ),
    )
    run.add_argument(
        "case",
        help="name of a case of the package (beam, channel, layer, wall), or the path of a "
        ".toml file",
    )
    _add_short_options(run)
    _add_output(run)
    add_settings(run)
    _add_check(run)
    run.set_defaults(spelling={"units": "units (--set excitation.1.record.units=UNIT)"})

    add_command(
        commands,
        "cases",
        _list_cases,
        help="list the cases of the package",
        description="List the cases of the package, and their folder.",
    )
    add_command(
        commands,
        "schema",
        _compose_schema,
        help="print the JSON schema of case files, for editors",
        description=(
            "Print the JSON schema of case files. To keep it: vi-contact schema > case.json."
        ),
    )

    new = add_command(
        commands,
        "new",
        _write_starter,
        help="write a case to begin with, and the script of its mesh",
        description=(
            "Write a commented case file and the Gmsh script of its mesh, which you then change."
        ),
    )
    new.add_argument("name", metavar="NAME", help=", ".join(list_starters()))
    new.add_argument(
        "folder", metavar="DIR", nargs="?", help="folder to write into (default: NAME)"
    )


def _add_short_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that stand for the most common settings."""
    group = parser.add_argument_group(
        "short options", "The run ends with an error when the case cannot use a given option."
    )
    group.add_argument(
        "--motion",
        metavar="FILE[,FILE]",
        help=(
            "shake the model by one record (horizontal), or by two records (horizontal, vertical)"
        ),
    )
    group.add_argument(
        "--scale", type=float, metavar="F", help="multiply the excitation by this factor"
    )
    group.add_argument("--dt", type=float, metavar="S", help="time step [s]")
    group.add_argument("--steps", type=int, metavar="N", help="number of steps")
    group.add_argument(
        "--solver",
        metavar="NAME",
        help="Condensed, Iterative, Volume, or a method such as Hildreth",
    )
    group.add_argument("--scheme", metavar="NAME", help=", ".join(schemes.__all__))
    group.add_argument(
        "--cross-check",
        action="store_true",
        help="solve every step a second time by another solver and compare the answers",
    )


def _add_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of the output folder and of restarts."""
    parser.add_argument(
        "--out",
        metavar="DIR",
        help=(
            "output folder (default: the value of out in [run], or results/NAME, where "
            "NAME is the name of the case)"
        ),
    )
    parser.add_argument(
        "--restart",
        action="store_true",
        help="continue the run in the output folder from its checkpoint",
    )
    parser.add_argument(
        "--restart-changed",
        action="store_true",
        dest="changed",
        help=(
            "continue the run from its checkpoint even if the problem has changed since "
            "the checkpoint"
        ),
    )
    parser.add_argument(
        "--wall-time",
        metavar="TIME",
        help=(
            "write a checkpoint and end with status 75 before this time since the start "
            "is over; give hours:minutes:seconds, or another form that Slurm reads as "
            "--time"
        ),
    )


def _add_check(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what is computed and printed."""
    parser.add_argument(
        "--check",
        action="store_true",
        help=(
            "describe the model, draw it as DIR/model.png, and stop; the mesh and the "
            "records are read, and no step is computed"
        ),
    )
    parser.add_argument("--quiet", action="store_true", help="print no progress line")


def _list_cases(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact cases``: return names, titles and the folder."""
    lines = [f"{name:<10} {title}" for name, title in list_builtin_cases().items()]
    return "\n".join([*lines, f"the files: {FOLDER}"])


def _compose_schema(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact schema``: return the schema."""
    from ..studies.cases.schema import write_schema  # late: finite elements

    return write_schema().rstrip()


def _write_starter(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact new``: write the files, and return what may be done next."""
    if world().rank:
        return ""
    files = copy_starter(options.name, Path(options.folder or options.name))
    case = files[0]
    return "\n".join(
        [
            *(f"wrote {path}" for path in files),
            "next:",
            f"    vi-contact run {case} --check",
            f"    vi-contact run {case}",
            f"    vi-contact report results/{options.name}",
        ]
    )


def _run(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact run``: return the summary on the first rank. Collective."""
    import mpi4py.MPI  # noqa: F401  # first: ``world`` finds it

    from ...run.wall_time import parse_wall_time

    comm = world()
    path = locate(options.case)
    timing.show_on_terminal(not options.quiet)
    if options.wall_time is not None:
        parse_wall_time(options.wall_time)
    case = _read_case(options, path)
    out = options.out or case.out or Path("results") / path.stem
    if options.check:
        _refuse_vain_options(options)
        return _check_model(case, comm, Path(out))
    solution = case.run(
        comm,
        out=out,
        restart=options.restart or options.changed,
        progress=not options.quiet,
        changed=options.changed,
        wall_time=options.wall_time,
    )
    if comm.rank != 0:
        return ""
    title = case.tables.get("title") or path.stem
    recorded = _tell_recorded(solution) if case.stages else ""
    return f"{title}\n{solution.summary()}{recorded}\noutput: {out}"


def _tell_recorded(solution: Any) -> str:
    """Return a line for each number that the records of a static stage have; none of a run.

    Args:
        solution: of the last stage.
    """
    if len(solution.history["t"]) > 1:
        return ""
    lines = [""]
    for name, (unit, _) in solution.columns.items():
        values = solution.history[name]
        if values.ndim == 1 and name not in OF_STEPS and not name.startswith("a_g_"):
            lines.append(f"  {name:26s} {values[-1]: .4e} {unit}".rstrip())
    return "\n".join(lines)


def _read_case(options: argparse.Namespace, path: Path) -> "Case":
    """Read a case file, with the short options and --set."""
    from ..studies.cases.case import read_case  # late: finite elements

    names = [field.name for field in fields(ShortOptions)]
    short = ShortOptions(**{name: getattr(options, name) for name in names})
    with ExitStack() as after:
        after.callback(gc.enable if gc.isenabled() else gc.disable)
        # modules are no garbage: looking for it takes a tenth of the way to the first step
        gc.disable()
        settings = short.settings(read_toml(path), options.settings)
        return read_case(path, settings, allow=options.allow)


def _refuse_vain_options(options: argparse.Namespace) -> None:
    """Raise InputError for options that steer the steps, none of which --check computes."""
    for name, option in OPTIONS.items():
        if getattr(options, name):
            raise InputError(
                f"{option} has no effect with --check, which computes no step: leave one of the "
                "two out"
            )


def _check_model(case: "Case", comm: Any, folder: Path) -> str:
    """Describe and draw the model of a case, into a folder. Collective.

    It raises InputError for what is wrong with it, once all the rest is told.
    """
    from ...core.files import on_root
    from ...core.own_files import inner_folder
    from ...fem.mesh.communicators import MpiComm
    from ...run.files.folder import is_marked, run_folder
    from ..plots.histories import write_picture  # late: matplotlib
    from ..plots.sketch import sketch
    from ..studies.cases.description.model import write_model
    from ..studies.cases.description.words import count_doubts, put_in_words
    from ..studies.cases.examination import examine

    case.check()
    on_root(MpiComm(comm), lambda: case.refuse_files_of_others(folder))
    if is_marked(folder):  # of a run, of which model.json there tells
        folder = inner_folder(folder, "check")
    model, ranks = examine(case, comm, folder)
    write_model(ranks, model, run_folder(ranks, folder))
    picture = folder / "model.png"
    units = case.sheet.units
    on_root(ranks, lambda: write_picture(sketch(model, units), picture, bbox_inches="tight"))
    if comm.rank == 0:
        say(f"{put_in_words(model, units)}\npicture: {picture}")
    if model["defects"]:
        raise InputError(f"{case.path}: {'; '.join(model['defects'])}")
    if comm.rank != 0:
        return ""
    return f"{case.path}: {model['title']}: the file is in order; {count_doubts(model)}"
