#!/usr/bin/env python3
"""Stretch a membrane over a ball, a field with a lower bound.

It is compared with the exact solution on five meshes.

The membrane is held at the height of the exact solution along the sides of a square, and lies on
the ball within the radius 0.69797, which is not known beforehand. The problem consists of a form of
UFL and a lower bound.

    bash demos/run.sh obstacle                # a table and a figure, into results/obstacle
    bash demos/run.sh -n 2 obstacle           # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

from demos.parts.pictures.bounds import gathered, plot_membrane
from demos.parts.problems.membrane import build
from vi_contact import vi
from vi_contact.cli import status_of
from vi_contact.exact.membrane import HALF, Membrane

# Parameters
# --------------------------------------------------------------------------------------------------
CELLS = (16, 32, 64, 128, 256)  # squares along a side
DRAWN = 64
OUT = Path("results/obstacle")


def main(quick: bool = False, out: Path = OUT) -> dict[str, float]:
    """Solve on all meshes (``quick``: the three coarse ones).

    It returns errors, the contact radius and the force.
    """
    comm = MPI.COMM_WORLD
    known = Membrane()
    numbers = {}
    meshes = CELLS[:3] if quick else CELLS
    drawn = None
    for cells in meshes:
        posed = build(comm, cells)
        result = vi.solve((posed.a, posed.L), posed.u, lower=posed.lower, bcs=[posed.bc])
        V = posed.u.function_space
        n = V.dofmap.index_map.size_local
        off = np.max(np.abs(posed.u.x.array[:n] - posed.exact.x.array[:n]), initial=0.0)
        push = result.lambda_lower.x.array[:n]
        points = V.tabulate_dof_coordinates()[:n]
        farthest = np.max(np.hypot(*points[push > 0.0, :2].T), initial=0.0)
        numbers[f"{cells}: error"] = comm.allreduce(float(off), op=MPI.MAX)
        numbers[f"{cells}: radius"] = comm.allreduce(float(farthest), op=MPI.MAX)
        numbers[f"{cells}: force"] = comm.allreduce(float(np.sum(push)))
        numbers[f"{cells}: active"] = float(result.active[0])
        numbers[f"{cells}: certificate"] = result.certificate.worst
        if cells == DRAWN:
            drawn = gathered(posed.u), gathered(result.lambda_lower)
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        sizes = [2.0 * HALF / cells for cells in meshes]
        errors = {
            "largest error of u": [numbers[f"{cells}: error"] for cells in meshes],
            "contact radius, from the area of active cells": [
                abs(radius(numbers, cells) - known.radius) for cells in meshes
            ],
            "force, relative": [
                abs(numbers[f"{cells}: force"] / known.force - 1.0) for cells in meshes
            ],
        }
        assert drawn is not None
        plot_membrane(*drawn, sizes, errors, out / "obstacle.png")
        print(table(numbers, meshes, known))
        print(f"\nThe figure is in {out}.")
    comm.Barrier()
    return numbers


def radius(numbers: dict[str, float], cells: int) -> float:
    """Return the radius of a disk of the area that belongs to the active nodes."""
    return float(np.sqrt(numbers[f"{cells}: active"] / np.pi) * 2.0 * HALF / cells)


def table(numbers: dict[str, float], meshes: tuple[int, ...], known: Membrane) -> str:
    """Return the errors of all meshes."""
    lines = [
        f"exact: contact radius {known.radius:.5f}, force {known.force:.5f}",
        "",
        f"{'cells':>6} {'error of u':>11} {'farthest active':>16} {'from area':>10} {'force':>9} "
        f"{'certificate':>12}",
    ]
    for cells in meshes:
        error, far, force, worst = (
            numbers[f"{cells}: {name}"] for name in ("error", "radius", "force", "certificate")
        )
        lines.append(
            f"{cells:>6} {error:>11.2e} {far:>16.5f} {radius(numbers, cells):>10.5f} {force:>9.5f} "
            f"{worst:>12.1e}"
        )
    return "\n".join(lines)


# Things to try: Membrane(unit=1e-9) in build(): the same active set; method=ReducedNewton() of
# vi_contact.solvers.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
