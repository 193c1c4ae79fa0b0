#!/usr/bin/env python3
"""Measure steps of bodies that turn, in linear steps of the same body.

    python3 benchmarks/turning.py [--size 8] [--turns 2] [--json FILE]
    mpirun -n 2 python3 benchmarks/turning.py

Two cases of a block of n/2 x n quadrilaterals:

- ``spin``: free, one turn a second, 20 steps a turn.
- ``rock``: released on its corner at 0.3 rad, 50 steps until it lands as the rigid block does.

Numbers of a case, with its name before them:

- ``linear_steps_mean``: certified linear steps in a step.
- ``tangents_per_step``: tangents that were made, with a factor each.
- ``certificate``: the worst one.
- ``energy_defect``: of ``spin`` the largest change of energy, of ``rock`` what the ledger leaves,
  over the energy at the start (of ``rock`` over m g R).
- ``momentum_defect``: of ``spin``, the largest change of momentum and spin over the spin.
- ``seconds``: processor time of all steps, of the busiest rank.
- ``ratio``: that over the time of as many steps of the linear body at small strain.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from marching import COMM, march, spend  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems import turning  # noqa: E402
from vi_contact.core.ledger import energy_balance  # noqa: E402

Numbers = dict[str, float]
PER_TURN = 20
PER_QUARTER = 50
ANGLE = 0.3  # rad


def measure(problem: vc.ContactProblem, dt: float, steps: int) -> tuple[Numbers, list[Any]]:
    """Return the numbers that both cases have, and the reports.

    Args:
        problem: what is marched.
        dt: length of a step [s].
        steps: number of steps.
    """
    seconds, (stepper, reports) = spend(lambda: march(problem, vc.EnergyMomentum(), dt, steps))
    linear = replace(problem, system=problem.system.changed(internal=None))
    plain, _ = spend(lambda: march(linear, vc.EnergyMomentum(), dt, steps))
    numbers = {
        "unknowns": problem.system.space.unknowns,
        "linear_steps_mean": float(np.mean([report.result.iterations for report in reports])),
        "tangents_per_step": stepper.prepared[dt].tangents / steps,
        "certificate": max(report.certificate.worst for report in reports),
        "seconds": seconds,
        "ratio": seconds / plain,
    }
    return numbers, reports


def measure_spin(n: int, turns: int) -> Numbers:
    """Return the numbers of the free block.

    Args:
        n: quadrilaterals along it.
        turns: how often it turns.
    """
    problem = turning.spin_block(COMM, turning.STONE, divisions=(max(n // 2, 1), n))
    numbers, reports = measure(problem, 1.0 / PER_TURN, PER_TURN * turns)
    states = [reports[0].old, *(report.new for report in reports)]
    energy = np.array([turning.find_energy(problem, state) for state in states])
    momenta = np.array([turning.find_momenta(problem, state) for state in states])
    numbers["energy_defect"] = float(np.abs(energy / energy[0] - 1.0).max())
    numbers["momentum_defect"] = float(
        np.abs(momenta - momenta[0]).max() / np.abs(momenta[0]).max()
    )
    return numbers


def measure_rock(n: int) -> Numbers:
    """Return the numbers of the block on its corner; ``n``: quadrilaterals along it."""
    block = turning.RigidBlock(0.5, 1.0)
    problem = turning.rock_block(COMM, block, ANGLE, divisions=(max(n // 2, 1), n))
    dt = block.find_quarter(ANGLE) / PER_QUARTER
    numbers, reports = measure(problem, dt, PER_QUARTER)
    unit = turning.STONE.rho * block.width * block.height * turning.GRAVITY * block.radius
    defects = [
        energy_balance(problem, report.old, report.new, report.averages()).defect
        for report in reports
    ]
    numbers["energy_defect"] = float(np.abs(defects).max()) / unit
    return numbers


def main(arguments: list[str] | None = None) -> int:
    """Measure both cases, print their numbers, and write them as JSON where asked for."""
    parser = argparse.ArgumentParser(description="Measure steps of bodies that turn.")
    parser.add_argument("--size", type=int, default=8, help="quadrilaterals along the block")
    parser.add_argument("--turns", type=int, default=2, help="of the free block")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    given = parser.parse_args(arguments)
    cases = {
        "spin": measure_spin(given.size, given.turns),
        "rock": measure_rock(given.size),
    }
    numbers = {
        f"{case}_{name}": value for case, found in cases.items() for name, value in found.items()
    }
    if COMM.rank == 0:
        for name, value in numbers.items():
            print(f"{name:28s} {value:.6g}")
        if given.json is not None:
            given.json.write_text(json.dumps(numbers, indent=2), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
