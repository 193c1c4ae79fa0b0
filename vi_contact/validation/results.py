"""Keep what entries found as rows of a csv file, and tell what has moved since.

The files of ``stored`` are those of the last run of the whole book at each setting. They are what
was found before; a limit says what is right.
"""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.files import write_csv
from ..core.own_files import read_bytes
from .runner import Outcome

RESULTS = Path(__file__).resolve().parent / "stored"
COLUMNS = (
    "entry",
    "setting",
    "figure",
    "unit",
    "found",
    "wanted",
    "error",
    "limit",
    "verdict",
    "reason",
    "seconds",
    "unknowns",
    "certificate",
    "energy_defect",
)
# CHOSEN, of the limit: a figure that differs by more from the last run has moved. So much another
# mesh may change it at most, and another release of Gmsh makes another mesh.
MOVED = 1.0 / 3.0
PATIENCE = 30.0  # seconds that an entry is expected to take of which nothing is stored

Row = Mapping[str, Any]  # a row of results, column -> text or number


def rows_of(outcome: Outcome) -> list[dict[str, Any]]:
    """Return a row for every figure of an outcome, and one for an entry without figures."""
    found = outcome.found
    common = {
        "entry": outcome.name,
        "setting": outcome.setting,
        "seconds": round(outcome.seconds, 2),
        "unknowns": 0 if found is None else found.unknowns,
        "certificate": math.nan if found is None else found.certificate,
        "energy_defect": math.nan if found is None else found.defect,
    }
    if not outcome.judgements:
        return [common | {"verdict": outcome.status, "reason": " ".join(outcome.why)}]
    rows = []
    for one in outcome.judgements:
        rows.append(
            common
            | {
                "figure": one.name,
                "unit": one.unit,
                "found": one.found,
                "wanted": one.wanted,
                "error": one.error,
                "limit": one.limit,
                "verdict": one.verdict,
                "reason": one.reason,
            }
        )
    for name, value in outcome.told.items():
        assert outcome.entry is not None
        told = next(one for one in outcome.entry.told if one.name == name)
        rows.append(
            common
            | {
                "figure": name,
                "unit": told.unit,
                "found": value,
                "verdict": "told",
                "reason": told.reason,
            }
        )
    return rows


def write_results(path: str | Path, outcomes: Iterable[Outcome]) -> None:
    """Write the rows of outcomes as a csv file."""
    write_rows(path, [row for outcome in outcomes for row in rows_of(outcome)])


def write_rows(path: str | Path, rows: Iterable[Row]) -> None:
    """Write rows of results as a csv file; NaN is an empty cell."""
    table = []
    for row in rows:
        cells = [row.get(column) for column in COLUMNS]
        table.append([None if cell != cell else cell for cell in cells])
    write_csv(path, COLUMNS, table)


def read_results(setting: str) -> list[Row]:
    """Return the stored rows of a setting, none where nothing is stored."""
    path = RESULTS / f"{setting}.csv"
    if not path.is_file():
        return []
    rows: list[Row] = []
    for texts in csv.DictReader(io.StringIO(read_bytes(path).decode())):
        numbers = {}
        for key in ("found", "wanted", "error", "limit", "seconds", "certificate", "energy_defect"):
            numbers[key] = float(texts[key]) if texts[key] else math.nan
        rows.append({**texts, **numbers})
    return rows


def find_moved(outcome: Outcome, stored: Sequence[Row]) -> list[str]:
    """Return sentences about the figures that differ from those of the last run of the book.

    Args:
        outcome: what was found now.
        stored: the rows of its setting.
    """
    before = {row["figure"]: row["found"] for row in stored if row["entry"] == outcome.name}
    sentences = []
    for one in outcome.judgements:
        last = before.get(one.name, one.found)
        if abs(one.found - last) > MOVED * one.limit:
            sentences.append(
                f"{outcome.name}: '{one.name}' has moved from {last:.8g} to {one.found:.8g}"
            )
    return sentences


def estimate_seconds(name: str, stored: Sequence[Row]) -> float:
    """Return how long an entry took in the last run of the book."""
    return max((row["seconds"] for row in stored if row["entry"] == name), default=PATIENCE)
