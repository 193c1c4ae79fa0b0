#!/usr/bin/env python3
"""Compare both forms of the Poincaré-Steklov operator in contact, positivity and thin bodies.

    python3 benchmarks/bem_forms.py [--sides 5 10 20] [--laws none Tresca Coulomb] [--json] [--thin]

The unit square is pressed on its top by a unit step, with c_P = 1, c_S = 1/2, rho = 1, k elements
on a side, c_P dt = h and T = 6. It has no friction, Tresca's threshold 0.05, or Coulomb's
coefficient 0.5. The rows have the impulse of the contact forces at t = 4 and the energy, the work
of all forces, at t = 2. Differences between the forms are the largest over all steps, relative to
the largest impulse and energy of the symmetric form. The eigenvalues are those of the symmetric
part of the space-time matrix of the whole boundary: k = 5 with 20 steps, k = 10 with 16, k = 20
with 8.

--thin computes two bodies. The first is the rod between rollers under a sin² load with h = 0.1: the
relative L2 error of its top up to T = 6 at c_P dt = h/2. The second is the triangle (0, 0), (1, 0),
(1, 0.12), which plane pulses cross. Their eigenvalues are those of 12 steps with h = 1/8 and c_P dt
= h.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "bem"), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
from plane_waves import MATERIAL, pulse  # noqa: E402
from test_energetic import echoes, rod, smooth_integral, smooth_load  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems.boundary_elements import square_problem  # noqa: E402
from vi_contact import bem  # noqa: E402
from vi_contact.bem.energetic import march_blocks  # noqa: E402

LAWS = {"none": vc.Frictionless(), "Tresca": vc.Tresca(0.05), "Coulomb": vc.Coulomb(0.5)}
FORMS = ("symmetric", "unsymmetric")
KEYS = (
    "k",
    "law",
    "form",
    "impulse",
    "energy",
    "impulse_difference",
    "energy_difference",
    "worst_certificate",
    "negative_eigenvalues",
    "smallest_eigenvalue",
    "eigenvalues",
    "p_matrix",
)
STEPS = {5: 20, 10: 16}
TRIANGLE = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.12)]


def spectrum(blocks: bem.EnergeticBlocks, form: str, steps: int) -> np.ndarray:
    """Return the eigenvalues of the symmetric part of the space-time matrix of S, in increments.

    The matrix is that of the whole boundary.
    """
    n = 2 * len(blocks.mesh)
    held = np.broadcast_to(np.eye(n), (steps, n, n))
    columns = march_blocks(
        blocks, np.ones(n, bool), np.zeros((steps, n, n)), held, symmetric=form == "symmetric"
    )[2]
    whole = np.zeros((steps, n, steps, n))
    for k in range(steps):
        for j in range(k + 1):
            whole[k, :, j] = columns[k - j]
    matrix = whole.reshape(steps * n, steps * n)
    return np.linalg.eigvalsh(0.5 * (matrix + matrix.T))


def contact(k: int, laws: list[str]) -> Iterator[dict[str, Any]]:
    """Yield a row for each friction law and form, with their difference from the symmetric form."""
    given = square_problem(k, MATERIAL, dt=1.0 / k, steps=6 * k)
    other = replace(
        given, operator=bem.PoincareSteklov(given.operator.blocks, MATERIAL.rho, symmetric=False)
    )
    problems = dict(zip(FORMS, (given, other), strict=True))
    condensed = {form: problem.condensed() for form, problem in problems.items()}
    values = {
        form: spectrum(given.operator.blocks, form, STEPS.get(k, 8)) if k <= 20 else np.zeros(0)
        for form in FORMS
    }
    for law in laws:
        first: tuple[np.ndarray, np.ndarray] | None = None
        for form, problem in problems.items():
            run = bem.march_contact(bem.BoundaryContact(condensed[form], friction=LAWS[law]))
            impulse = run.impulse
            energy = problem.solve(run.forces).work
            first = first or (impulse, energy)
            away = [
                float(np.abs(one - base).max() / np.abs(base).max())
                for one, base in zip((impulse, energy), first, strict=True)
            ]
            numbers = (
                k,
                law,
                form,
                impulse[4 * k - 1, 1],
                energy[2 * k - 1],
                *away,
                run.worst,
                *below_zero(values[form]).values(),
                run.contact.p_matrix.sentence,
            )
            yield dict(zip(KEYS, numbers, strict=True))


def thin_rods() -> Iterator[dict[str, Any]]:
    """Yield errors and eigenvalues of rods of the width h/share."""
    for share in (1.0, 2.0, 5.0, 10.0, 20.0):

        def mesh(h: float, share: float = share) -> bem.BoundaryMesh:
            half = 0.5 * h / share
            return bem.polygon([(-half, -0.5), (half, -0.5), (half, 0.5), (-half, 0.5)], h)

        blocks = bem.energetic_blocks(mesh(0.1), MATERIAL, dt=0.05, steps=120)
        for form in FORMS:
            motion = rod(blocks, smooth_load, symmetric=form == "symmetric").solve()
            exact = echoes(motion.times, smooth_integral)[:, None]
            top = motion.displacement[:, 1][:, blocks.mesh.nodes_of(blocks.mesh.labels == 2)]
            error = float(
                np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape))
            )
            yield {"body": f"rod, w = h/{share:g}", "form": form, "error": error} | positivity(
                mesh(0.125), form
            )


def triangle(h: float = 0.05) -> Iterator[dict[str, Any]]:
    """Yield errors of both pulses until T = 4 and eigenvalues of the sharp triangle."""
    steps = round(4.0 / h)
    blocks = bem.energetic_blocks(bem.polygon(TRIANGLE, h), MATERIAL, dt=h, steps=steps)
    for form in FORMS:
        for shear in (False, True):
            wave = pulse(shear=shear)
            operator = bem.PoincareSteklov(blocks, 1.0, symmetric=form == "symmetric")
            forces = bem.traction_forces(blocks.mesh, wave.traction, dt=h, steps=steps)
            found = bem.BoundaryProblem(operator, forces).solve().displacement
            exact = np.array(
                [wave.displacement(blocks.mesh.points, h * (j + 1)).T for j in range(steps)]
            )
            error = float(np.linalg.norm(found - exact) / np.linalg.norm(exact))
            body = f"triangle of 7 degrees, pulse {'PS'[shear]}"
            yield {"body": body, "form": form, "error": error} | positivity(
                bem.polygon(TRIANGLE, 0.125), form
            )


def positivity(mesh: bem.BoundaryMesh, form: str) -> dict[str, Any]:
    """Return what the space-time matrix of 12 steps with c_P dt = 1/8 has below zero."""
    values = spectrum(bem.energetic_blocks(mesh, MATERIAL, dt=0.125, steps=12), form, 12)
    return below_zero(values)


def below_zero(values: np.ndarray) -> dict[str, Any]:
    """Return how many of these eigenvalues are negative, the smallest, and how many there are.

    All three are None where no eigenvalues were computed.
    """
    if not len(values):
        return dict.fromkeys(("negative_eigenvalues", "smallest_eigenvalue", "eigenvalues"))
    return {
        "negative_eigenvalues": int((values < 0.0).sum()),
        "smallest_eigenvalue": float(values[0]),
        "eigenvalues": len(values),
    }


def main() -> None:
    """Print the rows of all sizes as lines, or with --json as one list."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sides", type=int, nargs="*", default=[5, 10, 20])
    parser.add_argument("--laws", nargs="*", default=list(LAWS), choices=list(LAWS))
    parser.add_argument("--json", action="store_true", help="print a list of rows and nothing else")
    parser.add_argument("--thin", action="store_true")
    chosen = parser.parse_args()
    rows = [contact(k, chosen.laws) for k in chosen.sides] + (
        [thin_rods(), triangle()] if chosen.thin else []
    )
    found = []
    for row in (row for part in rows for row in part):
        found.append(row)
        if not chosen.json:
            print(
                ", ".join(
                    f"{key} {value:.5g}" if isinstance(value, float) else f"{key} {value}"
                    for key, value in row.items()
                ),
                flush=True,
            )
    if chosen.json:
        print(json.dumps(found, indent=1, default=float))


if __name__ == "__main__":
    main()
