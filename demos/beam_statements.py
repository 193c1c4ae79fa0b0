#!/usr/bin/env python3
"""Ask every reading of the normal force of Ahn (2012) for both things that its text says of the results.

Larger contact forces cause more oscillations of the tip, and friction takes little beside viscosity: no reading has
both.

    bash demos/run.sh beam_statements              # the table of docs/theory/beam.md
    bash demos/run.sh beam_statements --json       # the same as JSON

24 runs of 1000 elements and 1000 steps, some 5 s. docs/theory/beam.md explains the readings.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # run from the source tree without installing

from demos.problems.beam_statements import HEAD, NEGLIGIBLE, VISCOSITIES, Row, row
from vi_contact.cli import status_of

# Parameters ----------------------------------------------------------------------------------------------------------
ELEMENTS, DT = 1000, 0.002


def main(quick: bool = False, as_json: bool = False) -> list[Row]:
    """Run all readings (``quick``: 50 elements, steps of 10 ms) and print their table; return its rows."""
    count, dt = (50, 0.01) if quick else (ELEMENTS, DT)
    rows = [row(reading, a2, count=count, dt=dt) for a2 in VISCOSITIES for reading in "ABC"]
    if as_json:
        print(json.dumps([one.told() for one in rows], indent=1))
        return rows
    both = [f"{one.reading} at a2 = {one.a2:g} s" for one in rows if one.statement_1 and one.statement_2]
    print(HEAD, *[one.line() for one in rows], sep="\n")
    print(f"\nStatement 2: friction below {NEGLIGIBLE:g} of viscosity.")
    print(f"Both statements: {', '.join(both) or 'no reading'}.")
    return rows


# Things to try: NEGLIGIBLE = 1 or EPS = 1e-4 in demos/problems/beam_statements.py.
if __name__ == "__main__":
    raise SystemExit(status_of(lambda: main(as_json="--json" in sys.argv)))
