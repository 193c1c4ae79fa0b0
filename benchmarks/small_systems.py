#!/usr/bin/env python3
"""Measure what a step of a small system costs, in steps of the same mathematics in bare numpy.

Both are timed in one run.

    python3 benchmarks/small_systems.py [--steps 400] [--rounds 11] [--json FILE]

The model is the wall of 8 x 12 cells with 216 unknowns and 11 contact points, under a harmonic
motion, with the Zienkiewicz-Wood-Taylor step and an impact law. ``march`` yields certified steps.
``simulate`` also keeps energies, contact and a run folder. The bare loop in this file has the
right-hand side, the substitutions, the search of the contact set, the certificate and the impact
law, and no objects. Times are processor time of the thread. Each run is timed between two runs of
the bare loop, and the median of their ratios counts, as the machine may be busy. Set-up without
assembly is in all of them. Start-up is the processor time of ``vi-contact run wall`` from the
command to the first step, over that of importing scipy and dolfinx just before, each in its own
process; forms and byte code are cached.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from mpi4py import MPI  # noqa: E402
from scipy.linalg import lapack  # noqa: E402
from scipy.sparse.linalg import splu  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems.wall import Wall, build  # noqa: E402
from vi_contact.core.stage import make_matrix  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)


class Bare:
    """Hold the wall as arrays, and step it in 40 lines of numpy and scipy."""

    def __init__(self, problem: vc.ContactProblem, dt: float) -> None:
        equations = problem.equations
        self.dt = dt
        self.load = problem.equations.load
        self.M, self.K = (self._csr(matrix) for matrix in (equations.M, equations.K))
        self.A = (4.0 / dt**2 * self.M + self.K).tocsr()
        self.points = problem.surface.owned
        self.gap0 = problem.surface.gap0
        self.state = initial_state(problem)

    @staticmethod
    def _csr(matrix: Any) -> sp.csr_matrix:
        ends, columns, values = matrix.mat.getValuesCSR()
        return sp.csr_matrix((values, columns, ends))

    def march(self, steps: int) -> tuple[np.ndarray, float]:
        """Return the last displacement and the worst certificate."""
        M, K, A, dt, points, gap0 = self.M, self.K, self.A, self.dt, self.points, self.gap0
        factor = splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        units = np.zeros((A.shape[0], len(points)))
        units[points, np.arange(len(points))] = 1.0
        columns = factor.solve(units)
        G = columns[points]
        norm = np.abs(columns[points]).sum(axis=1).max()
        largest = A.diagonal().max()
        u = self.state.u
        v = self.state.v
        t = 0.0
        worst = 0.0
        active = np.zeros(len(points), dtype=bool)
        known = b""
        for _ in range(steps):
            guess = u + dt * v
            b = 2.0 * self.load(t + 0.5 * dt) + M @ guess * (4.0 / dt**2) - K @ u
            x = factor.solve(b)
            r = np.zeros(len(points))
            q = gap0 - x[points]
            if active.any() or q.min() < 0.0:
                while True:
                    if active.tobytes() != known:
                        known = active.tobytes()
                        chosen = np.flatnonzero(active)
                        rows = G[chosen]
                        lower = lapack.dpotrf(rows[:, chosen], lower=1)[0] if len(chosen) else None
                    r = np.zeros(len(points))
                    w = q
                    if lower is not None:
                        part = lapack.dpotrs(lower, -q[chosen], lower=1)[0]
                        r[chosen] = part
                        w = q + part @ rows
                    wrong = np.where(active, r, w) < -1e-15 * norm * np.abs(r).max()
                    if not wrong.any():
                        break
                    active = active ^ wrong
                active = active & (r > 0.0)
                r = np.maximum(r, 0.0)
                x = x - columns @ r
                x[points[active]] = gap0[active]
            worst = max(worst, self._certificate(A @ x, b, x, r, guess, active, largest))
            v = v + 2.0 * ((x - u) / dt - v)
            v[points[active]] = 0.0
            u = x
            t = t + dt
        return u, worst

    def _certificate(
        self, Ax: Any, b: Any, x: Any, r: Any, guess: Any, active: Any, largest: float
    ) -> float:
        """Return the largest residual of vi_contact's certificate without friction."""
        residual = Ax - b
        gap = self.gap0 - x[self.points]
        residual[self.points] += r
        x_max, b_max, r_max = np.abs(x).max(), np.abs(b).max(), np.abs(r).max()
        x_ref = max(x_max, np.abs(guess).max())
        r_ref = max(b_max, r_max)
        if not x_ref > 0.0 < r_ref:
            return 0.0
        balance = np.abs(residual).max() / max(b_max, np.abs(Ax).max(), 1e-5 * largest * x_max)
        apart = np.abs(np.where(active, gap, 0.0)).max() / x_ref
        return max(
            balance,
            -gap.min() / x_ref,
            -r.min() / r_ref,
            apart,
            np.abs(np.where(active, 0.0, r)).max() / r_ref,
        )


LIBRARIES = "import time, scipy, dolfinx; print(time.process_time())"
FIRST_STEP = """
import os, sys, time
from importlib import import_module

def told(*_, **__):
    print(time.process_time(), flush=True)
    os._exit(0)

# imported by the command in any case
import_module("vi_contact.run.stepper").Stepper._attempt = told
from vi_contact.practice.cli.entry import main
main(["run", "wall", "--quiet", "--out", sys.argv[1]])
"""


def start_up(rounds: int) -> tuple[float, list[float]]:
    """Return the processor time [s] from command to first step, the median, and its ratios.

    They are ratios to the time of importing the libraries.
    """
    found: dict[str, list[float]] = {LIBRARIES: [], FIRST_STEP: []}
    with tempfile.TemporaryDirectory() as folder:
        cached = {
            name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
        }
        cached["PYTHONPYCACHEPREFIX"] = f"{folder}/byte_code"
        for _ in range(rounds + 1):
            for code, times in found.items():
                command = [sys.executable, "-c", code, f"{folder}/run"]
                ended = subprocess.run(
                    command, capture_output=True, text=True, check=True, env=cached
                )
                times.append(float(ended.stdout))
    libraries, first = (np.array(times[1:]) for times in found.values())
    return float(np.median(first)), (first / libraries).tolist()


def spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time [s] of a call, and its result."""
    begin = time.thread_time()
    result = work()
    return time.thread_time() - begin, result


def measured(steps: int, rounds: int) -> list[dict[str, Any]]:
    """Return the rows of march and simulate."""
    model = build(Wall(divisions=(8, 12)), MPI.COMM_WORLD)
    problem = model.problem("b")
    dt = model.time_step()
    bare = Bare(problem, dt)
    worst = [0.0]

    def march() -> np.ndarray:
        for _, report in vc.march(problem, scheme=SCHEME, dt=dt, steps=steps):
            worst[0] = max(worst[0], report.certificate.worst)
        return report.new.u

    def simulate() -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            return vc.simulate(
                problem, scheme=SCHEME, dt=dt, steps=steps, out=folder, progress=False
            ).state.u

    routes: dict[str, Callable[[], Any]] = {"march": march, "simulate": simulate}
    found = {name: [] for name in ("bare", *routes)}
    ratios = {name: [] for name in routes}
    expected = bare.march(steps)
    for name, work in routes.items():
        off = np.abs(work() - expected[0]).max() / np.abs(expected[0]).max()
        if not off < 1e-9:
            raise SystemExit(
                f"{name} and the bare loop differ by {off:.1e}: they do not march the same problem"
            )
    lone = partial(bare.march, steps)
    for _ in range(rounds):
        for name, work in routes.items():
            before, own, after = (spent(one)[0] / steps for one in (lone, work, lone))
            found["bare"] += [before, after]
            found[name].append(own)
            ratios[name].append(2.0 * own / (before + after))
    first = SCHEME.stage(problem, initial_state(problem), dt)
    factorisation = spent(lambda: make_matrix(problem.equations, first).factor)[0]
    set_up = spent(lambda: next(vc.march(problem, scheme=SCHEME, dt=dt, steps=1)))[0]
    common = {
        "unknowns": model.system.space.unknowns,
        "points": problem.surface.total,
        "dimension": 2,
        "problem": "wall",
        "friction": False,
        "setup_seconds": set_up,
        "setup_over_factorisation": set_up / factorisation,
        "certificate": worst[0],
        "bare_seconds_per_step": float(np.median(found["bare"])),
    }
    return [
        common
        | {
            "method": name,
            "ratio_median": float(np.median(ratios[name])),
            "ratio_mean": float(np.mean(ratios[name])),
            "seconds_per_step": float(np.median(found[name])),
        }
        for name in routes
    ]


def main() -> None:
    """Print the rows of the methods and the line of the start-up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--json", type=Path, help="write the rows into this file")
    options = parser.parse_args()
    rows = measured(options.steps, options.rounds)
    print(
        f"{'unknowns':>8} {'points':>6}  {'method':<9} {'ratio':>6} {'mean':>6} {'us/step':>8} "
        f"{'bare us':>8} "
        f"{'certificate':>11}"
    )
    for row in rows:
        print(
            f"{row['unknowns']:>8} {row['points']:>6}  {row['method']:<9} "
            f"{row['ratio_median']:>6.2f} "
            f"{row['ratio_mean']:>6.2f} {1e6 * row['seconds_per_step']:>8.0f} "
            f"{1e6 * row['bare_seconds_per_step']:>8.0f} {row['certificate']:>11.1e}"
        )
    first, ratios = start_up(options.rounds)
    print(
        f"start-up: {first:.2f} s to the first step, {np.median(ratios):.2f} times scipy and "
        "dolfinx"
    )
    rows.append(
        {
            "method": "start-up",
            "seconds": first,
            "ratio_median": float(np.median(ratios)),
            "ratio_mean": float(np.mean(ratios)),
        }
    )
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
