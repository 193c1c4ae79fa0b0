#!/usr/bin/env python3
"""Compare contact tractions of boundary and finite elements on the pressed square.

    python3 benchmarks/bem_tractions.py [--elements 20 40] [--cells 80 160] [--json FILE]

The unit square has c_P = 1, c_S = 1/2 and a unit pressure on its top from t = 0 to 5; c_P dt = h
for both methods. Forces on the nodes of the finite elements are collected on those of the boundary
elements (demos/parts/problems/compare_tractions.py), on the whole contact boundary with its ends.
The numbers are relative L2 differences. "0.2 s" compares means over windows of time, and "patches"
compares means over hat functions 0.1 wide too. "early" is until t = 3, at nodes two elements or
more from the ends. "late" is the same from t = 3 to 5.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.boundary_elements import square_problem
from demos.parts.problems.compare_tractions import Tractions, compared
from demos.parts.problems.square import Square, build
from vi_contact import bem

LAWS = {"none": vc.Frictionless(), "Tresca 0.05": vc.Tresca(0.05), "Coulomb 0.5": vc.Coulomb(0.5)}
END, TURN = 5.0, 3.0  # [s]
COLUMNS = ("step", "0.1 s", "0.2 s", "patches", "early", "late")


def row(both: Tractions) -> dict[str, float]:
    """Return the differences in means over windows and over patches.

    "early" and "late" are before and after the unloading wave, without the ends of the side.
    """
    inner = np.abs(both.x) < 0.5 - 1.5 * np.diff(both.x)[0]
    windows = {"step": 0.0, "0.1 s": 0.1, "0.2 s": 0.2}
    return {name: both.difference(window=window) for name, window in windows.items()} | {
        "patches": both.difference(window=0.2, width=0.1),
        "early": both.difference(window=0.2, between=(0.0, TURN), nodes=inner),
        "late": both.difference(window=0.2, between=(TURN, END), nodes=inner),
    }


def main() -> None:
    """Print the differences of every number of boundary elements from every number of cells."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--elements",
        type=int,
        nargs="+",
        default=[20],
        help="numbers of boundary elements on a side",
    )
    parser.add_argument(
        "--cells",
        type=int,
        nargs="+",
        default=[80, 160],
        help="numbers of finite elements on a side",
    )
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    material = Square().material
    rows = []
    condensed = {
        k: square_problem(k, material, dt=1.0 / k, steps=round(END * k)).condensed()
        for k in options.elements
    }
    print(
        f"{'elements':>8} {'cells':>6} {'law':<12} {'traction':<9}",
        *(f"{name:>8}" for name in COLUMNS),
    )
    for cells in options.cells:
        model = build(Square(cells=cells, pressure=1.0), MPI.COMM_WORLD)
        for law, friction in LAWS.items():
            problem = model.problem(friction=friction)
            fine = vc.simulate(
                problem,
                dt=model.square.time_step,
                t_end=END,
                record=(vc.Contact(),),
                progress=False,
            )
            for k, compliance in condensed.items():
                run = bem.march_contact(bem.BoundaryContact(compliance, friction=friction))
                both = compared(run, problem.surface.whole(), fine.history)
                for traction, pair in list(zip(("pressure", "shear"), both, strict=True))[
                    : 1 if law == "none" else 2
                ]:
                    found = row(pair)
                    rows.append(
                        {"elements": k, "cells": cells, "law": law, "traction": traction, **found}
                    )
                    print(
                        f"{k:>8} {cells:>6} {law:<12} {traction:<9}",
                        *(f"{found[name]:>8.4f}" for name in COLUMNS),
                        flush=True,
                    )
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
