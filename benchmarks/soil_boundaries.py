#!/usr/bin/env python3
"""What soil boundaries send back: dashpots at an angle, and how far the sides of a soil with a structure must be.

    python3 benchmarks/soil_boundaries.py [--angles 15 30 45 60 75] [--cells 14] [--only dashpots|sides]

Dashpots: a packet of plane waves on a strip that is one wavelength wide along the boundary, its sides tied; energy left
after the reflection over energy before (verification V8.1). Sides: a heavy stiff box at the surface of a soft layer on
rigid rock, shaken horizontally; largest deviation of the box's displacement from that with sides twelve depths away.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
from fem_problems import linear  # noqa: E402
from mpi4py import MPI  # noqa: E402
from wave_packet import energy_sent_back  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.exact import dashpot_energy  # noqa: E402
from vi_contact.fem.compat import geometry_dofmap  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402
from vi_contact.soil import FreeField  # noqa: E402

NU = 0.25
LENGTH = 2.5  # of the packet, in wavelengths
SOIL = vc.LinearElastic.from_wave_speeds(280.0, 150.0, 1900.0)
CONCRETE = vc.LinearElastic(E=3.0e10, nu=0.2, rho=2400.0)
DEPTH, BOX, H = 10.0, (6.0, 4.0), 1.0  # m: soil, box, cells
DT, STEPS = 5e-3, 400
SHAKE = vc.Ricker(1.0, 4.0)


def shaken_box(sides: str, distance: float) -> np.ndarray:
    """History of the box's displacement (steps, 2) with sides of some kind at ``distance`` [m] from it."""
    width = BOX[0] + 2.0 * distance
    divisions = round(width / H), round(DEPTH / H)
    block = BlockMesh(lengths=(width, DEPTH), divisions=divisions, corner=(-0.5 * width, -DEPTH))
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    middle = mesh.geometry.x[geometry_dofmap(mesh)].mean(axis=1)
    inside = (np.abs(middle[:, 0]) < 0.5 * BOX[0]) & (middle[:, 1] > -BOX[1])
    box, soil = (fem.Cells(n, np.flatnonzero(m).astype(np.int32), mesh) for n, m in (("box", inside), ("s", ~inside)))
    ends = [tags["left"], tags["right"]]
    boundary: dict[str, Any] = {
        "rollers": {"prescribed": [fem.Prescribed(one, components=(1,)) for one in ends]},
        "tied": {"tied": fem.Tied(*ends)},
        "free field": {"dashpots": [FreeField(one, base=SHAKE) for one in ends]},
        "dashpots": {"dashpots": [fem.Dashpots(one) for one in ends]},
        "free": {},
    }[sides]
    damping = vc.Rayleigh.from_frequencies(2.0, 8.0, xi1=0.03, xi2=0.03)
    system = fem.assemble(mesh, [(box, CONCRETE), (soil, SOIL)], clamped=tags["bottom"], damping=damping, **boundary)
    node = system.space.find_nodes(np.array([[0.0, 0.0]]))
    march = vc.march(linear(system, excitation=SHAKE), dt=DT, steps=STEPS)
    return np.array([system.space.sample(state.u, node, state.t)[0] for state, _ in march])


def dashpot_table(angles: Sequence[float], cells: int) -> None:
    print("| angle | P table | P packet | P measured | S table | S packet | S measured |\n" + "|---" * 7 + "|")
    for angle in angles:
        row = [f"{angle:g}°"]
        for wave in "PS":
            material, slope = vc.LinearElastic(E=1.0, nu=NU, rho=1.0), math.radians(angle)
            exact = dashpot_energy(material, slope, wave=wave)
            measured, packet = energy_sent_back(MPI.COMM_WORLD, material, wave, slope, length=LENGTH, cells=cells)
            row += [f"{exact:.5f}", f"{packet:.5f}", f"{measured:.5f}"]
        print("| " + " | ".join(row) + " |", flush=True)


def side_table(depths: Sequence[float]) -> None:
    reference = shaken_box("free field", 12.0 * DEPTH)
    largest = np.abs(reference[:, 0]).max()
    print(f"largest displacement {largest:.4g} m", flush=True)
    print("| sides | " + " | ".join(f"{d:g} depths" for d in depths) + " |\n|" + "---|" * (len(depths) + 1))
    for sides in ("rollers", "tied", "free field", "dashpots", "free"):
        errors = [np.abs(shaken_box(sides, d * DEPTH) - reference)[:, 0].max() / largest for d in depths]
        print(f"| {sides} | " + " | ".join(f"{100 * e:.2g} %" for e in errors) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--angles", type=float, nargs="+", default=[15.0, 30.0, 45.0, 60.0, 75.0])
    parser.add_argument("--cells", type=int, default=12, help="per wavelength")
    parser.add_argument("--only", choices=("dashpots", "sides"))
    given = parser.parse_args()
    if given.only != "dashpots":
        side_table((0.5, 1.0, 2.0, 3.0, 5.0))
    if given.only != "sides":
        dashpot_table(given.angles, given.cells)


if __name__ == "__main__":
    main()
