"""The command line ``vi-contact``: parses and prints, nothing else."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from ..core.errors import Interrupted, ViContactError
from ..core.version import __version__
from .beam import add_beam_command
from .case import add_case_commands
from .channel import add_channel_commands
from .errors import Parser, check_words, printable, told
from .ida import add_ida_commands
from .layer import add_layer_command
from .motion import add_motion_commands
from .options import add_output, add_shaking, add_step, chosen, impact_law
from .ranks import fail_together, rank
from .report import add_report_commands

_DESCRIPTION = """Dynamic unilateral contact of elastic structures: exact non-penetration, a closed energy ledger and a
certificate for every time step. Run under "mpirun -n N" for any number of ranks. Options -vi_contact_volume_... go to
PETSc (for example -vi_contact_volume_snes_monitor)."""


def parser() -> argparse.ArgumentParser:
    """All commands and options."""
    top = Parser(prog="vi-contact", description=_DESCRIPTION)
    top.add_argument("--version", action="version", version=f"vi-contact {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    wall = commands.add_parser(
        "wall",
        help="a wall beside the ground, shaken (seed 000, Figs. 2-5)",
        description="The wall of seed 000: clamped at its base, its right side may touch the ground. Without --motion "
        "a harmonic acceleration at half the first natural frequency shakes it for 400 steps.",
    )
    add_wall_arguments(wall)
    wall.set_defaults(run=_wall)
    add_case_commands(commands)
    add_channel_commands(commands)
    add_ida_commands(commands)
    add_layer_command(commands)
    add_motion_commands(commands)
    add_beam_command(commands)
    add_report_commands(commands)
    return top


def add_wall_arguments(wall: argparse.ArgumentParser) -> None:
    """The options of ``vi-contact wall`` (the demo takes the same)."""
    wall.add_argument(
        "--case", help="a: 3 points, b: 11, face: whole side, bilateral, free (default: a and b in DIR/a, DIR/b)"
    )
    add_shaking(wall, harmonic="1 m/s2")
    step = add_step(wall, dt="1/20 of the first natural period")
    step.add_argument("--projection", action="store_true", help="impact as an M-orthogonal impulse, no reset")
    step.add_argument("--gravity", action="store_true", help="a gravity stage with contact active comes first")
    step.add_argument(
        "--base-inertia", metavar="WORD", help="whole: the ground accelerates all mass (default with a record); "
        "catalogue: without the mass shared with the base, as in the figures' reference numbers (default without one)",
    )
    mesh = wall.add_argument_group("mesh")
    mesh.add_argument("--divisions", type=int, nargs=2, metavar=("NX", "NY"), help="elements across, up (default 8 12)")
    mesh.add_argument("--size", type=float, metavar="H", help="element size [m] of an unstructured mesh instead")
    mesh.add_argument("--triangles", action="store_true", help="triangles instead of quadrilaterals")
    add_output(wall, out="results/wall")


def _wall(options: argparse.Namespace) -> str:
    from mpi4py import MPI

    out = Path(options.out)
    cases = {case: out / case for case in "ab"} if options.case is None else {options.case: out}
    texts = [_wall_case(options, case, out) for case, out in cases.items()]
    return "\n\n".join(texts) if MPI.COMM_WORLD.rank == 0 else ""


def _wall_case(options: argparse.Namespace, case: str, out: Path) -> str:
    from mpi4py import MPI

    from ..models.wall import BASE_INERTIA, Wall
    from ..models.wall_run import WallRun, run_wall

    nx, ny = options.divisions or (8, 12)
    run = WallRun(
        case=case,
        wall=Wall(divisions=(nx, ny), size=options.size, triangles=options.triangles),
        impact=impact_law(options.impact, options.projection),
        gravity=options.gravity,
        base_inertia=options.base_inertia,
        **chosen(options),
    )
    solution = run_wall(run, MPI.COMM_WORLD, out, progress=not options.quiet)
    return f"Wall, case {case}\n{solution.summary()}\n{BASE_INERTIA[run.convention]}\noutput: {out}"


def split_petsc(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """(our own arguments, PETSc options): the latter are ``-vi_contact_... [value]``, our PETSc prefixes."""
    own: list[str] = []
    petsc: list[str] = []
    taking = False
    for argument in arguments:
        if argument.startswith("-vi_contact_"):
            petsc.append(argument)
            taking = True
        elif taking and not argument.startswith("-"):
            petsc.append(argument)
            taking = False
        else:
            own.append(argument)
            taking = False
    return own, petsc


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command; prints its text, or one sentence on standard error and returns 1; 128 + n after signal n."""
    own, petsc = split_petsc(sys.argv[1:] if arguments is None else arguments)
    options = parser().parse_args(own)
    if petsc:
        import petsc4py

        petsc4py.init(["vi-contact", *petsc])
    try:
        check_words(own)
        text = told(lambda: options.run(options), getattr(options, "spelling", {}))
    except ViContactError as error:
        fail_together(str(error))
        if rank() == 0:
            print(f"vi-contact: {error}", file=sys.stderr, flush=True)
        return 1
    except KeyboardInterrupt as error:
        stopped = error if isinstance(error, Interrupted) else Interrupted()
        if rank() == 0:
            print(f"vi-contact: {stopped}", file=sys.stderr, flush=True)
        return 128 + stopped.number
    except Exception:
        fail_together(traceback.format_exc())
        raise
    if text:
        print(printable(text))
    return 0
