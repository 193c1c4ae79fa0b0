#!/usr/bin/env python3
"""Press a strip footing into clay until it punches, and film the mechanism.

The clay has the undrained strength c, as von Mises' material with yield stress √3 c, whose shear
strength in plane strain is c. A smooth stiff strip comes down on it, step by step. Prandtl (1920):
the clay gives way under the pressure (2 + pi) c, with a wedge below the strip, two fans and two
wedges that rise beside it. The load over the settlement is below the bodies.

    bash demos/run.sh punch                     # a table and a film, into results/punch
    bash demos/run.sh punch --quick             # coarse, a few seconds
"""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.yielding import Snapshot, film_punch, take
from vi_contact import fem, laws
from vi_contact.core.algebra import Array
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
COHESION = 50e3  # [Pa], undrained
CLAY = laws.J2(E=20e6, nu=0.45, rho=1900.0, yield_stress=math.sqrt(3.0) * COHESION)
HALF = 1.0  # half width of the strip [m]
SIZE = (10.0, 4.0)  # of the clay [m]
EXACT = 2.0 + math.pi  # of pressure over cohesion
DEEPEST = 0.10  # settlement in the end [m]


def make_problem(comm: MPI.Comm, cells: int) -> vc.ContactProblem:
    """Return clay under a strip that comes down by t metres at the time t. Collective.

    Args:
        comm: the ranks.
        cells: in the half width of the strip.
    """
    divisions = (round(SIZE[0] / HALF) * cells, round(SIZE[1] / HALF) * cells)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=SIZE, divisions=divisions), comm)
    low, high = 0.5 * SIZE[0] - HALF, 0.5 * SIZE[0] + HALF

    def is_under(x: Any) -> Any:
        top = np.abs(x[1] - SIZE[1]) < 1e-9
        return top & (x[0] > low - 1e-9) & (x[0] < high + 1e-9)

    sides = [fem.Prescribed(tags[side], components=(0,)) for side in ("left", "right")]
    system = fem.assemble(mesh, CLAY, integration="bbar", clamped=tags["bottom"], prescribed=sides)
    strip = vc.HalfSpace(point=(0.0, SIZE[1]), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, fem.Facets.where("strip", mesh, is_under), obstacle=strip)
    return vc.ContactProblem(system, surface.moving(towards=lambda t: t))


def press(comm: MPI.Comm, cells: int, steps: int) -> tuple[Array, Array, list[Snapshot]]:
    """Return settlements [m], pressures over the cohesion, and snapshots. Collective.

    Args:
        comm: the ranks.
        cells: in the half width of the strip.
        steps: of load.
    """
    problem = make_problem(comm, cells)
    # half a cell beside the strip carries a part of its load
    width = 2.0 * HALF + 1.0 / cells * HALF
    pushed = DEEPEST * np.linspace(0.0, 1.0, steps + 1)[1:] ** 1.5
    loads, snapshots = [], []
    for state in vc.quasi_static(problem, pushed.tolist()):
        loads.append(problem.surface.comm.sum(np.array([state.r_n.sum()]))[0] / width / COHESION)
        snapshots.append(take(problem, state, f"a strip on clay, {1e3 * state.t:.0f} mm down"))
    return pushed, np.array(loads), snapshots


def main(arguments: Sequence[str] | None = None) -> tuple[Array, list[Snapshot]]:
    """Print the load, write the film; return pressures over the cohesion, and snapshots."""
    parser = ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="coarse, a few seconds")
    parser.add_argument("--out", type=Path, default=Path("results/punch"), help="folder")
    chosen = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    cells, steps = (2, 8) if chosen.quick else (8, 40)
    pushed, loads, snapshots = press(comm, cells, steps)
    if comm.rank == 0:
        print("settlement [mm]   pressure / c")
        for k in range(steps // 8 - 1, steps, steps // 8):
            print(f"{1e3 * pushed[k]:15.1f} {loads[k]:14.3f}")
        print(f"{'Prandtl':>15s} {EXACT:14.3f}")
        chosen.out.mkdir(parents=True, exist_ok=True)
        print(film_punch(snapshots, pushed, loads, EXACT, chosen.out / "punch.gif"))
    return loads, snapshots


# Things to try: SIZE = (10.0, 1.0), where rock below the clay stops the mechanism.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
