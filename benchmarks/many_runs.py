#!/usr/bin/env python3
"""Measure what a step costs when several runs are marched together, in steps of a run alone.

    python3 benchmarks/many_runs.py [--sizes 2e3] [--rounds 5] [--json FILE] [--group-of-one]

The model is the wall of step_cost.py with its whole right side in possible contact. Harmonic
motions of different amplitude and frequency shake it. ``march_many`` of k runs is timed beside k
times ``march``, in turn. ``cost_ratio`` is the processor time per run and step over that of single
runs, the median of the rounds. Set-up is in neither time, and nobody reads the reports.
``worst_difference`` compares a step with the single step that begins with the same state: the
largest difference in u and v over their largest entries.

With --group-of-one a run alone steps as a group of one, on rows (1, n), and only such rows are
printed: ``cost_ratio`` is then what the other way to make a step costs where there is one run.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems.wall import Wall, build  # noqa: E402
from vi_contact.run import together as groups  # noqa: E402

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)
SIZES = (216, 2e3, 2e4)
RUNS = (1, 2, 4, 8, 16)
CHECKED = 8  # steps that are made once more, alone, of two runs


def divisions(size: float) -> tuple[int, int]:
    """Return the cells of a wall of about so many unknowns, half as high again as wide."""
    across = max(round((size / 3.0) ** 0.5), 4)
    return across, round(1.5 * across)


def problems(size: float, count: int) -> tuple[list[vc.ContactProblem], float]:
    """Return runs of one wall under different motions, and their time step [s]."""
    model = build(Wall(divisions=divisions(size)), MPI.COMM_SELF, base_inertia="catalogue")
    one = model.problem("face")
    motions = (
        replace(
            one.excitation,
            amplitude=0.5 + 0.1 * k,
            frequency=one.excitation.frequency * (1.0 + 0.05 * k),
        )
        for k in range(count)
    )
    return [replace(one, excitation=motion) for motion in motions], model.time_step()


def seconds_per_step(loop: Iterator[Any], count: int) -> float:
    """Return the processor time of a step [s].

    The first step of each run, in which everything is set up, is left out.
    """
    for _ in range(count):
        next(loop)
    begin = time.thread_time()
    steps = 0
    for _ in loop:
        steps += 1
    return (time.thread_time() - begin) / steps


def measured(size: float, rounds: int, counts: Sequence[int] = RUNS) -> list[dict[str, Any]]:
    """Return the rows of one size, one for each number of runs."""
    every, dt = problems(size, max(counts))
    steps = round(min(max(4.8e5 / size, 12.0), 200.0))
    rows = []
    for count in counts:
        chosen = every[:count]
        ways: dict[str, Callable[[], list[Iterator[Any]]]] = {
            "alone": lambda chosen=chosen: [
                vc.march(one, scheme=SCHEME, dt=dt, steps=steps) for one in chosen[:4]
            ],
            "together": lambda chosen=chosen: [
                vc.march_many(chosen, scheme=SCHEME, dt=dt, steps=steps)
            ],
        }
        found: dict[str, list[float]] = {name: [] for name in ways}
        for _ in range(rounds):
            for name, made in ways.items():
                each = 1 if name == "alone" else count
                found[name].append(
                    float(np.mean([seconds_per_step(loop, each) for loop in made()]))
                )
        alone, together = (float(np.median(found[name])) for name in ways)
        ratios = [mine / lone for mine, lone in zip(found["together"], found["alone"], strict=True)]
        rows.append(
            {
                "unknowns": len(every[0].equations.u0),
                "runs": count,
                "cost_ratio": float(np.median(ratios)),
                "worst_difference": difference(chosen, dt, steps),
                "seconds_per_step": together,
                "seconds_per_single_step": alone,
            }
        )
        print(line(rows[-1]), flush=True)
    return rows


def difference(chosen: list[vc.ContactProblem], dt: float, steps: int) -> float:
    """Return the largest difference of steps from single steps that begin with the same states."""
    worst = 0.0
    every = max(steps // CHECKED, 1)
    for number, report in vc.march_many(chosen, scheme=SCHEME, dt=dt, steps=steps):
        if report.new.k % every == 0 and number < 2:
            alone, _ = next(
                vc.march(chosen[number], scheme=SCHEME, dt=dt, steps=1, state=report.old)
            )
            for ours, theirs in ((report.new.u, alone.u), (report.new.v, alone.v)):
                worst = max(worst, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
    return worst


def line(row: dict[str, Any]) -> str:
    """Return a row of the table, times in microseconds."""
    return (
        f"{row['unknowns']:>8} {row['runs']:>5} {1e6 * row['seconds_per_step']:>14.0f} "
        f"{1e6 * row['seconds_per_single_step']:>10.0f} {row['cost_ratio']:>6.2f} "
        f"{row['worst_difference']:>11.1e}"
    )


def main() -> None:
    """Print the rows of all sizes, and write them with --json."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--sizes", type=float, nargs="+", default=list(SIZES), help="numbers of unknowns, about"
    )
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path, help="write the rows into this file")
    parser.add_argument(
        "--group-of-one", action="store_true", help="step a run alone as a group of one"
    )
    options = parser.parse_args()
    counts = RUNS
    if options.group_of_one:
        groups.FEWEST = 1
        counts = (1,)
    print(
        f"{'unknowns':>8} {'runs':>5} {'us/run + step':>14} {'alone us':>10} {'ratio':>6} "
        f"{'difference':>11}"
    )
    rows = [row for size in options.sizes for row in measured(size, options.rounds, counts)]
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
