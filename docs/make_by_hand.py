"""Write docs/guide/by_hand.md: ten cases, calculated by hand and run.

    python3 docs/make_by_hand.py                 # write the page, after a change of docs/by_hand
    python3 docs/make_by_hand.py --check         # say whether it is up to date
    python3 docs/make_by_hand.py --run           # run all cases first, in some minutes
    python3 docs/make_by_hand.py --run quay wall # these only, beside what is stored

docs/by_hand has a file for each case. Its lines are worked off from top to bottom: a formula knows
what is given, g, and the symbols of the lines above it. ``sheet`` is arithmetic of columns of the
history, and ``at`` the row: rest, largest, or change from rest to the end. ``period`` is a natural
period of the model, of a case with other ``settings`` if there are any. Run folders are left in
build/by_hand; what was found in them is stored in docs/by_hand/found.csv. docs/make_wall_steps.py
stores the tables at the end of the page.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.units import STANDARD_GRAVITY
from vi_contact.practice.studies.cases.expressions import Expression
from vi_contact.practice.units.reading import read_unit
from vi_contact.practice.units.report_units import ReportUnits, choose_unit, write_number

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "by_hand"
FOUND = FOLDER / "found.csv"
STEPS = FOLDER / "steps.csv"
SHEETS = FOLDER / "sheets.csv"
PAGE = ROOT / "docs" / "guide" / "by_hand.md"
RUNS = ROOT / "build" / "by_hand"
UNITS = ReportUnits()
NAMES = (  # in the order of the page
    "wall",
    "dam",
    "pier",
    "pounding",
    "culvert",
    "cantilever",
    "quay",
    "buttress",
    "two_towers",
    "monument",
)
EXACT = 1e-6  # an accuracy below this is that of statics, and not of an estimate
_WORD = re.compile(r"\b[A-Za-z_]\w*\b", re.ASCII)

HEAD = """# Ten cases by hand

This page is for engineers who check a model before they sign for it. It has ten cases: the five
[shipped ones](practice.md) and five of other geometry in `demos/cases`. Each has a calculation by
hand, and beside it what the run found. The calculation was written down before the runs of this
page. Results of the shipped cases were known before from the page on [practice](practice.md), and
natural periods of the other five from `--check`, with which their files were tried.

    vi-contact run demos/cases/quay.toml --check
    vi-contact run demos/cases/quay.toml --out results/quay

A calculation is a list of lines. A formula knows the inputs above it, the symbols of earlier lines
and g = 9.80665 m/s². In plane strain forces are those of a metre, in kN/m. The column *accuracy*
says what the formula may be off, and was written down with it:

- *exact* numbers are statics. The run must have them but for round-off.
- A *lower* or an *upper* bound says that the run has more, or less.
- A percentage is that of an estimate. *Orientation* in the column *basis* marks formulas of
  another model, such as soil that yields. An accuracy *of B* is a share of that length.

The last column is *sheet* over *by hand*, or their difference as a share of a length. Where it is
outside of the accuracy, a sentence below the table says why. The page is written by
`docs/make_by_hand.py` from the files in `docs/by_hand` and stored results.
`python3 docs/make_by_hand.py --run` computes them anew.
"""

STEPS_HEAD = """## The wall at four time steps

This is the shipped wall under a record, at time steps of 10, 5, 2.5 and 1.25 ms. The record is El
Centro 1940, component north-south, in the version of Peknold: 31.2 s with a peak of 0.319 g. It has
a value every 20 ms and is not part of the package. `docs/make_wall_steps.py FILE` repeats the runs.
"""

STEPS_FOOT = """- **Peaks of thrust and moment last one step** and depend on it: the thrust
  doubles from 10 to 2.5 ms, and falls by 6 % from there to 1.25 ms. They are impacts: the fill, of
  which the stem has parted, strikes it. No number of these rows is a limit, and none may be signed
  for.
- **The mean of the thrust over 20 ms** hardly depends on the step. It is 1.4 times the thrust of
  Mononobe and Okabe under 0.25 g. The mean of the moment still falls as the step is halved.
- **Sway, open share, normal force and pressure under the toe** change little with the step and can
  be read at 10 ms. Sliding changes by 8 % from 10 to 5 ms, and by 3 % from there. It is along x:
  the wall goes to the left, away from its fill.
- **The thrust at the end is zero.** Elastic fill keeps its place, and a wall that has slid by
  2.6 mm does not touch it any more. Real fill follows the wall.
"""

SHEETS_HEAD = """### What page 1 of the report says

The same runs, each with `vi-contact report DIR --halved`: the numbers that decide, how long they
last above 90 %, and whether half the time step changes them by more than 5 %. A peak that lasts one
step in both runs is not converged, however little it changes. On one core the run of 10 ms took
10 s. Its report took 10 s, and with half the time step 56 s; the one of 2.5 ms took 131 s.
"""


@dataclass(frozen=True, kw_only=True)
class Line:
    """Hold a line of a calculation.

    Attributes:
        symbol: the name by which later lines call it.
        what: it is, in words.
        formula: arithmetic of what is given and of symbols above.
        unit: of its value, in the SI.
        basis: the source of the formula.
        quantity: the field of ``ReportUnits`` in whose unit it is written; lengths are sizes.
        accuracy: what it may be off, relative to ``scale`` or to the value; None: a bound or none.
        bound: "upper" or "lower".
        scale: formula of what the accuracy is relative to; "": the value.
        sheet: arithmetic of at most three columns of the history; "": no result of the run.
        at: the row: "rest", "largest" or "change".
        period: number of the natural period, from 1; 0: none.
        check: name of the check whose result it is; "": none.
        settings: of the case whose period it is, beside those in the file.
        why: the sentence on a difference beyond the accuracy.
    """

    symbol: str
    what: str
    formula: str
    unit: str
    basis: str
    quantity: str = ""
    accuracy: float | None = None
    bound: str = ""
    scale: str = ""
    sheet: str = ""
    at: str = ""
    period: int = 0
    check: str = ""
    settings: Sequence[str] = ()
    why: str = ""

    @property
    def is_compared(self) -> bool:
        """Return whether a run has this number."""
        return bool(self.sheet or self.period or self.check)

    @property
    def is_exact(self) -> bool:
        """Return whether it is statics, of which a run has all digits."""
        return self.accuracy is not None and self.accuracy <= EXACT


@dataclass(frozen=True, kw_only=True)
class Calculation:
    """Hold the calculation of a case by hand.

    Attributes:
        name: of its file.
        title: of its section.
        case: the case file, from the root.
        about: sentences on the case.
        given: rows (symbol, value, unit, what it is).
        lines: of the calculation.
        per_metre: whether forces are those of a metre of a body in plane strain.
    """

    name: str
    title: str
    case: str
    about: str
    given: Sequence[tuple[str, float, str, str]]
    lines: Sequence[Line]
    per_metre: bool = True
    values: dict[str, float] = field(init=False)
    scales: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        # Every line sees the ones above it alone.
        known = {"g": STANDARD_GRAVITY}
        for symbol, value, unit, _ in self.given:
            known[symbol] = value * (1.0 if unit == "-" else read_unit(unit)[0])
        values = {}
        scales = {}
        for line in self.lines:
            known[line.symbol] = values[line.symbol] = work_out(line.formula, known)
            scales[line.symbol] = abs(work_out(line.scale or line.formula, known))
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "scales", scales)

    def write(self, line: Line, value: float) -> str:
        """Write a value of a line in the units of the trade."""
        thickness = 1.0 if self.per_metre else None
        quantity = line.quantity or ("size" if line.unit == "m" else "")
        factor, unit = choose_unit(line.unit, UNITS, quantity=quantity, slice_thickness=thickness)
        number = write_number(factor * value, 6 if line.is_exact else 4)
        return f"{number} {unit}".removesuffix(" -")

    def agrees(self, line: Line, found: float) -> bool:
        """Tell whether the number of the run is within the accuracy of the line."""
        value = self.values[line.symbol]
        if line.bound == "upper":
            return found <= value * (1.0 + EXACT)
        if line.bound == "lower":
            return found >= value * (1.0 - EXACT)
        assert line.accuracy is not None, line.symbol
        return abs(found - value) <= line.accuracy * self.scales[line.symbol]


def work_out(formula: str, known: Mapping[str, float]) -> float:
    """Return the value of a formula of known symbols."""

    def insert(word: re.Match[str]) -> str:
        return f"({known[word[0]]!r})" if word[0] in known else word[0]

    return float(Expression(_WORD.sub(insert, formula))())


def read_calculation(name: str) -> Calculation:
    """Return the calculation of a case."""
    table = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    lines = [Line(**line) for line in table.pop("line")]
    return Calculation(name=name, lines=lines, **table)


def pick(line: Line, history: Mapping[str, Any]) -> float:
    """Return the number of the history that a line is compared with."""
    columns = list(dict.fromkeys(word for word in _WORD.findall(line.sheet) if word in history))
    letters = dict(zip(columns, "xyz", strict=False))
    text = _WORD.sub(lambda word: letters.get(word[0], word[0]), line.sheet)
    rows = {letters[column]: np.asarray(history[column]) for column in columns}
    values = np.asarray(Expression(text, "xyz")(**rows))
    if line.at == "rest":
        return float(values[0])
    if line.at == "largest":
        return float(np.nanmax(values))
    return float(values[-1] - values[0])


@cache
def find_periods(case: Path, settings: tuple[str, ...], out: Path) -> list[float]:
    """Return the natural periods [s] that --check finds of a case with these settings."""
    from vi_contact.practice.cli.entry import main as command

    arguments = ["run", str(case), "--check", "--quiet", "--out", str(out)]
    for setting in settings:
        arguments += ["--set", setting]
    with contextlib.redirect_stdout(io.StringIO()):
        status = command(arguments)
    if status != 0:
        raise SystemExit(f"{case.name} cannot be checked")
    model = json.loads((out / "model.json").read_text(encoding="utf-8"))
    return [float(period) for period in model["periods"]]


def run_case(
    calculation: Calculation, wanted: Sequence[Line], *, out: Path, settings: Sequence[str] = ()
) -> dict[str, float]:
    """Run a case and return what lines are compared with, by symbols.

    Args:
        calculation: of the case.
        wanted: lines that a run has the numbers of.
        out: folder of the run, and of models beside it.
        settings: of a shorter run, say.
    """
    from mpi4py import MPI

    from vi_contact.practice.studies import comparisons, read_case

    path = ROOT / calculation.case
    history = read_case(path, list(settings)).run(MPI.COMM_SELF, out=out, progress=False).history
    checks = {}
    if any(line.check for line in wanted):
        checks = {one.name: float(one.found) for one in comparisons(out)}
    found = {}
    for line in wanted:
        if line.sheet:
            found[line.symbol] = pick(line, history)
        elif line.check:
            found[line.symbol] = checks[line.check]
        else:
            folder = out.with_name(f"{out.name}_{line.symbol}")
            periods = find_periods(path, (*settings, *line.settings), folder)
            found[line.symbol] = periods[line.period - 1]
    return found


def read_stored(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table of stored results; none before its runs."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read_found() -> dict[tuple[str, str], float]:
    """Return the stored numbers by case and symbol; none before the first run."""
    return {(row["case"], row["symbol"]): float(row["found"]) for row in read_stored(FOUND)}


def write_found(found: Mapping[tuple[str, str], float]) -> None:
    """Store numbers, in the order of the page."""
    ordered = sorted(found.items(), key=lambda item: NAMES.index(item[0][0]))
    with FOUND.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["case", "symbol", "found"])
        for (case, symbol), value in ordered:
            rows.writerow([case, symbol, f"{value:.10g}"])


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield "| " + " | ".join(header) + " |"
    yield "|" + "---|" * len(header)
    for row in rows:
        yield "| " + " | ".join(row) + " |"
    yield ""


def accuracy_of(line: Line) -> str:
    """Return the accuracy of a line in words."""
    if line.bound:
        return f"{line.bound} bound"
    if line.accuracy is None:
        return ""
    if line.is_exact:
        return "exact"
    return f"{100.0 * line.accuracy:g} %" + (f" of {line.scale}" if line.scale else "")


def row_of(
    calculation: Calculation, line: Line, found: Mapping[tuple[str, str], float]
) -> list[str]:
    """Return the cells of a line."""
    value = calculation.values[line.symbol]
    cells = [f"`{line.symbol}`", line.what, f"`{line.formula}`", line.basis]
    cells += [calculation.write(line, value), accuracy_of(line)]
    key = calculation.name, line.symbol
    if not line.is_compared:
        return [*cells, "", ""]
    if key not in found:
        return [*cells, "not yet run", ""]
    # Round-off of a number that is zero tells nothing.
    if line.is_exact and value == 0.0 and calculation.agrees(line, found[key]):
        return [*cells, calculation.write(line, 0.0), ""]
    if line.scale:
        share = 100.0 * (found[key] - value) / calculation.scales[line.symbol]
        return [*cells, calculation.write(line, found[key]), f"{share:+.2g} % of {line.scale}"]
    ratio = write_number(found[key] / value, 6 if line.is_exact else 3)
    return [*cells, calculation.write(line, found[key]), ratio]


def section(calculation: Calculation, found: Mapping[tuple[str, str], float]) -> Iterator[str]:
    """Yield the section of a case."""
    yield f"## {calculation.title}\n"
    yield f"{calculation.about} The case is `{calculation.case}`.\n"
    inputs = [
        [f"`{symbol}`", what, f"{write_number(value)} {unit}".removesuffix(" -")]
        for symbol, value, unit, what in calculation.given
    ]
    yield from table(["input", "what it is", "value"], inputs)
    rows = [row_of(calculation, line, found) for line in calculation.lines]
    header = ["line", "what it is", "formula", "basis", "by hand", "accuracy", "sheet", "ratio"]
    yield from table(header, rows)
    reasons = [f"- `{line.symbol}`: {line.why}" for line in calculation.lines if line.why]
    if reasons:
        yield "\n".join(reasons) + "\n"


def find_unexplained(
    calculations: Sequence[Calculation], found: Mapping[tuple[str, str], float]
) -> Iterator[str]:
    """Yield numbers beyond their accuracy without a reason."""
    for calculation in calculations:
        for line in calculation.lines:
            key = calculation.name, line.symbol
            if line.why or not line.is_compared or key not in found:
                continue
            if not calculation.agrees(line, found[key]):
                yield f"{calculation.name}: {line.symbol}: {found[key]:.6g}"


def steps_section() -> Iterator[str]:
    """Yield the section on the wall at four time steps; nothing before these runs."""
    stored = read_stored(STEPS)
    if not stored:
        return
    yield STEPS_HEAD
    columns = list(dict.fromkeys(row["dt"] for row in stored))
    rows: dict[str, list[str]] = {}
    for row in stored:
        factor, unit = choose_unit(row["unit"], UNITS, slice_thickness=1.0)
        number = write_number(factor * float(row["value"]))
        name = row["name"] + (f" [{unit}]" if unit != "-" else "")
        rows.setdefault(name, [name]).append(number)
    yield from table(["", *(f"{1e3 * float(dt):g} ms" for dt in columns)], list(rows.values()))
    yield STEPS_FOOT
    yield from sheets_table()


def sheets_table() -> Iterator[str]:
    """Yield what page 1 of the report says at each time step; nothing before these runs."""
    stored = read_stored(SHEETS)
    if not stored:
        return
    yield SHEETS_HEAD
    columns = list(dict.fromkeys(row["dt"] for row in stored))
    rows: dict[str, list[str]] = {}
    for row in stored:
        cells = rows.setdefault(row["number"], [row["number"]])
        cells += [f"{row['value']}; {row['lasts']}", row["halved"]]
    header = [""]
    for dt in columns:
        header += [f"{1e3 * float(dt):g} ms", "converged in time? (dt/2)"]
    yield from table(header, list(rows.values()))


def written() -> str:
    """Return the page of the calculations and of stored results."""
    found = read_found()
    lines = [HEAD]
    for name in NAMES:
        lines += section(read_calculation(name), found)
    lines += steps_section()
    return "\n".join(lines)


def main() -> int:
    """Write the page, after running cases with --run; with --check say if it is up to date."""
    arguments = sys.argv[1:]
    if "--run" in arguments:
        names = [name for name in arguments if not name.startswith("--")] or NAMES
        found = read_found()
        for name in names:
            calculation = read_calculation(name)
            wanted = [line for line in calculation.lines if line.is_compared]
            for symbol, value in run_case(calculation, wanted, out=RUNS / name).items():
                found[name, symbol] = value
            write_found(found)
            print(name, flush=True)
    unexplained = list(find_unexplained([read_calculation(name) for name in NAMES], read_found()))
    for one in unexplained:
        print(f"a line beyond its accuracy needs a reason, why = …: {one}", file=sys.stderr)
    if "--check" not in arguments:
        PAGE.write_text(written(), encoding="utf-8")
    elif PAGE.read_text(encoding="utf-8") != written():
        print(
            f"{PAGE.name} is not that of docs/by_hand: python3 docs/make_by_hand.py",
            file=sys.stderr,
        )
        return 1
    return int(bool(unexplained))


if __name__ == "__main__":
    sys.exit(main())
