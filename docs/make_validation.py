"""Write docs/reference/validation.md from the entries of the validation book and stored results.

    python3 docs/make_validation.py            # write the page, and the words of stored results:
                                               # after every change of an entry
    python3 docs/make_validation.py --check    # say whether it is up to date
    python3 docs/make_validation.py --run      # compute all entries first: results and pictures too
    python3 docs/make_validation.py --run wedge dam    # these only, beside what is stored

The records of some entries must stand where VI_CONTACT_RECORDS says.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from vi_contact.validation import Entry, entry_names, read_entry, run_entry
from vi_contact.validation.data import NEEDED
from vi_contact.validation.entry import KINDS, RECORDS, SETTINGS
from vi_contact.validation.report import draw_outcome, input_rows
from vi_contact.validation.results import RESULTS, read_results, rows_of, write_rows
from vi_contact.validation.runner import (
    FAIL,
    KNOWN,
    PASS,
    compare_groups,
    count_within,
    group_by_reason,
)

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "validation.md"
FIGURES = ROOT / "docs" / "figures"
SHOWN = (".csv", ".toml", ".py", ".md")  # files of an entry that the page has links to
Rows = Sequence[Any]

HEAD = f"""# Validation book

This page is for readers who ask how far results of vi_contact agree with measurements, with
numbers of other programs and with textbooks. One entry, the ball, is compared with a measurement;
blocks, blocks_on_slope and columns with numbers of a program; the others with closed forms, a
textbook, or a calculation by hand. [Verification](verification.md) has what must agree
to round-off or to the order of a method. Here every limit has a reason of one sentence, and every
entry says what its result is not.

The entries blocks_on_slope and columns use MoreauJean. With the default scheme the slips of the
same models are larger: 4 % for the block, 10 to 22 % for columns of 16 and 8 cells, see
[limitations](limitations.md).

The page is written by `docs/make_validation.py` from the files in `vi_contact/validation`. Each
entry is a folder there: `data.csv` has the numbers of the source with licence and uncertainty,
`entry.toml` the inputs, limits and reasons, and `run.py` the computation. Coarse and fine are the
two settings of which this page has the results; sizes of cells and steps of both stand near the
head of `run.py`, and those of dams_by_hand in that of dam. In blocks both settings compute the
same. Nobody needs this page to repeat it:

    vi-contact validate                  # all entries at the coarse setting, in a few minutes
    vi-contact validate wedge --fine     # one of them with finer meshes and shorter steps
    vi-contact validate --mutants        # wrong inputs too, each of which must be noticed
    vi-contact validate --out report     # report.csv, report.pdf and pictures

The command ends with a status other than 0 when a figure is missing, NaN or outside of its limit,
when data were changed, and when a run ends in an error. Some entries need records that are not
part of the package. They are skipped, and this is printed, unless the environment variable
`{RECORDS}` names the folder of the records. Those of SLAMMER are in the public domain, and in
the folder `src/pyslammer/sample_ground_motions` of
[pySLAMMER](https://github.com/pySLAMMER/pySLAMMER) (commit dd8cfad3); `entry.toml` has the
checksum of each.

A changed value of `data.csv` is noticed in two ways. The file has a checksum in `entry.toml`, so
that any change fails. A value that is changed by two limits also fails by its figure. In a series
of many values, which is judged by statistics, a single value is noticed by the checksum alone.

There are two numbers for each figure: the limit says what is right, and the stored results in
`vi_contact/validation/stored` say what was found before. The command tells a figure that has
moved by more than a third of its limit since then, and a test fails.

A figure is *told* when it is of interest and nothing says what is right. A *known difference* is
one that does not agree: its limit only keeps it from growing, and the first table does not count
it as within.

The [certificate](glossary.md#certificate) says how well an answer satisfies all conditions of its
step: 0 is exact, and the worst of all steps and static stages is given. The
[energy defect](glossary.md#defect) is the energy that the ledger of a run in time cannot explain;
that of the worst run is given, over the largest energy or work of that run. Neither measures the
error of mesh or time step. Seconds are those of one core of a small machine.
"""

FOOT = """## Not in the book yet

- **Graphite bricks** (81 of them on a shaking table, measured): many bodies with gaps between
  them, each with clearances that are part of the data.
- **Stick-slip of a fault of 4 m** (FB03-087, measured by Okubo, Yamashita and Fukuyama: 56 events
  that drop the stress by 0.0203 MPa and slip 0.0342 mm). The program has what it needs: friction
  of rate and state, and steps by the slip rate. What is missing is data: a, b and dc of the
  surface in this run, the stiffness of the frame and of the jack that pulls, the mass and the
  supports of both blocks, and the normal stress along the fault, which is not even. The drop of an
  event goes with b - a and the slip with the drop over the stiffness, so any two could be met by
  chosen numbers, and nothing would be compared.
- **SSNP142 of code_aster** (a joint of a dam): its joint is a penalty, and its geometry is not
  at hand.
- **Example 8.8 of Kramer and Stewart**, and the periods of Pine Flat dam with its reservoir: the
  second is not made yet.
- **Statistics of rocking blocks, and pounding of buildings**: their tables are not public, and
  have to be fetched by hand.
"""


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield "| " + " | ".join(header) + " |"
    yield "|" + "---|" * len(header)
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
    yield ""


def digits(value: float) -> str:
    """Return a number with six digits, a dash for none."""
    return "-" if math.isnan(value) else f"{value:.6g}"


def overview(entries: Sequence[Entry], stored: dict[str, Rows]) -> Iterator[str]:
    """Yield the table of all entries."""
    yield "## Entries\n"
    rows = []
    for entry in entries:
        cells = [f"[{entry.name}](#{entry.name.replace('_', '-')})", KINDS[entry.kind], entry.title]
        for setting in ("coarse", "fine"):
            own = [row for row in stored[setting] if row["entry"] == entry.name]
            verdicts = [row["verdict"] for row in own]
            within, judged = count_within(verdicts)
            known = verdicts.count(KNOWN)
            seconds = own[0]["seconds"] if own else math.nan
            count = f"{within} of {judged}"
            if known:
                count += f", and {known} known differences"
            cells += [count, f"{seconds:.0f}"]
        rows.append(cells)
    header = ("entry", "numbers are", "title", "within, coarse", "s", "within, fine", "s")
    yield from table(header, rows)


def section(entry: Entry, stored: dict[str, Rows]) -> Iterator[str]:
    """Yield the lines about an entry."""
    own = {
        setting: [row for row in rows if row["entry"] == entry.name]
        for setting, rows in stored.items()
    }
    yield f"## {entry.name.replace('_', ' ')}\n"
    yield f"**{entry.title}.** {entry.about}\n"
    yield f"Kind of the numbers: {KINDS[entry.kind]}.\n"
    folder = f"../../vi_contact/validation/entries/{entry.name}"
    files = sorted(path.name for path in entry.folder.iterdir() if path.suffix in SHOWN)
    files.remove("__init__.py")
    # The site takes a link to a page for one of its own: of texts it names the file alone.
    links = [
        f"`{name}`" if name.endswith(".md") else f"[{name}]({folder}/{name})" for name in files
    ]
    yield f"Files of the entry: {', '.join(links)}.\n"
    about = [(key, entry.data.about[key]) for key in NEEDED]
    yield from table(("data.csv", ""), about)
    yield "How it is computed:\n"
    yield from (f"- {sentence}" for sentence in entry.model)
    yield "\nWhat the result is not:\n"
    yield from (f"- {sentence}" for sentence in entry.is_not)
    yield ""
    if (FIGURES / f"validation_{entry.name}.png").is_file():
        yield f"![{entry.title}](../figures/validation_{entry.name}.png)\n"
    yield from cost(own)
    yield from judged_figures(own)
    yield from reasons(own)
    yield from series(entry, own)
    yield from table(("input", "value", "unit", "kind", "source"), input_rows(entry))
    names = ", ".join(mutant.name for mutant in entry.mutants)
    yield f"Wrong inputs that must be noticed, and are, in `tests/validation_book`: {names}.\n"


def cost(own: dict[str, Rows]) -> Iterator[str]:
    """Yield the table of seconds, unknowns, certificate and energy defect."""
    rows = []
    for setting in ("coarse", "fine"):
        for row in own[setting][:1]:
            defect = row["energy_defect"]
            rows.append(
                (
                    setting,
                    f"{row['seconds']:.1f}",
                    str(row["unknowns"]),
                    f"{row['certificate']:.1e}" if row["certificate"] > 0.0 else "-",
                    f"{defect:.1e}" if defect == defect else "-",
                )
            )
    yield from table(("setting", "seconds", "unknowns", "certificate", "energy defect"), rows)


def judged_figures(own: dict[str, Rows]) -> Iterator[str]:
    """Yield the table of figures that are judged by themselves or told."""
    coarse = {row["figure"]: row for row in own["coarse"]}
    fine = {row["figure"]: row for row in own["fine"]}
    rows = []
    for name, row in (fine | coarse).items():
        if row["verdict"] in ("within", "outside"):
            continue
        cells = [name, row["unit"]]
        for of_setting in (coarse, fine):
            cells.append(digits(of_setting[name]["found"]) if name in of_setting else "-")
        cells += [digits(row["wanted"]), f"{row['error']:.2g}", f"{row['limit']:.2g}"]
        verdicts = {one[name]["verdict"] for one in (coarse, fine) if name in one}
        cells.append("fail" if "fail" in verdicts else row["verdict"])
        rows.append([cell.replace("nan", "-") for cell in cells])
    header = ("figure", "unit", "coarse", "fine", "wanted", "error", "limit", "verdict")
    yield from table(header, rows)


def reasons(own: dict[str, Rows]) -> Iterator[str]:
    """Yield the reasons of the limits, each with its figures."""
    rows = [*own["coarse"], *own["fine"]]
    pairs = group_by_reason((row["figure"], row["reason"]) for row in rows)
    yield from table(("figure", "why this limit"), pairs)


def series(entry: Entry, own: dict[str, Rows]) -> Iterator[str]:
    """Yield a sentence about each series, and each other group of many values."""
    for setting in ("coarse", "fine"):
        rows = {row["figure"]: row for row in own[setting]}
        figures = {name: row["found"] for name, row in rows.items()}
        wanted = entry.list_wanted(setting) if rows else []
        for group, one in compare_groups(wanted, figures).items():
            members = [each for each in wanted if each.group == group]
            unit = "" if members[0].unit == "-" else f" {members[0].unit}"
            known = sum(each.known for each in members)
            also = f"; {known} are known differences" if known else ""
            yield (
                f"At the setting {setting} {one.count} values of *{group}* have the slope "
                f"{one.slope:.5f}, the intercept {one.intercept:.3g}{unit} and R² = {one.r2:.6f}. "
                f"Of them {100 * one.share:.1f} % are within their limits{also}; the median of the "
                f"relative error is {100 * one.median:.2f} %. The largest difference is "
                f"{one.largest:.3g}{unit}, at {one.where}.\n"
            )
        outside = [name for name, row in rows.items() if row["verdict"] == "outside"]
        if outside:
            yield "Outside of their limits are:\n"
            yield from (f"- {name}" for name in outside)
            yield ""


def reworded(entries: Sequence[Entry], setting: str) -> Rows:
    """Return the stored rows of a setting with the reasons and verdicts of today's entries."""
    reason = {}
    known = set()
    for entry in entries:
        wanted = entry.list_wanted(setting)
        for one in [*wanted, *entry.statistics, *entry.told]:
            reason[entry.name, one.name] = one.reason
        known |= {(entry.name, one.name) for one in wanted if one.known}
    rows = []
    for row in read_results(setting):
        key = row["entry"], row["figure"]
        verdict = row["verdict"]
        if verdict in (PASS, KNOWN):
            verdict = KNOWN if key in known else PASS
        rows.append({**row, "reason": reason.get(key, row["reason"]), "verdict": verdict})
    return rows


def written(entries: Sequence[Entry], stored: dict[str, Rows]) -> str:
    """Return the page about these entries and the stored rows of settings."""
    lines = [HEAD, *overview(entries, stored)]
    for entry in entries:
        lines += section(entry, stored)
    return "\n".join([*lines, FOOT])


def run_all(names: Sequence[str]) -> int:
    """Compute entries at all settings, store their results and pictures; return how many failed."""
    failed = 0
    for setting in SETTINGS:
        stored = {name: [] for name in entry_names()} | {
            name: [row for row in read_results(setting) if row["entry"] == name]
            for name in entry_names()
        }
        for name in names:
            outcome = run_entry(name, setting=setting)
            print(f"{setting} {name}: {outcome.status}, {outcome.seconds:.1f} s", flush=True)
            print("".join(f"  {why}\n" for why in outcome.why), end="", flush=True)
            failed += outcome.status == FAIL
            if outcome.found is None:
                continue
            stored[name] = rows_of(outcome)
            if setting == "coarse":
                draw_outcome(outcome, FIGURES / f"validation_{name}.png")
        RESULTS.mkdir(exist_ok=True)
        write_rows(RESULTS / f"{setting}.csv", [row for rows in stored.values() for row in rows])
    return failed


def main() -> int:
    """Write the page, after computing entries with --run; with --check say if it is up to date."""
    arguments = sys.argv[1:]
    names = [name for name in arguments if not name.startswith("--")]
    failed = run_all(names or entry_names()) if "--run" in arguments else 0
    entries = [read_entry(name) for name in entry_names()]
    stored = {setting: reworded(entries, setting) for setting in SETTINGS}
    page = written(entries, stored)
    if "--check" in arguments:
        if PAGE.read_text(encoding="utf-8") != page:
            print(
                f"{PAGE.name} is not that of the stored results: python3 docs/make_validation.py",
                file=sys.stderr,
            )
            return 1
        return 0
    for setting, rows in stored.items():
        write_rows(RESULTS / f"{setting}.csv", rows)
    PAGE.write_text(page, encoding="utf-8")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
