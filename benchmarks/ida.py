#!/usr/bin/env python3
r"""Measure what an incremental dynamic analysis costs with eight runs in a process, or with one.

    python3 benchmarks/ida.py [--records 20] [--scales 5] [--duration 4] [--mesh 4 6] [--json FILE]
    python3 benchmarks/ida.py --case vi_contact/practice/studies/starters/wall.toml --set fields= \
        --scales 10 --step 0.2 --duration 10 --jobs 2

The case is the wall of demos/cases/wall_record.toml, which begins under its weight and slides with
Coulomb friction, under synthetic motions. It may be another case with contact and with a probe
called "top". The row has these keys:

* ``records``, ``scales``, ``runs``, ``unknowns``, and ``steps`` of a run;
* ``seconds_apart`` and ``seconds_together``: processor time of all processes of a study, from the
  command to its table and figure; ``ratio`` is the ratio of the two;
* ``wall_seconds_apart``, ``wall_seconds_together`` and ``wall_ratio``: the same by the clock, with
  so many ``jobs`` at a time;
* ``worst_difference``: the largest difference between the demands of the two studies, over the
  largest of each demand.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "demos" / "cases" / "wall_record.toml"
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402

from vi_contact import ground_motion  # noqa: E402
from vi_contact.practice.studies import IDA, read_case, run_ida  # noqa: E402
from vi_contact.practice.studies.ida import processes  # noqa: E402

DEMANDS = ("contact_uplift:max", "contact_resultant:max", "u_x_top:min")


def motions(folder: Path, count: int, duration: float) -> list[Path]:
    """Write synthetic motions with a peak of 3 m/s², and return their files."""
    ground = ground_motion.KanaiTajimi(s0=0.01, omega_g=25.0)
    envelope = ground_motion.Envelope(
        rise=0.1 * duration, end=0.6 * duration, decay=10.0 / duration
    )
    found = [folder / f"motion_{seed}.at2" for seed in range(1, count + 1)]
    for seed, path in enumerate(found, start=1):
        motion = ground_motion.synthetic(ground, duration, 0.01, seed=seed, envelope=envelope)
        ground_motion.write_at2(ground_motion.scaled_to_pga(motion, 3.0), path, "g")
    return found


def seconds() -> float:
    """Return the processor time [s] of this process and of those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def measured(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Return the row of both ways to run one study, and how far their demands differ."""
    mesh = [f"mesh.divisions={options.mesh}"] if options.case == CASE else []
    case = read_case(options.case, [*mesh, *options.settings])
    scales = tuple(options.step * k for k in range(1, options.scales + 1))
    study = IDA(case, motions(folder, options.records, options.duration), DEMANDS, scales=scales)
    spent, passed, rows = {}, {}, {}
    usual = processes.TOGETHER
    for way, runs in (("together", usual), ("apart", 1)):
        processes.TOGETHER = runs
        begin = seconds()
        clock = time.perf_counter()
        try:
            rows[way] = run_ida(study, folder / way, jobs=options.jobs, say=lambda line: None)
        finally:
            processes.TOGETHER = usual
        spent[way] = seconds() - begin
        passed[way] = time.perf_counter() - clock
    failed = [
        row["reason"] for found in rows.values() for row in found if row["status"] != "finished"
    ]
    if failed:
        sys.exit(f"{len(failed)} runs failed, the first because: {failed[0]}")
    names = [name.replace(":", "_") for name in DEMANDS]
    ours, theirs = (
        np.array([[row[name] for name in names] for row in rows[way]])
        for way in ("together", "apart")
    )
    about = json.loads(
        next((folder / "apart" / "runs").glob("*/summary.json")).read_text(encoding="utf-8")
    )
    return {
        "records": options.records,
        "scales": options.scales,
        "runs": len(rows["apart"]),
        "unknowns": about["unknowns"],
        "steps": about["steps"],
        "seconds_apart": spent["apart"],
        "seconds_together": spent["together"],
        "ratio": spent["together"] / spent["apart"],
        "jobs": options.jobs,
        "wall_seconds_apart": passed["apart"],
        "wall_seconds_together": passed["together"],
        "wall_ratio": passed["together"] / passed["apart"],
        "worst_difference": float(np.max(np.abs(ours - theirs) / np.abs(theirs).max(axis=0))),
    }


def main() -> None:
    """Print the row, a line for each number."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--case", type=lambda text: Path(text).resolve(), default=CASE, help="a case file"
    )
    parser.add_argument("--set", dest="settings", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--records", type=int, default=20)
    parser.add_argument(
        "--scales", type=int, default=5, help="number of scales: 1, 2, 3 and so on times --step"
    )
    parser.add_argument(
        "--step", type=float, default=0.5, help="step of the scales; scale 1 is a peak of 3 m/s²"
    )
    parser.add_argument("--jobs", type=int, default=1, help="number of processes at a time")
    parser.add_argument("--duration", type=float, default=4.0, help="duration of a motion [s]")
    parser.add_argument(
        "--mesh", type=int, nargs=2, default=[4, 6], help="cells across and up in the own case"
    )
    parser.add_argument("--json", type=Path, help="write the row into this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        row = measured(options, Path(folder))
    print("\n".join(f"{name:<22} {value:.4g}" for name, value in row.items()))
    if options.json:
        options.json.write_text(json.dumps([row], indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
