#!/usr/bin/env python3
"""Crack the base of a gravity dam in an earthquake, with water that follows the crack or does not.

The dam is 30 m high, with 26 m of water before it, on rigid rock. Its
base bears tension and cohesion until it cracks. First it gets its weight, the water on its face and
in its joint. Then the ground shakes, and the water before the face moves with it. The water in the
joint stays as it is ("kept", the usual rule), enters the crack ("follows"), or is not in what opens
newly ("none").

    bash demos/run.sh dam                # a table and two figures, into results/dam_demo
    bash demos/run.sh -n 2 dam           # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.dam import plot_histories, plot_openings
from vi_contact import fem, laws
from vi_contact.meshes import BlockMesh
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
HEIGHT, BASE, CREST, LEVEL = 30.0, 21.0, 4.0, 26.0  # [m]
CONCRETE = vc.LinearElastic(E=25e9, nu=0.2, rho=2400.0)
DAMPING = vc.Rayleigh(alpha=0.0, beta=2e-3)  # 6 % at 10 Hz
MU, COHESION, TENSION, ENERGY = 0.8, 6e5, 2e5, 200.0  # [-], [Pa], [Pa], [N/m]
ENTERS = 2e-5  # opening from which on water enters [m]
SHAKE, FREQUENCY = 2.4, 4.0  # of the ground [m/s²], [Hz]
DT, T_END = 1e-3, 1.2  # [s]
CELLS = 28  # of the base
RULES = ("kept", "follows", "none")
OUT = Path("results/dam_demo")


def taper(points: np.ndarray) -> np.ndarray:
    """Return the nodes (n, 2) of the box BASE x HEIGHT, moved into the dam [m]."""
    width = BASE - (BASE - CREST) * points[:, 1] / HEIGHT
    return np.column_stack([points[:, 0] * width / BASE, points[:, 1]])


def build(comm: Any, cells: int, rule: str) -> vc.ContactProblem:
    """Return the dam.

    Args:
        comm: the ranks.
        cells: of the base.
        rule: what the water in the joint does in the earthquake.
    """
    block = BlockMesh(lengths=(BASE, HEIGHT), divisions=(cells, cells), deform=taper)
    mesh, tags = fem.build_mesh(block, comm)
    reservoir = fem.Reservoir(face=tags["left"], level=LEVEL, model="incompressible")
    system = laws.with_weight(fem.assemble(mesh, CONCRETE, damping=DAMPING, reservoir=reservoir))
    rock = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=rock)
    water = laws.JointWater(
        heel=(0.0, 0.0), toe=(BASE, 0.0), level=LEVEL, quake=rule, opening=ENTERS
    )
    joint = laws.Joint(mu=MU, cohesion=COHESION, tension=TENSION, energy=ENERGY, water=water)
    shaking = vc.Harmonic(amplitude=SHAKE, frequency=FREQUENCY, direction=(1.0, 0.0))
    return vc.ContactProblem(
        system, surface, joint=joint, mass=vc.ConsistentMass(), excitation=shaking
    )


def find_profiles(surface: vc.ContactSurface, state: vc.State, order: np.ndarray) -> np.ndarray:
    """Return openings [m] and pressures of the water [Pa] (2, m) along the base. Collective."""
    gap = np.where(state.active, 0.0, surface.gap(state.t) - surface.normal_values(state.u))
    pair = np.column_stack([gap, state.memory["joint_water"]])
    return np.asarray(surface.everywhere(pair))[order].T


def crack(comm: Any, cells: int, rule: str, t_end: float) -> dict[str, Any]:
    """Return places x (m,), times (k,), openings, water (k, m) and histories of a run."""
    problem = build(comm, cells, rule)
    surface = problem.surface
    x = np.asarray(surface.everywhere(surface.points[:, 0]))
    order = np.argsort(x)
    rest = vc.static_equilibrium(problem)
    recorders = (vc.Uplift(), vc.JointEnergy(), vc.Energy())
    rows = [{name: value for r in recorders for name, value in r.start(problem, rest).items()}]
    opening, water = find_profiles(surface, rest, order)
    found: dict[str, Any] = {"t": [rest.t], "opening": [opening], "water": [water], "worst": 0.0}
    steps = vc.march(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(),
        solver=vc.Condensed(),
        dt=DT,
        t_end=t_end,
        state=rest,
    )
    for state, report in steps:
        opening, water = find_profiles(surface, state, order)
        rows.append({name: value for r in recorders for name, value in r.row(report).items()})
        found["t"].append(state.t)
        found["opening"].append(opening)
        found["water"].append(water)
        found["worst"] = max(found["worst"], report.certificate.worst)
    names = {
        "crack": "crack_length",
        "uplift": "uplift_force",
        "fracture": "loss_fracture",
        "defect": "energy_defect",
        "input": "work_input",
    }
    histories = {short: np.array([row[name] for row in rows]) for short, name in names.items()}
    arrays = {name: np.array(found[name]) for name in ("t", "opening", "water")}
    return {"x": x[order], "worst": found["worst"], **arrays, **histories}


def main(quick: bool = False, out: Path = OUT) -> dict[str, float]:
    """Run all rules (``quick``: for 0.4 s); return numbers in SI units."""
    comm = MPI.COMM_WORLD
    t_end = 0.4 if quick else T_END
    runs = {rule: crack(comm, CELLS, rule, t_end) for rule in RULES}
    numbers = {}
    for rule, run in runs.items():
        numbers |= {
            f"{rule}: certificate": run["worst"],
            f"{rule}: defect of the ledger": float(
                np.abs(run["defect"]).max() / np.abs(run["input"]).max()
            ),
            f"{rule}: longest crack": float(run["crack"].max()),
            f"{rule}: largest opening": float(run["opening"].max()),
            f"{rule}: uplift at rest": float(run["uplift"][0]),
            f"{rule}: least uplift": float(run["uplift"].min()),
            f"{rule}: largest uplift": float(run["uplift"].max()),
            f"{rule}: energy of fracture": float(run["fracture"][-1]),
        }
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        plot_openings(runs["follows"], out / "openings.png")
        plot_histories(runs, out / "histories.png")
        print("\n".join(f"{name:<32} {value:.6g}" for name, value in numbers.items()))
        print(f"\nThe figures are in {out}.")
    comm.Barrier()
    return numbers


# Things to try: SHAKE = 3.0 and DT = 2e-3, and with "follows" the whole base opens.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
