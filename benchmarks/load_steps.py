#!/usr/bin/env python3
"""Measure load steps of a rubber-like block between bounds: ``vi.Problem`` beside PETSc's SNES VI.

    python3 benchmarks/load_steps.py [--cells 16 32 64] [--steps 0.1 0.2] [--json FILE]
    mpirun -n 2 python3 benchmarks/load_steps.py

A block, 1 wide and 2 high in plane strain, of compressible neo-Hookean material with E = 1 and
nu = 0.3 at small strain, has n x 2n squares of two triangles. Its top is moved down by 0.8 in equal
steps and held sideways. No node of its boundary may pass the floor at height 0, u_y >= -y. Every
step starts from the answer of the step before.

"SNES" is PETSc's vinewtonrsls with the line search bt and a factor of MUMPS in every iteration. Its
Dirichlet data are lifted as DOLFINx does it: the residual of the free unknowns is that of the
linear step to the prescribed values. A tolerance of 1e-9 relative to the first residual ends it.

Each row is one size of mesh and of step; it ends at the first step that fails. ``iterations`` are
Newton steps of all load steps, ``linear`` the iterations of the linear methods in them,
``certificate`` the worst one, ``failures`` the load steps that were not solved (0 or 1). SNES has
its own ``snes_...``. ``difference`` is the largest difference of u at the last step that both
solved, as a share of 0.8. ``ratio`` is the processor time of a prepared ``vi.Problem`` over that of
SNES, whose matrix and forms are prepared too, for the load steps that both solved, of the busiest
rank.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import dolfinx  # noqa: E402
import numpy as np  # noqa: E402
import ufl  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

from vi_contact import StepFailure, vi  # noqa: E402
from vi_contact.fem import compat  # noqa: E402

COMM = MPI.COMM_WORLD
DOWN = 0.8  # what the top moves in all
HEIGHT = 2.0
OPTIONS = {
    "snes_linesearch_type": "bt",
    "snes_rtol": 1e-9,
    "snes_atol": 1e-10,
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_20": 0,
}


@dataclass(frozen=True)
class Block:
    """Hold the block: its displacement u, its energy, F, and the floor.

    ``bc`` is the condition at the top, and g has its values.
    """

    u: Any
    energy: Any
    F: Any
    g: Any
    bc: Any
    floor: Any

    def lower_top(self, by: float) -> None:
        """Prescribe how far the top is below its first place."""
        self.g.interpolate(lambda x: np.vstack([0.0 * x[0], -by + 0.0 * x[0]]))


def block(comm: Any, cells: int) -> Block:
    """Make the block with so many squares across."""
    on = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [1.0, HEIGHT]], [cells, 2 * cells])
    V = compat.lagrange(on, 1, (2,))
    u, g, floor = compat.function(V), compat.function(V), compat.function(V)

    # W = mu/2 (tr FᵀF - 2) - mu ln J + lambda/2 (ln J)²
    E, nu = 1.0, 0.3
    mu = E / (2.0 * (1.0 + nu))
    lam = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    gradient = ufl.Identity(2) + ufl.grad(u)
    J = ufl.det(gradient)
    W = (
        0.5 * mu * (ufl.tr(gradient.T * gradient) - 2.0)
        - mu * ufl.ln(J)
        + 0.5 * lam * ufl.ln(J) ** 2
    )
    energy = W * ufl.dx

    top = compat.entities_where(on, 1, lambda x: np.isclose(x[1], HEIGHT))
    bc = dolfinx.fem.dirichletbc(g, compat.locate_blocks(V, top))

    # The floor bounds the vertical component at all nodes of the boundary; the others are free.
    boundary = compat.locate_blocks(
        V, compat.entities_where(on, 1, lambda x: np.full(x.shape[1], True))
    )
    floor.x.array[:] = -np.inf
    floor.x.array[2 * boundary + 1] = -V.tabulate_dof_coordinates()[boundary, 1]
    return Block(u, energy, ufl.derivative(energy, u), g, bc, floor)


class Snes:
    """Solve a block by SNES vinewtonrsls; ``solve`` starts from what is in u."""

    def __init__(self, posed: Block) -> None:
        self.posed = posed
        self.factors = 0
        V = posed.u.function_space
        self.n = V.dofmap.index_map_bs * V.dofmap.index_map.size_local
        self.F = compat.compile_form(posed.F)
        self.J = compat.compile_form(ufl.derivative(posed.F, posed.u))
        held = compat.bc_values(posed.bc, len(posed.u.x.array))[0]
        self.held = held[held < self.n]
        self.A = compat.assemble_matrix(self.J)
        self.first = self.A.getOwnershipRange()[0]
        self.x, self.w = self.A.createVecs()

    def put(self, x: Any) -> None:
        """Write PETSc's unknowns into u."""
        self.posed.u.x.array[: self.n] = x.array_r
        self.posed.u.x.scatter_forward()

    def function(self, _snes: Any, x: Any, R: Any) -> None:
        """Evaluate F at free unknowns and u - g at held ones.

        F has what the linear step to the prescribed values adds.
        """
        self.put(x)
        F = compat.assemble_vector(self.F)
        off = x.array_r[self.held] - self.posed.g.x.array[self.held]
        R.array[:] = F.array_r[: self.n]
        F.destroy()
        if COMM.allreduce(float(np.max(np.abs(off), initial=0.0)), op=MPI.MAX) > 0.0:
            J = compat.assemble_matrix(self.J)
            self.w.set(0.0)
            self.w.array[self.held] = -off
            lifted = self.w.duplicate()
            J.mult(self.w, lifted)
            R.axpy(1.0, lifted)
            J.destroy()
        R.array[self.held] = off

    def jacobian(self, _snes: Any, x: Any, A: Any, _P: Any) -> None:
        """Evaluate J with the rows and columns of the identity at held unknowns."""
        self.put(x)
        J = compat.assemble_matrix(self.J)
        J.zeroRowsColumns((self.first + self.held).astype(PETSc.IntType), diag=1.0)
        J.copy(A)
        J.destroy()
        self.factors += 1

    def solve(self) -> tuple[bool, int]:
        """Return whether SNES converged, and its iterations."""
        database = PETSc.Options()
        snes = PETSc.SNES().create(COMM)
        snes.setOptionsPrefix("plain_")
        snes.setType("vinewtonrsls")
        for key, value in OPTIONS.items():
            database[f"plain_{key}"] = value
        lower, upper = self.x.duplicate(), self.x.duplicate()
        lower.array[:] = np.maximum(self.posed.floor.x.array[: self.n], PETSc.NINFINITY)
        lower.array[self.held] = PETSc.NINFINITY
        upper.set(PETSc.INFINITY)
        snes.setFunction(self.function, self.x.duplicate())
        snes.setJacobian(self.jacobian, self.A)
        snes.setVariableBounds(lower, upper)
        snes.setFromOptions()
        self.x.array[:] = self.posed.u.x.array[: self.n]
        try:
            snes.solve(None, self.x)
            converged = snes.getConvergedReason() > 0
        except PETSc.Error:
            converged = False
        for key in OPTIONS:
            database.delValue(f"plain_{key}")
        self.put(self.x)
        iterations = snes.getIterationNumber()
        snes.destroy()
        return converged, iterations


def run(
    posed: Block, count: int, solve: Callable[[], Any]
) -> tuple[list[Any], list[float], list[Any], int]:
    """Take the load steps until one fails; return answers, times, displacements and failures.

    A time [s] is that of the busiest rank.
    """
    given, seconds, fields = [], [], []
    for k in range(count):
        posed.lower_top(DOWN * (k + 1) / count)
        start = time.process_time()
        found = solve()
        seconds.append(COMM.allreduce(time.process_time() - start, op=MPI.MAX))
        if found is None:
            return given, seconds, fields, 1
        given.append(found)
        fields.append(posed.u.x.array.copy())
    return given, seconds, fields, 0


def row(cells: int, step: float) -> dict[str, Any]:
    """Measure one size of mesh and of load step, both ways."""
    count = round(DOWN / step)
    ours, theirs = block(COMM, cells), block(COMM, cells)
    problem = vi.Problem(ours.F, ours.u, bcs=[ours.bc])
    plain = Snes(theirs)

    def by_vi() -> Any:
        try:
            return problem.solve(lower=ours.floor)
        except StepFailure:
            return None

    def by_snes() -> Any:
        converged, iterations = plain.solve()
        return iterations if converged else None

    results, our_seconds, our_fields, our_failures = run(ours, count, by_vi)
    iterations, their_seconds, their_fields, their_failures = run(theirs, count, by_snes)
    both = min(len(our_fields), len(their_fields))
    off = (
        np.max(np.abs(our_fields[both - 1] - their_fields[both - 1]), initial=0.0)
        if both
        else np.nan
    )
    return {
        "cells": cells,
        "step": step,
        "solved": len(results),
        "iterations": sum(one.iterations for one in results),
        "linear": sum(one.inner for one in results),
        "certificate": max((one.certificate.worst for one in results), default=np.inf),
        "failures": our_failures,
        "snes_solved": len(iterations),
        "snes_iterations": sum(iterations),
        "snes_factorisations": plain.factors,
        "snes_failures": their_failures,
        "ratio": sum(our_seconds[:both]) / sum(their_seconds[:both]) if both else np.nan,
        "difference": COMM.allreduce(float(off), op=MPI.MAX) / DOWN,
    }


def main(arguments: list[str] | None = None) -> int:
    """Print the measurements, and write the rows if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--cells", type=int, nargs="+", default=[16, 32, 64], help="squares across the block"
    )
    parser.add_argument(
        "--steps", type=float, nargs="+", default=[0.1, 0.2], help="how far the top moves in a step"
    )
    parser.add_argument("--json", type=Path, help="file for the rows")
    given = parser.parse_args(arguments)
    # answers that are no minima are looked for
    logging.getLogger("vi_contact").setLevel(logging.ERROR)
    rows = []
    # the forms are compiled here
    vi.solve((first := block(COMM, 2)).F, first.u, lower=first.floor, bcs=[first.bc])
    if COMM.rank == 0:
        print(
            "cells  step | vi.solve: solved, Newton, linear, certificate | SNES: solved, factors | "
            "time ratio"
        )
    for cells in given.cells:
        for step in given.steps:
            one = row(cells, step)
            rows.append(one)
            if COMM.rank == 0:
                print(
                    f"{cells:>5} {step:>5} | {one['solved']:>4} {one['iterations']:>4} "
                    f"{one['linear']:>4} {one['certificate']:.0e} | {one['snes_solved']:>4} "
                    f"{one['snes_factorisations']:>4} | {one['ratio']:.2f}",
                    flush=True,
                )
    if COMM.rank == 0 and given.json:
        given.json.write_text(json.dumps({"rows": rows}, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
