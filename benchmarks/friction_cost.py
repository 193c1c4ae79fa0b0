#!/usr/bin/env python3
"""Measure what a step with Coulomb friction costs, in plain linear steps with the same matrix.

    python3 benchmarks/friction_cost.py [--sizes 2e4 2e5] [--steps 60] [--mu 0.3]

The model is the wall of step_cost.py with its whole right side in possible contact. A vertical
harmonic motion acts beside the horizontal one, so that points open, stick and slip. The certificate
is on and nothing is recorded. Seconds are processor time of one thread. A linear step, by the
fastest of three factors, is timed beside every step with contact. The rows have medians over the
steps with contact, and the mean ratio.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI

# first: it sets the number of threads
from step_cost import Factors, Linear, StepsWithContact, make_effective, wall_cells

import vi_contact as vc
from demos.parts.problems.wall import Wall, build
from vi_contact import solvers
from vi_contact.solvers.friction.extrapolation import Anderson

ROUTES: dict[str, Any] = {
    "FrictionNewton": vc.Condensed(),
    "FixedPoint": vc.Condensed(friction_method=solvers.FixedPoint()),
    "FixedPoint, Anderson": vc.Condensed(
        friction_method=solvers.FixedPoint(extrapolation=Anderson())
    ),
}
HEADER = (
    f"{'unknowns':>9} {'points':>6} {'route':<21} {'linear ms':>9} {'step ms':>9} {'ratio':>6} "
    f"{'mean':>6} {'iter':>5}"
    f" {'closed':>6} {'slip':>5} {'certificate':>11}"
)


def measured(
    problem: vc.ContactProblem, solver: Any, dt: float, count: int, linear: Linear
) -> dict[str, Any]:
    """Return the costs of ``count`` steps with contact, each beside a linear step.

    A third as many steps before them are not counted.
    """
    steps = StepsWithContact(problem, solver, dt, count, linear)
    iterations, slipping = [], []
    for report in steps:
        result = report.result
        iterations.append(result.iterations)
        if problem.frictional:
            moved = problem.surface.tangential_values(result.x) != report.step.slip0
            slipping.append(int((result.active & moved[:, 0]).sum()))
    seconds, plain, closed, worst = steps.seconds, steps.plain, steps.active, steps.worst
    return {
        "linear": 1e3 * float(np.median(plain)),
        "step": 1e3 * float(np.median(seconds)),
        "ratio": float(np.median(seconds) / np.median(plain)),
        "mean": float(np.mean(seconds) / np.mean(plain)),
        "iterations": float(np.mean(iterations)),
        "closed": float(np.mean(closed)),
        "slip": float(np.mean(slipping)) if slipping else 0.0,
        "worst": worst,
    }


def measure(size: float, steps: int, mu: float) -> None:
    """Print the lines of one size: without friction, and by every route with it."""
    model = build(Wall(divisions=wall_cells(size)), MPI.COMM_SELF, base_inertia="catalogue")
    shaken = model.problem("face")
    vertical = vc.Harmonic(3.0, 20.0, direction=(0.0, 1.0))
    plain = replace(shaken, excitation=(*shaken.excitations, vertical))
    dt = model.time_step()
    linear = Linear(plain, dt, Factors(make_effective(plain, dt).matrix, 2).by)
    for name, solver in {"no friction": vc.Condensed(), **ROUTES}.items():
        problem = plain if name == "no friction" else replace(plain, friction=vc.Coulomb(mu))
        f = measured(problem, solver, dt, steps, linear)
        print(
            f"{model.system.space.unknowns:>9} {problem.surface.total:>6} {name:<21} "
            f"{f['linear']:>9.3f}"
            f" {f['step']:>9.3f} {f['ratio']:>6.2f} {f['mean']:>6.2f} {f['iterations']:>5.1f} "
            f"{f['closed']:>6.1f}"
            f" {f['slip']:>5.1f} {f['worst']:>11.1e}",
            flush=True,
        )


def main() -> None:
    """Print the table, size by size."""
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    arguments.add_argument("--sizes", type=float, nargs="+", default=[2e4, 2e5])
    arguments.add_argument(
        "--steps", type=int, default=60, help="number of steps with contact that are timed"
    )
    arguments.add_argument("--mu", type=float, default=0.3)
    options = arguments.parse_args()
    print(HEADER, flush=True)
    for size in options.sizes:
        measure(size, options.steps, options.mu)


if __name__ == "__main__":
    main()
