#!/usr/bin/env python3
"""Shake a retaining wall whose fill yields, and film it.

The fill has been placed in three lifts (demos/cases/backfilled_wall.toml). The ground below is
elastic; the wall stands on it by contact with friction. When the rock moves towards the wall the
fill pushes it out, and yields. What the film shows beside the mesh is the plastic strain, and below
it how far the base has slid.

    bash demos/run.sh shaken_fill --record FILE  # a file of PEER, as of El Centro 1940: 12 s of it
    bash demos/run.sh shaken_fill                # without: a synthetic motion of the same peak
    bash demos/run.sh shaken_fill --quick        # 0.35 s of it, in some seconds
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

from demos.parts.pictures.yielding import film_motion
from demos.parts.problems.shaken_fill import find_pushed, read_snapshots, shake
from vi_contact import ground_motion
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
PEAK = 3.13  # of the motion [m/s²]; that of El Centro 1940, north-south
LENGTH = 12.0  # of the motion [s]
SEED = 4
SPECTRUM = ground_motion.KanaiTajimi(s0=0.01)
ENVELOPE = ground_motion.Envelope(rise=1.5, end=6.0, decay=0.5)


def read_motion(path: Path | None, length: float) -> ground_motion.Record:
    """Return the motion of the rock, from a file or synthetic.

    Args:
        path: of the file; None for none.
        length: of the motion [s].
    """
    if path is not None:
        return ground_motion.trimmed(ground_motion.read_record(path), 0.0, length)
    made = ground_motion.synthetic(SPECTRUM, LENGTH, 0.01, seed=SEED, envelope=ENVELOPE)
    return ground_motion.trimmed(ground_motion.scaled_to_pga(made, PEAK), 0.0, length)


def main(arguments: Sequence[str] | None = None) -> Any:
    """Run it, print what is left, write the film; return the solution."""
    parser = ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--record", type=Path, help="file of the motion, as PEER writes it")
    parser.add_argument("--quick", action="store_true", help="a short and strong motion")
    parser.add_argument("--out", type=Path, default=Path("results/shaken_fill"), help="folder")
    chosen = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    motion = read_motion(chosen.record, LENGTH)
    if chosen.quick:
        motion = ground_motion.scaled_to_pga(ground_motion.trimmed(motion, 1.6, 1.95), 5.0)
    solution = shake(comm, chosen.out, motion, 5 if chosen.quick else 10)
    history = solution.history
    pushed = find_pushed(history)
    if comm.rank == 0:
        peak = ground_motion.pga(motion)
        print(f"peak of the rock            {peak:10.3f} m/s²")
        print(f"slid away from the fill     {1e3 * pushed[-1]:10.2f} mm")
        print(f"moment at the stem's foot   {1e-3 * history['M_stem'][0]:10.1f} kNm at rest")
        print(f"                            {1e-3 * history['M_stem'].max():10.1f} kNm at most")
        print(f"                            {1e-3 * history['M_stem'][-1]:10.1f} kNm in the end")
        print(f"work of yielding            {1e-3 * history['loss_plastic'][-1]:10.3f} kJ/m")
        print(f"worst certificate           {solution.facts['worst_certificate']:10.1e}")
        snapshots = read_snapshots(chosen.out / "run", history["t"])
        print(film_motion(snapshots, history["t"], pushed, chosen.out / "shaken_fill.gif"))
    return solution


# Things to try: PEAK = 6.0; friction of 0.4 in demos/cases/backfilled_wall.toml.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
