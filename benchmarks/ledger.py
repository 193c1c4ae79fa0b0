#!/usr/bin/env python3
"""Measure how far rounding carries the energy, and how far the energy ledger closes.

    python3 benchmarks/ledger.py [--steps 1000] [--only Midpoint] [--json]

Every time scheme runs with every solver. Two runs of a block of 16 x 8 bilinear elements, 1 m high,
without damping: *free*, it swings on a clamped side and touches nothing; *thrown*, it falls
obliquely on a plane and rubs on it. Time steps have the Courant number 0.02, so that the quickest
wave takes fifty of them for an element. Printed are

    drift   largest |E/E(0) - 1| of the free run, E its energy, for schemes that keep the energy
    defect  what the ledger of all steps cannot explain, over the largest energy,
            of the free and of the thrown run

The table of docs/guide/schemes.md has the numbers. They are rounding errors: another BLAS gives
others of their size.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes.block import BlockMesh

SCHEMES: dict[str, Any] = {
    "Trapezoidal()": vc.Trapezoidal(),
    "Midpoint()": vc.Midpoint(),
    "ContactStabilisedNewmark()": vc.ContactStabilisedNewmark(),
    "ZienkiewiczWoodTaylor(phi=0.5)": vc.ZienkiewiczWoodTaylor(phi=0.5),
    "MoreauJean()": vc.MoreauJean(),
    "SS22(1/2, 1/2)": vc.SS22(0.5, 0.5),
    "Newmark(1/4, 1/2)": vc.Newmark(beta=0.25, gamma=0.5),
    "HHT(-0.1)": vc.HHT(-0.1),
    "GeneralisedAlpha, rho 0.8": vc.GeneralisedAlpha.spectral_radius(0.8),
    "Houbolt()": vc.Houbolt(),
}
SOLVERS: dict[str, Any] = {
    "Condensed()": vc.Condensed(),
    "Volume()": vc.Volume(),
    "Iterative()": vc.Iterative(),
    "Automatic()": vc.Automatic(),
}
# energy, in free flight
KEEPING = ("Trapezoidal", "Midpoint", "Contact", "Zienkiewicz", "Moreau", "SS22", "Newmark")
SOFT = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)
COURANT = 0.02
DIVISIONS = (16, 8)
HEIGHT = 1.0


def block(*, free: bool) -> vc.ContactProblem:
    """Return the block, thrown on a plane, or ``free`` of it and clamped at one side."""
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(2.0, HEIGHT), divisions=DIVISIONS), MPI.COMM_WORLD
    )
    held = {"clamped": tags["top"]} if free else {}
    start = (
        (lambda x: np.column_stack([HEIGHT - x[:, 1], x[:, 1] - HEIGHT])) if free else (1.0, -1.0)
    )
    system = fem.assemble(mesh, SOFT, initial_velocity=start, **held)
    plane = vc.HalfSpace((0.0, -10.0 if free else -1e-3), (0.0 if free else 0.1, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    rubs = vc.Frictionless() if free else vc.Coulomb(0.3)
    return vc.ContactProblem(system, surface, friction=rubs, mass=vc.ConsistentMass())


def measured(scheme: Any, solver: Any, steps: int) -> dict[str, float]:
    """Return the drift and both defects of one scheme and solver."""
    found: dict[str, float] = {}
    speed = np.sqrt(SOFT.E * (1.0 - SOFT.nu) / ((1.0 + SOFT.nu) * (1.0 - 2.0 * SOFT.nu)) / SOFT.rho)
    dt = COURANT * HEIGHT / DIVISIONS[1] / speed
    for name in ("free", "thrown"):
        problem = block(free=name == "free")
        solution = vc.simulate(
            problem,
            scheme=scheme,
            solver=solver,
            dt=dt,
            steps=steps,
            record=[vc.Energy()],
            progress=False,
        )
        found[f"defect, {name}"] = float(solution.facts["energy_defect"])
        if name == "free":
            total = solution.history["energy_kinetic"] + solution.history["energy_strain"]
            found["drift"] = float(np.max(np.abs(total / total[0] - 1.0)))
    return found


def main() -> None:
    """Print the drift and the defects of all pairs of a scheme and a solver."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=1000, help="of each run")
    parser.add_argument(
        "--only", default="", help="schemes and solvers whose names have this in them"
    )
    parser.add_argument("--json", action="store_true", help="print the numbers for programs")
    options = parser.parse_args()
    # of schemes that gain energy where a contact opens
    logging.getLogger("vi_contact").setLevel(logging.ERROR)
    rows = []
    if not options.json and MPI.COMM_WORLD.rank == 0:
        print("| scheme | solver | drift | defect, free | defect, thrown |\n|---|---|---|---|---|")
    for scheme_name, scheme in SCHEMES.items():
        for solver_name, solver in SOLVERS.items():
            if options.only.lower() not in f"{scheme_name} {solver_name}".lower():
                continue
            row = {
                "scheme": scheme_name,
                "solver": solver_name,
                **measured(scheme, solver, options.steps),
            }
            rows.append(row)
            if not options.json and MPI.COMM_WORLD.rank == 0:
                drift = f"{row['drift']:.1e}" if scheme_name.startswith(KEEPING) else "-"
                print(
                    f"| `{scheme_name}` | `{solver_name}` | {drift} | {row['defect, free']:.1e} | "
                    f"{row['defect, thrown']:.1e} |",
                    flush=True,
                )
    if options.json and MPI.COMM_WORLD.rank == 0:
        print(json.dumps({"steps": options.steps, "rows": rows}, indent=2))


if __name__ == "__main__":
    main()
