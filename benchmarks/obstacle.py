#!/usr/bin/env python3
"""Measure what bounds on a field cost: ``vi.solve`` and PETSc's SNESVI, a membrane over a ball.

    python3 benchmarks/obstacle.py [--cells 449] [--json FILE]
    mpirun -n 2 python3 benchmarks/obstacle.py

First comes the cost at 2e5 unknowns: processor time of the busiest rank from the forms to the
answer, without a first guess. "plain" is SNES vinewtonrsls as users set it up, with PETSc's
tolerances, but without a line search and with MUMPS, which is its quickest setting. Then SNESVI
with all defaults of PETSc stands beside ``vi.solve`` on a small mesh. It starts from nothing, from
the solution, and with heights in another unit. ``wrong`` counts unknowns on the wrong side of the
active set. ``error`` is the error of u, relative to its size, against ``vi.solve``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

from demos.parts.problems.membrane import Posed, build  # noqa: E402
from vi_contact import vi  # noqa: E402
from vi_contact.fem import compat  # noqa: E402

COMM = MPI.COMM_WORLD
QUICKEST = {
    "snes_linesearch_type": "none",
    "ksp_type": "preonly",
    "pc_type": "cholesky",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_20": 0,
    "snes_max_it": 1000,
}
DEFAULTS = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_20": 0,
}
COLUMNS = ("case", "reason", "iterations", "wrong", "error", "vi_iterations", "vi_certificate")
CASES = (  # what, size of u, whether it starts from the solution
    ("from nothing", 1.0, False),
    ("u of size 1e-5", 1e-5, False),
    ("u of size 1e-7", 1e-7, False),
    ("u of size 1e-9", 1e-9, False),
    ("u of size 1e8", 1e8, False),
    ("from the solution", 1.0, True),
)


def plain(posed: Posed, options: dict[str, Any]) -> tuple[str, int, Any]:
    """Return PETSc's reason, iterations and x of SNES vinewtonrsls, which begins with posed.u.

    x has the free and the clamped unknowns.
    """
    A = compat.assemble_matrix(compat.compile_form(posed.a))
    V = posed.u.function_space
    n = V.dofmap.index_map.size_local
    clamped = np.zeros(n, dtype=bool)
    values = posed.exact.x.array[:n]
    held = compat.bc_values(posed.bc, len(posed.u.x.array))[0]
    clamped[held[held < n]] = True
    x, b = A.createVecs()
    x.array[:] = np.where(clamped, values, 0.0)
    A.mult(x, b)
    b.scale(-1.0)
    b.array[clamped] = values[clamped]
    rows = (A.getOwnershipRange()[0] + np.flatnonzero(clamped)).astype(PETSc.IntType)
    A.zeroRowsColumns(rows, diag=1.0)
    A.setOption(PETSc.Mat.Option.SPD, True)
    lower, upper = x.duplicate(), x.duplicate()
    lower.array[:] = np.where(clamped, PETSc.NINFINITY, posed.lower.x.array[:n])
    upper.set(PETSc.INFINITY)
    snes = PETSc.SNES().create(COMM)
    F = b.duplicate()
    database = PETSc.Options()
    snes.setOptionsPrefix("plain_")
    snes.setType("vinewtonrsls")
    for key, value in options.items():
        database[f"plain_{key}"] = value

    def function(_snes: Any, x: Any, F: Any) -> None:
        A.mult(x, F)
        F.axpy(-1.0, b)

    snes.setFunction(function, F)
    snes.setJacobian(lambda *_: None, A.copy())
    snes.setVariableBounds(lower, upper)
    snes.setFromOptions()
    x.array[:] = posed.u.x.array[:n]
    snes.solve(None, x)
    for key in options:
        database.delValue(f"plain_{key}")
    names = {
        value: name
        for name, value in vars(PETSc.SNES.ConvergedReason).items()
        if isinstance(value, int)
    }
    return names[snes.getConvergedReason()], snes.getIterationNumber(), np.array(x.array_r)


def spent(start: float) -> float:
    """Return the processor time [s] of the busiest rank since then."""
    return float(COMM.allreduce(time.process_time() - start, op=MPI.MAX))


def cost(cells: int) -> dict[str, Any]:
    """Run both routes once, cold, with forms compiled beforehand."""
    small = build(COMM, 4)
    vi.solve((small.a, small.L), small.u, lower=small.lower, bcs=[small.bc])
    posed = build(COMM, cells)
    start = time.process_time()
    result = vi.solve((posed.a, posed.L), posed.u, lower=posed.lower, bcs=[posed.bc])
    ours = spent(start)
    answer = np.array(posed.u.x.array)
    posed.u.x.array[:] = 0.0  # a mesh made again might be cut into other parts
    start = time.process_time()
    reason, iterations, x = plain(posed, QUICKEST)
    theirs = spent(start)
    n = len(x)
    difference = COMM.allreduce(float(np.max(np.abs(x - answer[:n]))), op=MPI.MAX)
    return {
        "unknowns": posed.u.function_space.dofmap.index_map.size_global,
        "ranks": COMM.size,
        "route": result.method,
        "cpu_seconds": ours,
        "iterations": result.inner,
        "certificate": result.certificate.worst,
        "active": result.active[0],
        "plain_cpu_seconds": theirs,
        "plain_iterations": iterations,
        "plain_reason": reason,
        "ratio": theirs / ours,
        "difference": difference,
    }


def failures(cells: int) -> list[dict[str, Any]]:
    """Return the rows of SNESVI with all of PETSc's defaults beside vi.solve, on a small mesh."""
    rows = []
    for case, unit, warm in CASES:
        posed = build(COMM, cells, unit)
        result = vi.solve((posed.a, posed.L), posed.u, lower=posed.lower, bcs=[posed.bc])
        answer = np.array(posed.u.x.array)
        if warm:
            result = vi.solve((posed.a, posed.L), posed.u, lower=posed.lower, bcs=[posed.bc])
        else:
            posed.u.x.array[:] = 0.0
        reason, iterations, x = plain(posed, DEFAULTS)
        n = len(x)
        ours = result.lambda_lower.x.array[:n] > 0.0
        theirs = x <= posed.lower.x.array[:n]
        error, size = (
            COMM.allreduce(float(np.max(np.abs(one))), op=MPI.MAX)
            for one in (x - answer[:n], answer[:n])
        )
        rows.append(
            {
                "case": case,
                "reason": reason,
                "iterations": iterations,
                "error": error / size,
                "wrong": int(COMM.allreduce(int(np.count_nonzero(ours != theirs)))),
                "vi_iterations": result.inner,
                "vi_certificate": result.certificate.worst,
            }
        )
    return rows


def main(arguments: list[str]) -> int:
    """Print both measurements, and write the numbers if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--cells", type=int, default=449, help="squares along a side; 449 are 2e5 unknowns"
    )
    parser.add_argument(
        "--small",
        type=int,
        default=48,
        help="squares along a side where SNESVI's failures are shown",
    )
    parser.add_argument("--json", type=Path, help="file for the numbers")
    given = parser.parse_args(arguments)
    numbers, rows = cost(given.cells), failures(given.small)
    if COMM.rank == 0:
        print(
            "\n".join(
                f"{key:>18}: {value:.4g}" if isinstance(value, float) else f"{key:>18}: {value}"
                for key, value in numbers.items()
            )
        )
        print(
            f"\n{'SNESVI by default':<18} {'reason':<24} {'its':>4} {'wrong':>6} {'error':>8}   "
            "vi.solve: its, certificate"
        )
        for row in rows:
            case, reason, its, wrong, error, ours, worst = (row[key] for key in COLUMNS)
            print(
                f"{case:<18} {reason:<24} {its:>4} {wrong:>6} {error:>8.1e} {ours:>14} "
                f"{worst:>12.1e}"
            )
        if given.json:
            given.json.write_text(json.dumps({**numbers, "snesvi_by_default": rows}, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
