#!/usr/bin/env python3
"""What a unilateral step costs, as a multiple of a plain linear step with the same matrix, in one run.

    python3 benchmarks/step_cost.py [--model wall] [--sizes 1e3 2e3 2e4 2e5] [--steps 60] [--json FILE]
    python3 benchmarks/step_cost.py --model channel [--sizes 2e4 2e5]

The wall of seed 000 with its whole right side in possible contact, or its buried channel after the gravity stage,
harmonic motion, Zienkiewicz-Wood-Taylor step, impact rule and certificate on, no records. A linear step is right-hand
side, one back-substitution and update, timed beside every unilateral one. Figures are medians and means over the steps
that have contact, one thread, one rank.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact.core.algebra import total  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402
from vi_contact.meshes.channel import ChannelMesh  # noqa: E402
from vi_contact.models.channel import model as channel  # noqa: E402
from vi_contact.models.wall import Wall, build  # noqa: E402
from vi_contact.solvers.volume.route import Volume  # noqa: E402
from vi_contact.solvers.volume.snes import ReducedNewton  # noqa: E402

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)
DIVISIONS = {1e3: (18, 27), 2e3: (26, 39), 2e4: (82, 123), 2e5: (167, 600)}  # up to 600 contact points
ROUTES: dict[str, Any] = {
    "condensed": vc.Condensed(),
    "volume, reference": Volume(method=ReducedNewton()),
}
SLOW = {"volume, reference": 1e5}  # not run at or above this size
CELLS = {1e3: 0.65, 2e3: 0.45, 2e4: 0.14, 2e5: 0.0436}  # of the channel's mesh [m]; up to 232 contact points
RUBBING = "condensed, Coulomb 0.4"
CHANNEL_ROUTES = {name: solver for name, solver in ROUTES.items() if name not in SLOW} | {RUBBING: vc.Condensed()}


def memory() -> float:
    """Largest resident memory of the process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """(seconds, result)."""
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


class LinearSteps:
    """Plain linear steps with the same matrix, one at a time."""

    def __init__(self, problem: vc.ContactProblem, A: Any, dt: float) -> None:
        self.problem, self.A, self.dt = problem, A, dt
        self.state = initial_state(problem)
        self.no_force = np.zeros(problem.surface.count)

    def __call__(self) -> None:
        step = SCHEME.step(self.problem, self.state, self.A, self.dt)
        x = self.A.factor.solve(step.b)
        result = vc.StepResult(x, self.no_force, self.no_force > 0.0, 0, "linear")
        self.state = SCHEME.finish(self.problem, self.state, step, result, self.dt)


class StepsWithContact:
    """Iterates over the reports of ``count`` steps with contact, each timed beside a linear step; a third as many
    before them warm up.

    set_up: seconds of the first step; seconds, plain: of the steps and of the linear ones; active: points in contact;
    worst: certificate of all steps.
    """

    def __init__(
        self, problem: vc.ContactProblem, solver: Any, dt: float, count: int, linear: LinearSteps,
        state: vc.State | None = None,
    ) -> None:
        self.loop = vc.march(problem, scheme=SCHEME, solver=solver, dt=dt, steps=100 * count, state=state)
        self.set_up, _ = timed(lambda: next(self.loop))
        self.count, self.linear = count, linear
        self.seconds: list[float] = []
        self.plain: list[float] = []
        self.active: list[int] = []
        self.worst = 0.0

    def __iter__(self) -> Iterator[vc.Report]:
        warm_up = self.count // 3
        while len(self.seconds) < self.count:
            spent, (_, report) = timed(lambda: next(self.loop))
            self.worst = max(self.worst, report.certificate.worst)
            active = int(total(report.problem.surface.comm, report.new.active.sum()))
            if not active:
                continue
            warm_up -= 1
            if warm_up >= 0:
                continue
            self.seconds.append(spent)
            self.plain.append(timed(self.linear)[0])
            self.active.append(active)
            yield report


def unilateral_steps(
    problem: vc.ContactProblem, solver: Any, dt: float, count: int, linear: LinearSteps, state: vc.State | None = None
) -> dict[str, Any]:
    """Times ``count`` steps with contact after a third as many to warm up, each beside a linear step."""
    steps = StepsWithContact(problem, solver, dt, count, linear, state)
    iterations = [report.result.iterations for report in steps]
    set_up, seconds, plain, active, worst = steps.set_up, steps.seconds, steps.plain, steps.active, steps.worst
    return {
        "set_up_seconds": set_up,
        "linear_ms": 1e3 * float(np.median(plain)),
        "median_ms": 1e3 * float(np.median(seconds)),
        "mean_ms": 1e3 * float(np.mean(seconds)),
        "ratio": float(np.median(seconds) / np.median(plain)),
        "mean_ratio": float(np.mean(seconds) / np.mean(plain)),
        "iterations": float(np.mean(iterations)),
        "active": float(np.mean(active)),
        "certificate": worst,
        "peak_memory_MB": memory(),
    }


def measure(size: float, steps: int) -> dict[str, Any]:
    """One size: the linear step and every route."""
    model = build(Wall(divisions=DIVISIONS[size]), MPI.COMM_WORLD, base_inertia="catalogue")
    problem = model.problem("face")
    dt = model.time_step()
    A = SCHEME.effective_matrix(problem, dt)
    factorisation, _ = timed(lambda: A.factor)
    linear = LinearSteps(problem, A, dt)
    row: dict[str, Any] = {
        "unknowns": model.system.space.unknowns, "contact_points": problem.surface.total,
        "factorisation_seconds": factorisation, "routes": {},
    }
    for name, solver in ROUTES.items():
        if size < SLOW.get(name, np.inf):
            found = unilateral_steps(problem, solver, dt, steps, linear)
            row["routes"][name] = found
            print(line(row, name, found), flush=True)
    return row


def measure_channel(size: float, steps: int) -> dict[str, Any]:
    """One size of the buried channel, after its gravity stage: sliding by both routes, and rubbing."""
    model = channel.build(channel.Channel(ChannelMesh(size=CELLS[size])), MPI.COMM_WORLD)
    dt, row = model.channel.time_step(), {"unknowns": model.system.space.unknowns, "routes": {}}
    for name, solver in CHANNEL_ROUTES.items():
        problem = model.problem(friction=vc.Coulomb(0.4) if name == RUBBING else None)
        gravity, state = timed(lambda one=problem: vc.static_equilibrium(one, solver=vc.Condensed()))
        linear = LinearSteps(problem, SCHEME.effective_matrix(problem, dt), dt)
        linear()  # factorises
        found = unilateral_steps(problem, solver, dt, steps, linear, state) | {"gravity_seconds": gravity}
        row["routes"][name] = found
        row["contact_points"] = problem.surface.total
        print(line(row, name, found), flush=True)
    return row


COLUMNS = (  # title, width, format, key
    ("linear ms", 9, ".3f", "linear_ms"),
    ("ms median", 9, ".3f", "median_ms"),
    ("ms mean", 8, ".3f", "mean_ms"),
    ("ratio", 6, ".2f", "ratio"),
    ("mean", 6, ".2f", "mean_ratio"),
    ("iter", 5, ".2f", "iterations"),
    ("active", 6, ".1f", "active"),
    ("set-up s", 8, ".2f", "set_up_seconds"),
    ("MB", 6, ".0f", "peak_memory_MB"),
    ("certificate", 11, ".1e", "certificate"),
)
HEADER = f"{'unknowns':>9} {'points':>6} {'route':<26}" + "".join(f" {name:>{width}}" for name, width, _, _ in COLUMNS)


def line(row: dict[str, Any], name: str, found: dict[str, Any]) -> str:
    """One row of the table."""
    cells = "".join(f" {found[key]:>{width}{form}}" for _, width, form, key in COLUMNS)
    return f"{row['unknowns']:>9} {row['contact_points']:>6} {name:<26}{cells}"


def seed_wall(steps: int = 400) -> float:
    """Seconds of the seed's 400-step wall, mesh to last step, after imports."""
    def run() -> None:
        model = build(Wall(), MPI.COMM_WORLD, base_inertia="catalogue")
        for _ in vc.march(
            model.problem("b"), scheme=SCHEME, solver=vc.Condensed(), dt=model.time_step(), steps=steps
        ):
            pass
    return timed(run)[0]


def main() -> None:
    """Prints the table and writes it with --json."""
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    arguments.add_argument("--model", default="wall", choices=("wall", "channel"))
    arguments.add_argument("--sizes", type=float, nargs="+", default=list(DIVISIONS), choices=list(DIVISIONS))
    arguments.add_argument("--steps", type=int, default=60, help="steps with contact that are timed")
    arguments.add_argument("--json", metavar="FILE")
    options = arguments.parse_args()
    whole: dict[str, Any] = {}
    if options.model == "wall":
        whole["seed_wall_seconds"] = seed_wall()
        print(f"the seed's wall, 400 steps, mesh to last step: {whole['seed_wall_seconds']:.2f} s\n")
    print(HEADER, flush=True)
    one = measure if options.model == "wall" else measure_channel
    whole["rows"] = [one(size, options.steps) for size in options.sizes]
    if options.json:
        Path(options.json).write_text(json.dumps(whole, indent=1) + "\n")


if __name__ == "__main__":
    main()
