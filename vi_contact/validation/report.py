"""Write the report on outcomes of the validation book: a csv file, pictures, and a PDF."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..core.version import __version__
from ..practice.plots.pages import write_pages
from ..practice.plots.sections import Section, Table
from ..practice.units.report_units import write_number
from .entry import KINDS, Entry
from .results import write_results
from .runner import FAIL, SKIP, Outcome, count_within, group_by_reason
from .statistics import QUANTITIES, Agreement

HEADER = ("figure", "unit", "found", "wanted", "error", "limit", "verdict")


def write_report(folder: str | Path, outcomes: Sequence[Outcome]) -> list[Path]:
    """Write report.csv, report.pdf and a picture of each entry; return their paths.

    Args:
        folder: where they go; it is made if it does not exist.
        outcomes: of one setting.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "report.csv"
    write_results(table, outcomes)
    pictures = {}
    for outcome in outcomes:
        picture = draw_outcome(outcome, folder / f"{outcome.name}.png")
        if picture is not None:
            pictures[outcome.name] = picture
    sections = [_sum_up(outcomes)]
    for outcome in outcomes:
        own = [pictures[outcome.name]] if outcome.name in pictures else []
        sections.append(_section_of(outcome, own))
    page = folder / "report.pdf"
    write_pages(
        page,
        "Validation of vi_contact",
        [("version", __version__), ("setting", outcomes[0].setting if outcomes else "-")],
        sections,
        f"vi_contact {__version__}",
    )
    return [table, page, *pictures.values()]


def draw_outcome(outcome: Outcome, path: Path) -> Path | None:
    """Draw what an entry found, by the function ``draw`` of its run.py; None without one."""
    if outcome.entry is None or outcome.found is None or not hasattr(outcome.entry.run, "draw"):
        return None
    outcome.entry.run.draw(outcome.found, outcome.entry.data, path)
    return path


def _sum_up(outcomes: Sequence[Outcome]) -> Section:
    """Return the section with a line for each entry."""
    rows = []
    for outcome in outcomes:
        found = outcome.found
        within, judged = count_within([one.verdict for one in outcome.judgements])
        rows.append(
            (
                outcome.name,
                outcome.status,
                f"{within} of {judged}",
                f"{outcome.seconds:.1f}",
                "-" if found is None else str(found.unknowns),
                "-" if found is None else write_number(found.certificate),
                "-" if found is None else write_number(found.defect),
            )
        )
    header = (
        "entry",
        "verdict",
        "within limits",
        "seconds",
        "unknowns",
        "certificate",
        "energy defect",
    )
    return Section("Entries", tables=[Table(header, rows)])


def _section_of(outcome: Outcome, pictures: Sequence[Path]) -> Section:
    """Return the section of an entry."""
    entry = outcome.entry
    title = f"{outcome.name}: {outcome.status}"
    if entry is None or not outcome.judgements:
        return Section(title, sentences=outcome.why)
    sentences = [
        f"{entry.title}. Kind: {KINDS[entry.kind]}. {entry.about}",
        *entry.model,
        "What this is not: " + " ".join(entry.is_not),
        f"Source: {entry.data.about['source']}; {entry.data.about['how']}; uncertainty: "
        f"{entry.data.about['uncertainty']}.",
    ]
    reasons = group_by_reason((one.name, one.reason) for one in outcome.judgements)
    tables = [
        Table(HEADER, figure_rows(outcome)),
        Table(("figure", "reason of the limit"), reasons),
    ]
    if outcome.agreements:
        tables.append(Table(("series", *QUANTITIES), agreement_rows(outcome.agreements)))
    tables.append(Table(("input", "value", "unit", "kind", "source"), input_rows(entry)))
    return Section(title, sentences=sentences, tables=tables, pictures=pictures)


def figure_rows(outcome: Outcome) -> list[tuple[str, ...]]:
    """Return the texts of all figures of an outcome, under ``HEADER``."""
    rows = []
    for one in outcome.judgements:
        verdict = one.verdict.replace(FAIL, "FAIL")
        values = (one.found, one.wanted, one.error, one.limit)
        rows.append((one.name, one.unit, *(f"{value:.6g}" for value in values), verdict))
    units = {} if outcome.entry is None else {one.name: one.unit for one in outcome.entry.told}
    for name, value in outcome.told.items():
        rows.append((name, units[name], f"{value:.6g}", "", "", "", "told"))
    return rows


def agreement_rows(agreements: Mapping[str, Agreement]) -> list[tuple[str, ...]]:
    """Return the texts of series, under "series" and ``QUANTITIES``."""
    rows = []
    for series, one in agreements.items():
        texts = [f"{getattr(one, name):.6g}" for name in QUANTITIES]
        texts[-1] += f" ({one.where})"
        rows.append((f"{series}, {one.count} values", *texts))
    return rows


def input_rows(entry: Entry) -> Sequence[tuple[str, ...]]:
    """Return the texts of the inputs of an entry."""
    rows = []
    for name, one in entry.inputs.items():
        value = f"{one.value:g}" if isinstance(one.value, float) else str(one.value)
        rows.append((name, value, one.unit or "-", one.kind, one.source))
    return rows


def describe(outcome: Outcome) -> str:
    """Return an outcome in lines for a terminal."""
    if outcome.status == SKIP:
        return f"{outcome.name}: skip, {' '.join(outcome.why).removeprefix(f'{outcome.name}: ')}"
    lines = [f"{outcome.name}: {outcome.status}, {outcome.seconds:.1f} s"]
    found = outcome.found
    if found is not None and found.unknowns:
        lines[0] += f", {found.unknowns} unknowns, certificate {found.certificate:.1e}"
        if found.defect == found.defect:  # not NaN: there was a run in time
            lines[0] += f", energy defect {found.defect:.1e}"
    reason = ""
    for one in outcome.judgements:
        if one.counted:
            continue
        if one.reason != reason:
            reason = one.reason
            lines.append(f"    limit: {reason}")
        verdict = one.verdict.replace(FAIL, "FAIL")
        unit = "" if one.unit == "-" else f" {one.unit}"
        lines.append(
            f"  {verdict}  {one.name}: found {one.found:.6g}, wanted {one.wanted:.6g}, error "
            f"{one.error:.2g}, limit {one.limit:.2g}{unit}"
        )
    for series, agreed in outcome.agreements.items():
        lines.append(
            f"  {series}: {agreed.count} values, {100 * agreed.share:.1f} % within their limits, "
            f"median error {100 * agreed.median:.2g} %, largest difference {agreed.largest:.4g} at "
            f"{agreed.where}"
        )
    lines += [f"  told  {name}: {value:.6g}" for name, value in outcome.told.items()]
    lines += [f"  {why}" for why in outcome.why]
    return "\n".join(lines)
