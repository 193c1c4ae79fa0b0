"""Say in words, tables and curves what a run tells a design engineer.

This is the content of the page, whatever draws it.
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
from ...run.solution import energy_warning
from ..engineering.peak_values import peaks
from . import charts
from .charts import Chart
from .histories import LEDGER, scale_values
from .maps import Drawing, maps_of
from .report_words import (
    CHARTS,
    HEADERS,
    MODEL_FACTS,
    MODEL_TABLES,
    RESULTS,
    SAY,
    SUMMARY,
)


@dataclass(frozen=True)
class Table:
    """Hold a table of texts; ``sortable``: whether a reader may want its rows in another order."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    sortable: bool = False


@dataclass(frozen=True)
class Section:
    """Hold a part of the page.

    It has, in this order, sentences, tables, curves, drawings on one axis each, pictures.
    """

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[Table] = ()
    charts: Sequence[Chart] = ()
    drawings: Sequence[Drawing] = ()
    pictures: Sequence[Path] = ()


def sections_of(
    run: RunFolder, model: Mapping[str, Any], columns: Sequence[Sequence[str]] | None = None
) -> list[Section]:
    """Return the sections that a run has data for.

    ``model`` is model.json, empty where there is none; ``columns`` are groups of columns for the
    histories, in place of those that move.
    """
    if len(run.history["t"]) < 2:
        raise InputError(
            f"the run in '{run.folder}' has no steps yet: report on it when it has some"
        )
    histories = (
        charts.chart_histories(run, CHARTS)
        if columns is None
        else charts.chart_groups(run, columns)
    )
    found = [
        _model(model),
        _motion(run, model),
        _results(run),
        _accelerations(run),
        Section("Histories", charts=histories, drawings=maps_of(run)),
        _certificate(run),
        _peaks(run),
    ]
    return [one for one in found if one.sentences or one.tables or one.charts or one.drawings]


NOT_SHOWN = ("places", "others", "sides")  # of what model.json tells of a contact


def format_number(value: float) -> str:
    """Return a number with four digits, a dash for none."""
    return "-" if np.isnan(value) else f"{value:.4g}"


def format_value(value: Any, depth: int = 9) -> str:
    """Return a value of a file as it is read by people.

    What is nested deeper than anybody would is left out.
    """
    if isinstance(value, Mapping) and depth:
        return ", ".join(f"{key} = {format_value(one, depth - 1)}" for key, one in value.items())
    if isinstance(value, list | tuple | Mapping):
        return ", ".join(format_value(one, depth - 1) for one in value) if depth else "…"
    if isinstance(value, float):
        return f"{value:.5g}"
    return "-" if value is None else shorten(str(value), 200, placeholder=" …")


def tabulate(title: str, rows: Any) -> list[Table]:
    """Return the table of objects that a file lists.

    It has a column for each of their keys; there is none for anything else.
    """
    given = (
        [one for one in rows if isinstance(one, Mapping)] if isinstance(rows, list | tuple) else []
    )
    header = list(dict.fromkeys(key for one in given for key in one if key not in NOT_SHOWN))
    return (
        [Table(header, [[format_value(one.get(key)) for key in header] for one in given], title)]
        if given
        else []
    )


def _model(model: Mapping[str, Any]) -> Section:
    tables = [
        table for title, key in MODEL_TABLES.items() for table in tabulate(title, model.get(key))
    ]
    said = [
        text.format(format_value(model[key])) for text, key in MODEL_FACTS.items() if model.get(key)
    ]
    warnings = model.get("warnings")
    said += [
        f"Warning: {format_value(one)}." for one in (warnings if isinstance(warnings, list) else ())
    ]
    return Section("Model and contact", said, tables)


def _motion(run: RunFolder, model: Mapping[str, Any]) -> Section:
    records, shown = tabulate("records (SI units)", model.get("records")), charts.chart_motion(run)
    said = []
    if shown:
        peaks = {
            line.name: np.max(np.abs(run.history[line.name])) / STANDARD_GRAVITY
            for line in shown[0].lines
        }
        told = " and ".join(f"{peak:.3g} g along {name[-1]}" for name, peak in peaks.items())
        said = [SAY["shaken"].format(peaks=told), SAY["spectrum"]]
    return Section("Ground motion", said, records, shown)


def _results(run: RunFolder) -> Section:
    rows = [
        row for title, starts in RESULTS.items() for row in _result_rows(run, title, tuple(starts))
    ]
    safe = list(_safety(run))
    tables = [Table(HEADERS["results"], rows), Table(HEADERS["safety"], safe)]
    return Section(
        "Base shear, thrust, uplift and sliding",
        [SAY["safety"]] if safe else [],
        [one for one in tables if one.rows],
    )


def _result_rows(run: RunFolder, title: str, prefixes: tuple[str, ...]) -> Iterable[list[str]]:
    """Return the rows of the columns that begin so.

    Of heights, the row is at the largest thrust, for without thrust they say nothing.
    """
    t = run.history["t"]
    for name in (name for name in run.columns if name.startswith(prefixes)):
        values = run.history.get(name, np.zeros((0, 0)))
        kind, _, part = name.partition("_")
        if (
            values.ndim != 1
            or np.isnan(values).all()
            or kind == "height"
            and not np.nan_to_num(values).any()
        ):
            continue  # the thrust on a level part has no height
        thrust = run.history.get(f"N_{part}") if kind in ("height", "level") else None
        row = int(np.nanargmax(np.abs(values) if thrust is None else thrust + 0.0 * values))
        shown, unit = scale_values(values, run.columns[name][0])
        yield [
            title,
            name,
            unit,
            format_number(shown[row]),
            format_number(t[row]),
            format_number(shown[0]),
            format_number(shown[-1]),
        ]


def _safety(run: RunFolder) -> Iterable[list[str]]:
    """Return the rows of the parts of the contact.

    In them 1 / (1 - margin) is the friction that they could carry over what they do.
    """
    for name in (name for name in run.history if name.startswith("margin_")):
        used = 1.0 - run.history[name]
        if not np.isnan(used).all() and np.nanmax(used) > 0.0:
            row = int(np.nanargmax(used))
            last = 1.0 / used[-1] if used[-1] > 0.0 else np.inf
            yield [
                name[7:],
                format_number(1.0 / used[row]),
                format_number(run.history["t"][row]),
                format_number(last),
            ]


def _accelerations(run: RunFolder) -> Section:
    """Accelerations of probes, low-passed beside raw."""
    names = (
        [name for axis in "xyz" for name in charts.list_varying(run, f"a_{axis}_")]
        if len(run.history["t"]) > 20
        else []
    )
    title, rows, found = (
        "Accelerations, low-passed and raw",
        [],
        {name: charts.smooth_acceleration(run, name) for name in names},
    )
    # the same for all: they have the run's step
    corner = max((corner for _, _, corner in found.values()), default=0.0)
    for name, (raw, smooth, _) in found.items():
        low, high = (float(np.max(np.abs(one.acceleration))) for one in (smooth, raw))
        rows.append(
            [
                name,
                *map(format_number, (low, low / STANDARD_GRAVITY, high, high / STANDARD_GRAVITY)),
            ]
        )
    said, below = SAY["accelerations"].format(corner=corner), f"peak below {corner:.3g} Hz [m/s²]"
    table = Table(
        ("column", below, "[g]", "raw peak, not convergent at impacts [m/s²]", "[g]"),
        rows,
        sortable=True,
    )
    shown = [charts.chart_acceleration(run, name, *found[name]) for name in names[:2]]
    return Section(title, [said], [table], shown) if rows else Section(title)


def _certificate(run: RunFolder) -> Section:
    """Return what the certificate and the ledger say, and what they do not."""
    facts, history = run.facts, run.history
    worst, steps = float(np.max(history["certificate"])), len(history["t"]) - 1
    asked = f", {facts['tolerance']:.0e} was asked for" if facts.get("tolerance") else ""
    said = [SAY["certificate"].format(steps=steps, worst=worst, asked=asked), SAY["limits"]]
    if facts.get("status") != "finished":
        said.append(
            SAY["unfinished"].format(
                why=facts.get("reason") or facts.get("status") or "killed, or going on"
            )
        )
    energy = charts.chart_energy(run)
    tables = []
    if energy is not None:
        ends = {name: float(history[name][-1]) for name, *_ in LEDGER if name in history}
        most = float(np.max(history["energy_kinetic"] + history["energy_strain"]))
        rows = [
            [label, format_number(ends[name]), format_number(ends[name] / most)]
            for name, label, *_ in LEDGER
            if ends.get(name)
        ]
        tables.append(Table(HEADERS["energies"], rows))
        defect = float(np.max(np.abs(history["energy_defect"]))) / most
        said.append(SAY["ledger"].format(defect=defect, most=most))
    said += [f"Warning: {one}." for one in (energy_warning(facts), facts.get("sampling")) if one]
    shown = [one for one in (energy, charts.chart_certificate(run)) if one is not None]
    return Section("Certificate and energies in words", said, tables, shown)


def _peaks(run: RunFolder) -> Section:
    rows = [
        [
            one.name,
            one.quantity,
            one.unit,
            *map(format_number, (one.max, one.t_max, one.min, one.t_min)),
        ]
        for one in peaks(run.history, run.columns)
    ]
    return Section(
        "Peak values of all columns", tables=[Table(HEADERS["peaks"], rows, sortable=True)]
    )


def header_facts(run: RunFolder) -> list[tuple[str, str]]:
    """Return (name, value) of what the report says first.

    They are of the method, and of the outcome; a dash is for what is unknown.
    """
    t, facts = run.history["t"], {key: one for key, one in run.facts.items() if one is not None}
    facts |= {
        "count": len(t) - 1,
        "first": t[0],
        "last": t[-1],
        "worst": np.max(run.history["certificate"]),
        "own": facts.get("versions", {}).get("vi_contact", "-"),
        "status": facts.get("status", "not ended"),
        "mean": facts.get("iterations_per_step", {}).get("mean", np.nan),
    }
    known: dict[str, Any] = defaultdict(lambda: "-")
    known |= {
        key: format_number(one) if isinstance(one, float) else one for key, one in facts.items()
    }
    return [
        (name, shorten(text.format_map(known), 78, placeholder=" …"))
        for name, text in SUMMARY.items()
    ]
