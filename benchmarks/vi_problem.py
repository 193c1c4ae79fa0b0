#!/usr/bin/env python3
"""Measure what a solve of a prepared ``vi.Problem`` costs, beside a SNES VI of PETSc that is kept.

    python3 benchmarks/vi_problem.py [--cells 19] [--rounds 41] [--json FILE]

Two problems between bounds on squares of two triangles are solved many times from one first guess:
a membrane over a ball, which is linear, and a soap film over the same ball, which is not. Each has
(cells + 1)² unknowns, 400 by default. "SNES" is PETSc's vinewtonrsls with the line search bt and
an LU factor of PETSc's own in every iteration. Its forms are compiled, and its matrix, vectors and
solver are made, once, too. A tolerance of 1e-9 relative to the first residual ends it. Both are
timed in turn, and forms are compiled beforehand.

Numbers of the membrane; those of the film have ``film_`` before them:

- ``unknowns``: number of unknowns, those at the rim too.
- ``first_solve_ms``: to prepare a ``vi.Problem`` and to solve it once; ``vi.solve`` does this.
- ``solve_ms``: a solve of the prepared problem, the median of all rounds.
- ``snes_ms``: a solve of the kept SNES, the median of all rounds.
- ``ratio``: the median of ``vi.Problem`` over SNES in the same round.
- ``iterations``, ``inner``, ``snes_iterations``: Newton steps, those of the linear method, and
  those of SNES.
- ``certificate``, ``difference``: the worst certificate, and the largest difference of u between
  both, as a share of its size.
- ``leak_bytes_per_call``: by how much the memory grows that C code has from malloc.
- ``leak_blocks_per_call``: by how many the objects grow that Python holds.

Times are milliseconds of processor time.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
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
import ufl  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

from demos.parts.problems.membrane import Posed, build  # noqa: E402
from vi_contact import vi  # noqa: E402
from vi_contact.fem import compat  # noqa: E402

COMM = MPI.COMM_SELF
CALLS = 200  # of which the growth of memory is measured
WARM = 20  # calls before it is measured
OPTIONS = {
    "snes_linesearch_type": "bt",
    "snes_rtol": 1e-9,
    "snes_atol": 1e-14,
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_ordering_type": "nd",
}


def film(u: Any) -> Any:
    """Return the form of a soap film, the derivative of its area."""
    v = ufl.TestFunction(u.function_space)
    slope = ufl.grad(u)
    stretch = ufl.sqrt(1.0 + ufl.inner(slope, slope))
    return ufl.inner(slope, ufl.grad(v)) / stretch * ufl.dx


def membrane(u: Any) -> Any:
    """Return the form of a membrane."""
    v = ufl.TestFunction(u.function_space)
    return ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx


class KeptSnes:
    """Hold SNES vinewtonrsls, with all that it needs; ``solve`` starts from what is in u."""

    def __init__(self, posed: Posed, form: Any) -> None:
        self.u = posed.u
        self.F = compat.compile_form(form)
        self.J = compat.compile_form(ufl.derivative(form, posed.u))
        self.residual = compat.function(posed.u.function_space)
        self.held, self.values = compat.bc_values(posed.bc, len(posed.u.x.array))
        self.A = compat.create_matrix(self.J, COMM)
        self.x, R = self.A.createVecs()
        lower = self.x.duplicate()
        upper = self.x.duplicate()
        lower.array[:] = posed.lower.x.array
        lower.array[self.held] = PETSc.NINFINITY
        upper.set(PETSc.INFINITY)
        self.snes = PETSc.SNES().create(COMM)
        self.snes.setOptionsPrefix("kept_")
        self.snes.setType("vinewtonrsls")
        self.snes.setFunction(self.function, R)
        self.snes.setJacobian(self.jacobian, self.A)
        self.snes.setVariableBounds(lower, upper)
        database = PETSc.Options()
        for key, value in OPTIONS.items():
            database[f"kept_{key}"] = value
        self.snes.setFromOptions()

    def function(self, _snes: Any, x: Any, R: Any) -> None:
        """Evaluate F at free unknowns, and u - g at held ones."""
        self.u.x.array[:] = x.array_r
        compat.assemble_into(self.F, self.residual)
        R.array[:] = self.residual.x.array
        R.array[self.held] = x.array_r[self.held] - self.values

    def jacobian(self, _snes: Any, x: Any, A: Any, _P: Any) -> None:
        """Evaluate J with the rows and columns of the identity at held unknowns."""
        self.u.x.array[:] = x.array_r
        compat.assemble_again(self.J, A)
        A.zeroRowsColumns(self.held.astype(PETSc.IntType), diag=1.0)

    def solve(self) -> int:
        """Return the number of iterations; RuntimeError where SNES does not converge."""
        self.x.array[:] = self.u.x.array
        self.x.array[self.held] = self.values  # so that nothing has to be lifted
        self.snes.solve(None, self.x)
        if self.snes.getConvergedReason() <= 0:
            raise RuntimeError(f"SNES ends with reason {self.snes.getConvergedReason()}")
        self.u.x.array[:] = self.x.array_r
        return int(self.snes.getIterationNumber())


def spend(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time of a call [ms], and what it returns."""
    start = time.process_time()
    answer = call()
    return 1e3 * (time.process_time() - start), answer


class _Mallinfo(ctypes.Structure):
    """Hold what glibc tells of its memory (mallinfo2)."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        )
    ]


def count_memory() -> tuple[int, int]:
    """Return the bytes that C code has from malloc, 0 without glibc, and Python's blocks."""
    gc.collect()
    tell = getattr(ctypes.CDLL(None), "mallinfo2", None)
    size = 0
    if tell is not None:
        tell.restype = _Mallinfo
        told = tell()
        size = told.uordblks + told.hblkhd
    return size, sys.getallocatedblocks()


def measure_leak(call: Callable[[], Any], calls: int) -> tuple[float, float]:
    """Return by how many bytes and blocks memory grows in a call, on the mean."""
    for _ in range(WARM):
        call()
    before = count_memory()
    for _ in range(calls):
        call()
    after = count_memory()
    return (after[0] - before[0]) / calls, (after[1] - before[1]) / calls


def compare(make_form: Callable[[Any], Any], cells: int, rounds: int, calls: int) -> dict[str, Any]:
    """Return the numbers of one problem.

    Args:
        make_form: u -> F(u; v).
        cells: squares along a side.
        rounds: solves of each that are timed.
        calls: solves over which the growth of memory is measured.
    """
    # Forms are compiled on a small mesh.
    small = build(COMM, 2)
    vi.solve(make_form(small.u), small.u, lower=small.lower, bcs=[small.bc])

    posed = build(COMM, cells)
    theirs = build(COMM, cells)
    guess = posed.u.x.array.copy()
    kept: list[vi.Problem] = []

    def first() -> Any:
        kept.append(vi.Problem(make_form(posed.u), posed.u, bcs=[posed.bc]))
        return kept[0].solve(lower=posed.lower)

    def again() -> Any:
        posed.u.x.array[:] = guess
        return kept[0].solve(lower=posed.lower)

    first_ms, _ = spend(first)
    snes = KeptSnes(theirs, make_form(theirs.u))
    ours_ms = []
    snes_ms = []
    for _ in range(rounds):
        milliseconds, result = spend(again)
        ours_ms.append(milliseconds)
        theirs.u.x.array[:] = guess
        milliseconds, iterations = spend(snes.solve)
        snes_ms.append(milliseconds)
    difference = np.max(np.abs(posed.u.x.array - theirs.u.x.array))
    leak_bytes, leak_blocks = measure_leak(again, calls)
    return {
        "unknowns": len(guess),
        "first_solve_ms": first_ms,
        "solve_ms": float(np.median(ours_ms)),
        "snes_ms": float(np.median(snes_ms)),
        "ratio": float(np.median(np.array(ours_ms) / np.array(snes_ms))),
        "iterations": result.iterations,
        "inner": result.inner,
        "snes_iterations": iterations,
        "certificate": result.certificate.worst,
        "difference": float(difference / np.max(np.abs(posed.u.x.array))),
        "leak_bytes_per_call": leak_bytes,
        "leak_blocks_per_call": leak_blocks,
    }


def main(arguments: list[str] | None = None) -> int:
    """Print the measurements, and write the numbers if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cells", type=int, default=19, help="squares along a side")
    parser.add_argument("--rounds", type=int, default=41, help="solves that are timed")
    parser.add_argument(
        "--calls", type=int, default=CALLS, help="solves over which memory is watched"
    )
    parser.add_argument("--json", type=Path, help="file for the numbers")
    given = parser.parse_args(arguments)
    numbers = compare(membrane, given.cells, given.rounds, given.calls)
    of_film = compare(film, given.cells, given.rounds, given.calls)
    numbers |= {f"film_{key}": value for key, value in of_film.items()}
    for key, value in numbers.items():
        print(f"{key:>25}: {value:.4g}" if isinstance(value, float) else f"{key:>25}: {value}")
    if given.json:
        given.json.write_text(json.dumps(numbers, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
