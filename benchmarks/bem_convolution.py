#!/usr/bin/env python3
"""Compare convolution quadrature with the energetic boundary elements on the problems of bem.py.

    python3 benchmarks/bem_convolution.py [--sides 10 20] [--methods convolution energetic]

The body is the unit square with k elements on a side, c_P dt = h, T = 6, N = 6 k steps, and the
symmetric form. Every row is computed by one thread in a process of its own, and its seconds are
processor time. Errors are those of bem.py. The contact problem is the pressed square under Tresca's
friction. Its columns are the impulse at t = 4, the energy at t = 2, and the iterations of Uzawa's
method with rho = 1/lambda_max(W_0) and with a fifth of it; nan means more than 2000.
The last column is the greatest eigenvalue of W_0.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "bem"), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
from convolution_operator import convolution_operator  # noqa: E402
from plane_waves import MATERIAL, SQUARE, pulse  # noqa: E402
from test_energetic import echoes, smooth_integral, smooth_load  # noqa: E402

from vi_contact import Tresca, bem  # noqa: E402
from vi_contact.bem.contact import BoundaryContact  # noqa: E402
from vi_contact.bem.contact_run import march_contact  # noqa: E402
from vi_contact.bem.uzawa_space_time import SpaceTimeUzawa  # noqa: E402
from vi_contact.core.errors import StepFailure  # noqa: E402

METHODS = ("energetic", "convolution")
COLUMNS = (
    "k",
    "assembly",
    "solve",
    "condense",
    "peak MB",
    "pulse P",
    "pulse S",
    "sin²",
    "step",
    "base",
    "max base",
    "impulse",
    "E(2)",
    "Uzawa",
    "Uzawa/5",
    "W_0",
)
Problem = Callable[..., Any]
Forces = Callable[[float, int], np.ndarray]


def discretised(method: str, k: int) -> tuple[Problem, Callable[[Forces], np.ndarray]]:
    """Return problem(forces, fixed=, contact=) of a method, and the loads that it takes.

    The loads are made of mean forces of any number of steps.
    """
    mesh = bem.polygon(SQUARE, 1.0 / k)
    dt = 1.0 / k
    steps = 6 * k
    if method == "energetic":
        operator = bem.PoincareSteklov(
            bem.energetic_blocks(mesh, MATERIAL, dt=dt, steps=steps), MATERIAL.rho
        )
        return lambda *a, **more: bem.BoundaryProblem(operator, *a, **more), lambda forces: forces(
            dt, steps
        )
    transformed = convolution_operator(mesh, MATERIAL, dt=dt, steps=steps)
    return (
        lambda *a, **more: bem.BoundaryProblem(transformed, *a, **more),
        transformed.frequencies.substep_means,
    )


def row(method: str, k: int) -> dict[str, float]:
    """Return times [s], memory and errors of one method with k elements a side."""
    start = time.process_time()
    problem, loads = discretised(method, k)
    result = {"k": k, "assembly": time.process_time() - start}
    for name, shear in (("pulse P", False), ("pulse S", True)):
        result[name] = pulse_error(problem, loads, k, shear=shear)
    start = time.process_time()
    rod_errors(result, problem, loads, "sin²", smooth_load, smooth_integral, k)
    result["solve"] = time.process_time() - start
    rod_errors(result, problem, loads, "step", lambda t: 1.0, lambda t: np.maximum(t, 0.0), k)
    pressed_square(result, problem, k)
    return result | {
        "peak MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0 * 1.048576
    }


def pulse_error(problem: Problem, loads: Callable, k: int, *, shear: bool) -> float:
    """Return the relative L2 error of a plane pulse, P or (``shear``) S, until T = 4."""
    wave = pulse(shear=shear)
    mesh = bem.polygon(SQUARE, 1.0 / k)
    forces = loads(lambda dt, steps: bem.traction_forces(mesh, wave.traction, dt=dt, steps=steps))
    exact = np.array([wave.displacement(mesh.points, (j + 1) / k).T for j in range(4 * k)])
    return float(
        np.linalg.norm(problem(forces).solve().displacement[: 4 * k] - exact)
        / np.linalg.norm(exact)
    )


def rod_errors(
    result: dict,
    problem: Problem,
    loads: Callable,
    name: str,
    load: Callable,
    integral: Callable,
    k: int,
):
    """Put the error of the top of the rod under one load into the result.

    The load "step" also gives the error of the force at the base.
    """
    mesh = bem.polygon(SQUARE, 1.0 / k)
    sides = [mesh.nodes_of(mesh.labels == side) for side in range(4)]
    forces = loads(
        lambda dt, steps: bem.traction_forces(
            mesh, lambda x, n, t: n * load(t), dt=dt, steps=steps, elements=mesh.labels == 2
        )
    )
    motion = problem(forces, fixed=np.stack([sides[1] | sides[3], sides[0]])).solve()
    exact = echoes(motion.times, integral)[:, None]
    top = motion.displacement[:, 1][:, sides[2]]
    result[name] = float(
        np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape))
    )
    if name == "step":
        base = -motion.forces[:, 1][:, sides[0]].sum(axis=1)
        middle = motion.times - 0.5 / k
        exact_base = np.where((middle > 1.0) & ((middle - 1.0) % 4.0 < 2.0), 2.0, 0.0)
        result["base"] = float(np.linalg.norm(base - exact_base) / np.linalg.norm(exact_base))
        result["max base"] = float(base.max())


def pressed_square(result: dict, problem: Problem, k: int) -> None:
    """Put impulse at t = 4, energy at t = 2, W_0 and iterations of Uzawa's method into the result.

    The square is pressed under Tresca's friction; nan means that Uzawa's method did not end.
    """
    mesh = bem.polygon(SQUARE, 1.0 / k)
    forces = bem.traction_forces(
        mesh, lambda x, n, t: -n, dt=1.0 / k, steps=6 * k, elements=mesh.labels == 2
    )
    whole = problem(forces, contact=mesh.labels == 0)
    start = time.process_time()
    contact = BoundaryContact(whole.condensed(), friction=Tresca(0.05))
    result["condense"] = time.process_time() - start
    run = march_contact(contact)
    result["impulse"] = run.impulse[4 * k - 1, 1]
    result["E(2)"] = whole.solve(run.forces).work[2 * k - 1]
    result["W_0"] = float(np.linalg.eigvalsh(contact.compliance.W[0])[-1])
    for name, share in (("Uzawa", 1.0), ("Uzawa/5", 0.2)):
        try:
            run = SpaceTimeUzawa(rho=share / result["W_0"], max_iterations=2000).solve(contact)
            result[name] = int(run.iterations[0])
        except StepFailure:
            result[name] = float("nan")


def main() -> None:
    """Print a row for each size and method, each computed in its own process."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sides", type=int, nargs="*", default=[10, 20])
    parser.add_argument("--methods", nargs="*", choices=METHODS, default=METHODS)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(row(chosen.one[0], int(chosen.one[1]))))
        return
    print(f"{'':>10}", *(f"{name:>9}" for name in COLUMNS))
    for k in chosen.sides:
        for method in chosen.methods:
            command = [sys.executable, __file__, "--one", method, str(k)]
            result = json.loads(
                subprocess.run(command, check=True, capture_output=True, text=True).stdout
            )
            print(f"{method:>10}", *(f"{result[name]:9.5g}" for name in COLUMNS), flush=True)


if __name__ == "__main__":
    main()
