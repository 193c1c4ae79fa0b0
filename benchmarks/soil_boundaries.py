#!/usr/bin/env python3
"""Measure what soil boundaries reflect, and how far away the sides of a soil must be.

The reflection of dashpots depends on the angle of the waves.

    python3 benchmarks/soil_boundaries.py [--angles 15 30 45 60 75] [--cells 14]
        [--only dashpots|sides|boxes]

dashpots: a group of plane waves runs in a strip that is one wavelength wide along the boundary, and
whose sides are tied. The column is the energy that is left after the reflection, over the energy
before it. sides: a heavy stiff box at the surface of a soft layer on rigid rock is shaken
horizontally. The column is the largest deviation of the displacement of the box from that with
sides twelve depths away. boxes: the same in space with sides that are tied in both directions,
against sides six depths away. Then level ground on a compliant base is shaken in three components,
between dashpots or free sides. The column is the deviation of the velocity in the middle of the
surface from that of tied sides, which is exact.
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
from dashpot_reflection import dashpot_energy  # noqa: E402
from fem_problems import linear  # noqa: E402
from mpi4py import MPI  # noqa: E402
from wave_packet import energy_sent_back  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.fem.compat import geometry_dofmap  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402
from vi_contact.practice.soil import FreeField, upgoing  # noqa: E402

NU = 0.25
LENGTH = 2.5  # of the packet, in wavelengths
SOIL = vc.LinearElastic.from_wave_speeds(280.0, 150.0, 1900.0)
CONCRETE = vc.LinearElastic(E=3.0e10, nu=0.2, rho=2400.0)
DEPTH = 10.0  # of the soil [m]
BOX = (6.0, 4.0)  # [m]
H = 1.0  # of the cells [m]
DT = 5e-3
STEPS = 400
PAIRS = (("left", "right"), ("back", "front"))
SHAKE = vc.Ricker(1.0, 4.0)


def shaken_box(sides: str, distance: float) -> np.ndarray:
    """Return the history of the box's displacement (steps, 2) with sides of some kind.

    The sides are at ``distance`` [m] from it.
    """
    width = BOX[0] + 2.0 * distance
    divisions = round(width / H), round(DEPTH / H)
    block = BlockMesh(lengths=(width, DEPTH), divisions=divisions, corner=(-0.5 * width, -DEPTH))
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    middle = mesh.geometry.x[geometry_dofmap(mesh)].mean(axis=1)
    inside = (np.abs(middle[:, 0]) < 0.5 * BOX[0]) & (middle[:, 1] > -BOX[1])
    box, soil = (
        fem.Cells(n, np.flatnonzero(m).astype(np.int32), mesh)
        for n, m in (("box", inside), ("s", ~inside))
    )
    ends = [tags["left"], tags["right"]]
    boundary: dict[str, Any] = {
        "rollers": {"prescribed": [fem.Prescribed(one, components=(1,)) for one in ends]},
        "tied": {"tied": fem.Tied(*ends)},
        "free field": {"dashpots": [FreeField(one, base=SHAKE) for one in ends]},
        "dashpots": {"dashpots": [fem.Dashpots(one) for one in ends]},
        "free": {},
    }[sides]
    damping = vc.Rayleigh.from_frequencies(2.0, 8.0, xi1=0.03, xi2=0.03)
    system = fem.assemble(
        mesh, [(box, CONCRETE), (soil, SOIL)], clamped=tags["bottom"], damping=damping, **boundary
    )
    node = system.space.find_nodes(np.array([[0.0, 0.0]]))
    march = vc.march(linear(system, excitation=SHAKE), dt=DT, steps=STEPS)
    return np.array([system.space.sample(state.u, node, state.t)[0] for state, _ in march])


def shaken_box_in_space(distance: float) -> np.ndarray:
    """Return the displacements (steps, 3) of a box with tied sides at ``distance`` [m].

    It is 8 m x 8 m x 4 m in 8 m of soil.
    """
    width = 8.0 + 2.0 * distance
    h = 2.0
    block = BlockMesh(
        lengths=(width, 8.0, width),
        divisions=(round(width / h), 4, round(width / h)),
        corner=(-0.5 * width, -8.0, -0.5 * width),
    )
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    middle = np.abs(mesh.geometry.x[geometry_dofmap(mesh)].mean(axis=1))
    inside = middle.max(axis=1) < 4.0
    box, soil = (
        fem.Cells(n, np.flatnonzero(m).astype(np.int32), mesh)
        for n, m in (("box", inside), ("s", ~inside))
    )
    system = fem.assemble(
        mesh,
        [(box, CONCRETE), (soil, SOIL)],
        clamped=tags["bottom"],
        tied=[fem.Tied(tags[a], tags[b]) for a, b in PAIRS],
        damping=vc.Rayleigh.from_frequencies(2.0, 8.0, xi1=0.03, xi2=0.03),
    )
    shake = vc.Ricker(1.0, 4.0, direction=(1.0, 0.0, 0.0))
    return surface_history(system, vc.march(linear(system, excitation=shake), dt=DT, steps=200), 0)


def level_box(width: float, sides: str) -> np.ndarray:
    """Return the velocities (steps, 3) in the middle of the surface of level soil.

    The soil is 8 m deep, on a compliant base.
    """
    block = BlockMesh(
        lengths=(width, 8.0, width),
        divisions=(round(width / 2.0), 8, round(width / 2.0)),
        corner=(-0.5 * width, -8.0, -0.5 * width),
    )
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    waves = [vc.Ricker(1.0, 4.0, direction=tuple(e)) for e in np.eye(3)]
    base = fem.CompliantBase(tags["bottom"], motion=upgoing(waves, dt=1e-3))
    tied = [fem.Tied(tags[a], tags[b]) for a, b in PAIRS] if sides == "tied" else ()
    around = (
        [fem.Dashpots(tags[one]) for pair in PAIRS for one in pair] if sides == "dashpots" else []
    )
    system = fem.assemble(mesh, SOIL, tied=tied, dashpots=[base, *around])
    return surface_history(system, vc.march(linear(system), dt=DT, steps=100), 1)


def surface_history(system: Any, march: Any, derivative: int) -> np.ndarray:
    """Return u or v, its ``derivative`` 0 or 1, in the middle of the surface: (steps, 3)."""
    node = system.space.find_nodes(np.zeros((1, 3)))
    return np.array(
        [
            system.space.sample((state.u, state.v)[derivative], node, state.t)[0]
            for state, _ in march
        ]
    )


def box_tables() -> None:
    """Print errors of tied sides near a box in space, and of other sides beside level ground."""
    reference = shaken_box_in_space(48.0)[:, 0]
    for depths in (0.5, 1.0, 2.0, 3.0):
        error = (
            np.abs(shaken_box_in_space(8.0 * depths)[:, 0] - reference).max()
            / np.abs(reference).max()
        )
        print(f"tied sides {depths:g} depths away: {100 * error:.2g} %", flush=True)
    for width in (8.0, 16.0, 32.0):
        exact = level_box(width, "tied")
        for sides in ("dashpots", "free"):
            error = np.abs(level_box(width, sides) - exact).max(axis=0) / np.abs(exact).max(axis=0)
            print(
                f"level ground {width / 8.0:g} depths wide, {sides}: {np.round(100 * error)} %",
                flush=True,
            )


def dashpot_table(angles: Sequence[float], cells: int) -> None:
    """Print the energy that dashpots send back at each angle: exact, of the packet, measured."""
    print(
        "| angle | P table | P packet | P measured | S table | S packet | S measured |\n"
        + "|---" * 7
        + "|"
    )
    for angle in angles:
        row = [f"{angle:g}°"]
        for wave in "PS":
            material = vc.LinearElastic(E=1.0, nu=NU, rho=1.0)
            slope = math.radians(angle)
            exact = dashpot_energy(material, slope, wave=wave)
            measured, packet = energy_sent_back(
                MPI.COMM_WORLD, material, wave, slope, length=LENGTH, cells=cells
            )
            row += [f"{exact:.5f}", f"{packet:.5f}", f"{measured:.5f}"]
        print("| " + " | ".join(row) + " |", flush=True)


def side_table(depths: Sequence[float]) -> None:
    """Print the errors of five kinds of sides, against a free field twelve depths away."""
    reference = shaken_box("free field", 12.0 * DEPTH)
    largest = np.abs(reference[:, 0]).max()
    print(f"largest displacement {largest:.4g} m", flush=True)
    print(
        "| sides | "
        + " | ".join(f"{d:g} depths" for d in depths)
        + " |\n|"
        + "---|" * (len(depths) + 1)
    )
    for sides in ("rollers", "tied", "free field", "dashpots", "free"):
        errors = [
            np.abs(shaken_box(sides, d * DEPTH) - reference)[:, 0].max() / largest for d in depths
        ]
        print(f"| {sides} | " + " | ".join(f"{100 * e:.2g} %" for e in errors) + " |", flush=True)


def main() -> None:
    """Print the tables that are asked for, by default all of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--angles", type=float, nargs="+", default=[15.0, 30.0, 45.0, 60.0, 75.0])
    parser.add_argument("--cells", type=int, default=12, help="number of cells in a wavelength")
    parser.add_argument("--only", choices=("dashpots", "sides", "boxes"))
    given = parser.parse_args()
    if given.only in (None, "sides"):
        side_table((0.5, 1.0, 2.0, 3.0, 5.0))
    if given.only in (None, "dashpots"):
        dashpot_table(given.angles, given.cells)
    if given.only in (None, "boxes"):
        box_tables()


if __name__ == "__main__":
    main()
