"""``vi-contact run CASE.toml``: options and what the command does."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .options import add_restart


def add_case_commands(commands: Any) -> None:
    """Adds ``run`` to the commands of the top parser."""
    sentence = "run a case file: a contact problem in TOML, table by table the calls of the Python interface"
    run = commands.add_parser("run", help=sentence, description=sentence[0].upper() + sentence[1:] + ".")
    run.add_argument("case", help="the case file (docs/guide/studies.md)")
    run.add_argument("--out", metavar="DIR", help="output folder (default: out of [run], or results/NAME of the file)")
    add_restart(run, "the output folder")
    run.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
                     help="replace a value of the file, such as friction.mu=0.5 or excitation.1.scale=2; repeatable")
    run.add_argument("--check", action="store_true", help="read the file and stop: nothing is computed")
    run.add_argument("--quiet", action="store_true", help="no progress line")
    run.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> str:
    from mpi4py import MPI

    from ..studies.cases.case import read_case

    comm = MPI.COMM_WORLD
    case = read_case(options.case, options.settings)
    name = case.tables.get("title") or Path(options.case).stem
    if options.check:
        case.check()
        case.check_mesh(comm)
        return f"{options.case}: {name}: the file is in order" if comm.rank == 0 else ""
    out = options.out or case.out or Path("results") / Path(options.case).stem
    solution = case.run(
        comm, out=out, restart=options.restart or options.changed, progress=not options.quiet, changed=options.changed
    )
    return f"{name}\n{solution.summary()}\noutput: {out}" if comm.rank == 0 else ""
