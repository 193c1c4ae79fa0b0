#!/usr/bin/env python3
"""Measure steps of a block whose base joint cracks, in steps of the same block with Coulomb's law.

    python3 benchmarks/joints.py [--size 12] [--dt 4e-3] [--json FILE]
    mpirun -n 2 python3 benchmarks/joints.py

The block is 16 m wide and 40 m high, n x 15/12 n quadrilaterals, pushed at its left side until more
than 30 % of its base has lost tension and cohesion. Numbers:

- ``passes_mean``, ``passes_max``: passes in a step, on the contact unknowns.
- ``over_coulomb``: processor time of a step over that of a step with Coulomb's law, of the busiest
  rank: the smallest of three runs each.
- ``certificate``, ``law``: the worst certificate, and the worst difference between the strength
  used and that of the answer.
- ``energy_defect``: what the ledger leaves, over the work of the loads.
- ``lost``: share of the base that has lost its strength.
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
from vi_contact.meshes import BlockMesh  # noqa: E402

COMM = MPI.COMM_WORLD
STONE = vc.LinearElastic(E=2e10, nu=0.2, rho=2400.0)
OPENING = 1e-4  # m
JOINT = laws.Joint(mu=1.0, cohesion=6e5, tension=2e5, opening=OPENING)
T_END = 1.16  # s
RUNS = 3


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
    runs = [march(problem, dt, [vc.Energy()]) for _ in range(RUNS)]
    others = [march(coulomb, dt, []) for _ in range(RUNS)]
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and write.

    Args:
        arguments: of the command line; None: those of the process.
    """
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--size", type=int, default=12, help="cells over the width")
    parser.add_argument("--dt", type=float, default=4e-3, help="time step [s]")
    parser.add_argument("--json", type=Path, help="where the numbers are written")
    options = parser.parse_args(arguments)
    numbers = measure(options.size, options.dt)
    if COMM.rank == 0:
        for name, value in numbers.items():
            print(f"{name:14s} {value:.6g}")
        if options.json is not None:
            options.json.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
