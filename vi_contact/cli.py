"""The command line ``vi-contact``: parses and prints, nothing else."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import __version__
from .cli_beam import add_beam_command
from .cli_case import add_case_commands
from .cli_motion import add_motion_commands
from .cli_report import add_report_commands
from .errors import ViContactError

_DESCRIPTION = """Dynamic unilateral contact of elastic structures: exact non-penetration, a closed energy ledger and a
certificate for every time step. Run under "mpirun -n N" for any number of ranks. Options -vi_contact_volume_... go to
PETSc (for example -vi_contact_volume_snes_monitor)."""


def parser() -> argparse.ArgumentParser:
    """All commands and options."""
    top = argparse.ArgumentParser(prog="vi-contact", description=_DESCRIPTION)
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
    add_motion_commands(commands)
    add_beam_command(commands)
    add_report_commands(commands)
    return top


def add_wall_arguments(wall: argparse.ArgumentParser) -> None:
    """The options of ``vi-contact wall`` (the demo takes the same)."""
    wall.add_argument(
        "--case", help="a: 3 points, b: 11, face: whole side, bilateral, free (default: a and b in DIR/a, DIR/b)"
    )
    shake = wall.add_argument_group("ground motion")
    shake.add_argument("--motion", metavar="FILE", help="horizontal record: PEER AT2, USGS SMC or two columns")
    shake.add_argument("--vertical", metavar="FILE", help="vertical record, beside --motion")
    shake.add_argument("--units", help="units of two-column files: m/s2, cm/s2, gal, g, ...")
    shake.add_argument("--scale", type=float, default=1.0, help="factor on the record, or on the harmonic's 1 m/s2")
    shake.add_argument("--pga", type=float, metavar="A", help="scale both to this peak [m/s2] of the first")
    shake.add_argument("--resample", type=float, metavar="DT", help="resample to this step [s], band-limited")
    step = wall.add_argument_group("step")
    step.add_argument(
        "--solver", default="condensed",
        help="condensed (default), hildreth, projected-cg, volume, volume-reference, semismooth, tron, bnls"
    )
    step.add_argument(
        "--scheme", default="zwt",
        help="zwt: the source's (default); trapezoidal: does not ring; newmark, hht, generalised-alpha, houbolt, "
        "contact-stabilised, kane, moreau-jean, midpoint, ss22, newmark-consistent",
    )
    step.add_argument(
        "--impact", help="inelastic, elastic, none or a restitution in [0, 1]; default inelastic with zwt and ss22, "
        "none with schemes that need no impact law",
    )
    step.add_argument("--projection", action="store_true", help="impact as an M-orthogonal impulse, no reset")
    step.add_argument("--gravity", action="store_true", help="a gravity stage with contact active comes first")
    step.add_argument("--dt", type=float, help="time step [s] (default 1/20 of the first natural period)")
    step.add_argument("--steps", type=int, help="number of steps (default 400, or the whole record)")
    step.add_argument("--cross-check", action="store_true", help="solve every step by the other route too and compare")
    mesh = wall.add_argument_group("mesh")
    mesh.add_argument("--divisions", type=int, nargs=2, metavar=("NX", "NY"), help="elements across, up (default 8 12)")
    mesh.add_argument("--size", type=float, metavar="H", help="element size [m] of an unstructured mesh instead")
    mesh.add_argument("--triangles", action="store_true", help="triangles instead of quadrilaterals")
    output = wall.add_argument_group("output")
    output.add_argument("--out", default="results/wall", metavar="DIR", help="output folder (default results/wall)")
    output.add_argument("--fields-every", type=int, default=10, metavar="K", help="steps between frames, 0: none")
    output.add_argument("--restart", action="store_true", help="continue the run in --out from its checkpoint")
    output.add_argument("--quiet", action="store_true", help="no progress line")


def _impact(name: str | None, projection: bool) -> Any:
    from .errors import InputError
    from .impact import ComponentReset, Elastic, Inelastic, MassProjection, Newton, NoImpact

    if name is None and not projection:
        return None
    reading: Any = MassProjection() if projection else ComponentReset()
    if name is None:
        return Inelastic(reading)
    if name == "none":
        return NoImpact()
    if name in ("inelastic", "elastic"):
        return Inelastic(reading) if name == "inelastic" else Elastic(reading)
    try:
        return Newton(float(name), reading)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        known = "inelastic, elastic, none or a restitution in [0, 1]"
        raise InputError(f"unknown impact law '{name}': give {known}") from None


def _wall(options: argparse.Namespace) -> str:
    from mpi4py import MPI

    cases = {options.case: Path(options.out)} if options.case else {case: Path(options.out) / case for case in "ab"}
    texts = [_wall_case(options, case, out) for case, out in cases.items()]
    return "\n\n".join(texts) if MPI.COMM_WORLD.rank == 0 else ""


def _wall_case(options: argparse.Namespace, case: str, out: Path) -> str:
    from mpi4py import MPI

    from .models.wall import Wall
    from .models.wall_run import WallRun, run_wall

    nx, ny = options.divisions or (8, 12)
    run = WallRun(
        case=case,
        wall=Wall(divisions=(nx, ny), size=options.size, triangles=options.triangles),
        motion=options.motion,
        vertical=options.vertical,
        units=options.units,
        scale=options.scale,
        pga=options.pga,
        resample=options.resample,
        solver=options.solver,
        scheme=options.scheme,
        impact=_impact(options.impact, options.projection),
        gravity=options.gravity,
        dt=options.dt,
        steps=options.steps,
        cross_check=options.cross_check,
        fields_every=options.fields_every,
        restart=options.restart,
    )
    solution = run_wall(run, MPI.COMM_WORLD, out, progress=not options.quiet)
    return f"Wall, case {case}\n{solution.summary()}\noutput: {out}"


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
    """Runs a command; prints its text, or one sentence on standard error and returns 1."""
    own, petsc = split_petsc(sys.argv[1:] if arguments is None else arguments)
    options = parser().parse_args(own)
    if petsc:
        import petsc4py

        petsc4py.init(["vi-contact", *petsc])
    try:
        text = options.run(options)
    except ViContactError as error:
        if _rank() == 0:
            print(f"vi-contact: {error}", file=sys.stderr, flush=True)
        return 1
    if text:
        print(text)
    return 0


def _rank() -> int:
    """This process's rank, without importing MPI for commands that do not use it."""
    return sys.modules["mpi4py.MPI"].COMM_WORLD.rank if "mpi4py.MPI" in sys.modules else 0
