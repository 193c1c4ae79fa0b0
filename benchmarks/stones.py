#!/usr/bin/env python3
"""Measure steps of walls of bonded stones with friction that are shaken, by number of stones.

    python3 benchmarks/stones.py [--stones 50,100,200,400] [--steps 2000] [--json FILE]
    python3 benchmarks/stones.py --quick

A wall in running bond stands on ground that shakes: stones of 0.4 x 0.2 m with 18 x 8 cells, so
that a joint has nine or ten contact points, mu 0.6, weight, a sine of 0.4 g at 5 Hz, 1 ms a step.
Every step is certified. Numbers, of each wall, in lists:

- ``stones``: of the wall, half ones too.
- ``conditions``: contact points.
- ``ms_per_step``: processor time.
- ``over_product``: the same over that of a product with A, measured in the same run.
- ``bytes_per_condition``: of G, of factors of bodies, and of the factor of the last linear problem.
- ``certificate``: the worst one.
- ``linear_solves``, ``factors``, ``gmres``: linear problems, their factors and iterations a step.
- ``columns``: of inverses, a step, by which factors are mended where rows change.
- ``operations``: of factors and solutions with them, a step, multiplications and additions.
- ``share_factor``, ``share_gmres``, ``share_bodies``, ``share_split``: of the time of the steps,
  what goes into factors of linear problems, into their iterations, into solves with A, and into
  the split over rings of joints.
- ``set_up_s``: mesh, joints and matrices; ``prepare_s``: factors of bodies and G.

``power`` is that by which ``ms_per_step`` grows with the stones, fitted over all walls, and
``power_of_operations`` the same of ``operations``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from marching import COMM, Clock  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.kernels.bodies import Bodies, CondensedBodies  # noqa: E402
from vi_contact.meshes.masonry import MasonryMesh  # noqa: E402
from vi_contact.solvers.friction.hyperstatic import Hyperstatic  # noqa: E402
from vi_contact.solvers.friction.kept_factor import KeptFactor  # noqa: E402

STONE = vc.LinearElastic(E=1e10, nu=0.2, rho=2400.0)
SHAKING = vc.Harmonic(amplitude=4.0, frequency=5.0, direction=(1.0, 0.0))
DT = 1e-3  # s
PRODUCTS = 20


def make_wall(stones: int, cells: tuple[int, int]) -> vc.ContactProblem:
    """Return a wall of about so many stones, as many in a course as there are courses."""
    side = max(round(stones**0.5), 1)
    courses = max(round(stones / (side + 0.5)), 1)
    wall = MasonryMesh(stones=side, courses=courses, height=0.2, ground=0.2, divisions=cells)
    mesh, tags = fem.build_mesh(wall, COMM)
    system = fem.assemble(
        mesh,
        STONE,
        clamped=tags["ground_bottom"],
        loads=fem.BodyForce((0.0, -9.81 * STONE.rho)),
        damping=vc.Rayleigh(alpha=0.0, beta=2e-4),
    )
    surface = fem.contact_pairs(system, within=1e-6)
    return vc.ContactProblem(
        system,
        surface,
        friction=vc.Coulomb(0.6),
        excitation=SHAKING,
        mass=vc.ConsistentMass(),
    )


def measure(stones: int, cells: tuple[int, int], steps: int) -> dict[str, float]:
    """Return the numbers of a wall.

    Args:
        stones: about how many.
        cells: along the sides of a stone.
        steps: that are measured, after the first.
    """
    start = time.process_time()
    problem = make_wall(stones, cells)
    set_up = time.process_time() - start
    stepper = vc.Stepper(problem, solver=vc.Condensed())
    start = time.process_time()
    stepper.accept(stepper.attempt(DT))
    prepare = time.process_time() - start

    clock = Clock()
    clock.watch(KeptFactor, "_factorise", "factor")
    clock.watch(KeptFactor, "_iterate", "gmres")
    clock.watch(CondensedBodies, "find_free_motion", "bodies")
    clock.watch(CondensedBodies, "answer", "bodies")
    clock.watch(Hyperstatic, "_split", "split")
    friction: Any = stepper.prepared[DT].first
    kept = friction.friction.small.kept
    before = np.array([kept.factors, kept.iterations, kept.columns, kept.operations])
    certificate = 0.0
    solves = 0
    start = time.process_time()
    for _ in range(steps):
        trial = stepper.attempt(DT)
        stepper.accept(trial)
        certificate = max(certificate, trial.report.certificate.worst)
        solves += trial.report.result.iterations
    spent = time.process_time() - start
    clock.stop()
    after = np.array([kept.factors, kept.iterations, kept.columns, kept.operations])
    factors, iterations, columns, operations = after - before

    # A product with A, in the same run.
    A = stepper.prepared[DT].A
    x = stepper.state.u.copy()
    start = time.process_time()
    for _ in range(PRODUCTS):
        A @ x
    product = (time.process_time() - start) / PRODUCTS

    conditions = problem.surface.total
    bodies: Bodies = friction.friction.condensed.bodies
    held = 12.0 * friction.friction.delassus.nnz + kept.bytes
    held += sum(shape.bytes for shape in bodies.shapes)
    return {
        "stones": sum(len(shape.unknowns) for shape in bodies.shapes) - 1,
        "conditions": conditions,
        "ms_per_step": 1e3 * spent / steps,
        "over_product": spent / steps / product,
        "bytes_per_condition": held / conditions,
        "certificate": certificate,
        "linear_solves": solves / steps,
        "factors": factors / steps,
        "gmres": iterations / steps,
        "columns": columns / steps,
        "operations": operations / steps,
        **{f"share_{name}": seconds / spent for name, seconds in clock.seconds.items()},
        "set_up_s": set_up,
        "prepare_s": prepare,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and write.

    Args:
        arguments: of the command line; None: those of the process.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--stones", default="200", help="of each wall, with commas between")
    parser.add_argument("--steps", type=int, default=2000, help="of each wall")
    parser.add_argument("--quick", action="store_true", help="walls of 30 and 60 stones, 10 steps")
    parser.add_argument("--json", type=Path, help="where the numbers are written")
    options = parser.parse_args(arguments)
    walls = [int(part) for part in options.stones.split(",")]
    steps = options.steps
    if options.quick:
        walls, steps = [30, 60], 10
    found: dict[str, Any] = {}
    for stones in walls:
        numbers = measure(stones, (18, 8), steps)
        for key, value in numbers.items():
            found.setdefault(key, []).append(float(value))
        if COMM.rank == 0:
            print(*(f"{key} {value:.3g}" for key, value in numbers.items()), sep="  ", flush=True)
    if len(walls) > 1:
        sizes = np.log(found["stones"])
        for name, key in (("power", "ms_per_step"), ("power_of_operations", "operations")):
            found[name] = float(np.polyfit(sizes, np.log(found[key]), 1)[0])
            if COMM.rank == 0:
                print(f"{name} {found[name]:.3g}")
    if options.json is not None and COMM.rank == 0:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
