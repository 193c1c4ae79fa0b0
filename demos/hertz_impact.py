#!/usr/bin/env python3
"""Throw a steel ball on a rigid plane.

Elastic finite elements are compared with Hertz' quasi-static theory.

A ball of 10 mm is thrown down with 0.1 m/s. It touches the plane for 83 microseconds, with up to
145 N on a spot of a third of a millimetre, and rebounds with its full speed. The model is a quarter
of the ball, with the default scheme.

    bash demos/run.sh hertz_impact          # the figure and a table, into results/hertz_impact
    bash demos/run.sh -n 2 hertz_impact     # the same on two ranks
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.impact import ImpactCurves, plot_impact
from demos.parts.problems.ball import QUARTERS, Ball, BallModel, build, hertz_motion
from vi_contact.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
BALL = Ball(radius=0.01, speed=0.1, material=vc.LinearElastic(E=2.1e11, nu=0.3, rho=7800.0))
MESHES = (4, 8)  # cells in the largest contact radius
STEPS = 200  # in the contact time
OUT = Path("results/hertz_impact")
COLUMNS = ("approach", "duration", "force", "rebound", "certificate", "ledger defect")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all meshes (``quick``: the first, half the steps).

    It returns approach, duration, force and rebound over those of the theory, certificate and
    ledger defect, by mesh.
    """
    comm = MPI.COMM_WORLD
    curves, numbers = {}, {}
    for cells in MESHES[:1] if quick else MESHES:
        name = f"{cells} cells in the contact radius"
        model = build(replace(BALL, cells=cells), comm)
        problem = model.problem()
        dt = model.time_step(STEPS // 2 if quick else STEPS)
        solution = vc.simulate(
            problem,
            dt=dt,
            t_end=1.2 * model.exact.duration,
            record=(vc.Energy(), vc.Contact(), vc.Probe({"centre": model.probes()["centre"]})),
            out=out / f"{cells}_cells",
            progress=progress,
        )
        curves[name] = curve = curves_of(model, problem, solution)
        values = (
            curve.approach.max() / model.exact.approach,
            np.count_nonzero(curve.force) * dt / model.exact.duration,
            curve.force.max() / model.exact.deepest.force,
            -(np.diff(curve.approach)[-1] / dt) / BALL.speed,
            solution.facts["worst_certificate"],
            solution.facts["energy_defect"],
        )
        numbers |= {
            f"{name}: {what}": float(value) for what, value in zip(COLUMNS, values, strict=True)
        }
    if comm.rank == 0:
        plot_impact(
            curves, model.exact, lambda t: hertz_motion(model.exact, t), out / "hertz_impact.png"
        )
        print(table(numbers))
        print(f"\nFigure and histories are in {out}.")
    comm.Barrier()
    return numbers


def curves_of(model: BallModel, problem: vc.ContactProblem, solution: vc.Solution) -> ImpactCurves:
    """Return the histories of the whole ball; time and approach count from the first touch."""
    history = solution.history
    points = problem.surface.whole().points
    force = QUARTERS * history["contact_resultant"]
    return ImpactCurves(
        t=history["t"] - model.ball.height / model.ball.speed,
        force=force,
        approach=-history["u_y_centre"] - model.ball.height,
        distance=np.hypot(points[:, 0], points[:, 2]),
        pressure=history["pressure"][force.argmax()],
    )


def table(numbers: dict[str, float]) -> str:
    """Return a line per mesh; the theory is 1."""
    lines = [f"{'over the quasi-static theory':<30}" + "".join(f"{what:>14}" for what in COLUMNS)]
    for name in dict.fromkeys(key.split(":")[0] for key in numbers):
        values = [numbers[f"{name}: {what}"] for what in COLUMNS]
        lines.append(
            f"{name:<30}"
            + "".join(f"{v:>14.4f}" for v in values[:4])
            + "".join(f"{v:>14.1e}" for v in values[4:])
        )
    return "\n".join(lines)


# Things to try: speed=10.0 (the theory holds as long as the contact is small and long); E=1e7,
# rho=1000 for rubber; MESHES = (12,), which takes a minute; scheme=vc.Midpoint() in simulate.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
