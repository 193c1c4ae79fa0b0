#!/usr/bin/env python3
"""Run the peers of this folder, one process a row, and print the comparison.

`bash benchmarks/peers/run.sh` calls it. The first command runs the peers with its own interpreter;
the second prints the table of stored rows, which --json FILE stores as one file; the third puts
stored rows in the place of those of the same programs in results.json; the last prints the tables
of the page from results.json.

    python3 benchmarks/peers/compare.py NAME…
    python3 benchmarks/peers/compare.py --join FILE…
    python3 benchmarks/peers/compare.py --renew FILE…
    python3 benchmarks/peers/compare.py --page PAGE
"""

from __future__ import annotations

import argparse
import ast
import datetime
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from problems import HERE, PROBLEMS, SIZES, THROWN, initial_energy, lines_of, measure

WORDS = ("INSTALL", "TITLE", "WAYS", "STOPS", "MISSING", "BY_HAND")
TIMES = ("solve", "process")
COLUMNS = {
    "signorini": ("n", *TIMES, "force_error", "penetration", "energy_error", "stops", "lines"),
    "thrown": (
        *TIMES,
        "energy_end",
        "energy_largest",
        "impulse_error",
        "largest_force_error",
        "penetration",
        "stops",
        "lines",
    ),
    "bar": (
        *TIMES,
        "energy_end",
        "energy_largest",
        "force_error_first",
        "force_error",
        "displacement_error",
        "penetration",
        "stops",
        "lines",
    ),
}
LONG = (
    5.0  # a row that takes longer [s] is run once; others three times, of which the shortest counts
)
LIMIT = 600  # processor time of a row [s]


def path_of(name: str) -> Path:
    """Return the peer's file."""
    return HERE / f"peer_{name}.py"


def names() -> list[str]:
    """Return all peers, this project first."""
    found = sorted(path.stem.removeprefix("peer_") for path in HERE.glob("peer_*.py"))
    return sorted(found, key=lambda name: name != "vi_contact")


def words_of(name: str) -> dict[str, Any]:
    """Return the constants of a peer's file, without importing it."""
    tree = ast.parse(path_of(name).read_text(encoding="utf-8"))
    pairs = [
        (one.targets[0].id, one.value)
        for one in tree.body
        if isinstance(one, ast.Assign) and isinstance(one.targets[0], ast.Name)
    ]
    return {"MISSING": {}, "BY_HAND": {}} | {
        key: ast.literal_eval(value) for key, value in pairs if key in WORDS
    }


def rows_of(name: str) -> list[dict[str, Any]]:
    """Run all rows of a peer."""
    words, rows = words_of(name), []
    said = subprocess.run(
        [sys.executable, str(path_of(name)), "version"], capture_output=True, text=True, check=False
    )
    if said.returncode:
        return [
            {
                "peer": words["TITLE"],
                "name": name,
                "problem": problem,
                "failed": reason(said.stderr),
            }
            for problem in PROBLEMS
        ]
    version = said.stdout.strip().splitlines()[-1]
    for problem in PROBLEMS:
        start = {"peer": words["TITLE"], "name": name, "version": version, "problem": problem}
        if problem in words["MISSING"]:
            rows.append(start | {"failed": words["MISSING"][problem]})
            continue
        for way, how in words["WAYS"][problem].items():
            for n in (
                SIZES if problem == "signorini" else (THROWN["n"] if problem == "thrown" else 0,)
            ):
                row = start | {
                    "way": way,
                    "how": how,
                    "n": n,
                    "stops": words["STOPS"][problem][way],
                }
                row["lines"] = lines_of(path_of(name), problem)
                if problem in words["BY_HAND"]:
                    row["by_hand"] = words["BY_HAND"][problem]
                rows.append(row | one(name, problem, n, way))
                print(
                    json.dumps(
                        {
                            key: rows[-1].get(key)
                            for key in ("name", "problem", "way", "n", *COLUMNS[problem], "failed")
                        }
                    ),
                    file=sys.stderr,
                    flush=True,
                )
    return rows


def one(name: str, problem: str, n: int, way: str) -> dict[str, Any]:
    """Return processor times and measures of a row, or why there are none."""
    best: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "answer.npz"
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [sys.executable, str(path_of(name)), problem, str(n), way, str(out)]
            try:
                done = subprocess.run(
                    command,
                    cwd=folder,
                    capture_output=True,
                    text=True,
                    timeout=4 * LIMIT,
                    check=False,
                    preexec_fn=limited,
                )
            except subprocess.TimeoutExpired:
                return {"failed": f"not done after {4 * LIMIT} s by the clock"}
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            process = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            if process > LIMIT:
                return {"failed": f"not done after {LIMIT} s of processor time"}
            if done.returncode or not out.exists():
                return {"failed": reason(done.stderr or done.stdout)}
            with np.load(out) as stored:
                answer = {key: stored[key] for key in stored.files}
            if not best or process < best["process"]:
                best = {
                    "process": round(process, 3),
                    "solve": round(float(answer["solve"]), 4),
                    "clock": round(float(answer["clock"]), 3),
                }
            if process > LONG:
                break
        found = measure(problem, answer, n)
        if "energy" in answer:  # for the figure: 80 values over the first
            told = answer["energy"] / initial_energy(problem)
            every = len(told) // 80
            best["energies"] = [float(f"{value:.4g}") for value in told[every - 1 :: every]]
    return best | {key: float(f"{value:.6g}") for key, value in found.items()}


def limited() -> None:
    """Let the process that begins here, and each that it starts, have so much processor time."""
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 5))


def reason(text: str) -> str:
    """Return the last line that says something, without the places of this machine."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return (
        lines[-1].replace(str(HERE), "benchmarks/peers")[:200] if lines else "ended without a word"
    )


def machine() -> dict[str, Any]:
    """Return what a reader must know of the machine."""
    model = next(
        (
            line.split(":")[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if "model name" in line
        ),
        "unknown",
    )
    release = next(
        (
            line.split("=")[1].strip('"')
            for line in Path("/etc/os-release").read_text().splitlines()
            if line.startswith("PRETTY")
        ),
        "",
    )
    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "cpu": model,
        "cores": os.cpu_count(),
        "system": release,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "load": round(os.getloadavg()[0], 1),
    }


def table(rows: list[dict[str, Any]], problem: str) -> str:
    """Return the rows of a problem as a table in Markdown."""
    columns = COLUMNS[problem]
    lines = [
        "| program | way | " + " | ".join(name.replace("_", " ") for name in columns) + " |",
        "|---|---|" + "---|" * len(columns),
    ]
    for row in rows:
        if row["problem"] != problem:
            continue
        if "failed" in row:
            lines.append(
                f"| {row['peer']} | {row.get('way', '')} | {row['failed']} |"
                + " |" * (len(columns) - 1)
            )
        else:
            lines.append(
                f"| {row['peer']} | {row['way']} | "
                + " | ".join(shown(key, row[key]) for key in columns)
                + " |"
            )
    return "\n".join(lines)


def ways(rows: list[dict[str, Any]]) -> str:
    """Return how each program solved each problem, as a table in Markdown."""
    lines = ["| program | problem | way | how | by hand |", "|---|---|---|---|---|"]
    said = dict.fromkeys((row["peer"], row["problem"], row.get("way", "")) for row in rows)
    first = {(row["peer"], row["problem"], row.get("way", "")): row for row in reversed(rows)}
    for key in said:
        row = first[key]
        lines.append(f"| {' | '.join(key)} | {row.get('how', '')} | {row.get('by_hand', '')} |")
    return "\n".join(lines)


def summary(about: dict[str, Any], rows: list[dict[str, Any]]) -> str:
    """Return date, machine and versions of a run as a sentence and a list."""
    cpu = about["cpu"].removesuffix(" Processor")
    lines = [
        f"The run of {about['date']}: {cpu}, {about['cores']} cores, load {about['load']} at the "
        f"end, {about['system']}, Python {about['python']}, numpy {about['numpy']}.",
        *(f"{peers} ran again: {when}." for peers, when in about.get("renewed", {}).items()),
        "",
    ]
    versions = dict.fromkeys((row["peer"], row.get("version", "not installed")) for row in rows)
    return "\n".join([*lines, *(f"- {peer} {version}" for peer, version in versions)])


def renew(stored: dict[str, Any], files: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a stored run in which programs have the rows of later runs, told with their dates.

    Lines of code are counted anew in all rows.
    """
    rows = list(stored["rows"])
    dates: dict[str, str] = {}
    for file in files:
        names = {row["name"] for row in file["rows"]}
        place = next(number for number, row in enumerate(rows) if row["name"] in names)
        rows = [row for row in rows if row["name"] not in names]
        rows[place:place] = file["rows"]
        peers = " and ".join(dict.fromkeys(row["peer"] for row in file["rows"]))
        dates[peers] = f"{file['about']['date']}, {file['about']['cpu']}"
    for row in rows:
        if "lines" in row:
            row["lines"] = lines_of(path_of(row["name"]), row["problem"])
    return {"about": stored["about"] | {"renewed": dates}, "rows": rows}


def store(stored: dict[str, Any], path: Path) -> None:
    """Write a run, a line for each row."""
    text = ",\n".join(json.dumps(row) for row in stored["rows"])
    about = json.dumps(stored["about"])
    path.write_text(f'{{"about": {about},\n"rows": [\n{text}\n]}}\n', encoding="utf-8")


def parts_of(stored: dict[str, Any]) -> dict[str, str]:
    """Return what the page tells of a stored run, by the name of its place."""
    rows = stored["rows"]
    tables = {problem: table(rows, problem) for problem in PROBLEMS}
    return {"about": summary(stored["about"], rows)} | tables | {"ways": ways(rows)}


def renewed(page: str, parts: dict[str, str]) -> str:
    """Return the page with new text between `<!-- NAME -->` and `<!-- end -->`."""
    for name, text in parts.items():
        before, mark, rest = page.partition(f"<!-- {name} -->\n")
        if not mark:
            raise ValueError(f"the page has no line <!-- {name} -->")
        page = f"{before}{mark}\n{text}\n\n<!-- end -->{rest.partition('<!-- end -->')[2]}"
    return page


def shown(key: str, value: Any) -> str:
    """Return a number as the tables show it: times in s, energies and errors as they are."""
    if key == "stops":
        return str(value)
    if key in ("n", "lines"):
        return str(int(value))
    if key.startswith("energy_") and key != "energy_error":
        return f"{value:.4f}" if abs(value) < 1e3 else f"{value:.1e}"
    if key in ("solve", "process"):
        return f"{value:.2f}"
    return (
        "0"
        if abs(value) < 1e-15
        else f"{value:.1e}"
        if value < 1e-2 or value >= 1e3
        else f"{value:.3f}"
    )


def main() -> None:
    """Run or join rows, print the tables, store them if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--join", nargs="*", help="join these files of rows; nothing is run")
    parser.add_argument(
        "--renew", nargs="+", help="take the rows of these files into results.json; nothing is run"
    )
    parser.add_argument("--json", help="file for machine, date, versions and rows")
    parser.add_argument(
        "--page", help="page whose tables become those of results.json, without runs"
    )
    given = parser.parse_args()
    if given.page:
        stored = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
        page = Path(given.page)
        page.write_text(
            renewed(page.read_text(encoding="utf-8"), parts_of(stored)), encoding="utf-8"
        )
        return
    if given.renew:
        stored = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
        files = [json.loads(Path(file).read_text(encoding="utf-8")) for file in given.renew]
        store(renew(stored, files), HERE / "results.json")
        return
    about = machine()
    if given.join is None:
        rows = [row for name in given.names for row in rows_of(name)]
    else:
        rows = [
            row
            for file in given.join
            for row in json.loads(Path(file).read_text(encoding="utf-8"))["rows"]
        ]
    print(summary(about, rows))
    for problem in PROBLEMS:
        print(f"\n{problem}\n\n{table(rows, problem)}")
    if given.json:
        store({"about": about, "rows": rows}, Path(given.json))


if __name__ == "__main__":
    main()
