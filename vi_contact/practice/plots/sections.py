"""Say in words, tables and curves what a run tells a design engineer.

This is the content of the report; ``pages`` prints it, and ``web_page`` writes it for browsers.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from ...run.files.reading import RunFolder
from ...run.recorders.contact_parts import is_upright
from ...run.solution import energy_warning
from ..engineering.column_groups import begins
from ..engineering.peak_values import peaks
from ..units.report_units import ReportUnits, write_number
from . import charts
from .charts import Chart
from .histories import LEDGER
from .maps import Drawing, list_maps
from .report_numbers import PLACES, ReportNumbers, read_slice
from .report_words import (
    CHARTS,
    HEADERS,
    RESULTS,
    SAY,
    SUMMARY,
)

# What of a part that stands upright says nothing: its thrust has a height in place of e.
FOR_LEVEL_PARTS = ("e", "theta", "settlement")
NOISE = 1e-6  # of the largest number in the same unit: what is smaller is rounding
ROUNDING = 1e-9  # of the largest number of a column: what is smaller is none
FEW_ROWS = 20  # of a history: accelerations of a run with no more are not filtered


@dataclass(frozen=True)
class Table:
    """Hold a table of texts.

    Attributes:
        header: names of the columns.
        rows: a text for each column.
        title: stands above; none when empty.
        sortable: whether a reader may want the rows in another order.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    sortable: bool = False


@dataclass(frozen=True)
class Section:
    """Hold a part of the page; what it has stands in the order of the attributes.

    Attributes:
        title: heading.
        sentences: paragraphs.
        tables: after them.
        notes: paragraphs after the tables.
        charts: curves.
        drawings: each draws on one axis.
        pictures: PNG files.
        begins_page: whether it begins a page in print.
    """

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    drawings: Sequence[Drawing] = ()
    pictures: Sequence[Path] = ()
    begins_page: bool = False

    @property
    def is_empty(self) -> bool:
        """Say whether there is nothing below the heading."""
        shown = (self.sentences, self.tables, self.notes, self.charts, self.drawings, self.pictures)
        return not any(shown)


def sections_of(
    run: RunFolder,
    model: Mapping[str, Any],
    columns: Sequence[Sequence[str]] | None = None,
    *,
    inputs: Sequence[Table] = (),
    units: ReportUnits | None = None,
) -> list[Section]:
    """Return the sections that a run has data for.

    Args:
        run: what ``read_run`` returned.
        model: model.json of its folder, empty where there is none.
        columns: groups of columns of one unit, a chart each for the histories; None: those that
            move.
        inputs: tables of what was put in, for the first section.
        units: of the tables; None: the usual ones.

    Raises:
        InputError: the run has no steps, or columns do not exist or have different units.
    """
    if len(run.history["t"]) < 2:
        raise InputError(
            f"the run in '{run.folder}' has no steps yet: report on it when it has some; of a "
            "static stage see history.csv, which has one row"
        )
    numbers = ReportNumbers(units or ReportUnits(), read_slice(model))
    if columns is None:
        histories = charts.chart_histories(run, CHARTS, numbers.choose_unit)
    else:
        histories = charts.chart_groups(run, columns, numbers.choose_unit)
    sections = [
        _describe_model(model, inputs),
        _describe_motion(run),
        _tabulate_results(run, numbers),
        _compare_accelerations(run),
        Section("Histories", charts=histories, drawings=list_maps(run, model)),
        _explain_certificate(run),
        _tabulate_peaks(run, numbers),
    ]
    return [section for section in sections if not section.is_empty]


def format_value(value: Any, depth: int = 9) -> str:
    """Return a value of a file as it is read by people.

    What is nested deeper than anybody would is left out.
    """
    if isinstance(value, Mapping) and depth:
        return ", ".join(f"{key} = {format_value(item, depth - 1)}" for key, item in value.items())
    if isinstance(value, list | tuple | Mapping):
        return ", ".join(format_value(item, depth - 1) for item in value) if depth else "…"
    if isinstance(value, float):
        return f"{value:.5g}"
    return "-" if value is None else shorten(str(value), 200, placeholder=" …")


def _describe_model(model: Mapping[str, Any], inputs: Sequence[Table]) -> Section:
    """Set what was put in before all results, with what is doubted of it."""
    warnings = model.get("warnings")
    sentences = []
    if isinstance(warnings, list):
        sentences = [f"Warning: {format_value(warning)}." for warning in warnings]
    return Section("Model and contact", sentences, inputs)


def _describe_motion(run: RunFolder) -> Section:
    """Say how strongly the ground moved."""
    motion = charts.chart_motion(run)
    sentences = []
    if motion:
        texts = []
        for line in motion[0].lines:
            peak = np.max(np.abs(run.history[line.name])) / STANDARD_GRAVITY
            texts.append(f"{peak:.3g} g along {line.name[-1]}")
        sentences = [SAY["shaken"].format(peaks=" and ".join(texts)), SAY["spectrum"]]
    return Section("Ground motion", sentences, charts=motion)


def _tabulate_results(run: RunFolder, numbers: ReportNumbers) -> Section:
    """Tabulate forces, sliding and the like, and how far each part is from sliding."""
    results: list[list[str]] = []
    scales = find_scales(run)
    for title, prefixes in RESULTS.items():
        results += _list_results(run, numbers, scales, title, tuple(prefixes))
    safety = list(_list_safety(run))
    tables = [Table(HEADERS["results"], results), Table(HEADERS["safety"], safety)]
    return Section(
        "Base shear, thrust, open share and sliding",
        [SAY["safety"]] if safety else [],
        [table for table in tables if table.rows],
    )


def _list_results(
    run: RunFolder,
    numbers: ReportNumbers,
    scales: Mapping[str, float],
    title: str,
    prefixes: tuple[str, ...],
) -> Iterable[list[str]]:
    """Yield the rows of the columns that begin so.

    Of heights, the row is at the largest thrust, for without thrust they say nothing.

    Args:
        run: what ``read_run`` returned.
        numbers: writes them.
        scales: as of ``find_scales``.
        title: what the columns are.
        prefixes: their beginnings.
    """
    t = run.history["t"]
    for name in run.columns:
        values = run.history.get(name)
        if not begins(name, prefixes) or values is None:
            continue
        if values.ndim != 1 or np.isnan(values).all():
            continue
        unit = run.columns[name][0]
        if np.nanmax(np.abs(values)) <= NOISE * scales[unit]:
            continue  # such as the height of the thrust on a level part
        kind, _, part = name.partition("_")

        if kind in FOR_LEVEL_PARTS and is_upright(part, run.history):
            continue

        # When the result is largest in size; heights count where they are numbers.
        thrust = run.history.get(f"N_{part}") if kind in ("height", "level") else None
        row = int(np.nanargmax(np.abs(values) if thrust is None else thrust + 0.0 * values))
        size = abs(float(values[row]))
        factor, unit = numbers.choose_unit(name, unit, size)
        of_rows = [
            0.0 if abs(values[place]) <= ROUNDING * size else factor * float(values[place])
            for place in (row, 0, -1)
        ]
        scaled = [of_rows[0], float(t[row]), *of_rows[1:]]
        yield [title, name, unit, *map(write_number, scaled)]


def find_scales(run: RunFolder) -> dict[str, float]:
    """Return SI unit -> the largest size of a number in the columns of this unit.

    What is smaller than ``NOISE`` of it is rounding. Places do not count: they are metres where
    displacements are micrometres.
    """
    scales: dict[str, float] = defaultdict(float)
    for name, (unit, _) in run.columns.items():
        values = run.history.get(name, np.array([]))
        is_measured = values.ndim == 1 and not np.isnan(values).all()
        if is_measured and not name.startswith(PLACES):
            scales[unit] = max(scales[unit], float(np.nanmax(np.abs(values))))
    return scales


def _list_safety(run: RunFolder) -> Iterable[list[str]]:
    """Yield the rows of the parts of the contact.

    In them 1 / (1 - margin) is the friction that they could carry over what they do.
    """
    for name in run.history:
        if not name.startswith("margin_"):
            continue
        used = 1.0 - run.history[name]
        if np.isnan(used).all() or np.nanmax(used) <= 0.0:
            continue  # never loaded in shear
        row = int(np.nanargmax(used))
        last = 1.0 / used[-1] if used[-1] > 0.0 else np.inf
        yield [
            name.removeprefix("margin_"),
            write_number(1.0 / used[row]),
            write_number(run.history["t"][row]),
            write_number(last),
        ]


def _compare_accelerations(run: RunFolder) -> Section:
    """Set accelerations of probes, low-passed and raw, beside each other."""
    title = "Accelerations, low-passed and raw"
    names: list[str] = []
    if len(run.history["t"]) > FEW_ROWS:
        for axis in "xyz":
            names += charts.list_varying(run, f"a_{axis}_")
    if not names:
        return Section(title)
    motions = {name: charts.smooth_acceleration(run, name) for name in names}
    # the same for all: they have the run's step
    corner = max(corner for _, _, corner in motions.values())
    rows = []
    for name, (raw, smooth, _) in motions.items():
        low = float(np.max(np.abs(smooth.acceleration)))
        high = float(np.max(np.abs(raw.acceleration)))
        numbers = (low, low / STANDARD_GRAVITY, high, high / STANDARD_GRAVITY)
        rows.append([name, *map(write_number, numbers)])
    below = f"peak below {corner:.3g} Hz [m/s²]"
    table = Table(
        ("column", below, "[g]", "raw peak, not convergent at impacts [m/s²]", "[g]"),
        rows,
        sortable=True,
    )
    curves = [charts.chart_acceleration(run, name, *motions[name]) for name in names[:2]]
    sentences = [SAY["accelerations"].format(corner=corner)]
    return Section(title, sentences, [table], charts=curves)


def _explain_certificate(run: RunFolder) -> Section:
    """Say what the certificate and the ledger tell, and what they do not."""
    facts = run.facts
    history = run.history
    worst = float(np.max(history["certificate"]))
    asked = f", {facts['tolerance']:.0e} was asked for" if facts.get("tolerance") else ""
    sentences = [
        SAY["certificate"].format(steps=len(history["t"]) - 1, worst=worst, asked=asked),
        SAY["limits"],
    ]
    if facts.get("status") != "finished":
        why = facts.get("reason") or facts.get("status") or "killed, or going on"
        sentences.append(SAY["unfinished"].format(why=why))

    tables = [Table(HEADERS["method"], header_facts(run))]
    curves = []
    energy = charts.chart_energy(run)
    if energy is not None:
        most = float(np.max(history["energy_kinetic"] + history["energy_strain"]))
        tables.append(_tabulate_energies(run, most))
        defect = float(np.max(np.abs(history["energy_defect"]))) / most
        sentences.append(SAY["ledger"].format(defect=defect, most=most))
        curves.append(energy)
    curves.append(charts.chart_certificate(run))

    warnings = (energy_warning(facts), facts.get("sampling"), facts.get("joint_elements"))
    sentences += [f"Warning: {warning}." for warning in warnings if warning]
    return Section("Solver, certificate and energies", sentences, tables, charts=curves)


def _tabulate_energies(run: RunFolder, most: float) -> Table:
    """Tabulate the terms of the ledger at the end, over the largest energy [J] too."""
    rows = []
    for name, label, *_ in LEDGER:
        end = float(run.history[name][-1]) if name in run.history else 0.0
        if end:
            rows.append([label, write_number(end), write_number(end / most)])
    return Table(HEADERS["energies"], rows)


def _tabulate_peaks(run: RunFolder, numbers: ReportNumbers) -> Section:
    """Tabulate the largest and the smallest value of every column that has values but zero."""
    rows = []
    for peak in peaks(run.history, run.columns):
        if not np.nan_to_num([peak.max, peak.min]).any():
            continue
        size = float(np.nanmax(np.abs([peak.max, peak.min])))
        factor, unit = numbers.choose_unit(peak.name, peak.unit, size)
        values = (factor * peak.max, peak.t_max, factor * peak.min, peak.t_min)
        rows.append([peak.name, peak.quantity, unit, *map(write_number, values)])
    return Section(
        "Peak values of all columns", tables=[Table(HEADERS["peaks"], rows, sortable=True)]
    )


def header_facts(run: RunFolder) -> list[tuple[str, str]]:
    """Return (name, value) of the method of a run and of its outcome; a dash where unknown."""
    t = run.history["t"]
    facts = {key: value for key, value in run.facts.items() if value is not None}
    facts |= {
        "count": len(t) - 1,
        "first": t[0],
        "last": t[-1],
        "worst": np.max(run.history["certificate"]),
        "own": facts.get("versions", {}).get("vi_contact", "-"),
        "status": facts.get("status", "not ended"),
        "mean": facts.get("iterations_per_step", {}).get("mean", np.nan),
    }
    values: dict[str, Any] = defaultdict(lambda: "-")
    for key, value in facts.items():
        values[key] = write_number(value) if isinstance(value, float) else value
    return [
        (name, shorten(text.format_map(values), 78, placeholder=" …"))
        for name, text in SUMMARY.items()
    ]
