"""``vi-contact run CASE``, ``vi-contact cases`` and ``vi-contact new NAME``: options and what the commands do."""

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
from .errors import printable, world
from .options import WALL_TIME, add_settings

if TYPE_CHECKING:
    from ..studies.cases.case import Case


def add_case_commands(commands: Any) -> None:
    """Add ``run`` and ``cases`` to the commands of the top parser."""
    run = commands.add_parser(
        "run", help="run a case: one that ships with the package, or a TOML file",
        description="Run a case. The short options and --set change what it says; 'vi-contact cases' lists those that "
        "ship with the package, 'vi-contact report DIR' draws what the run found.",
    )
    run.add_argument("case", help="name of a case that ships (wall, channel), or a .toml file")
    short = run.add_argument_group("short options", "an option that the case has no use for is refused")
    short.add_argument("--motion", metavar="FILE[,FILE]", help="shake by records, a horizontal and a vertical one")
    short.add_argument("--scale", type=float, metavar="F", help="factor on what shakes")
    short.add_argument("--dt", type=float, metavar="S", help="time step [s]")
    short.add_argument("--steps", type=int, metavar="N", help="number of steps")
    short.add_argument("--solver", metavar="NAME", help="Condensed, Iterative, Volume or a method, as Hildreth")
    short.add_argument("--scheme", metavar="NAME", help=", ".join(schemes.__all__))
    short.add_argument("--cross-check", action="store_true", help="solve every step by the other route too and compare")
    run.add_argument("--out", metavar="DIR", help="output folder (default: out of [run], or results/NAME of the case)")
    run.add_argument("--restart", action="store_true", help="continue the run in the output folder from its checkpoint")
    run.add_argument("--restart-changed", action="store_true", dest="changed",
                     help="the same, also when the problem is another one than that of the checkpoint")
    run.add_argument("--wall-time", metavar="TIME", help=WALL_TIME)
    add_settings(run)
    run.add_argument("--check", action="store_true", help="tell what the model is, draw it as DIR/model.png, "
                     "and stop: mesh and records are read, and no step is computed")
    run.add_argument("--quiet", action="store_true", help="no progress line")
    run.set_defaults(run=_run, spelling={"units": "units (--set excitation.1.record.units=UNIT)"})
    cases = commands.add_parser("cases", help="list the cases that ship with the package",
                                description="List the cases that ship with the package, and their folder.")
    cases.set_defaults(run=_cases)
    schema = commands.add_parser("schema", help="print the JSON schema of case files, for editors",
                                 description="Print the JSON schema of case files: vi-contact schema > case.json.")
    schema.set_defaults(run=lambda options: FOLDER.with_name("case.schema.json").read_text("utf-8").rstrip())
    new = commands.add_parser("new", help="write a case to begin with, and the script of its mesh",
                              description="Write a commented case file and the Gmsh script of its mesh, to be changed.")
    new.add_argument("name", metavar="NAME", help=", ".join(starters()))
    new.add_argument("folder", metavar="DIR", nargs="?", help="default: NAME")
    new.set_defaults(run=_new)


def _cases(options: argparse.Namespace) -> str:
    lines = [f"{name:<10} {title}" for name, title in builtin_cases().items()]
    return "\n".join([*lines, f"the files: {FOLDER}"])


def _new(options: argparse.Namespace) -> str:
    if world().rank:
        return ""
    files = copy_starter(options.name, Path(options.folder or options.name))
    steps = f"run {files[0]} --check", f"run {files[0]}", f"report results/{options.name}"
    return "\n".join([*(f"wrote {path}" for path in files), "next:", *(f"    vi-contact {one}" for one in steps)])


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
        gc.disable()  # modules are no garbage: looking for it takes a tenth of the way to the first step
        case = read_case(path, short.settings(read_toml(path), options.settings), allow=options.allow)
    name = case.tables.get("title") or path.stem
    restart = options.restart or options.changed
    out = options.out or case.out or Path("results") / path.stem
    if options.check:
        return _checked(case, comm, Path(out))
    found = case.run(comm, out=out, restart=restart, progress=not options.quiet, changed=options.changed,
                     wall_time=options.wall_time)
    return f"{name}\n{found.summary()}\noutput: {out}" if comm.rank == 0 else ""


def _checked(case: "Case", comm: Any, folder: Path) -> str:
    """Describe and draw the model of a case; InputError for what is wrong with it, once all the rest is told."""
    from ..core.files import on_root
    from ..plots.sketch import sketch  # late: matplotlib
    from ..run.files.folder import ABOUT, HISTORY_CSV, run_folder
    from ..studies.cases.description import describe, in_words, write_model

    case.check()
    parts = case.parts(comm)
    model, ranks = describe(case, comm, parts), parts.system.algebra.comm
    case.columns(comm, parts)  # points and groups of the recorders
    if any((folder / name).exists() for name in (ABOUT, HISTORY_CSV)):  # of a run, of which model.json there tells
        folder = folder / "check"
    write_model(ranks, model, run_folder(ranks, folder))
    on_root(ranks, lambda: sketch(model).savefig(folder / "model.png", dpi=130, bbox_inches="tight"))
    if comm.rank == 0:
        print(printable(f"{in_words(model)}\npicture: {folder / 'model.png'}"))
    if model["defects"]:
        raise InputError(f"{case.path}: {'; '.join(model['defects'])}")
    return f"{case.path}: {model['title']}: the file is in order" if comm.rank == 0 else ""
