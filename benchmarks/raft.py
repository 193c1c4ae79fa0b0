#!/usr/bin/env python3
"""Measure what the building on a raft of demos/raft.py costs, and what halving h and dt changes.

    python3 benchmarks/raft.py                              # costs at 2e4 and 1e5 unknowns
    python3 benchmarks/raft.py --sizes 2e4 1e5 3e5 --steps 8    # the table of the guide
    python3 benchmarks/raft.py --sizes 2e4 1e5 --iterative  # the same steps without any factor
    python3 benchmarks/raft.py --sizes 1e6 --steps 2 --iterative --no-gravity
    python3 benchmarks/raft.py --halving                    # runs of 5 s on three meshes
    python3 benchmarks/raft.py --json raft.json             # all of it as a file too

The table of the guide takes seven minutes and 7 GB; --halving also has three time steps. Costs are
seconds of processor time of rank 0: of the stages of set-up, of the first step, which prepares its
solver, and the mean of those after it. For them the building starts from its rest with a rocking
velocity about x and y, which lifts half of the raft at once: contact sets change from step to step,
and no earthquake has to arrive first.
"""

from __future__ import annotations

import json
import os
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import process_time
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos import raft  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402

COMM = MPI.COMM_WORLD
ROCKING = np.array([0.03, -0.04, 0.0])  # rad/s
# of CELLS, dt [s]
HALVED = [(1.4, 5e-3), (0.7, 5e-3), (0.35, 5e-3), (0.7, 1e-2), (0.7, 2.5e-3), (0.7, 1.25e-3)]


class Timer:
    """Hold the processor time of every stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def __call__(self, stage: str, work: Callable[..., Any], *given: Any) -> Any:
        """Return what the work returns, and keep its time."""
        begin = process_time()
        found = work(*given)
        self.seconds[stage] = process_time() - begin
        if COMM.rank == 0:
            print(f"  {stage:<42} {self.seconds[stage]:.4g}", flush=True)
        return found


def cost(
    finer: float, steps: int, solver: vc.Condensed | vc.Iterative, gravity: bool
) -> dict[str, Any]:
    """Return what set-up and steps of one mesh cost.

    Without ``gravity`` its stage is left out, and the weight falls on bodies without stresses.
    """
    timer = Timer()
    mesh, tags = timer("mesh", raft.meshed, finer, COMM)
    static, problem = timer("assembling, contact", raft.problems, mesh, tags)
    state = initial_state(problem)
    if gravity:
        state = timer("gravity", partial(vc.static_equilibrium, static, solver=vc.Condensed()))
        problem, state = timer("release", fem.release, static, state, problem)
    del static
    marching = vc.march(
        problem, dt=raft.DT, steps=steps, state=thrown(problem, state), solver=solver
    )
    surface = problem.surface
    begin = process_time()
    stamps = [begin]
    open_shares = []
    changes = []
    iterations = []
    worst = 0.0
    method = ""
    for new, report in marching:
        stamps.append(process_time())
        if COMM.rank == 0:
            print(f"  step to t = {new.t:<29.4g} {stamps[-1] - stamps[-2]:.4g}", flush=True)
        closed = surface.everywhere(new.active)
        before = surface.everywhere(report.old.active)
        open_shares.append(1.0 - closed.mean())
        changes.append(int(np.sum(closed != before)))
        iterations.append(report.result.iterations)
        worst = max(worst, report.certificate.worst)
        method = report.result.method
    each = np.diff(stamps)
    return {
        "factor": finer,
        "unknowns": round(COMM.allreduce(problem.system.rows)),
        "points": surface.total,
        "method": method,
        **timer.seconds,
        "first step": float(each[0]),
        "step": float(each[1:].mean()),
        "iterations": float(np.mean(iterations[1:])),
        "changes of the set": float(np.mean(changes[1:])),
        "open": float(np.mean(open_shares)),
        "steps": steps,
        "worst": worst,
        "ranks": COMM.size,
        "peak GB": 1e-9 * COMM.allreduce(1024 * getrusage(RUSAGE_SELF).ru_maxrss),
    }


def thrown(problem: vc.ContactProblem, state: vc.State) -> vc.State:
    """Return the state at rest with the building turning about the middle of the raft."""
    system = problem.system
    space: Any = system.space
    bodies = space.body_of_node
    mine = np.flatnonzero(space.points[:, 2] > 0.0)
    building = max(COMM.allgather(int(bodies[mine[0]]) if len(mine) else -1))
    speed = np.where((bodies == building)[:, None], np.cross(ROCKING, space.points), 0.0)
    moving = initial_state(
        vc.ContactProblem(system.changed(v0=space.restrict(speed)), problem.surface)
    )
    return state.with_velocity(moving.v)


def halved() -> Iterator[dict[str, Any]]:
    """Yield the key numbers of the whole run on every mesh and with every time step."""
    for finer, dt in HALVED:
        problem, start = raft.stages(finer, COMM, vc.Condensed())
        weight = float(COMM.allreduce(start.r_n.sum()))
        begin = process_time()
        solution = vc.simulate(
            problem,
            dt=dt,
            t_end=raft.T_END,
            state=start,
            solver=vc.Condensed(),
            record=raft.recorders(),
            progress=False,
        )
        yield {
            "factor": finer,
            "dt": dt,
            "unknowns": round(COMM.allreduce(problem.system.rows)),
            **raft.key_numbers(solution.history, weight),
            "worst certificate": solution.facts["worst_certificate"],
            "energy defect": solution.facts["energy_defect"],
            "seconds": process_time() - begin,
        }


def told(found: dict[str, Any]) -> str:
    """Return a row as lines of text, one for each number."""

    def text(value: Any) -> str:
        return f"{value:.4g}" if isinstance(value, float) else str(value)

    return "\n".join(f"  {key:<42} {text(value)}" for key, value in found.items())


def main() -> None:
    """Print the costs of all sizes, or with --halving the key numbers of whole runs."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "--sizes", nargs="+", choices=raft.SIZES, default=["2e4", "1e5"], help="unknowns, about"
    )
    parser.add_argument("--steps", type=int, default=20, help="number of steps in a row of costs")
    parser.add_argument(
        "--iterative", action="store_true", help="use Iterative() in place of Condensed()"
    )
    parser.add_argument("--no-gravity", action="store_true", help="leave out the gravity stage")
    parser.add_argument(
        "--halving", action="store_true", help="compute whole runs, on other meshes and steps"
    )
    parser.add_argument("--json", type=Path, help="file for all numbers")
    options = parser.parse_args()
    solver = vc.Iterative() if options.iterative else vc.Condensed()
    costs = (
        cost(raft.SIZES[size], options.steps, solver, not options.no_gravity)
        for size in options.sizes
    )
    found: list[dict[str, Any]] = []
    for one in halved() if options.halving else costs:
        found.append(one)
        if COMM.rank == 0:
            print(told(one), end="\n\n", flush=True)
            if options.json:
                options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
