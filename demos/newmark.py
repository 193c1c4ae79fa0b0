#!/usr/bin/env python3
"""Compare the sliding that stays after a pulse with Newmark's block, for a block and for a wall.

First a stiff block on level ground with Coulomb friction, whose k_y is mu: contact must agree with
Newmark's equation to the step. Then the wall of demos/cases/backfilled_wall.toml, whose fill yields
and whose base slides; its k_y is by hand (Richards and Elms). Both have k_y/k_max = 0.3 and 0.6.

    bash demos/run.sh newmark                   # a table and a figure, into results/newmark
    bash demos/run.sh newmark --quick           # the block alone, in some seconds
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

from demos.parts.pictures.lifts import plot_slips
from demos.parts.problems.newmark import (
    GRAVITY,
    find_resistance,
    make_pulse,
    make_record,
    slide,
    slide_block,
)
from demos.parts.problems.shaken_fill import find_pushed, shake
from vi_contact.core.algebra import Array
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
RATIOS = (0.3, 0.6)  # k_y / k_max
DT = 1.0e-3  # of the block [s]; the wall takes 0.01 s
LENGTH = 2.0  # of the motion of the wall [s]

Slips = dict[tuple[str, float], tuple[Array, Array, Array]]


def slide_wall(comm: MPI.Comm, ratio: float, out: Path) -> tuple[Array, Array, Array]:
    """Return times [s], slips of the wall and of Newmark's block [m]. Collective.

    Args:
        comm: the ranks.
        ratio: k_y / k_max.
        out: folder of the run.
    """
    resistance = find_resistance() * GRAVITY
    pulse = make_pulse(resistance / ratio)
    history = shake(comm, out / f"wall_{ratio:g}", make_record(pulse, 0.01, LENGTH)).history
    times = history["t"]
    return times, find_pushed(history), slide(pulse, times, resistance, one_sided=True)


def main(arguments: Sequence[str] | None = None) -> Slips:
    """Print a table and draw the figure; return times and slips of each."""
    parser = ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="the block alone")
    parser.add_argument("--out", type=Path, default=Path("results/newmark"), help="folder")
    chosen = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    slips: Slips = {}
    for ratio in RATIOS:
        slips["block", ratio] = slide_block(comm, ratio, DT)
        if not chosen.quick:
            slips["wall", ratio] = slide_wall(comm, ratio, chosen.out)
    if comm.rank == 0:
        print(f"k_y of the wall, by hand: {find_resistance():.3f}")
        print(
            "what     k_y/k_max   slip that stays [mm]   Newmark's block [mm]   furthest apart [mm]"
        )
        for (name, ratio), (_, found, exact) in slips.items():
            apart = float(np.abs(found - exact).max())
            print(
                f"{name:8s} {ratio:9.1f} {1e3 * found[-1]:22.2f} {1e3 * exact[-1]:22.2f} "
                f"{1e3 * apart:21.2f}"
            )
        chosen.out.mkdir(parents=True, exist_ok=True)
        print(plot_slips(slips, chosen.out / "slips.png"))
    return slips


# Things to try: DT = 4e-3, where the block is further apart; FREQUENCY = 4 in the problem's file.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
