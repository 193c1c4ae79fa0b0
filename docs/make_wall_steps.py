"""Run the shipped wall under a record at three time steps, for a table of docs/guide/by_hand.md.

    python3 docs/make_wall_steps.py elcentro.at2    # some minutes
    python3 docs/make_wall_steps.py                 # reads the run folders that are there

The record is not part of the package. What is found is stored in docs/by_hand/steps.csv, from which
docs/make_by_hand.py writes the table. Run folders are left in build/by_hand.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from vi_contact.practice.studies import read_case
from vi_contact.run.files.reading import read_run

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "vi_contact" / "practice" / "studies" / "starters" / "wall.toml"
STORED = ROOT / "docs" / "by_hand" / "steps.csv"
RUNS = ROOT / "build" / "by_hand"
TIME_STEPS = (0.01, 0.005, 0.0025)  # s
WINDOW = 0.02  # s, over which means are taken: two of the longest steps
PEAKS = {
    "thrust on the stem": ("N_stem", "N"),
    "moment at the foot of the stem": ("M_stem", "N m"),
    "normal force under the base": ("N_base", "N"),
    "pressure under the toe": ("pressure_low_base", "Pa"),
    "open share of the base": ("uplift_base", "-"),
}
Row = tuple[str, str, float]


def lasts(t: np.ndarray, values: np.ndarray) -> float:
    """Return how long a peak lasts above 90 % of it [s], both ways from its time."""
    peak = int(np.argmax(values))
    below = np.flatnonzero(values < 0.9 * values[peak])
    before = below[below < peak].max(initial=-1)
    after = below[below > peak].min(initial=len(values))
    return float((after - before - 1) * (t[1] - t[0]))


def mean_peak(t: np.ndarray, values: np.ndarray) -> float:
    """Return the largest mean over WINDOW of what acts in steps; the first row is no step."""
    count = round(WINDOW / (t[1] - t[0]))
    return float(np.convolve(values[1:], np.ones(count) / count, "valid").max())


def measure(history: Mapping[str, Any]) -> list[Row]:
    """Return rows (name, unit, value) of a run."""
    t = np.asarray(history["t"])
    rows: list[Row] = []
    for name, (column, unit) in PEAKS.items():
        values = np.nan_to_num(np.asarray(history[column]))
        rows.append((f"largest {name}", unit, float(values.max())))
        rows.append((f"{name}: time of it", "s", float(t[values.argmax()])))
        rows.append((f"{name}: above 90 % of it for", "s", lasts(t, values)))
        if column in ("N_stem", "M_stem"):
            rows.append((f"largest mean of the {name} over 20 ms", unit, mean_peak(t, values)))
    sliding = np.asarray(history["sliding_base"])
    rows.append(("sliding of the base that stays", "m", float(sliding[-1] - sliding[0])))
    top = np.asarray(history["u_x_top"]) - np.asarray(history["u_x_toe"])
    rows.append(
        ("top of the stem against the toe, largest", "m", float(np.abs(top - top[0]).max()))
    )
    rows.append(("thrust on the stem at the end", "N", float(history["N_stem"][-1])))
    return rows


def main() -> None:
    """Run the wall at all time steps if a record is given, and store what is found."""
    rows = []
    for dt in TIME_STEPS:
        out = RUNS / f"wall_{1e3 * dt:g}ms"
        if len(sys.argv) > 1:
            record = Path(sys.argv[1]).resolve()
            settings = [f'excitation.1.record="{record}"', f"run.dt={dt}", "fields="]
            read_case(CASE, settings).run(MPI.COMM_SELF, out=out, progress=False)
        rows += [(dt, *row) for row in measure(read_run(out).history)]
        print(f"{dt} s", flush=True)
    with STORED.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["dt", "name", "unit", "value"])
        table.writerows([dt, name, unit, f"{value:.8g}"] for dt, name, unit, value in rows)


if __name__ == "__main__":
    main()
