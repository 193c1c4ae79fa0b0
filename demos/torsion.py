#!/usr/bin/env python3
"""Twist an elastic-plastic bar.

Find a stress function between bounds on a disk (known exactly) and on a square.

The yield condition |∇u| <= k is, for a bar without holes, the obstacle |u| <= k times the distance
to the boundary. Where u lies on the obstacle the bar is plastic. On the disk the plastic zone and
the torque are known for every twist. On the square the elastic bar and the limit torque are known,
and one twist is computed again by another method, projected relaxation of finite differences.

    bash demos/run.sh torsion                # a table and a figure, into results/torsion
    bash demos/run.sh -n 2 torsion           # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from demos.parts.exact.torsion import (
    DISK_LIMIT,
    SQUARE_LIMIT,
    disk_function,
    disk_torque,
    square_elastic,
)
from demos.parts.pictures.bounds import gathered, plot_torsion
from vi_contact import vi
from vi_contact.fem import compat
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
CELLS = 64  # along a side, or a diameter
TWISTS = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0)  # G theta a / k
DRAWN = 2.0
OUT = Path("results/torsion")


def section(comm: Any, cells: int, disk: bool) -> Any:
    """Return a mesh of the square (-1, 1)², or of the disk.

    It becomes the disk when squares around 0 are made circles.
    """
    kind = dolfinx.mesh.DiagonalType.crossed if disk else dolfinx.mesh.DiagonalType.right
    on = dolfinx.mesh.create_rectangle(comm, [[-1, -1], [1, 1]], [cells, cells], diagonal=kind)
    if disk:
        x = on.geometry.x
        size = np.max(np.abs(x[:, :2]), axis=1)
        x[:, :2] *= (size / np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300))[:, None]
    return on


def distance(x: Any, disk: bool) -> Any:
    """Return the distance to the boundary."""
    return np.maximum(
        1.0 - (np.hypot(x[0], x[1]) if disk else np.maximum(np.abs(x[0]), np.abs(x[1]))), 0.0
    )


class Bar:
    """Hold the problem of one section; ``twist`` solves it."""

    def __init__(self, comm: Any, cells: int, disk: bool) -> None:
        on = section(comm, cells, disk)
        self.comm = comm
        V = compat.lagrange(on, 1)
        self.u, self.upper, self.lower = (dolfinx.fem.Function(V) for _ in range(3))
        self.upper.interpolate(lambda x: distance(x, disk))
        self.lower.x.array[:] = -self.upper.x.array
        edge = dolfinx.mesh.locate_entities_boundary(on, 1, lambda x: np.full(x.shape[1], True))
        zero = dolfinx.fem.Function(V)
        bc = dolfinx.fem.dirichletbc(zero, dolfinx.fem.locate_dofs_topological(V, 1, edge))
        self.w = dolfinx.fem.Constant(on, 0.0)
        v = ufl.TestFunction(V)
        F = ufl.inner(ufl.grad(self.u), ufl.grad(v)) * ufl.dx - 2.0 * self.w * v * ufl.dx
        self.problem = vi.Problem(F, self.u, bcs=[bc])
        self.volume = compat.compile_form(2.0 * self.u * ufl.dx)

    def twist(self, w: float) -> tuple[float, Any]:
        """Return the torque and the result of the problem, which begins with what is in u."""
        self.w.value = w
        result = self.problem.solve(lower=self.lower, upper=self.upper)
        return float(self.comm.allreduce(dolfinx.fem.assemble_scalar(self.volume))), result


def relaxed(cells: int, w: float, sweeps: int = 4000) -> Any:
    """Return u at the nodes (cells + 1)² of the square.

    It uses projected over-relaxation of five-point differences.
    """
    h = 2.0 / cells
    omega = 2.0 / (1.0 + np.sin(np.pi / cells))
    line = np.linspace(-1.0, 1.0, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    bound = distance((x, y), disk=False)
    u = np.zeros_like(x)
    i, j = np.indices(x.shape)
    inner = (np.abs(x) < 1.0 - 0.5 * h) & (np.abs(y) < 1.0 - 0.5 * h)
    for _ in range(sweeps):
        before = u.copy()
        for colour in (0, 1):
            mean = np.zeros_like(u)
            mean[1:-1, 1:-1] = 0.25 * (
                u[2:, 1:-1] + u[:-2, 1:-1] + u[1:-1, 2:] + u[1:-1, :-2] + 2.0 * w * h**2
            )
            here = inner & ((i + j) % 2 == colour)
            u[here] = np.clip(u + omega * (mean - u), -bound, bound)[here]
        if np.max(np.abs(u - before)) < 1e-13:
            break
    return u


def main(quick: bool = False, out: Path = OUT) -> dict[str, float]:
    """Twist both bars (``quick``: on a quarter of the cells).

    It returns torques, zones and their errors.
    """
    comm = MPI.COMM_WORLD
    cells = CELLS // 2 if quick else CELLS
    numbers = {}
    fields = {}
    torques: dict[str, list[float]] = {}
    for name, disk in (("disk", True), ("square", False)):
        bar = Bar(comm, cells, disk)
        for w in TWISTS:
            torque, result = bar.twist(w)
            torques.setdefault(name, []).append(torque)
            n = len(bar.u.x.array) - bar.u.function_space.dofmap.index_map.num_ghosts
            points = bar.u.function_space.tabulate_dof_coordinates()[:n]
            plastic = result.lambda_upper.x.array[:n] > 0.0
            numbers[f"{name} {w:g}: torque"] = torque
            numbers[f"{name} {w:g}: plastic"] = float(result.active[1])
            numbers[f"{name} {w:g}: certificate"] = result.certificate.worst
            if disk:
                r = np.hypot(points[:, 0], points[:, 1])
                off = float(np.max(np.abs(bar.u.x.array[:n] - disk_function(w, r)), initial=0.0))
                inside = -float(np.min(r[plastic], initial=2.0))
                numbers[f"disk {w:g}: error"] = comm.allreduce(off, op=MPI.MAX)
                numbers[f"disk {w:g}: plastic from"] = -comm.allreduce(inside, op=MPI.MAX)
            if w == DRAWN:
                values, push = gathered(bar.u), gathered(result.lambda_upper)
                if values is not None and push is not None:
                    fields[f"{name}, twist {w:g}"] = (*values, push[1] > 0.0)
                    if not disk:
                        numbers["relaxation"] = against_relaxation(*values, cells, w)
    numbers["relaxation"] = comm.bcast(numbers.get("relaxation"))
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        w = np.linspace(0.0, max(TWISTS), 200)
        elastic, _ = square_elastic()
        early = w[w < 1.0]
        plot_torsion(
            fields,
            {
                "disk, exact": (w, disk_torque(w) / DISK_LIMIT),
                "disk, computed": (TWISTS, np.array(torques["disk"]) / DISK_LIMIT),
                "square, computed": (TWISTS, np.array(torques["square"]) / SQUARE_LIMIT),
                "square, elastic": (early, elastic * early / SQUARE_LIMIT),
            },
            out / "torsion.png",
        )
        print(table(numbers))
        print(f"\nThe figure is in {out}.")
    comm.Barrier()
    return numbers


def against_relaxation(points: Any, values: Any, cells: int, w: float) -> float:
    """Return the largest difference of u on the square from finite differences.

    On these triangles they are the same equations.
    """
    nodes = np.rint((points[:, :2] + 1.0) * 0.5 * cells).astype(int)
    return float(np.max(np.abs(values - relaxed(cells, w)[nodes[:, 0], nodes[:, 1]])))


def table(numbers: dict[str, float]) -> str:
    """Return torques beside the known ones."""
    lines = [
        f"{'twist':>6} {'disk: torque':>13} {'exact':>9} {'error of u':>11} {'plastic from':>13} "
        f"{'exact':>7} {'square: torque':>15} {'elastic':>9} {'limit':>7}"
    ]
    for w in TWISTS:
        torque, error, inner = (
            numbers[f"disk {w:g}: {name}"] for name in ("torque", "error", "plastic from")
        )
        zone = f"{inner:.4f}" if inner < 2.0 else "none"
        lines.append(
            f"{w:>6g} {torque:>13.5f} {float(disk_torque(w)):>9.5f} {error:>11.1e} {zone:>13} "
            f"{1.0 / w:>7.4f} {numbers[f'square {w:g}: torque']:>15.5f} "
            f"{square_elastic()[0] * w:>9.5f} {SQUARE_LIMIT:>7.4f}"
        )
    lines += [
        "",
        f"square at {DRAWN:g}, difference from projected relaxation: {numbers['relaxation']:.1e} "
        "of k a",
    ]
    return "\n".join(lines)


# Things to try: CELLS = 128; a twist of 20, where the bar is plastic but for its ridges.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
