#!/usr/bin/env python3
"""Place the backfill of a retaining wall in lifts, and compare the moment at the stem's foot.

The wall stands on elastic ground by contact alone, and the fill rubs on it. K0 is given nowhere:
each lift is placed free of stress on what has moved, and yields as it likes. One, three and six
lifts on two meshes are beside earth pressures by hand, and beside a fill that is elastic.
docs/guide/lifts.md has the numbers.

    bash demos/run.sh lifts                     # a table and a figure, into results/lifts
    bash demos/run.sh lifts --quick             # three lifts on the coarse mesh
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

from demos.parts.pictures.lifts import plot_lifts
from demos.parts.problems.lifts import (
    ELASTIC,
    HEIGHT,
    SOIL,
    WEIGHT,
    Backfilled,
    backfill,
    find_by_hand,
)
from vi_contact.practice.cli import status_of

VARIANTS: dict[str, tuple[int, Any]] = {  # how many lifts, and of what
    "one elastic lift": (1, ELASTIC),
    "one lift": (1, SOIL),
    "three lifts": (3, SOIL),
    "six lifts": (6, SOIL),
}
SIZES = (0.9, 0.45)  # of the cells at the wall [m]


def print_table(walls: Sequence[Backfilled]) -> None:
    """Print thrust and moment of all variants, and those by hand."""
    print("fill                cells [m]   thrust [kN/m]   moment at the foot [kNm/m]")
    for wall in walls:
        print(
            f"{wall.name:18s} {wall.size:10.2f} {1e-3 * wall.thrusts[-1]:15.1f} "
            f"{1e-3 * wall.moments[-1]:28.1f}"
        )
    for name, K in find_by_hand().items():
        thrust = 0.5e-3 * K * WEIGHT * HEIGHT**2
        print(f"{name:18s} {'by hand':>10s} {thrust:15.1f} {thrust * HEIGHT / 3.0:28.1f}")
    print(f"worst certificate  {max(wall.certificate for wall in walls):.1e}")


def main(arguments: Sequence[str] | None = None) -> list[Backfilled]:
    """Print the table, draw the figure, and return what is measured."""
    parser = ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="three lifts on the coarse mesh")
    parser.add_argument("--out", type=Path, default=Path("results/lifts"), help="folder")
    chosen = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    names = ["three lifts"] if chosen.quick else list(VARIANTS)
    sizes = SIZES[:1] if chosen.quick else SIZES
    walls = []
    for size in sizes:
        walls += [backfill(comm, name, *VARIANTS[name], size) for name in names]
    if comm.rank == 0:
        print_table(walls)
        chosen.out.mkdir(parents=True, exist_ok=True)
        finest = [wall for wall in walls if wall.size == sizes[-1]]
        print(plot_lifts(finest, chosen.out / "moments.png", find_by_hand(), WEIGHT))
    return walls


# Things to try, in demos/parts/problems/lifts.py: MU = 0 leaves Rankine's wall; SOIL of 28 degrees;
# GROUND of 50 MPa tilts the wall.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
