#!/usr/bin/env python3
"""Measure steps of bodies whose internal force is not linear, in linear steps of the same body.

    python3 benchmarks/nonlinear.py [--size 16] [--steps 400] [--json FILE]
    mpirun -n 2 python3 benchmarks/nonlinear.py

Three cases:

- ``chain``: 40 cubic springs thrown against a stop with an inelastic impact law; tangents are up to
  eight times the reference. Its matrices are of one rank: every rank computes it alone.
- ``block``: a neo-Hookean block of n x 2n quadrilaterals, thrown obliquely on the ground at a
  quarter of the speed of shear waves, with Coulomb friction.
- ``barrel``: a neo-Hookean block of n x 2n squares of two triangles, 1 m wide and 2 m high, pressed
  by 0.3 m in static stages of 0.1 m. Supports that move are refused with internal=: the top is held
  and the ground rises, which is the same problem seen from the top. ``vi_...`` is ``vi.Problem`` on
  the same mesh (``load_steps.py``), whose top moves; ``difference`` is the largest difference of
  the displacements at the end, seen from the top, as a share of the way. Pressed further the block
  gives way sideways on the smooth ground: ``vi.Problem`` then finds an equilibrium that is no
  minimum, and static stages, which seek one, are refused.

Numbers of a case, with its name before them:

- ``linear_steps_mean``, ``linear_steps_max``: certified linear steps in a step.
- ``tangents_per_step``: tangents that were made, with a factor each.
- ``certificate``: the worst one of the nonlinear steps.
- ``energy_defect``: what the ledger leaves, over the largest energy.
- ``loss_algorithmic``: the largest loss or gain of the scheme so far, by its own formula, over the
  largest energy. Of static stages both are none.
- ``seconds``: processor time of all steps, of the busiest rank.
- ``ratio``: that over the time of as many steps of the same body with its reference stiffness
  alone.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
from load_steps import COMM  # noqa: E402
from load_steps import block as pose_for_vi  # noqa: E402
from marching import march, spend  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems.nonlinear import (  # noqa: E402
    Rubber,
    hang_block,
    make_chain,
    throw_block,
)
from vi_contact import vi  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402
from vi_contact.run.static import Equilibria  # noqa: E402

Numbers = dict[str, float]
CHAIN_DT = 2e-3  # s
CHAIN_SPEED = 12.0  # m/s
STRAINS = 25  # steps in which the block goes its own width at the speed of shear waves
BARREL_STEP = 0.1  # m
BARREL_STAGES = 3


def make_linear(problem: vc.ContactProblem) -> vc.ContactProblem:
    """Return the problem of the body that has the reference stiffness alone."""
    return replace(problem, system=problem.system.changed(internal=None))


def measure_march(problem: vc.ContactProblem, dt: float, steps: int) -> Numbers:
    """Return the numbers of a history.

    Args:
        problem: what is marched.
        dt: length of a step [s].
        steps: number of steps.
    """
    seconds, (stepper, reports) = spend(lambda: march(problem, vc.Midpoint(), dt, steps))
    plain, _ = spend(lambda: march(make_linear(problem), vc.Midpoint(), dt, steps))

    # The ledger is kept afterwards, so that it is not in the time.
    ledger = vc.Energy()
    first = ledger.start(stepper.method.problem, reports[0].old)
    rows = [first, *map(ledger.row, reports)]
    energies = [row["energy_kinetic"] + row["energy_strain"] for row in rows]
    losses = [abs(row["loss_algorithmic"]) for row in rows]
    defects = [abs(row["energy_defect"]) for row in rows]
    passes = [report.result.iterations for report in reports]
    return {
        "linear_steps_mean": float(np.mean(passes)),
        "linear_steps_max": max(passes),
        "tangents_per_step": stepper.prepared[dt].tangents / steps,
        "certificate": max(report.certificate.worst for report in reports),
        "energy_defect": max(defects) / max(energies),
        "loss_algorithmic": max(losses) / max(energies),
        "steps_in_contact": sum(bool(report.result.active.any()) for report in reports),
        "seconds": seconds,
        "ratio": seconds / plain,
    }


def measure_chain(steps: int) -> Numbers:
    """Return the numbers of the chain of springs."""
    return measure_march(make_chain(speed=CHAIN_SPEED, impact=vc.Inelastic()), CHAIN_DT, steps)


def measure_block(n: int, steps: int) -> Numbers:
    """Return the numbers of the block that is thrown.

    Args:
        n: quadrilaterals across.
        steps: number of steps.
    """
    problem = throw_block(COMM, n, friction=vc.Coulomb(0.3), mass=vc.ConsistentMass())
    dt = 1.0 / (STRAINS * Rubber().shear_speed)
    return {
        "unknowns": problem.system.space.unknowns,
        **measure_march(problem, dt, steps),
    }


def solve_stages(problem: vc.ContactProblem, times: list[float]) -> tuple[Equilibria, list[Any]]:
    """Return what has solved the static stages, and the states at all times [s]."""
    equilibria = Equilibria(problem, solver=vc.Condensed())
    state = initial_state(problem)
    states = []
    for t in times:
        state = equilibria.solve(state, t)
        states.append(state)
    return equilibria, states


def solve_by_vi(n: int, times: list[float]) -> tuple[Any, list[Any]]:
    """Return the block of ``load_steps.py``, whose top has moved, and the answers of all stages.

    Args:
        n: squares across.
        times: how far the top is down [m].
    """
    posed = pose_for_vi(COMM, n)
    problem = vi.Problem(posed.F, posed.u, bcs=[posed.bc])
    results = []
    for down in times:
        posed.lower_top(down)
        results.append(problem.solve(lower=posed.floor))
    return posed, results


def sort_by_place(points: Any, u: Any) -> np.ndarray:
    """Return the displacements of all ranks in the order of their places.

    Args:
        points: (k, 2) nodes of this rank [m].
        u: (k, 2) their displacements [m].
    """
    rows = np.concatenate(COMM.allgather(np.hstack([np.round(points, 9), u])))
    return np.asarray(rows[np.lexsort(rows[:, :2].T)][:, 2:])


def measure_barrel(n: int, count: int) -> Numbers:
    """Return the numbers of the static stages.

    Args:
        n: squares across.
        count: number of stages.
    """
    problem = hang_block(COMM, divisions=(n, 2 * n), rubber=Rubber(E=1.0))
    times = [BARREL_STEP * (k + 1) for k in range(count)]
    seconds, (equilibria, states) = spend(lambda: solve_stages(problem, times))
    plain, _ = spend(lambda: solve_stages(make_linear(problem), times))
    vi_seconds, (posed, results) = spend(lambda: solve_by_vi(n, times))

    # Seen from the top, that of vi.Problem has moved up with everything else.
    space: Any = problem.system.space
    end = states[-1]
    ours = sort_by_place(space.points, space.expand(problem.cartesian(end.u), end.t))
    V = posed.u.function_space
    owned = V.dofmap.index_map.size_local
    theirs = posed.u.x.array[: 2 * owned].reshape(-1, 2) + [0.0, times[-1]]
    theirs = sort_by_place(V.tabulate_dof_coordinates()[:owned, :2], theirs)
    curved = equilibria.solver
    assert curved is not None  # the body is not linear
    return {
        "unknowns": space.unknowns,
        "linear_steps_mean": sum(curved.counts) / count,
        "linear_steps_max": max(curved.counts),
        "tangents_per_step": curved.tangents / count,
        "certificate": max(state.certificate for state in states),
        "seconds": seconds,
        "ratio": seconds / plain,
        "vi_iterations_mean": float(np.mean([result.iterations for result in results])),
        "vi_certificate": max(result.certificate.worst for result in results),
        "vi_seconds": vi_seconds,
        "difference": float(np.max(np.abs(ours - theirs))) / times[-1],
    }


def main(arguments: list[str] | None = None) -> int:
    """Print the measurements, and write the numbers if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=int, default=16, help="cells across the blocks")
    parser.add_argument("--steps", type=int, default=400, help="steps of chain and block")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    given = parser.parse_args(arguments)
    # Forms are compiled on small meshes.
    measure_block(2, 2)
    measure_barrel(2, 1)

    numbers = {}
    for name, measure in (
        ("chain", lambda: measure_chain(given.steps)),
        ("block", lambda: measure_block(given.size, given.steps)),
        ("barrel", lambda: measure_barrel(given.size, BARREL_STAGES)),
    ):
        for key, value in measure().items():
            numbers[f"{name}_{key}"] = value
            if COMM.rank == 0:
                print(f"{name}_{key:<20} {value:.4g}", flush=True)
    if COMM.rank == 0 and given.json:
        given.json.write_text(json.dumps(numbers, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
