#!/usr/bin/env python3
"""Measure the error of contact of spheres on meshes that do not match, and its order in cells.

    python3 benchmarks/contact_in_space.py [--hertz 4 8 16] [--mindlin 4 8 12] [--torsion 4 6 8]
        [--json FILE]

The numbers are cells across the radius a of contact. A problem without numbers is left out. Hertz
has three problems: a sphere on a rigid plane, two spheres, and a sphere of steel on a block of
aluminium; the error is the mean over twelve approaches. Cattaneo and Mindlin press two spheres,
push them by Q along x, and back. Torsion turns two spheres with Coulomb friction.
tests/support/spheres.py says what is measured. P, Q and T are the forces and the moment by which
the contact answers to given motions of the bodies far away. Errors are in per cent, and c/a is in
per cent of 1. "order" is the order of the absolute error between this number of cells and the one
before.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
from spheres import PartialSlip, Torsion, hertz  # noqa: E402

Row = dict[str, Any]
TITLES = {  # of what is printed in per cent, by problem
    "hertz": {"force": "P", "scatter": "of one", "peak": "p0", "radius": "a", "profile": "p in L2"},
    "mindlin": {"force": "P", "shear": "Q", "stick": "c/a", "profile": "q in L2"},
    "torsion": {"force": "P", "moment": "T", "stick": "c/a", "profile": "τ in L2"},
}
Measure = Callable[[float], list[Row]]


def pressed(kind: str, *, simplices: bool = False) -> Measure:
    """Return the measure of a Hertz contact, which gives one row for so many cells across a."""
    case = f"{kind}, tetrahedra" if simplices else kind
    return lambda n: [{"case": case, **hertz(kind, n, simplices=simplices)}]


def sheared(n: float) -> list[Row]:
    """Return the rows of partial slip, one for each tangential force Q."""
    return [{"case": f"Q = {row['Q']:.2f} mu P", **row} for row in PartialSlip(n).compared()]


def twisted(n: float) -> list[Row]:
    """Return the rows of torsion, the last one without slip."""
    problem = Torsion(n)
    rows = [
        {"case": f"T = {row['T']:.2f} of sliding, c = {row['c']:.1f} a", **row}
        for row in problem.compared()
    ]
    return [*rows, {"case": "no slip", "moment": problem.without_slip()}]


PROBLEMS: dict[str, list[Measure]] = {
    "hertz": [
        *(pressed(kind) for kind in ("plane", "spheres", "block")),
        pressed("spheres", simplices=True),
    ],
    "mindlin": [sheared],
    "torsion": [twisted],
}


def measured(name: str, measure: Measure, levels: list[float]) -> list[Row]:
    """Return the rows of all levels, with the order of each error from one level to the next."""
    rows: list[Row] = []
    for n in levels:
        start = time.perf_counter()
        found = measure(n)
        for row in found:
            row |= {"problem": name, "cells": n, "seconds": time.perf_counter() - start}
            for before in [one for one in rows if one["case"] == row["case"]][-1:]:
                ratio = np.log(n / before["cells"])
                row |= {
                    f"order_{key}": float(np.log(abs(before[key] / row[key])) / ratio)
                    for key in TITLES[name]
                    if row.get(key)
                }
            print(line(name, row), flush=True)
        rows += found
    return rows


def header(name: str) -> str:
    """Return the titles of a table, each with the order beside it."""
    return f"{name:<34} {'cells':>5} " + " ".join(
        f"{title + ' %':>9} order" for title in TITLES[name].values()
    )


def line(name: str, row: Row) -> str:
    """Return one row of the table, errors in per cent, with its seconds."""
    cells = [(row.get(key), row.get(f"order_{key}")) for key in TITLES[name]]
    shown = (
        f"{'-' if error is None else format(100.0 * error, '.3f'):>9} "
        f"{'' if order is None else format(order, '.1f'):>5}"
        for error, order in cells
    )
    return f"{row['case']:<34} {row['cells']:>5g} " + " ".join(shown) + f" {row['seconds']:6.0f} s"


def main() -> None:
    """Print the tables, and write their rows with --json."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    usual = {"hertz": [4.0, 8.0, 16.0], "mindlin": [4.0, 8.0, 12.0], "torsion": [4.0, 6.0, 8.0]}
    for name, levels in usual.items():
        parser.add_argument(
            f"--{name}", type=float, nargs="*", default=levels, help="numbers of cells across a"
        )
    parser.add_argument(
        "--json", type=Path, help="file for all figures: rows with problem, case, cells, errors"
    )
    options = parser.parse_args()
    rows: list[Row] = []
    for name, measures in PROBLEMS.items():
        if getattr(options, name):
            print(header(name), flush=True)
            for measure in measures:
                rows += measured(name, measure, getattr(options, name))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
