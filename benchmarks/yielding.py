#!/usr/bin/env python3
"""Measure steps of bodies that yield: linear steps, where the time goes, memory, and certificates.

    python3 benchmarks/yielding.py [--size 16] [--steps 60] [--json FILE]
    mpirun -n 2 python3 benchmarks/yielding.py

Cases are thrown on rough ground, marched by the midpoint rule with ``Condensed``:

- ``metal``: a steel block of n x 2n squares with bbar, von Mises with both hardenings.
- ``soil``: the like of soil, Mohr-Coulomb with phi 30 and psi 10 degrees.
- ``cone``: the like by Drucker and Prager's cone.
- ``elastic``: the soil at a hundredth of the speed, where less than 0.1 % of the points yield.
- ``space``: a block of steel of n/4 x n/4 x n/2 hexahedra.

Numbers of a case, with its name before them:

- ``linear_steps_mean``, ``linear_steps_max``: certified linear steps in a step; of the first four
  cases over the steps in which at least 10 % of the points yield, where there are any.
- ``share_stress``, ``share_assembly``, ``share_factor``: of the processor time of the steps, what
  goes into stresses and strains, into matrices of tangents, and into preparing linear steps.
- ``bytes_per_point``: of a point of integration, with B, its state, and the pattern of tangents.
- ``certificate``: the worst one, the law of the material in it.
- ``energy_defect``: what the ledger leaves, over the largest energy.
- ``yielding_points``: the mean share of points that yield in a step.
- ``tangents_per_step``: tangents that were made, with a factor each.
- ``seconds``: processor time of all steps, of the busiest rank.

Without the name of a case before them the keys are those of ``soil``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from marching import COMM, Clock  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.fem.body.strain_points import StrainPoints  # noqa: E402
from vi_contact.fem.body.yielding import YieldingForce  # noqa: E402
from vi_contact.laws import J2, DruckerPrager, MohrCoulomb  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402
from vi_contact.solvers.nonlinear import NonlinearSolver  # noqa: E402

Numbers = dict[str, float]
STEEL = J2(200e9, 0.3, 7800.0, 250e6, isotropic=2e9, kinematic=4e9)
SOIL = MohrCoulomb(50e6, 0.3, 1900.0, cohesion=10e3, phi=30.0, psi=10.0)
CONE = DruckerPrager(50e6, 0.3, 1900.0, cohesion=10e3, phi=30.0, psi=10.0)
MANY = 0.1  # of the points: a step in which so many yield counts as one that yields


def throw(law: Any, divisions: tuple[int, ...], velocity: tuple[float, ...]) -> vc.ContactProblem:
    """Return a block of cubes 0.5 m wide and 1 m high that is thrown on rough ground."""
    d = len(divisions)
    lengths = (0.5, 1.0) if d == 2 else (0.5, 0.5, 1.0)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=lengths, divisions=divisions), COMM)
    system = fem.assemble(mesh, law, integration="bbar", initial_velocity=velocity)
    up = tuple(float(i == d - 1) for i in range(d))
    ground = vc.HalfSpace(point=(0.0,) * d, normal=up)
    below = tags["bottom"] if d == 2 else tags["back"]
    surface = fem.contact_surface(system, below, obstacle=ground)
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))


def count_yielding(report: Any) -> float:
    """Return the share of points whose alpha has grown in a step."""
    name = "material_0_alpha"
    grown = report.new.memory[name] - report.old.memory.get(name, 0.0) > 0.0
    counts = COMM.allreduce(np.array([np.count_nonzero(grown), grown.size]))
    return float(counts[0] / counts[1])


def measure(problem: vc.ContactProblem, dt: float, steps: int) -> Numbers:
    """Return the numbers of a case.

    Args:
        problem: what is thrown.
        dt: length of a step [s].
        steps: how many.
    """
    clock = Clock()
    clock.watch(StrainPoints, "strain", "stress")
    clock.watch(StrainPoints, "force", "stress")
    clock.watch(YieldingForce, "_follow", "stress")
    clock.watch(YieldingForce, "_compute_tangents", "stress")
    clock.watch(YieldingForce, "residual", "stress")
    clock.watch(StrainPoints, "free_matrix", "assembly")
    clock.watch(NonlinearSolver, "_prepare", "factor")
    clock.watch(NonlinearSolver, "_prepare_whole", "factor")
    stepper = vc.Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed())
    reports = []
    start = time.process_time()
    for _ in range(steps):
        trial = stepper.attempt(dt)
        stepper.accept(trial)
        reports.append(trial.report)
    seconds = max(COMM.allgather(time.process_time() - start))
    clock.stop()

    # The ledger is kept afterwards, so that it is not in the time.
    ledger = vc.Energy()
    first = ledger.start(stepper.method.problem, reports[0].old)
    rows = [first, *map(ledger.row, reports)]
    largest = max(row["energy_kinetic"] + row["energy_strain"] for row in rows)
    passes = np.array([report.result.iterations for report in reports])
    shares = np.array([count_yielding(report) for report in reports])
    counted = passes[shares >= MANY] if np.any(shares >= MANY) else passes
    internal: Any = problem.system.internal
    return {
        "linear_steps_mean": float(counted.mean()),
        "linear_steps_max": float(counted.max()),
        **{f"share_{name}": spent / seconds for name, spent in clock.seconds.items()},
        "bytes_per_point": internal.bytes_per_point,
        "certificate": max(report.certificate.worst for report in reports),
        "energy_defect": max(abs(row["energy_defect"]) for row in rows) / largest,
        "yielding_points": float(shares.mean()),
        "tangents_per_step": stepper.prepared[dt].tangents / steps,
        "seconds": seconds,
    }


def make_cases(n: int) -> dict[str, tuple[Callable[[], vc.ContactProblem], float]]:
    """Return what is thrown, and the step [s] in which a wave crosses two cells."""
    flat = (n, 2 * n)
    k = max(n // 4, 2)
    steel = 2.0 * 0.5 / STEEL.elastic.c_p
    soil = 2.0 * 0.5 / SOIL.elastic.c_p
    return {
        "metal": (lambda: throw(STEEL, flat, (6.0, -20.0)), steel / n),
        "soil": (lambda: throw(SOIL, flat, (1.0, -2.0)), soil / n),
        "cone": (lambda: throw(CONE, flat, (1.0, -2.0)), soil / n),
        "elastic": (lambda: throw(SOIL, flat, (0.01, -0.02)), soil / n),
        "space": (lambda: throw(STEEL, (k, k, 2 * k), (6.0, 0.0, -20.0)), steel / k),
    }


def main(arguments: list[str] | None = None) -> int:
    """Measure the cases, print their numbers, and write them to a file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--size", type=int, default=16, help="cells along the width of a block")
    parser.add_argument("--steps", type=int, default=60, help="steps of a case")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    given = parser.parse_args(arguments)
    numbers: Numbers = {}
    for name, (make, dt) in make_cases(given.size).items():
        found = measure(make(), dt, given.steps)
        numbers |= {f"{name}_{key}": value for key, value in found.items()}
        if name == "soil":
            numbers |= found
        if COMM.rank == 0:
            print(name, *(f"{key} {value:.3g}" for key, value in found.items()), sep="  ")
    if given.json is not None and COMM.rank == 0:
        given.json.write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
