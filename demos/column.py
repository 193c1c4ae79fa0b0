#!/usr/bin/env python3
"""Overturn a free-standing column on a shaking ground, and watch it fall on its side.

The column turns by a right angle: its material knows large rotations, its scheme keeps energy and
spin, and every node of its boundary may land. Beside it falls Housner's rigid block (1963), whose
equation is integrated at any angle until it lies.

    bash demos/run.sh column               # a table, a picture and a film, into results/column
    bash demos/run.sh -n 2 column          # the same on two ranks

Units are SI; docs/guide/turning.md explains what a body that turns can do.
"""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.turning import plot_fall
from demos.parts.problems.turning import GRAVITY, RigidBlock, find_tilts, shake_column
from vi_contact import fem
from vi_contact.laws import ImpulseUpdate
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
SHAPE = RigidBlock(width=0.5, height=2.0)  # [m]
STONE = vc.SaintVenantKirchhoff(E=1.0e9, nu=0.0, rho=2000.0)  # [Pa, -, kg/m³]
# the ground goes to the left, so that the column falls to the right: twice what lifts it
PULSE = vc.HalfSine(amplitude=-2.0 * GRAVITY * 0.25, duration=0.9)
DURATION = 2.4  # [s]
OUT = Path("results/column")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run the fall (``quick``: few cells, until it lies) and return the key numbers."""
    comm = MPI.COMM_WORLD
    rigid = SHAPE.fall_over(lambda t: -PULSE.acceleration(t), DURATION)
    lies = float(rigid.t[-1])
    problem = shake_column(
        comm,
        SHAPE,
        PULSE,
        material=STONE,
        divisions=(2, 8) if quick else (4, 16),
        friction=vc.Coulomb(0.7),
        impact=vc.Inelastic(ImpulseUpdate()),
    )
    solution = vc.simulate(
        problem,
        dt=0.01 if quick else 0.005,
        t_end=lies + 0.1 if quick else DURATION,
        record=[
            vc.Energy(),
            vc.Contact(),
            vc.Probe({"left": (0.0, 0.0), "right": (SHAPE.width, 0.0)}),
        ],
        out=out / "run",
        fields=fem.XDMF(every=4),
        progress=progress,
    )
    history = solution.history
    facts = solution.facts
    numbers = {
        "rigid block lies at": lies,
        "certificate": facts["worst_certificate"],
        "energy defect": facts["energy_defect"],
    }
    if comm.rank == 0:
        t = history["t"]
        tilt = find_tilts(SHAPE, history)
        until = t < lies
        numbers["tilt beside the rigid one"] = float(
            np.max(np.abs(tilt[until] - rigid.sol(t[until])[0]))
        )
        numbers["lies at"] = float(t[np.argmax(tilt > 0.5 * pi - 0.05)])
        numbers["tilt at the end"] = float(tilt[-1])
        for name, value in numbers.items():
            print(f"{name:28s} {value:.6g}")
        plot_fall(out / "run", history, tilt, rigid, out / "column.png")
        if not quick:
            vc.plots.film(vc.read_run(out / "run"), out / "column.gif", magnified=1.0)
    comm.Barrier()  # nobody leaves before the figures are there
    return numbers


# Things to try: a pulse of 0.3 s, after which the column rocks and stands; friction of 0.2, on
# which it slides; a softer column (E = 1e7), which bends as it falls; vc.Elastic() for the impact.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
