#!/usr/bin/env python3
"""Measure what the mesh (H, DT) of the contact multiplier does beside (h, dt) of displacements.

    python3 benchmarks/bem_multiplier.py [--sides 8 16 24] [--finest 32]
        [--json FILE] [--figure FILE]

A square is under the pressure 1 until t = 4, with c_P dt = 0.9 h and h = 1/k, without friction and
with Tresca's threshold 0.05. H/h and DT/dt are 1, 2, 3, 4 and 8, in space alone, in time alone and
in both. Contact is tested at the ends of intervals or in the mean. "degree" is the degree of lambda
on a patch, and "sigma" belongs to the weight of the means.

* inf_sup: the constant of the pairing, space times time (demos/parts/problems/inf_sup.py);
* step: the smallest eigenvalue of the normal flexibility of one interval per length, over DT/(rho
  c_P).

The other columns compare with nodal forces that are tested at the ends of steps, on a mesh with
--finest elements on a side:

* oscillation: the largest second difference of the error of the contact force (means over
  intervals), over four times the largest force;
* impulse_error: the largest error of the contact impulse, over the largest impulse;
* energy_error: the largest error of the energy of the body, over the largest energy;
* multiplier_error: the error of the pressure in L2 of space and time, without the ends of the side;
* t, force, finest: histories of the force, and of the means of the finest force;
* uzawa: iterations to 1e-8 without friction with rho = 0.4/lambda_max(W[0]); null means more than
  2000.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402

from demos.parts.pictures.multiplier import plot_multiplier  # noqa: E402
from demos.parts.problems.boundary_elements import square_problem  # noqa: E402
from demos.parts.problems.inf_sup import space_constant, time_constant  # noqa: E402
from vi_contact import Frictionless, LinearElastic, Tresca, bem  # noqa: E402
from vi_contact.core.errors import InputError, StepFailure  # noqa: E402

MATERIAL = LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
LAWS = {"none": Frictionless(), "Tresca": Tresca(0.05)}
RATIOS = (1, 2, 3, 4, 8)
SIGMAS = (0.125, 0.25, 0.5, 1.0)  # sigma DT
T_END = 4.0
STEP = 0.9  # c_P dt / h: fronts then come inside of intervals, whatever their length
# of certificates: before the front comes displacements are 1e-20, penetrations round-off of these
TOLERANCE = 1e-6
RHO = 0.4  # of Uzawa's step, in 1/lambda_max(W[0])
MOST = 2000  # of his iterations
INNER = 0.375  # |x| up to which pressures are compared: corners of a rubbing square are singular
KEYS = (
    "k",
    "law",
    "degree",
    "H_over_h",
    "DT_over_dt",
    "sigma",
    "testing",
    "inf_sup",
    "step",
    "oscillation",
    "impulse_error",
    "energy_error",
    "multiplier_error",
    "uzawa",
)


@dataclass(frozen=True)
class Answer:
    """Hold impulse, energy and pressure of a run at times t, of which the first is 0.

    The pressure is that of the points x in each interval.
    """

    t: np.ndarray
    impulse: np.ndarray
    energy: np.ndarray
    x: np.ndarray
    pressure: np.ndarray

    def pressures(self, x: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the pressures of patches or nodes nearest to x, at times t: (len(t), len(x))."""
        nearest = np.abs(x[:, None] - self.x).argmin(axis=1)
        return self.pressure[np.searchsorted(self.t[1:], t)][:, nearest]


def answer(
    problem: bem.BoundaryProblem, run: bem.ContactRun, forces: np.ndarray, every: int = 1
) -> Answer:
    """Return impulse, work and pressure of a run, whose nodal forces are these."""
    work = np.concatenate([[0.0], problem.solve(forces).work[every - 1 :: every]])
    return Answer(
        np.concatenate([[0.0], run.times]),
        np.concatenate([[0.0], run.impulse[:, 1]]),
        work,
        run.contact.compliance.points[:, 0],
        run.pressure,
    )


def errors(found: Answer, fine: Answer) -> dict[str, Any]:
    """Return histories of the contact force, oscillation and errors beside the finest answer.

    Forces are means over intervals.
    """
    t = found.t[found.t <= T_END * (1.0 + 1e-9)]
    n = len(t)
    exact = np.interp(t, fine.t, fine.impulse)
    force, wrong = (np.diff(history) / np.diff(t) for history in (exact, found.impulse[:n] - exact))
    energy = np.interp(t, fine.t, fine.energy)
    x = np.linspace(-INNER, INNER, 193)
    middle = (np.arange(480) + 0.5) / 480 * t[-1]
    pressure = fine.pressures(x, middle)
    return {
        "t": t.tolist(),
        "force": (force + wrong).tolist(),
        "finest": force.tolist(),
        "oscillation": float(np.abs(np.diff(wrong, 2)).max() / (4.0 * force.max())),
        "impulse_error": float(np.abs(found.impulse[:n] - exact).max() / exact.max()),
        "energy_error": float(np.abs(found.energy[:n] - energy).max() / energy.max()),
        "multiplier_error": float(
            np.linalg.norm(found.pressures(x, middle) - pressure) / np.linalg.norm(pressure)
        ),
    }


@dataclass(frozen=True)
class Square:
    """Hold the pressed square with k elements a side, condensed to its contact."""

    k: int

    def __post_init__(self) -> None:
        steps = 24 * -(-int(T_END * self.k / STEP) // 24)  # a multiple of all intervals
        problem = square_problem(self.k, MATERIAL, dt=STEP / self.k, steps=steps)
        object.__setattr__(self, "problem", problem)
        object.__setattr__(self, "compliance", problem.condensed())

    def finest(self, law: str) -> Answer:
        """Return the answer with nodal forces at the ends of steps, the one to compare with."""
        run = bem.march_contact(
            bem.BoundaryContact(self.compliance, friction=LAWS[law]), tolerance=TOLERANCE
        )
        return answer(self.problem, run, run.forces)

    def row(self, law: str, fine: Answer, **choice: Any) -> dict[str, Any]:
        """Return one row: the answer on a mesh of the multiplier's own, with its errors."""
        mesh = self.problem.operator.mesh
        elements = self.problem.contact
        own = bem.MultiplierMesh(mesh, elements, self.compliance, **choice)
        contact = bem.BoundaryContact(own.condensed(), friction=LAWS[law])
        run = bem.march_contact(contact, tolerance=TOLERANCE)
        steps = len(self.compliance.W)
        degree = own.degree
        normal = contact.surface.owned
        first = (
            contact.W[0][np.ix_(normal, normal)]
            * MATERIAL.rho
            * MATERIAL.c_p
            / contact.compliance.dt
        )
        root = np.sqrt(contact.compliance.lengths)
        constant = space_constant(mesh, elements, own.patch, degree) * time_constant(
            steps, own.interval, own.testing
        )
        ends = law == "none" and own.testing == "end"
        return {
            "k": self.k,
            "law": law,
            "degree": degree,
            "H_over_h": own.patch,
            "DT_over_dt": own.interval,
            "sigma": own.sigma,
            "testing": own.testing,
            "inf_sup": constant,
            "step": float(np.linalg.eigvalsh(0.5 * root[:, None] * (first + first.T) * root)[0]),
            **errors(answer(self.problem, run, own.forces(run.forces), own.interval), fine),
            "uzawa": iterations(contact) if ends else None,
        }


def iterations(contact: bem.BoundaryContact) -> int | None:
    """Return the iterations of Uzawa's method, or None where they are more than MOST."""
    rho = RHO / float(np.linalg.eigvalsh(contact.W[0])[-1])
    try:
        return int(bem.SpaceTimeUzawa(rho=rho, max_iterations=MOST).solve(contact).iterations[0])
    except StepFailure:
        return None


def choices(k: int) -> list[dict[str, Any]]:
    """Return the meshes in space, in time and in both; then linear multipliers; then weights."""
    pairs = [(r, 1) for r in RATIOS] + [(1, r) for r in RATIOS[1:]] + [(r, r) for r in RATIOS[1:]]
    found: list[dict[str, Any]] = [
        {"patch": patch, "interval": interval, "testing": testing}
        for testing in ("end", "mean")
        for patch, interval in pairs
    ]
    found += [{"patch": r, "interval": r, "degree": 1} for r in RATIOS[1:]]
    return found + [
        {"patch": 2, "interval": 2, "testing": "mean", "sigma": share * k / (2 * STEP)}
        for share in SIGMAS
    ]


def main() -> None:
    """Print the rows of all sides, or read them, and draw the errors of the finest side."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sides", type=int, nargs="*", default=[8, 16, 24])
    parser.add_argument("--finest", type=int, default=32)
    parser.add_argument(
        "--json", type=Path, help="file for all numbers; a file that exists is drawn without a run"
    )
    parser.add_argument(
        "--figure", type=Path, help="picture of the errors of the finest of the sides"
    )
    chosen = parser.parse_args()
    if chosen.json and chosen.json.exists():
        rows = json.loads(chosen.json.read_text())
    else:
        rows = []
        best = Square(chosen.finest)
        fine = {law: best.finest(law) for law in LAWS}
        print(*(f"{key:>10.10}" for key in KEYS))
        for k in chosen.sides:
            square = Square(k)
            for law in LAWS:
                for choice in choices(k):
                    try:
                        rows.append(square.row(law, fine[law], **choice))
                    except InputError as error:  # large weights swing: the page says which
                        print(f"{k:>10}  {law}  refused: {error}", flush=True)
                        continue
                    values = [rows[-1][key] or 0 for key in KEYS]
                    shown = [
                        f"{value:10.3g}" if isinstance(value, float) else f"{value:>10}"
                        for value in values
                    ]
                    print(*shown, flush=True)
        if chosen.json:
            chosen.json.write_text(json.dumps(rows) + "\n")
    if chosen.figure:
        print(plot_multiplier(rows, chosen.figure))


if __name__ == "__main__":
    main()
