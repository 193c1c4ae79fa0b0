"""Run the shipped wall under a record, for two tables of docs/guide/by_hand.md.

    python3 docs/make_wall_steps.py elcentro.at2    # some minutes
    python3 docs/make_wall_steps.py                 # reads the run folders that are there

The record is not part of the package. Each of three runs is repeated with half the time step, as
``vi-contact report --halved`` does. What is found is stored in docs/by_hand/steps.csv, and page 1
of the three reports in docs/by_hand/sheets.csv; docs/make_by_hand.py writes the tables. Run folders
are left in build/by_hand.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from vi_contact.practice.engineering.peak_values import find_stretch
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.refinement import refine
from vi_contact.run.files.reading import read_run

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "vi_contact" / "practice" / "studies" / "starters" / "wall.toml"
STORED = ROOT / "docs" / "by_hand" / "steps.csv"
SHEETS = ROOT / "docs" / "by_hand" / "sheets.csv"
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
    first, last = find_stretch(values)
    return float((last - first + 1) * (t[1] - t[0]))


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


def read_sheet(out: Path) -> list[tuple[str, ...]]:
    """Return (number, value, duration, dt/2) of page 1 of the report on a run, as it has them."""
    from vi_contact.practice.studies.report import write_report

    page = out / "page.pdf"
    first = write_report(out, out=page).first
    rows = [[cell.replace("\xa0", " ") for cell in row] for row in first.tables[0].rows]
    return [(f"{row[0]}, `{row[1]}`", row[2], row[4], row[5]) for row in rows]


def run_wall(record: Path) -> None:
    """Run the wall at all time steps, and with half of each."""
    for dt in TIME_STEPS:
        out = RUNS / f"wall_{1e3 * dt:g}ms"
        settings = [f'excitation.1.record="{record}"', f"run.dt={dt}", "fields="]
        read_case(CASE, settings).run(MPI.COMM_SELF, out=out, progress=False)
        refine(out, MPI.COMM_SELF, names=["dt"], progress=False)
        print(f"{dt} s", flush=True)


def store(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Store a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)


def main() -> None:
    """Run the wall at all time steps if a record is given, and store what is found."""
    if len(sys.argv) > 1:
        run_wall(Path(sys.argv[1]).resolve())
    folders = {dt: RUNS / f"wall_{1e3 * dt:g}ms" for dt in TIME_STEPS}
    shortest = TIME_STEPS[-1]
    runs = folders | {0.5 * shortest: folders[shortest] / "refined" / "dt"}
    steps = []
    for dt, folder in runs.items():
        found = measure(read_run(folder).history)
        steps += [(dt, name, unit, f"{value:.8g}") for name, unit, value in found]
    store(STORED, ["dt", "name", "unit", "value"], steps)
    sheets = [(dt, *row) for dt, folder in folders.items() for row in read_sheet(folder)]
    store(SHEETS, ["dt", "number", "value", "lasts", "halved"], sheets)


if __name__ == "__main__":
    main()
