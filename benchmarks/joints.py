#!/usr/bin/env python3
"""Measure steps of a block whose base joint cracks, in steps of the same block with Coulomb's law.

    python3 benchmarks/joints.py [--size 12] [--dt 4e-3] [--json FILE]
    mpirun -n 2 python3 benchmarks/joints.py
    python3 benchmarks/joints.py --rupture3d [--cells 40] [--steps 4]

The block is 16 m wide and 40 m high, n x 15/12 n quadrilaterals, pushed at its left side until more
than 30 % of its base has lost tension and cohesion. Numbers:

- ``passes_mean``, ``passes_max``: passes in a step, on the contact unknowns. Newton's method, which
  goes on from a pass while the contact set stays, is not counted.
- ``over_coulomb``: processor time of a step over that of a step with Coulomb's law, of the busiest
  rank: the smallest of five runs each.
- ``certificate``, ``law``: the worst certificate, and the worst difference between the strength
  used and that of the answer.
- ``energy_defect``: what the ledger leaves, over the work of the loads.
- ``lost``: share of the base that has lost its strength.

``--rupture3d`` measures a rupture in space with ``Iterative`` instead: two half spaces of n x n/2 x
n/2 hexahedra each, 1.1e5 unknowns at n = 40, with slip weakening between them. From a nucleus the
rupture spreads in all directions of the fault.

- ``products``: products with the effective matrix in a step, mean over the steps.
- ``iterations``: of conjugate gradients and the like in a step.
- ``slipping``: share of the fault that has slipped.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem, laws  # noqa: E402
from vi_contact.meshes import BlockMesh, TwoBlocks  # noqa: E402

COMM = MPI.COMM_WORLD
STONE = vc.LinearElastic(E=2e10, nu=0.2, rho=2400.0)
ROCK = vc.LinearElastic(E=8e10, nu=0.25, rho=2670.0)
OPENING = 1e-4  # m
JOINT = laws.Joint(mu=1.0, cohesion=6e5, tension=2e5, opening=OPENING)
T_END = 1.16  # s
RUNS = 5


def make_block(size: int) -> vc.ContactProblem:
    """Return the block on its joint.

    Args:
        size: cells over the width.
    """
    block = BlockMesh(lengths=(16.0, 40.0), divisions=(size, 15 * size // 12))
    mesh, tags = fem.build_mesh(block, COMM)
    push = fem.Traction(tags["left"], (1.1e5, 0.0), history=lambda t: min(t, 1.0) ** 2)
    system = fem.assemble(
        mesh,
        STONE,
        loads=[fem.BodyForce((0.0, -24000.0)), push],
        damping=vc.Rayleigh(alpha=0.0, beta=2e-3),
    )
    surface = fem.contact_surface(system, tags["bottom"])
    return vc.ContactProblem(system, surface, joint=JOINT, mass=vc.ConsistentMass())


def march(problem: vc.ContactProblem, dt: float, recorders: Sequence[Any]) -> dict[str, Any]:
    """Return time a step [s], worst residuals, the last row and the stepper of a run.

    Args:
        problem: what is marched from rest under its weight.
        dt: time step [s].
        recorders: what is asked after each step, outside of the time.
    """
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    scheme = vc.ZienkiewiczWoodTaylor()
    stepper = vc.Stepper(problem, scheme=scheme, solver=vc.Condensed(), state=rest)
    stepper.attempt(dt)  # the factor
    for recorder in recorders:
        recorder.start(stepper.method.problem, stepper.state)
    spent = 0.0
    certificate = law = 0.0
    row: dict[str, Any] = {}
    while stepper.state.t < T_END - 0.5 * dt:
        start = time.process_time()
        trial = stepper.attempt(dt)
        spent += time.process_time() - start
        stepper.accept(trial)
        certificate = max(certificate, trial.report.certificate.worst)
        law = max(law, trial.report.certificate.law)
        for recorder in recorders:
            row |= recorder.row(trial.report)
    seconds = max(COMM.allgather(spent)) / stepper.state.k
    return {
        "seconds": seconds,
        "certificate": certificate,
        "law": law,
        "row": row,
        "stepper": stepper,
    }


def measure(size: int, dt: float) -> dict[str, float]:
    """Return the numbers of the head of this file.

    Args:
        size: cells over the width.
        dt: time step [s].
    """
    problem = make_block(size)
    coulomb = replace(problem, joint=None, friction=vc.Coulomb(1.0))
    runs, others = [], []
    for _ in range(RUNS):  # one beside the other, as a machine is not always as fast
        runs.append(march(problem, dt, [vc.Energy()]))
        others.append(march(coulomb, dt, []))
    run = runs[0]
    stepper = run["stepper"]
    surface = problem.surface
    weights = surface.everywhere(surface.weights)
    kappa = surface.everywhere(stepper.state.memory["joint_kappa"])
    passes = stepper.joints[dt].passes
    own = min(one["seconds"] for one in runs)
    return {
        "passes_mean": float(np.mean(passes)),
        "passes_max": float(np.max(passes)),
        "over_coulomb": own / min(one["seconds"] for one in others),
        "milliseconds": 1e3 * own,
        "certificate": run["certificate"],
        "law": run["law"],
        "energy_defect": abs(run["row"]["energy_defect"]) / run["row"]["work_input"],
        "lost": float(weights[kappa >= OPENING].sum() / weights.sum()),
        "steps": float(stepper.state.k),
    }


def make_rupture(cells: int) -> vc.ContactProblem:
    """Return two half spaces with a fault between them, 60 MPa beyond rest in its nucleus.

    Args:
        cells: along the fault, 300 m each.
    """
    h = 300.0
    half = BlockMesh(
        lengths=(cells * h, 0.5 * cells * h, 0.5 * cells * h),
        divisions=(cells, cells // 2, cells // 2),
    )
    blocks = TwoBlocks(lower=half, upper=half)
    mesh, tags = fem.build_mesh(blocks, COMM)
    upper, lower = blocks.interface
    far = [side for side in tags if side not in (upper, lower) and "_" in side]
    system = fem.assemble(mesh, ROCK, dashpots=[fem.Dashpots(tags[side]) for side in far])
    surface = fem.contact_pair(system, tags[upper], tags[lower])
    middle = np.array([0.5 * cells * h, 0.25 * cells * h])

    def shear(x: Any) -> Any:
        """Return tau0 (m,) [Pa], beyond the static strength within 1.5 km of the middle."""
        away = np.hypot(x[:, 0] - middle[0], x[:, 2] - middle[1])
        return np.where(away < 1500.0, 82e6, 70e6)

    joint = laws.SlipWeakening(
        static=0.677,
        kinetic=0.525,
        distance=0.4,
        prestress=laws.Prestress(normal=120e6, shear=shear, nucleate=True),
    )
    return vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())


def measure_rupture(cells: int, steps: int) -> dict[str, float]:
    """Return the numbers of a rupture in space.

    Args:
        cells: along the fault.
        steps: how many are made, half as long as a wave takes through a cell.
    """
    problem = make_rupture(cells)
    dt = 0.5 * 300.0 / 6000.0
    scheme = vc.ZienkiewiczWoodTaylor()
    stepper = vc.Stepper(problem, scheme=scheme, solver=vc.Iterative())
    certificate = law = 0.0
    start = time.process_time()
    for _ in range(steps):
        trial = stepper.attempt(dt)
        stepper.accept(trial)
        certificate = max(certificate, trial.report.certificate.worst)
        law = max(law, trial.report.certificate.law)
    spent = max(COMM.allgather(time.process_time() - start))
    work = stepper.prepared[dt].first.work
    surface = problem.surface
    way = surface.everywhere(stepper.state.memory["joint_way"])
    return {
        "unknowns": float(COMM.allreduce(problem.equations.rows)),
        "points": float(surface.total),
        "steps": float(steps),
        "passes_mean": float(np.mean(stepper.joints[dt].passes)),
        "products": work.products / steps,
        "iterations": work.linear_iterations / steps,
        "seconds": spent / steps,
        "certificate": certificate,
        "law": law,
        "slipping": float(np.mean(way > 0.0)),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and write.

    Args:
        arguments: of the command line; None: those of the process.
    """
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--size", type=int, default=12, help="cells over the width")
    parser.add_argument("--dt", type=float, default=4e-3, help="time step [s]")
    parser.add_argument("--rupture3d", action="store_true", help="measure a rupture in space")
    parser.add_argument("--cells", type=int, default=40, help="of the rupture, along the fault")
    parser.add_argument("--steps", type=int, default=4, help="of the rupture")
    parser.add_argument("--json", type=Path, help="where the numbers are written")
    options = parser.parse_args(arguments)
    if options.rupture3d:
        numbers = measure_rupture(options.cells, options.steps)
    else:
        numbers = measure(options.size, options.dt)
    if COMM.rank == 0:
        for name, value in numbers.items():
            print(f"{name:14s} {value:.6g}")
        if options.json is not None:
            options.json.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
