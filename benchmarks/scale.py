#!/usr/bin/env python3
"""Measure what a contact step in three dimensions costs without any factor.

The unit of cost is a product with the matrix of the step.

    python3 benchmarks/scale.py [--sizes 6e4 1e6] [--json FILE]
    mpirun -n 2 python3 benchmarks/scale.py --sizes 2e5

The body is a block of two layers, the upper one ten times stiffer, on a wavy rigid plane; all of
its lower face may touch. Some steps are those of the thrown block with the default scheme at
Courant numbers C = c_p dt / h of 1 and 10, after a common history at C = 10. Others, at C = 100 and
in statics, are those of a block at rest whose top is pushed down slowly. The plain linear problem
is solved for the same steps: with the same A, load, tolerance, preconditioner and guess, and
without contact.

Times are processor time of the busiest rank. ``flops`` are its operations in a step, as PETSc
counts them; they show how ranks share the work, whatever else the machine does. A product is one
with A as AIJ, timed in the same run. ``peak_bytes`` includes set-up. ``bytes_per_unknown`` is the
memory while stepping (Linux), with mesh, M, K and A, and without the memory that Python and its
libraries take before the first mesh. On small blocks the condensed route stands beside it.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import dolfinx  # noqa: E402
import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core.verify import kkt_residual  # noqa: E402
from vi_contact.fem.mesh.communicators import give_back, keep_communicator  # noqa: E402

COMM = MPI.COMM_WORLD
NU, CONTRAST, WEIGHT = 0.3, 10.0, 0.02  # E and rho of the lower layer are 1
# of P waves in the upper layer
SPEED = float(np.sqrt(CONTRAST * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))))
COURANTS = (1.0, 10.0)
FAR = 100.0
PUSH = 5e-4  # of the top in a step at C = 100 and in a static one
# unknowns beyond which only C = 10 is run, on tetrahedra: what a machine of one person carries
LARGE = 5e5
SMALL = (2e3, 1.5e4)  # blocks for the condensed route
ELEMENTS = {"hexahedra": "hexahedron", "tetrahedra": "tetrahedron"}


def busiest(seconds: float) -> float:
    """Return the largest value of all ranks [s]."""
    return float(COMM.allreduce(seconds, op=MPI.MAX))


class Memory:
    """Hold the largest resident memory of all ranks together since the last ``forget`` [bytes].

    It is zero where the system does not tell it. ``bare``: what Python and its libraries take
    before there is any mesh.
    """

    def __init__(self) -> None:
        self.bare = self.peak()

    def forget(self) -> None:
        """Free what nobody holds, and begin a new largest value."""
        gc.collect()
        give_back(keep_communicator(COMM))
        with suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")

    def peak(self) -> float:
        """Return the largest value [bytes], VmHWM of Linux, summed over the ranks."""
        try:
            lines = Path("/proc/self/status").read_text().splitlines()
        except OSError:
            return 0.0
        here = next(float(line.split()[1]) * 1024.0 for line in lines if line.startswith("VmHWM"))
        return float(COMM.allreduce(here))


MEMORY = Memory()


@dataclass(frozen=True)
class Block:
    """Hold a problem and the size of its cells [m]."""

    problem: vc.ContactProblem
    h: float
    element: str

    @property
    def mu(self) -> float:
        """Return Coulomb's coefficient, 0 without friction."""
        return float(getattr(self.problem.friction, "mu", 0.0))

    def rubbing(self, mu: float) -> Block:
        """Return the block with Coulomb friction of this coefficient."""
        return replace(self, problem=replace(self.problem, friction=vc.Coulomb(mu)))

    @property
    def unknowns(self) -> int:
        """Return the number of unknowns of the system on all ranks."""
        return int(self.problem.system.space.unknowns)

    def dt(self, courant: float) -> float:
        """Return the time step [s] of a Courant number, C h / c_P."""
        return courant * self.h / SPEED


def wavy(x: Any) -> Any:
    """Return the gap of the wavy plane below the face [m]."""
    waves = 1.0 - np.cos(12.0 * np.pi * x[:, 0]) * np.cos(10.0 * np.pi * x[:, 1])
    return 2e-2 * ((x[:, 0] - 0.5) ** 2 + (x[:, 1] - 0.45) ** 2) + 4e-3 * waves


def divisions(unknowns: float, dimension: int) -> tuple[int, ...]:
    """Return the cells along the axes of a flat block with about so many unknowns."""
    n = (
        round((2.75 * unknowns) ** (1.0 / 3.0))
        if dimension == 3
        else round((2.0 * unknowns) ** 0.5)
    )
    high = max(round(n / 8.5), 2) if dimension == 3 else max(n // 4, 2)
    return (n,) * (dimension - 1) + (high,)


def box(cells: tuple[int, ...], element: str) -> Any:
    """Return the mesh, built on all ranks together."""
    top = [1.0] * (len(cells) - 1) + [cells[-1] / cells[0]]
    ghosts = dolfinx.mesh.GhostMode.shared_facet
    corners = [np.zeros(len(cells)), np.array(top)]
    kind = getattr(dolfinx.mesh.CellType, element)
    make = dolfinx.mesh.create_box if len(cells) == 3 else dolfinx.mesh.create_rectangle
    return make(COMM, corners, list(cells), kind, ghost_mode=ghosts)


def block(unknowns: float, element: str, *, pushed: bool = False, dimension: int = 3) -> Block:
    """Return the block, thrown, or at rest with its top pushed down slowly."""
    cells = divisions(unknowns, dimension)
    kind = (
        ELEMENTS[element]
        if dimension == 3
        else {"hexahedra": "quadrilateral", "tetrahedra": "triangle"}[element]
    )
    mesh = box(cells, kind)
    up = dimension - 1
    h = 1.0 / cells[0]
    height = cells[-1] * h

    def face(name: str, z: float) -> Any:
        found = dolfinx.mesh.locate_entities_boundary(
            mesh, up, lambda x: np.abs(x[up] - z) < 0.1 * h
        )
        return fem.Facets(name, found, mesh)

    def layer(name: str, low: float, high: float) -> Any:
        index_map = mesh.topology.index_map(mesh.topology.dim)
        every = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
        middle = dolfinx.mesh.compute_midpoints(mesh, mesh.topology.dim, every)[:, up]
        return fem.Cells(name, np.flatnonzero((middle >= low) & (middle < high)), mesh)

    halves = 0.5 * height
    soft, hard = (vc.LinearElastic(E=E, nu=NU, rho=1.0) for E in (1.0, CONTRAST))
    materials = [(layer("soft", -1.0, halves), soft), (layer("hard", halves, 2.0), hard)]
    side = np.eye(dimension)[0]
    tilt = np.eye(dimension)[up]
    speed = -PUSH / (FAR * h / SPEED) * tilt
    held = fem.Prescribed(
        face("top", height), lambda x, t: np.tile(speed * t, (len(x), 1)), tuple(speed)
    )
    system = fem.assemble(
        mesh,
        materials,
        prescribed=held if pushed else (),
        loads=fem.BodyForce(tuple(-WEIGHT * tilt)),
        initial_velocity=None
        if pushed
        else lambda x: np.outer(0.01 * x[:, 0] - 0.025, tilt) + 0.01 * side,
    )
    surface = fem.contact_surface(system, face("bottom", 0.0), obstacle=vc.AnalyticGap(wavy))
    return Block(vc.ContactProblem(system, surface), h, element)


class Watched:
    """Solve steps with another solver, and remember what it prepared and solved.

    The last steps are kept, with the processor time [s] that they took.
    """

    def __init__(self, solver: Any) -> None:
        self.solver = solver
        self.check = solver.check
        self.prepared: Any = None
        self.setup = 0.0
        self.rows: list[dict[str, float]] = []
        self.last: list[Any] = []

    def prepare(self, *given: Any) -> Watched:
        """Prepare the solver, and keep the processor time [s] of it as ``setup``."""
        start = time.process_time()
        self.prepared = self.solver.prepare(*given)
        self.setup = time.process_time() - start
        return self

    def solve(self, step: Any) -> Any:
        """Solve a step, and add a row of its seconds, operations, iterations and counts."""
        before = self.counts()
        operations = PETSc.Log.getFlops()
        start = time.process_time()
        result = self.prepared.solve(step)
        spent = busiest(time.process_time() - start)
        flops = busiest(PETSc.Log.getFlops() - operations)
        counts = {key: value - before[key] for key, value in self.counts().items()}
        self.rows.append(
            {"seconds": spent, "flops": flops, "iterations": result.iterations, **counts}
        )
        self.last = [*self.last[-1:], step]
        return result

    def counts(self) -> dict[str, float]:
        """Return iterations, products and renewals so far, all 0 of a solver that counts none."""
        work = getattr(self.prepared, "work", None)
        return {
            name: getattr(work, name, 0) for name in ("linear_iterations", "products", "renewals")
        }


def product_seconds(A: Any) -> float:
    """Return the processor time [s] of one product with A as it was assembled."""
    mat = A.matrix.mat
    x, y = mat.createVecs()
    x.set(1.0)
    best = np.inf
    for _ in range(5):
        start = time.process_time()
        for _ in range(3):
            mat.mult(x, y)
        best = min(best, (time.process_time() - start) / 3.0)
    return busiest(best)


def linear_iterations(watched: Watched) -> float | None:
    """Return the mean iterations of the same steps without contact: the plain linear problem."""
    if not hasattr(watched.prepared, "work") or watched.last[0].slip0 is not None:
        return None
    before = watched.counts()["linear_iterations"]
    for step in watched.last:
        watched.prepared.solve(replace(step, bound=np.full_like(step.bound, np.inf)))
    return float(watched.counts()["linear_iterations"] - before) / len(watched.last)


def history(given: Block) -> vc.State:
    """Return the state after the steps at C = 10 that bring the block well into contact."""
    steps = max(3, round(0.25 / given.dt(10.0)))
    solver = vc.Iterative("icc", tolerance=1e-7)
    marched = vc.march(given.problem, solver=solver, dt=given.dt(10.0), steps=steps, tolerance=1e-6)
    return deque((state for state, _ in marched), maxlen=1)[0]


def dynamic(
    given: Block, state: vc.State | None, courant: float, solver: Any, steps: int, warm: int
) -> dict[str, Any]:
    """Return a row of steps from a state, of which the first ``warm`` do not count."""
    watched = Watched(solver)
    worst = 0.0
    closed = []
    dt = given.dt(courant)
    for _, report in vc.march(
        given.problem, solver=watched, dt=dt, steps=warm + steps, state=state
    ):
        worst = max(worst, report.certificate.worst)
        closed.append(float(COMM.allreduce(int(report.new.active.sum()))))
        if len(closed) == warm:
            watched.rows.clear()
            MEMORY.forget()
    return row(given, watched, courant, worst, float(np.mean(closed[warm:])), report.step.A)


def static(given: Block, solver: Any, steps: int) -> dict[str, Any]:
    """Return a row of static steps: the weight grows, each step starts from the one before."""
    problem = given.problem
    watched = Watched(solver)
    worst = 0.0
    equations, surface = problem.equations, problem.surface
    A = equations.effective(m=0.0, c=0.0, k=1.0)
    watched.prepare(A, surface, 1.0)
    x = np.zeros(equations.rows)
    active = np.zeros(len(surface.gap0), dtype=bool)
    closed = []
    for k in range(steps + 1):
        load = equations.load((k + 4) * given.dt(FAR))
        step = vc.StepProblem(A, load, surface.gap0, surface, 1.0, x, active, 0.0, k)
        result = watched.solve(step)
        worst = max(worst, kkt_residual(step, result).worst)
        x, active = result.x, result.active
        closed.append(float(COMM.allreduce(int(active.sum()))))
    del watched.rows[0]
    return row(given, watched, None, worst, float(np.mean(closed[1:])), A)


def row(
    given: Block, watched: Watched, courant: float | None, worst: float, closed: float, A: Any
) -> dict[str, Any]:
    """Return what the table shows of the steps that ``watched`` solved, as means of a step."""
    resident = MEMORY.peak()
    product = product_seconds(A)
    solver = watched.solver
    linear = linear_iterations(watched)
    mean = {key: float(np.mean([one[key] for one in watched.rows])) for key in watched.rows[0]}
    own = hasattr(watched.prepared, "work")
    return {
        "unknowns": given.unknowns,
        "points": int(COMM.allreduce(len(given.problem.surface.owned))),
        "closed": closed,
        "dimension": int(given.problem.system.space.dimension),
        "element": given.element,
        "courant": courant,
        "friction": type(given.problem.friction).__name__ if given.mu else None,
        "mu": given.mu,
        "method": type(solver).__name__,
        "preconditioner": watched.prepared.kind if own else None,
        "iterations": mean["iterations"],
        "linear_iterations": mean["linear_iterations"] if own else None,
        "newton_steps": mean["iterations"] if given.mu else 0.0,
        "products": mean["products"] if own else None,
        "renewals": mean["renewals"],
        "largest_renewals": max(one["renewals"] for one in watched.rows),
        "cpu_products": mean["seconds"] / product,
        "setup_products": busiest(watched.setup) / product,
        "seconds": mean["seconds"],
        "flops": mean["flops"],
        "product_seconds": product,
        "over_linear": None if not linear else mean["linear_iterations"] / linear,
        "peak_bytes": resident,
        "bytes_per_unknown": (resident - MEMORY.bare) / given.unknowns,
        "certificate": worst,
        "ranks": COMM.size,
    }


def rows_of(size: float, steps: int) -> Iterator[dict[str, Any]]:
    """Yield all rows of one size: elements, Courant numbers, friction and statics."""
    for element in ("tetrahedra",) if size > LARGE else ELEMENTS:
        MEMORY.forget()
        given = block(size, element)
        state = history(given)
        set_up = MEMORY.peak()
        for courant in (10.0,) if size > LARGE else COURANTS:
            yield dynamic(given, state, courant, vc.Iterative(), steps, 2) | {"peak_bytes": set_up}
        for mu in (0.3, 0.8):
            yield dynamic(given.rubbing(mu), state, 10.0, vc.Iterative(), steps, 2) | {
                "peak_bytes": set_up
            }
        if size <= LARGE:
            del given, state
            MEMORY.forget()
            given = block(size, element, pushed=True)
            yield dynamic(given, None, FAR, vc.Iterative(), steps, 6)
            yield static(given, vc.Iterative(), 4)
            del given


def small_rows(steps: int) -> Iterator[dict[str, Any]]:
    """Yield rows of the condensed and of the iterative route side by side."""
    for dimension in (2, 3):
        for size in SMALL:
            given = block(size, "tetrahedra", dimension=dimension)
            state = history(given)
            for courant in COURANTS:
                for solver in (vc.Condensed(), vc.Iterative()):
                    yield dynamic(given, state, courant, solver, steps, 2)


SHOWN = (
    "unknowns",
    "points",
    "closed",
    "element",
    "courant",
    "mu",
    "method",
    "preconditioner",
    "iterations",
    "linear_iterations",
    "over_linear",
    "products",
    "renewals",
    "cpu_products",
    "setup_products",
    "seconds",
    "flops",
    "bytes_per_unknown",
    "certificate",
)


def told(found: dict[str, Any]) -> str:
    """Return a row as text, with a dash for what it does not have."""

    def text(value: Any) -> str:
        return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

    return "  ".join(f"{text(found[key]):>10}" for key in SHOWN)


def main() -> None:
    """Print a row for each run as soon as it is done, and write all of them with --json."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--sizes", type=float, nargs="+", default=[6e4], help="numbers of unknowns, about"
    )
    parser.add_argument("--steps", type=int, default=4, help="number of steps in a row")
    parser.add_argument("--no-small", action="store_true", help="leave out the condensed route")
    parser.add_argument("--json", type=Path, help="file for all numbers")
    options = parser.parse_args()
    found: list[dict[str, Any]] = []
    if COMM.rank == 0:
        print("  ".join(f"{key[:10]:>10}" for key in SHOWN), flush=True)
    parts = [rows_of(size, options.steps) for size in options.sizes]
    for part in parts if options.no_small else [*parts, small_rows(options.steps)]:
        for one in part:
            found.append(one)
            if COMM.rank == 0:
                print(told(one), flush=True)
                if options.json:
                    options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
