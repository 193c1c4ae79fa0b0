#!/usr/bin/env python3
"""Measure what displacements of second order gain: elements of degree 1 and 2 on the same nodes.

    python3 benchmarks/second_order.py [--bending 2 4 8] [--hertz 8 16] [--impact 50 100]
        [--json FILE]

The numbers are cells of degree 1. Cells of degree 2 are half as many on a side and have the same
nodes, so that all elements have as many unknowns (nearly as many on the graded meshes of hertz). A
problem without numbers is left out.

* bending: the first frequency of a cantilever, 8 times as long as high, with so many cells over its
  height, in space and in the plane (plane stress), against Q2 with 6 and 16 cells; nu = 0.3, and
  0.4999 in plane strain.
* hertz: the pressure of a cylinder on so many cells in the half-width of the contact: its error in
  L2 over the norm.
* impact: the force of a bar thrown at a wall, on so many cells along it and 4 across: the rms of
  the error around the contact, and the largest error in its middle, over the exact force.

Errors are in per cent. "entries" are those of K for each unknown.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from graded import even_then_growing, growing  # noqa: E402
from hertz_line import HertzLine  # noqa: E402
from mpi4py import MPI  # noqa: E402
from scipy.sparse.linalg import eigsh  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems.bar import Bar, build  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core.system import SemiDiscreteSystem  # noqa: E402
from vi_contact.exact import ThrownBar  # noqa: E402
from vi_contact.fem.petsc_algebra import as_petsc  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402

Row = dict[str, Any]
ELEMENTS = {"P1": (1, True), "Q1": (1, False), "P2": (2, True), "Q2": (2, False)}
SLENDER = 8  # length over height
SECTIONS = {  # of the cantilever: dimension, section, Poisson's ratio
    "in space": (3, None, 0.3),
    "plane stress": (2, vc.PlaneStress(1.0), 0.3),
    "plane strain, nu = 0.4999": (2, vc.PlaneStrain(), 0.4999),
}


def matrix(one: Any) -> sp.csr_matrix:
    """Return a matrix of a system on one rank in the form of scipy."""
    ends, columns, values = as_petsc(one).mat.getValuesCSR()
    return sp.csr_matrix((values, columns, ends))


def entries(system: SemiDiscreteSystem) -> float:
    """Return the entries of K that are not zero, for each unknown."""
    return matrix(system.K).count_nonzero() / system.rows


def cantilever(body: str, cells: int, element: str) -> tuple[float, SemiDiscreteSystem]:
    """Return the first frequency [rad/s] and the system of a bending cantilever.

    It has so many cells over its height.
    """
    d, section, nu = SECTIONS[body]
    degree, simplices = ELEMENTS[element]
    lengths = (float(SLENDER), *(1.0,) * (d - 1))
    mesh, tags = fem.build_mesh(
        BlockMesh(
            lengths=lengths, divisions=tuple(int(n) * cells for n in lengths), simplices=simplices
        ),
        MPI.COMM_SELF,
    )
    rollers = [fem.Prescribed(tags["back"], components=(2,))] if d == 3 else []
    material = vc.LinearElastic(E=1.0, nu=nu, rho=1.0)
    system = fem.assemble(
        mesh, material, section=section, clamped=tags["left"], prescribed=rollers, degree=degree
    )
    values = eigsh(matrix(system.K), 1, matrix(system.M), sigma=0.0, return_eigenvectors=False)
    return float(np.sqrt(values[0])), system


def bending(cells: list[int]) -> list[Row]:
    """Return rows with the error of the first frequency in per cent."""
    rows = []
    for body in SECTIONS:
        exact, _ = cantilever(body, 6 if body == "in space" else 16, "Q2")
        for n in cells:
            for element, (degree, _) in ELEMENTS.items():
                found, system = cantilever(body, n // degree, element)
                rows.append(
                    {
                        "problem": f"bending, {body}",
                        "cells": n,
                        "element": element,
                        "unknowns": system.rows,
                        "entries": entries(system),
                        "frequency": 100.0 * (found / exact - 1.0),
                    }
                )
    return rows


def hertz(cells: list[int]) -> list[Row]:
    """Return rows with the error of a cylinder's pressure in L2, in per cent of its norm."""
    a, R, span = 0.02, 1.0, 30.0
    exact = HertzLine(force=np.pi * a**2 / (4.0 * R), modulus=1.0, radius=R)
    rows = []
    for n in cells:
        for element, (degree, simplices) in ELEMENTS.items():
            h = a / n * degree
            growth = 1.15**degree
            axes = [
                even_then_growing(h, 1.5 * a, span * a, growth=growth),
                growing(h, span * a, growth=growth),
            ]

            def placed(x: Any, axes: Any = axes) -> Any:
                even = [np.linspace(0.0, 1.0, len(nodes)) for nodes in axes]
                return np.column_stack([np.interp(x[:, i], even[i], axes[i]) for i in range(2)])

            spec = BlockMesh(
                divisions=tuple(len(p) - 1 for p in axes), simplices=simplices, deform=placed
            )
            mesh, tags = fem.build_mesh(spec, MPI.COMM_SELF)
            system = fem.assemble(
                mesh,
                vc.LinearElastic(E=0.91, nu=0.3, rho=1.0),
                degree=degree,
                prescribed=fem.Prescribed(tags["left"], components=(0,)),
                loads=fem.Traction(tags["top"], (0.0, -0.5 * exact.force / (span * a))),
            )
            ground = vc.AnalyticGap(lambda x: x[:, 0] ** 2 / (2.0 * R))
            surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
            state = vc.static_equilibrium(vc.ContactProblem(system, surface))
            w = surface.weights
            p = exact.pressure(surface.points[:, 0])
            rows.append(
                {
                    "problem": "hertz",
                    "cells": n,
                    "element": element,
                    "unknowns": system.rows,
                    "entries": entries(system),
                    "in contact": int(np.sum(state.r_n > 0.0)),
                    "pressure": 100.0 * float(np.sqrt(w @ (state.r_n / w - p) ** 2 / (w @ p**2))),
                }
            )
    return rows


def impact(cells: list[int]) -> list[Row]:
    """Return rows with errors of the force of a thrown strip, in per cent of the exact force."""
    case = ThrownBar()
    rows = []
    for n in cells:
        for element, (degree, triangles) in ELEMENTS.items():
            bar = Bar(
                case,
                elements=n // degree,
                across=4 // degree,
                dimension=2,
                triangles=triangles,
                degree=degree,
            )
            model = build(bar, MPI.COMM_SELF)
            dt = bar.time_step(0.5 / degree)
            found = np.array(
                [
                    (state.t, state.r_n.sum())
                    for state, _ in vc.march(model.problem(), dt=dt, steps=round(1.5 / dt))
                ]
            )
            t = found[:, 0]
            away = (found[:, 1] / bar.section - case.force(found[:, 0])) / case.pressure
            span, middle = (t > 0.3) & (t < 1.4), (t > 0.6) & (t < 1.067)
            rows.append(
                {
                    "problem": "impact",
                    "cells": n,
                    "element": element,
                    "unknowns": model.system.rows,
                    "entries": entries(model.system),
                    "force": 100.0 * float(np.sqrt(np.mean(away[span] ** 2))),
                    "ringing": 100.0 * float(np.abs(away[middle]).max()),
                }
            )
    return rows


def line(row: Row) -> str:
    """Return one row as a line for people."""
    told = ("frequency", "pressure", "force", "ringing", "in contact")
    values = " ".join(f"{name} {row[name]:.3g}" for name in told if name in row)
    return (
        f"{row['problem']:<34} {row['cells']:>4} {row['element']} {row['unknowns']:>7} unknowns "
        f"{row['entries']:>5.1f} entries  {values}"
    )


def main() -> None:
    """Print a line for each row of the three problems, and write all of them with --json."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for problem, cells in (("bending", [2, 4, 8]), ("hertz", [8, 16]), ("impact", [50, 100])):
        parser.add_argument(f"--{problem}", type=int, nargs="*", default=cells)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    rows = []
    for problem in (bending, hertz, impact):
        if getattr(given, problem.__name__):
            for row in problem(getattr(given, problem.__name__)):
                rows.append(row)
                print(line(row), flush=True)
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
