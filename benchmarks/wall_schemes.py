#!/usr/bin/env python3
"""Run the first wall with every time scheme, with the article's time step and a sixteenth of it.

    python3 benchmarks/wall_schemes.py [--only NAME…]

It prints the table of docs/start/first_wall.md: the range of the top corner [µm], and the energy
that contact, impact rule and scheme take, as a share of the input work. Each row is the command
``vi-contact run wall`` with the words of SCHEMES. Three minutes of one processor.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from vi_contact.practice.cli.entry import main as command

SCHEMES = {  # the first column of the table -> what is added to vi-contact run wall
    "`ZienkiewiczWoodTaylor`": [],
    "`SS22`": ["--scheme", "SS22"],
    "`Trapezoidal`": ["--scheme", "Trapezoidal"],
    "`Newmark`": ["--scheme", "Newmark"],
    "`HHT`": ["--scheme", "HHT"],
    "`GeneralisedAlpha.spectral_radius` of 0.8": [
        "--scheme",
        "GeneralisedAlpha.spectral_radius",
        "--set",
        "scheme.rho_inf=0.8",
    ],
    "`Houbolt`": ["--scheme", "Houbolt"],
    "`ContactStabilisedNewmark`": ["--scheme", "ContactStabilisedNewmark"],
    "`ContactStabilisedNewmark` with `projected = false` (Kane)": [
        "--scheme",
        "ContactStabilisedNewmark",
        "--set",
        "scheme.projected=false",
    ],
    "`MoreauJean`": ["--scheme", "MoreauJean"],
    "`Midpoint`": ["--scheme", "Midpoint"],
    "`Newmark` on `ConsistentMass`, with the impact rule": [
        "--set",
        'scheme={type="Newmark"}',
        "--set",
        "mass.type=ConsistentMass",
    ],
}
FINER = 16
LOSSES = ("loss_contact", "loss_impact", "loss_algorithmic")


def run(words: list[str], finer: int = 1) -> tuple[str, str]:
    """Return the range of the top corner [µm] and the share of the input work that is taken.

    Both are texts as the table has them.
    """
    steps = ["--steps", str(400 * finer), "--set", f"run.dt.parts={20 * finer}"]
    with tempfile.TemporaryDirectory() as folder:
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = command(
                ["run", "wall", *words, *steps, "--set", "fields=", "--quiet", "--out", folder]
            )
        if status:
            raise SystemExit(said.getvalue())
        with open(Path(folder) / "history.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    top = [1e6 * float(row["u_x_12"]) for row in rows]
    taken = sum(float(rows[-1][name]) for name in LOSSES) / float(rows[-1]["work_input"])
    return f"{min(top):.1f} to {max(top):.1f}", f"{100.0 * taken:.0f} %"


def row(name: str, coarse: tuple[str, str], fine: tuple[str, str]) -> str:
    """Return a row of the table."""
    return f"| {name} | {coarse[0]} | {fine[0]} | {coarse[1]} | {fine[1]} |"


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument(
        "--only", nargs="+", metavar="NAME", help="rows that begin with these names"
    )
    given = options.parse_args()
    print(f"| scheme | dt | dt/{FINER} | energy taken, dt | dt/{FINER} |\n|---|---|---|---|---|")
    for name, words in SCHEMES.items():
        if not given.only or name.strip("`").startswith(tuple(given.only)):
            print(row(name, run(words), run(words, FINER)), flush=True)


if __name__ == "__main__":
    main()
