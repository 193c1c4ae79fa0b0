#!/usr/bin/env python3
"""Measure what 1000 steps of the Timoshenko beam with friction at its tip cost, in two ways.

    python3 benchmarks/beam_steps.py [--elements 100 1000 10000] [--repeat 5]

The first way is the block elimination of its source (Ahn 2012), the second the schemes and solvers
of this package. The times are the best of so many repetitions, with ledger and certificates, on one
thread. Nothing else should run.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import vi_contact as vc  # noqa: E402
from vi_contact import beam  # noqa: E402

STEPS = 1000
DT = 0.002


def best(action: Callable[[], object], repeat: int) -> float:
    """Return the shortest time of so many runs [s], as other programs only lengthen it."""
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def runs(count: int) -> list[Callable[[], object]]:
    """Return the four runs that are timed, for so many elements.

    Readings A and C and the exact law go by block elimination, the exact law also by the package.
    """
    elements = beam.published_elements(count)
    start = beam.published_start()
    body = beam.TimoshenkoBeam(viscosity=0.001)
    law = vc.Coulomb(0.3)
    problem = beam.beam_problem(
        body, elements, normal_force=lambda t: 100.0, friction=law, start=start
    )

    def algorithm(name: str, friction: beam.TipFriction) -> object:
        stepper = beam.BeamStepper(
            body, elements, DT, beam.readings(DT)[name], beam.published_mu, friction
        )
        return beam.run_beam(stepper, start, steps=STEPS)

    def contract() -> object:
        return [state.t for state, _ in vc.march(problem, scheme=vc.Midpoint(), dt=DT, steps=STEPS)]

    newton, exact = beam.published_friction(), beam.ExactFriction()
    cases = (("A", newton), ("C", newton), ("A", exact))
    return [*(partial(algorithm, *case) for case in cases), contract]


def main() -> None:
    """Print the seconds of so many steps, one line for each number of elements."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--elements", type=int, nargs="+", default=[100, 1000, 10000])
    options.add_argument("--repeat", type=int, default=5)
    given = options.parse_args()
    print(
        f"{STEPS} steps, seconds\n  elements   reading A   reading C   exact law   exact law "
        "through the contract"
    )
    for count in given.elements:
        print(
            f"  {count:8d}"
            + "".join(f"{best(action, given.repeat):12.3f}" for action in runs(count))
        )


if __name__ == "__main__":
    main()
