"""Choose what curves show a run.

Charts are numbers: the printed page and the one for browsers draw the same.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.checks import provides
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from ..engineering.column_groups import begins
from ..engineering.floor_spectra import recorded_motion
from ..ground_motion.processing import filtered
from ..ground_motion.record import Record
from ..ground_motion.spectra import response_spectrum
from .histories import (
    LEDGER,
    draw_curve,
    fit_title,
    list_shaken_axes,
    panels,
    plain_numbers,
    put_legend_above,
    scale_values,
)
from .records import SAMPLES_A_PERIOD
from .report_words import CHARTS_OF_THE_WHOLE

# What is no more than this is nothing: a term of energy over the largest one, and the range of a
# column over its size.
NOTHING = 1e-6
FIRST_PERIOD = 0.02  # s, of a spectrum: 50 Hz, beyond which engineers ask for nothing
# Hz, CHOSEN: where records are filtered as a rule; lower where a period would have under five steps
LOW_PASS = 25.0
STEPS_A_PERIOD = 5
CURVES = 8  # of probes in an overview: beyond, nobody tells them apart
# What is never larger than this part of the largest curve of an axis has an axis of its own.
SEEN = 0.1
TITLE_PAD = 3.0  # points, between a legend and the title above it
Run = Any  # a Solution, or a RunFolder, which needs h5py
UnitChoice = Callable[[str, str, float], tuple[float, str]]


@dataclass(frozen=True)
class Line:
    """Hold a curve.

    Attributes:
        name: stands in the legend.
        x: (n,).
        y: (n,).
        pale: whether the numbers say little.
        colour: in print; None: that of its place on the axis.
        style: in print, as of matplotlib, "." for dots; "-": that of its place on the axis.
    """

    name: str
    x: Array
    y: Array
    pale: bool = False
    colour: str | None = None
    style: str = "-"


@dataclass(frozen=True)
class Chart:
    """Hold curves over one axis.

    Attributes:
        title: stands above.
        x: name of the axis, with its unit.
        y: likewise.
        lines: the curves, those that matter most first.
        log_x: whether the axis is logarithmic.
        log_y: likewise.
        bound: a level that is marked.
    """

    title: str
    x: str
    y: str
    lines: tuple[Line, ...]
    log_x: bool = False
    log_y: bool = False
    bound: float | None = None

    @property
    def places(self) -> dict[str, int]:
        """Return the number of each name, by which its curves have their look."""
        names = dict.fromkeys(line.name for line in self.lines)
        return {name: place for place, name in enumerate(names)}

    def shorten(self, count: int) -> "Chart":
        """Return the chart with the lines of its first so many names."""
        names = list(dict.fromkeys(line.name for line in self.lines))[:count]
        return replace(self, lines=tuple(line for line in self.lines if line.name in names))


def chart_motion(run: Run) -> list[Chart]:
    """Chart the ground's acceleration in a run, and its response spectrum.

    There are none where it was at rest.
    """
    columns = [f"a_g_{axis}" for axis in list_shaken_axes(run.history)]
    if not columns:
        return []
    charts = [chart_columns(run, columns, "ground acceleration")]
    if len(run.history["t"]) > 2:
        charts.append(_chart_spectrum(run, columns))
    return charts


def chart_histories(
    run: Run, groups: Mapping[str, Sequence[str]], choose_unit: UnitChoice | None = None
) -> list[Chart]:
    """Chart what moves during a run.

    Args:
        run: Solution or RunFolder.
        groups: title of a chart -> beginnings of names of columns, of which the first whose columns
            move is charted.
        choose_unit: as of ``chart_columns``.

    Returns:
        charts for every title whose columns move; of these, those with the unit of the first. What
        is never larger than a tenth of the largest of them has a chart of its own.
    """
    charts = []
    for title, prefixes in groups.items():
        for prefix in prefixes:
            names = list_varying(run, prefix)
            if names:
                unit, *_ = run.columns[names[0]]
                same = [name for name in names if run.columns[name][0] == unit]
                own_title = CHARTS_OF_THE_WHOLE.get(prefix, title)
                charts += _chart_sizes(run, same, own_title, prefix, choose_unit)
                break
    return charts


def _chart_sizes(
    run: Run,
    names: Sequence[str],
    title: str,
    prefix: str,
    choose_unit: UnitChoice | None,
) -> list[Chart]:
    """Chart columns of one unit and beginning, those of very different sizes apart.

    Largest come first. Titles of charts that stand apart name what is on them.
    """
    sizes = {name: float(np.nanmax(np.abs(run.history[name]))) for name in names}
    groups: list[list[str]] = []
    largest = 0.0
    for name in sorted(names, key=lambda name: -sizes[name]):
        if not groups or sizes[name] < SEEN * largest:
            groups.append([])
            largest = sizes[name]
        groups[-1].append(name)
    if len(groups) == 1:
        return [chart_columns(run, names, title, choose_unit)]
    charts = []
    for group in groups:
        parts = [name.removeprefix(prefix) for name in group]
        named = f"{title}: {', '.join(parts)}"
        charts.append(chart_columns(run, group, named, choose_unit))
    return charts


def chart_columns(
    run: Run, names: Sequence[str], title: str, choose_unit: UnitChoice | None = None
) -> Chart:
    """Chart the histories of columns.

    Args:
        run: Solution or RunFolder.
        names: columns of one unit.
        title: stands above.
        choose_unit: returns (factor, name of the unit) for a column, its SI unit and its largest
            size; None: the SI unit with the prefix that fits.
    """
    unit, *_ = run.columns[names[0]]
    values = np.array([run.history[name] for name in names])
    if choose_unit is None:
        values, prefixed = scale_values(values, unit)
    else:
        size = float(np.nanmax(np.abs(values), initial=0.0))
        factor, prefixed = choose_unit(names[0], unit, size)
        values = factor * values
    lines = [Line(name, run.history["t"], row) for name, row in zip(names, values, strict=True)]
    return Chart(title, "time [s]", f"[{prefixed}]", tuple(lines))


def chart_groups(
    run: Run, groups: Sequence[Sequence[str]], choose_unit: UnitChoice | None = None
) -> list[Chart]:
    """Chart each group of columns; ``choose_unit`` as of ``chart_columns``.

    InputError for columns that do not exist, or of different units.
    """
    for group in groups:
        for name in group:
            if name not in run.columns or np.ndim(run.history.get(name, 0)) != 1:
                raise InputError(f"the run has no column '{name}': see columns.json in its folder")
        if len({run.columns[name][0] for name in group}) > 1:
            raise InputError(
                f"columns {', '.join(group)} have different units: draw one chart for each unit"
            )
    return [chart_columns(run, group, ", ".join(group), choose_unit) for group in groups]


def list_varying(run: Run, prefix: str) -> list[str]:
    """List the columns of this beginning that are not constant, those that vary most first."""
    ranges = {name: _find_range(run, name) for name in run.columns if begins(name, (prefix,))}
    return sorted((name for name in ranges if ranges[name] > 0.0), key=lambda name: -ranges[name])


def _find_range(run: Run, name: str) -> float:
    """Return the largest less the smallest value of a column, zero where that is rounding."""
    values = run.history.get(name)
    if values is None or values.ndim != 1 or np.isnan(values).all():
        return 0.0
    extent = float(np.nanmax(values) - np.nanmin(values))
    return extent if extent > NOTHING * float(np.nanmax(np.abs(values))) else 0.0


def _chart_spectrum(run: Run, names: Sequence[str]) -> Chart:
    """Chart the pseudo-acceleration of the ground's motion.

    The damping is 5 %; the line is pale at periods that its steps do not resolve.
    """
    lines = []
    for name in names:
        record = recorded_motion(run.history, name)
        periods = choose_periods(record)
        psa = response_spectrum(record, periods).psa / STANDARD_GRAVITY
        trusted = periods >= SAMPLES_A_PERIOD * record.dt
        lines.append(Line(name, periods[trusted], psa[trusted]))
        lines.append(Line(name, periods, psa, pale=True))
    title = "response spectrum of the ground, 5 %"
    return Chart(title, "period [s]", "pseudo-acceleration [g]", tuple(lines), log_x=True)


def choose_periods(record: Record) -> Array:
    """Choose the periods [s] of a spectrum.

    They go from 0.02 s, for what is short is what structures with contact feel, to twice the
    duration, or 10 s.
    """
    last = max(2.0 * record.duration, 1.0)
    if record.duration > 1.0:
        last = min(last, 10.0)
    return np.geomspace(FIRST_PERIOD, last, 150)


def smooth_acceleration(run: Run, name: str) -> tuple[Record, Record, float]:
    """Return an acceleration raw and low-passed, with the corner [Hz].

    The filter is Butterworth's of order 4, forward and backward.

    That of column v_<axis>_<label> where it was recorded: it has the jumps of an impact law.
    """
    velocity = "v" + name[1:]
    raw = recorded_motion(run.history, velocity if velocity in run.history else name)
    corner = min(LOW_PASS, 1.0 / (STEPS_A_PERIOD * raw.dt))
    return raw, filtered(raw, high=corner), corner


def chart_acceleration(run: Run, name: str, raw: Record, smooth: Record, corner: float) -> Chart:
    """Chart an absolute acceleration low-passed and, pale, raw.

    Args:
        run: Solution or RunFolder that recorded it.
        name: column of the acceleration, such as a_x_top.
        raw: as ``smooth_acceleration`` returns it.
        smooth: likewise, low-passed.
        corner: corner frequency of the filter [Hz].
    """
    values, unit = scale_values(np.array([smooth.acceleration, raw.acceleration]), "m/s²")
    t = run.history["t"][0] + raw.times
    lines = (
        Line(f"below {corner:.3g} Hz", t, values[0]),
        Line("raw", t, values[1], pale=True),
    )
    return Chart(f"{name}, low-passed and raw", "time [s]", f"[{unit}]", lines)


def chart_energy(run: Run) -> Chart | None:
    """Chart the terms of the ledger; None where there is no energy."""
    history = run.history
    if "energy_defect" not in history:
        return None
    if not np.any(history["energy_kinetic"] + history["energy_strain"]):
        return None
    sizes = {name: float(np.max(np.abs(history[name]))) for name, *_ in LEDGER if name in history}
    least = NOTHING * max(sizes.values())
    present = [entry for entry in LEDGER if sizes.get(entry[0], 0.0) > least]
    values, unit = scale_values(np.array([history[name] for name, *_ in present]), "J")
    lines = [
        Line(label, history["t"], row) for row, (_, label, *_) in zip(values, present, strict=True)
    ]
    return Chart("energy", "time [s]", f"[{unit}]", tuple(lines))


def chart_certificate(run: Run) -> Chart:
    """Chart the worst residual of every step, and the tolerance.

    Exact zeros are drawn at the bottom, at 1e-18.
    """
    worst = Line(
        "worst residual",
        run.history["t"][1:],
        np.maximum(run.history["certificate"][1:], 1e-18),
        style=".",
    )
    return Chart(
        "certificate of every step",
        "time [s]",
        "worst residual [-]",
        (worst,),
        log_y=True,
        bound=run.facts.get("tolerance") or None,
    )


def draw_chart(axis: Any, chart: Chart) -> None:
    """Draw a chart with its title on the left and the legend between it and the curves."""
    places = chart.places
    for line in chart.lines:
        draw_curve(axis, line.x, line.y, places[line.name], **_choose_look(line, chart.log_x))
    if chart.log_x:
        axis.set_xscale("log")
        plain_numbers(axis.xaxis)
        axis.set_ylim(bottom=0.0)
    if chart.log_y and any(np.any(line.y > 0.0) for line in chart.lines):
        axis.set_yscale("log")
        # powers of ten are formulas, which the page does not read
        axis.yaxis.set_major_formatter("{x:.0e}")
    elif not chart.log_y:
        # The number that matplotlib would take off all ticks stands where the legend is.
        axis.ticklabel_format(axis="y", useOffset=False)
    if chart.bound is not None:
        label = f"tolerance {chart.bound:g}"
        axis.axhline(chart.bound, color="tab:red", ls="--", lw=0.8, label=label)
    legend = put_legend_above(axis, 6.0)
    axis.set_title(fit_title(axis, chart.title), loc="left", pad=legend + TITLE_PAD)
    if not chart.log_x:
        axis.margins(x=0.0)
    axis.set(xlabel=chart.x, ylabel=chart.y)


def _choose_look(line: Line, log_x: bool) -> dict[str, Any]:
    """Choose what of a line is not the look of its place on the axis.

    Args:
        line: what is drawn.
        log_x: whether the axis is logarithmic: in a spectrum a pale line belongs to the one of its
            name before it, in a history it is one of its own.
    """
    look: dict[str, Any] = {"label": line.name}
    if line.colour is not None:
        look["color"] = line.colour
    if line.style == ".":
        look |= {"ls": "none", "marker": ".", "ms": 2, "markevery": None}
    elif line.style != "-":
        look |= {"ls": line.style, "marker": None}
    if line.pale and log_x:
        look |= {"label": None, "alpha": 0.35, "zorder": 1.5, "marker": None}
    elif line.pale:
        look |= {"color": "0.7", "lw": 0.6, "ls": "solid", "marker": None, "zorder": 1.5}
    return look


def plot_overview(run: Run) -> Any:
    """Return a matplotlib Figure of a Solution or RunFolder.

    It has the displacements of the first 8 probes, the contact force, the energy ledger, as far as
    they were recorded, and the certificate of every step.
    """
    provides(
        "plot_overview",
        "run",
        run,
        ("history", "columns", "facts"),
        "give a Solution, or what read_run returns",
    )
    charts = []
    probes = [name for name in run.history if name.startswith("u_")][:CURVES]
    if probes:
        charts.append(chart_columns(run, probes, "displacement"))
    if "contact_resultant" in run.history:
        charts.append(chart_columns(run, ["contact_resultant"], "contact force"))
    energy = chart_energy(run)
    if energy is not None:
        charts.append(energy)
    charts.append(chart_certificate(run))
    figure, axes = panels(len(charts), (9.0, 2.0 * len(charts)))
    for axis, chart in zip(axes, charts, strict=True):
        draw_chart(axis, chart)
        axis.set_xlabel(chart.x if axis is axes[-1] else "")
    return figure
