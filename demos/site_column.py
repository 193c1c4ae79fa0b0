#!/usr/bin/env python3
"""Shake level ground whose sand yields, beside elastic and equivalent-linear sand.

A column of 20 m stands on a compliant base of rock (demos/cases/site_column.toml). Its sand is of
Iwan's elements, which follow the curve of Seed and Idriss and damp by their loops in time. Beside
it are the same column with the stiffness of small strains, and equivalent-linear waves.

    bash demos/run.sh site_column                  # a table and a picture, into results/site_column
    bash demos/run.sh site_column --record FILE    # a file of PEER, of an outcrop of the rock
    bash demos/run.sh site_column --quick          # 2 s of the motion and ten cells
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

from demos.parts.pictures.site_column import GRAVITY, plot_columns
from demos.parts.problems.site_column import (
    ELASTIC,
    Shaken,
    make_settings,
    read_motion,
    send_waves,
    shake,
)
from vi_contact import ground_motion
from vi_contact.practice.cli import status_of


def main(arguments: Sequence[str] | None = None) -> dict[str, Shaken]:
    """Run the columns, print a table, draw the picture; return what was found by name."""
    parser = ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--record", type=Path, help="file of the motion, as PEER writes it")
    parser.add_argument("--quick", action="store_true", help="2 s of the motion, ten cells")
    parser.add_argument("--out", type=Path, default=Path("results/site_column"), help="folder")
    chosen = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    cells = 10 if chosen.quick else 20
    until = 2.0 if chosen.quick else None
    settings = make_settings(chosen.out, chosen.record, until, cells, comm)
    found = {
        "elastic": shake(comm, [*settings, *ELASTIC], chosen.out / "elastic"),
        "equivalent-linear": send_waves(comm, settings, cells),
        "Iwan in time": shake(comm, settings, chosen.out / "iwan"),
    }
    if comm.rank == 0:
        outcrop = read_motion(settings)
        print(f"outcrop of the rock   {ground_motion.pga(outcrop) / GRAVITY:6.3f} g")
        print("column                surface   largest shear strain")
        for name, one in found.items():
            peak = ground_motion.pga(one.surface) / GRAVITY
            print(f"{name:20s}  {peak:6.3f} g  {100.0 * one.strain.max():6.3f} %")
        yielding = found["Iwan in time"].facts
        print(f"worst certificate     {yielding['worst_certificate']:.0e}")
        plot_columns(found, outcrop, chosen.out / "site_column.png")
    comm.Barrier()  # nobody leaves before the figure is there
    return found


# Things to try: excitation.1.scale = 0.01 in the case, where all three agree; a softer rock.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
