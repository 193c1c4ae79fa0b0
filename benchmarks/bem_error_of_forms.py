#!/usr/bin/env python3
"""Measure the squared energy error of both forms of the Poincaré-Steklov operator against h.

The slope is measured as well.

    python3 benchmarks/bem_error_of_forms.py [--levels 5 10 20 40]
        [--examples square "concrete on steel"] [--supports rollers clamped "Tresca 0.05"]
        [--json FILE] [--figure docs/figures/bem_error_of_forms.png]

The examples are the pressed square under a step and the concrete box under its slow load. c_P dt /
h is fixed, and a side has k elements. The base is on rollers, clamped, or in contact with friction.
Every level is compared with the finest symmetric solution.
demos/parts/problems/error_of_forms.py defines errors, slopes and the error of the reference.

--json FILE writes rows with the keys case, form, k, finest, error_squared, energy_difference,
slope, local_slopes, settled, reference_error, cosine and certificate. Rows of other cases that the
file has already stay, and the figure shows all.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demos.parts.pictures.errors import plot_errors  # noqa: E402
from demos.parts.problems.error_of_forms import EXAMPLES, measure  # noqa: E402


def table(rows: list[dict[str, Any]]) -> str:
    """Return a heading and a line for each row, with the local slopes at its end."""
    lines = [
        f"{'case':<32}{'form':<13}{'k':>4}{'error²':>11}{'reference':>11}{'energy':>11}"
        f"{'slope':>7}  local"
    ]
    for row in rows:
        local = " ".join(f"{slope:.2f}" for slope in row["local_slopes"])
        lines.append(
            f"{row['case']:<32}{row['form']:<13}{row['k']:>4}{row['error_squared']:>11.3e}"
            f"{row['reference_error']:>11.3e}{row['energy_difference']:>11.3e}{row['slope']:>7.2f} "
            f" {local}" + ("" if row["settled"] else "  not settled")
        )
    return "\n".join(lines)


def main() -> None:
    """Compute the cases that are asked for, and keep the rows of all others in the file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--levels", type=int, nargs="+", default=[5, 10, 20, 40])
    parser.add_argument("--examples", nargs="+", choices=list(EXAMPLES), default=list(EXAMPLES))
    parser.add_argument(
        "--supports", nargs="+", default=[], help="base: rollers, clamped, or a friction law"
    )
    parser.add_argument("--json", type=Path)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    if options.json and options.json.exists():
        rows = json.loads(options.json.read_text())
    for example in options.examples:
        start = time.process_time()
        supports = [
            one
            for one in EXAMPLES[example].supports
            if one in (options.supports or EXAMPLES[example].supports)
        ]
        found = measure(example, options.levels, *supports)
        rows = [row for row in rows if row["case"] not in {new["case"] for new in found}] + found
        print(
            table(found), f"\n{time.process_time() - start:.0f} s of processor time\n", flush=True
        )
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1) + "\n")
    if options.figure:
        plot_errors(rows, options.figure)


if __name__ == "__main__":
    main()
