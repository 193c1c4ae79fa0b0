#!/usr/bin/env python3
"""Compare every reading of the normal force of Ahn (2012) with its statements.

There are two statements that its text makes on the results.

The text prints the normal force incompletely, so that it can be read in three ways. It states that
larger contact forces cause more oscillations of the tip, and that friction takes little energy
beside viscosity. No reading gives both.

    bash demos/run.sh beam_statements              # the table of docs/theory/beam.md
    bash demos/run.sh beam_statements --json       # the same as JSON

The figure is in results/beam_statements. There are 24 runs of 1000 elements and 1000 steps, which
take about 5 s. docs/theory/beam.md explains the readings.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demos.parts.pictures.beam_statements import plot_statements
from demos.parts.problems.beam_statements import HEAD, NEGLIGIBLE, VISCOSITIES, Row, row
from vi_contact.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
ELEMENTS = 1000
DT = 0.002
OUT = Path("results/beam_statements")


def main(quick: bool = False, as_json: bool = False, out: Path = OUT) -> list[Row]:
    """Run all readings (``quick``: 50 elements, steps of 10 ms).

    Their table is printed and drawn; its rows are returned.
    """
    count, dt = (50, 0.01) if quick else (ELEMENTS, DT)
    rows = [row(reading, a2, count=count, dt=dt) for a2 in VISCOSITIES for reading in "ABC"]
    if as_json:
        print(json.dumps([one.told() for one in rows], indent=1))
        return rows
    both = [
        f"{one.reading} at a2 = {one.a2:g} s" for one in rows if one.statement_1 and one.statement_2
    ]
    print(HEAD, *[one.line() for one in rows], sep="\n")
    print(
        f"\nStatement 2 holds where friction takes less than {NEGLIGIBLE:g} of what viscosity "
        "takes."
    )
    print(
        f"Both statements hold for {', '.join(both)}."
        if both
        else "No reading satisfies both statements."
    )
    out.mkdir(parents=True, exist_ok=True)
    plot_statements(rows, out / "beam_statements.png")
    print(f"\nThe figure is in {out}.")
    return rows


# Things to try: NEGLIGIBLE = 1 or EPS = 1e-4 in demos/parts/problems/beam_statements.py.
if __name__ == "__main__":
    raise SystemExit(status_of(lambda: main(as_json="--json" in sys.argv)))
