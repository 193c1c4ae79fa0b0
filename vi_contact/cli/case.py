"""Carry out ``vi-contact run CASE``, ``vi-contact cases`` and ``vi-contact new NAME``.

This has their options and what they do.
"""

import argparse
import gc
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import schemes
from ..core import stages
from ..core.errors import InputError
from ..studies.cases.library import FOLDER, builtin_cases, copy_starter, located, starters
from ..studies.cases.short_settings import ShortOptions
from ..studies.cases.toml_file import read_toml
from .errors import say, world
from .options import add_command

if TYPE_CHECKING:
    from ..studies.cases.case import Case


OPTIONS = {"restart": "--restart", "changed": "--restart-changed", "wall_time": "--wall-time"}


def add_case_commands(commands: Any) -> None:
    """Add ``run``, ``cases``, ``schema`` and ``new`` to the commands of the top parser."""
    words = {"schemes": ", ".join(schemes.__all__), "starters": ", ".join(starters())}
    run = add_command(
        commands, "run", _run, "run", "short", "output", "settings", "check", words=words
    )
    run.set_defaults(spelling={"units": "units (--set excitation.1.record.units=UNIT)"})
    add_command(
        commands,
        "cases",
        lambda options: "\n".join(
            [
                *(f"{name:<10} {title}" for name, title in builtin_cases().items()),
                f"the files: {FOLDER}",
            ]
        ),
    )
    add_command(commands, "schema", _schema)
    add_command(commands, "new", _new, "new", words=words)


def _schema(options: argparse.Namespace) -> str:
    from ..studies.cases.schema import text  # late: finite elements

    return text().rstrip()


def _new(options: argparse.Namespace) -> str:
    if world().rank:
        return ""
    files = copy_starter(options.name, Path(options.folder or options.name))
    steps = f"run {files[0]} --check", f"run {files[0]}", f"report results/{options.name}"
    return "\n".join(
        [*(f"wrote {path}" for path in files), "next:", *(f"    vi-contact {one}" for one in steps)]
    )


def _run(options: argparse.Namespace) -> str:
    import mpi4py.MPI  # noqa: F401  # first: ``world`` finds it

    from ..run.wall_time import seconds_of
    from ..studies.cases.case import read_case  # late: finite elements

    comm, path = world(), located(options.case)
    stages.show(not options.quiet)
    if options.wall_time is not None:
        seconds_of(options.wall_time)
    if options.steps is not None and options.steps < 1:
        raise InputError(f"--steps {options.steps}: give at least one step")
    short = ShortOptions(**{one.name: getattr(options, one.name) for one in fields(ShortOptions)})
    with ExitStack() as after:
        after.callback(gc.enable if gc.isenabled() else gc.disable)
        # modules are no garbage: looking for it takes a tenth of the way to the first step
        gc.disable()
        case = read_case(
            path, short.settings(read_toml(path), options.settings), allow=options.allow
        )
    name = case.tables.get("title") or path.stem
    restart = options.restart or options.changed
    out = options.out or case.out or Path("results") / path.stem
    if options.check:
        vain = next(
            (name for name in ("restart", "changed", "wall_time") if getattr(options, name)), None
        )
        if vain is not None:
            raise InputError(
                f"{OPTIONS[vain]} has no effect with --check, which computes no step: leave one of "
                "the two out"
            )
        return _checked(case, comm, Path(out))
    found = case.run(
        comm,
        out=out,
        restart=restart,
        progress=not options.quiet,
        changed=options.changed,
        wall_time=options.wall_time,
    )
    return f"{name}\n{found.summary()}\noutput: {out}" if comm.rank == 0 else ""


def _checked(case: "Case", comm: Any, folder: Path) -> str:
    """Describe and draw the model of a case.

    It raises InputError for what is wrong with it, once all the rest is told.
    """
    from ..core.files import on_root
    from ..core.own_files import inner_folder
    from ..plots.histories import write_picture  # late: matplotlib
    from ..plots.sketch import sketch
    from ..run.files.folder import is_marked, run_folder
    from ..studies.cases.description import describe, in_words, write_model

    case.check()
    parts = case.parts(comm)
    model, ranks = describe(case, comm, parts), parts.system.algebra.comm
    case.columns(comm, parts)  # points and groups of the recorders
    if is_marked(folder):  # of a run, of which model.json there tells
        folder = inner_folder(folder, "check")
    write_model(ranks, model, run_folder(ranks, folder))
    on_root(ranks, lambda: write_picture(sketch(model), folder / "model.png", bbox_inches="tight"))
    if comm.rank == 0:
        say(f"{in_words(model)}\npicture: {folder / 'model.png'}")
    if model["defects"]:
        raise InputError(f"{case.path}: {'; '.join(model['defects'])}")
    return f"{case.path}: {model['title']}: the file is in order" if comm.rank == 0 else ""
