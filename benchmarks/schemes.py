#!/usr/bin/env python3
"""Measure what time schemes do in an impact, against exact solutions, and what a step costs.

    python3 benchmarks/schemes.py [--elements 100] [--bounces 20] [--blocks 2e3 2e4] [--no-bars]
        [--json FILE]

There are two tables, in the form of docs/guide/schemes.md:

* the bars (1D elements): the largest error of the contact force of a bar that is thrown at a wall,
  in the window 0.6 < t < 1.067; the energy of a bouncing bar after 1, 4 and 20 bounces over the
  exact 1/8; and the L2 error of its contact force over four bounces. The force is the one that a
  scheme reports: end value or mean of the step;
* the block: a unit square in plane strain is thrown at 1 m/s on the ground, in 400 steps of 1 ms.
  The columns are energy and mean speed at the end, the largest force, and the time of a step over
  that of the plain linear step with the same matrix, which is timed beside it.
"""

from __future__ import annotations

import argparse
import json
import logging
import math
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

import vi_contact as vc  # noqa: E402
from demos.parts.problems.bar import Bar, build  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core.stage import complete, pose  # noqa: E402
from vi_contact.exact.bar import PeriodicBar, ThrownBar  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402

CONSISTENT = vc.ConsistentMass()
SCHEMES: dict[str, tuple[Any, Any]] = {  # name -> scheme, mass (None: the scheme's own choice)
    "Trapezoidal (default)": (vc.Trapezoidal(), None),
    "Newmark(¼, ½)": (vc.Newmark(), None),
    "HHT(-0.1)": (vc.HHT(-0.1), None),
    "GeneralisedAlpha, rho 0.8": (vc.GeneralisedAlpha.spectral_radius(0.8), None),
    "Houbolt": (vc.Houbolt(), None),
    "ContactStabilisedNewmark": (vc.ContactStabilisedNewmark(), None),
    "Midpoint, ZWT(½), SS22, Kane": (vc.Midpoint(), None),
    "ZWT(0.6)": (vc.ZienkiewiczWoodTaylor(phi=0.6), None),
    "MoreauJean(½), e = 0": (vc.MoreauJean(), None),
    "MoreauJean(½), e = 1": (vc.MoreauJean(e=1.0), None),
    "Newmark(¼, ½), consistent mass": (vc.Newmark(), CONSISTENT),
    "HHT(-0.1), consistent mass": (vc.HHT(-0.1), CONSISTENT),
}


def march(problem: Any, scheme: Any, dt: float, steps: int) -> Any:
    """Take steps with the condensed solver."""
    return vc.march(problem, scheme=scheme, solver=vc.Condensed(), dt=dt, steps=steps)


def energy(report: Any) -> float:
    """Return the kinetic and strain energy after a step [J]."""
    system = report.problem.equations
    return float(system.kinetic_energy(report.new.v) + system.strain_energy(report.new.u))


def force(one: Any) -> float:
    """Return the contact force of all ranks [N], of a state or a mean of a step."""
    return float(MPI.COMM_WORLD.allreduce(one.r_n.sum()))


def oscillation(elements: int, courant: float, scheme: Any, mass: Any) -> float:
    """Return max |p/300 - 1| of the thrown bar over 0.6 < t < 1.067."""
    bar = Bar(ThrownBar(), elements=elements)
    dt = bar.time_step(courant)
    worst = 0.0
    for state, _ in march(
        build(bar, MPI.COMM_WORLD).problem(mass=mass), scheme, dt, int(1.067 / dt)
    ):
        if 0.6 < state.t < 1.067:
            worst = max(worst, abs(force(state) / bar.section / 300.0 - 1.0))
    return worst


def bounces(elements: int, courant: float, count: int, scheme: Any, mass: Any) -> dict[str, Any]:
    """Return the energies of the bouncing bar after 1, 4 and ``count`` bounces over 1/8.

    Beside them are the relative L2 error of the force of four bounces, and its largest force over
    the exact one.
    """
    bar = Bar(PeriodicBar(), elements=elements)
    dt = bar.time_step(courant)
    per_bounce = round(3.0 / dt)
    problem = build(bar, MPI.COMM_WORLD).problem(mass=mass)
    energies = []
    error = 0.0
    size = 0.0
    peak = 0.0
    for k, (state, report) in enumerate(march(problem, scheme, dt, count * per_bounce), start=1):
        if k <= 4 * per_bounce:
            exact = float(bar.case.force(state.t - 0.5 * dt))
            error = error + (force(report.balance) - exact) ** 2
            size = size + exact**2
            peak = max(peak, force(state) / 0.5)
        if k % per_bounce == 0:
            energies.append(energy(report) / 0.125)
            if energies[-1] > 1e4:
                break
    found = {n: energies[n - 1] if len(energies) >= n else math.inf for n in (1, 4, count)}
    return {"energies": list(found.values()), "force_error": math.sqrt(error / size), "peak": peak}


def linear_step(report: Any, scheme: Any, dt: float) -> float:
    """Return the seconds of the plain linear step with the same matrix from the same state."""
    problem = report.problem
    old = report.old
    A = report.step.A
    none = np.zeros(problem.surface.count)
    begin = time.perf_counter()
    stage = scheme.stage(problem, old, dt)
    step = pose(problem, stage, A)
    result = vc.StepResult(A.factor.solve(step.b), none, none > 0.0, 0, "linear")
    scheme.finish(problem, old, stage, complete(stage, step, result), dt)
    return time.perf_counter() - begin


def block(
    unknowns: float, scheme: Any, mass: Any, *, steps: int = 400, dt: float = 1e-3
) -> dict[str, float]:
    """Throw the unit square: E = 1000, nu = 0.3, rho = 1, gap 0.05, speed 1."""
    n = round(math.sqrt(unknowns / 2.0)) - 1
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(n, n)), MPI.COMM_WORLD)
    rubber = vc.LinearElastic(E=1000.0, nu=0.3, rho=1.0)
    system = fem.assemble(mesh, rubber, section=vc.PlaneStrain(), initial_velocity=(0.0, -1.0))
    ground = vc.HalfSpace(point=(0.0, -0.05), normal=(0.0, 1.0))
    problem = vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"], obstacle=ground), mass=mass
    )
    largest = 0.0
    seconds = []
    linear = []
    worst = 0.0
    flight = None
    loop = iter(march(problem, scheme, dt, steps))
    for _ in range(steps):
        begin = time.perf_counter()
        state, report = next(loop)
        spent = time.perf_counter() - begin
        # linear steps start from it: no scheme has anything to do for contact there
        flight = flight or report
        largest = max(largest, force(state))
        worst = max(worst, report.certificate.worst)
        if problem.surface.some(state.active):
            seconds.append(spent)
            linear.append(linear_step(flight, scheme, dt))
    equations = report.problem.equations
    up = equations.influence[:, 1]
    return {
        "unknowns": len(state.u),
        "energy": energy(report) / 0.5,
        "speed": float(up @ (equations.M @ state.v)),
        "force": largest,
        "ms": 1e3 * float(np.median(seconds)),
        "ratio": float(np.median(seconds) / np.median(linear)),
        "certificate": worst,
    }


def number(value: float) -> str:
    """Return four digits, or "> 10⁴" for what has left the scale."""
    return "> 10⁴" if value > 1e4 else f"{value:.4g}" if value >= 10 else f"{value:.3f}"


def bar_row(elements: int, count: int, scheme: Any, mass: Any) -> dict[str, Any]:
    """Return a scheme's row of the first table, for Courant numbers 1, ½ and 0.1."""
    return {
        str(courant): {"oscillation": oscillation(elements, courant, scheme, mass)}
        | bounces(elements, courant, count if courant >= 0.5 else 4, scheme, mass)
        for courant in (1.0, 0.5, 0.1)
    }


def print_bars(rows: dict[str, Any], count: int) -> None:
    """Print the table of the bars, with three energies where 20 bounces were run."""
    print(
        f"| scheme | Courant | force error in the window | energy after 1, 4, {count} bounces | "
        "L2 error of the force | largest force |\n|---|---|---|---|---|---|"
    )
    for name, row in rows.items():
        for courant, found in row.items():
            energies = ", ".join(
                number(e) for e in found["energies"][: 3 if courant != "0.1" else 2]
            )
            print(
                f"| {name} | {courant} | {found['oscillation']:.1e} | {energies} | "
                f"{found['force_error']:.2f} | {number(found['peak'])} |",
                flush=True,
            )


def print_blocks(rows: dict[str, Any]) -> None:
    """Print the table of the blocks, with the cost of a step over a linear one."""
    print(
        "| scheme | unknowns | energy | mean speed | largest force | ms per step | over a linear "
        "step |\n"
        "|---|---|---|---|---|---|---|"
    )
    for name, row in rows.items():
        for found in row:
            print(
                f"| {name} | {found['unknowns']} | {number(found['energy'])} | "
                f"{found['speed']:.3f} | {number(found['force'])} | {found['ms']:.2f} | "
                f"{found['ratio']:.1f} |",
                flush=True,
            )


def main() -> None:
    """Print both tables, and write them with --json."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--elements", type=int, default=100)
    parser.add_argument("--bounces", type=int, default=20)
    parser.add_argument("--no-bars", action="store_true", help="only the blocks")
    parser.add_argument("--blocks", type=float, nargs="*", default=[2e3, 2e4])
    parser.add_argument("--only", help="schemes whose name contains this")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    logging.getLogger("vi_contact").setLevel(logging.ERROR)
    chosen = {
        name: pair for name, pair in SCHEMES.items() if not options.only or options.only in name
    }
    bars = (
        {}
        if options.no_bars
        else {n: bar_row(options.elements, options.bounces, *s) for n, s in chosen.items()}
    )
    print_bars(bars, options.bounces)
    blocks = {
        name: [block(size, *pair) for size in options.blocks] for name, pair in chosen.items()
    }
    print()
    print_blocks(blocks)
    if options.json:
        options.json.write_text(
            json.dumps({"bars": bars, "blocks": blocks}, indent=1), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
