#!/usr/bin/env python3
"""Draw energies of the bar, and errors against processor time, from the stored comparison.

It reads benchmarks/peers/results.json and writes docs/figures/peers.png:

    python3 benchmarks/peers/figure.py
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from problems import BAR, HERE

MARKS = "osD^vP*X"
ROUND_OFF = 1e-16  # errors below are drawn here


def draw(rows: list[dict[str, Any]], out: Path) -> None:
    """Draw all rows that have numbers, one colour and one mark a program."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    rows = [row for row in rows if "failed" not in row]
    peers = list(dict.fromkeys(row["peer"] for row in rows))
    look = {peer: (f"C{k}", MARKS[k]) for k, peer in enumerate(peers)}
    figure, (energy, near, static, bounce) = plt.subplots(
        4, 1, figsize=(6.0, 14.0), layout="constrained"
    )
    end = BAR["dt"] * BAR["steps"]
    for row in (row for row in rows if row["problem"] == "bar"):
        told = row["energies"]
        times = end * np.arange(1, len(told) + 1) / len(told)
        best = row["way"] == "best"
        for axes in (energy, near):
            axes.plot(
                times,
                told,
                "-" if best else "--",
                color=look[row["peer"]][0],
                lw=1.6 if best else 1.1,
            )
    energy.set_yscale("log")
    near.set_ylim(0.3, 1.2)
    for axes, title in ((energy, "Bar, ten bounces"), (near, "The same, enlarged")):
        axes.axhline(1.0, color="0.6", lw=0.8, zorder=0)
        axes.set(xlabel="time [s]", ylabel="energy of the bar over the first [-]")
        axes.set_title(f"{title}: 1 is exact; solid: best, dashed: other way", fontsize=10)
    for axes, problem, key, title, ticks in (
        (static, "signorini", "force_error", "Square that lifts off, n = 64", (0.3, 0.5, 1, 2)),
        (bounce, "bar", "force_error_first", "Bar, first bounce", (0.5, 1, 2, 5, 10, 20, 50, 100)),
    ):
        for row in (row for row in rows if row["problem"] == problem and row["n"] in (0, 64)):
            colour, mark = look[row["peer"]]
            fill = colour if row["way"] == "best" else "none"
            axes.loglog(
                row["process"], max(row[key], ROUND_OFF), mark, color=colour, mfc=fill, ms=8
            )
        axes.set(
            xlabel="processor time of the whole process [s]",
            ylabel="relative error of the contact force [-]",
        )
        axes.set_title(f"{title}: filled: best, hollow: other way", fontsize=10)
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.xaxis.set_minor_formatter(mpl.ticker.NullFormatter())
        axes.grid(alpha=0.3)
    handles = [plt.Line2D([], [], color=colour, marker=mark) for colour, mark in look.values()]
    energy.legend(
        handles, peers, loc="lower center", bbox_to_anchor=(0.45, 1.08), ncol=4, fontsize=9
    )
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    stored = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    draw(
        stored["rows"],
        Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parents[1] / "docs/figures/peers.png",
    )
