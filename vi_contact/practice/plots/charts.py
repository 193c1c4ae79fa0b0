"""Choose what curves show a run.

They are numbers that the printed page and the one for browsers draw alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.checks import provides
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from ..engineering.floor_spectra import recorded_motion
from ..ground_motion.processing import filtered
from ..ground_motion.record import Record
from ..ground_motion.spectra import response_spectrum
from .histories import LEDGER, list_shaken_axes, panels, plain_numbers, scale_values
from .records import SAMPLES_A_PERIOD

# of the largest energy: terms below it are not drawn; of the size of a column: that is constant
NOTHING = 1e-6
FIRST_PERIOD = 0.02  # s, of a spectrum: 50 Hz, beyond which engineers ask for nothing
# Hz, CHOSEN: where records are filtered as a rule; lower where a period would have under five steps
LOW_PASS = 25.0
STEPS_A_PERIOD = 5
CURVES = 8  # of probes in an overview: beyond, nobody tells them apart
Run = Any  # a Solution, or a RunFolder, which needs h5py


@dataclass(frozen=True)
class Line:
    """Hold a curve: its name, numbers x and y (n,).

    It is ``pale`` where the numbers say little; it has a colour and a style of print.
    """

    name: str
    x: Array
    y: Array
    pale: bool = False
    colour: str | None = None
    style: str = "-"


@dataclass(frozen=True)
class Chart:
    """Hold curves over one axis, those that matter most first; y with its unit.

    ``bound``: a level that is marked.
    """

    title: str
    x: str
    y: str
    lines: tuple[Line, ...]
    log_x: bool = False
    log_y: bool = False
    bound: float | None = None

    def shorten(self, names: int) -> "Chart":
        """Return the chart with its first so many names."""
        kept = list(dict.fromkeys(line.name for line in self.lines))[:names]
        return replace(self, lines=tuple(line for line in self.lines if line.name in kept))


def chart_motion(run: Run) -> list[Chart]:
    """Return the ground's acceleration in a run, and its response spectrum.

    There are none where it was at rest.
    """
    ground = [f"a_g_{axis}" for axis in list_shaken_axes(run.history)]
    if not ground:
        return []
    found = [chart_columns(run, ground, "ground acceleration")]
    return found + ([_spectrum(run, ground)] if len(run.history["t"]) > 2 else [])


def chart_histories(run: Run, groups: Mapping[str, Sequence[str]]) -> list[Chart]:
    """Return a chart for every title whose columns move.

    They are those of the first of its beginnings of names that do.
    """
    charts = []
    for title, prefixes in groups.items():
        found = next(filter(None, (list_varying(run, prefix) for prefix in prefixes)), [])
        if found:
            unit = run.columns[found[0]][0]
            charts.append(
                chart_columns(run, [name for name in found if run.columns[name][0] == unit], title)
            )
    return charts


def chart_columns(run: Run, names: Sequence[str], title: str) -> Chart:
    """Return the histories of columns of one unit, with a prefix that fits."""
    values, unit = scale_values(
        np.array([run.history[name] for name in names]), run.columns[names[0]][0]
    )
    lines = [Line(name, run.history["t"], one) for name, one in zip(names, values, strict=True)]
    return Chart(title, "time [s]", f"[{unit}]", tuple(lines))


def chart_groups(run: Run, columns: Sequence[Sequence[str]]) -> list[Chart]:
    """Return a chart for each group of columns.

    InputError for columns that do not exist, or of different units.
    """
    for group in columns:
        for name in group:
            if name not in run.columns or np.ndim(run.history.get(name, 0)) != 1:
                raise InputError(f"the run has no column '{name}': see columns.json in its folder")
        if len({run.columns[name][0] for name in group}) > 1:
            raise InputError(
                f"columns {', '.join(group)} have different units: draw one chart for each unit"
            )
    return [chart_columns(run, group, ", ".join(group)) for group in columns]


def list_varying(run: Run, prefix: str) -> list[str]:
    """Return the columns of this beginning that are not constant, those that vary most first."""
    ways = {name: _range(run, name) for name in run.columns if name.startswith(prefix)}
    return sorted((name for name in ways if ways[name] > 0.0), key=lambda name: -ways[name])


def _range(run: Run, name: str) -> float:
    values = run.history.get(name)
    if values is None or values.ndim != 1 or np.isnan(values).all():
        return 0.0
    way = float(np.nanmax(values) - np.nanmin(values))
    return way if way > NOTHING * float(np.nanmax(np.abs(values))) else 0.0


def _spectrum(run: Run, names: Sequence[str]) -> Chart:
    """Return the pseudo-acceleration of the ground's motion.

    The damping is 5 %; the line is pale at periods that its steps do not resolve.
    """
    lines = []
    for name in names:
        record = recorded_motion(run.history, name)
        periods = choose_periods(record)
        psa = response_spectrum(record, periods).psa / STANDARD_GRAVITY
        trusted = periods >= SAMPLES_A_PERIOD * record.dt
        lines += [Line(name, periods[trusted], psa[trusted]), Line(name, periods, psa, pale=True)]
    title = "response spectrum of the ground, 5 %"
    return Chart(title, "period [s]", "pseudo-acceleration [g]", tuple(lines), log_x=True)


def choose_periods(record: Record) -> Array:
    """Return the periods [s] of a spectrum.

    They go from 0.02 s, for what is short is what structures with contact feel, to twice the
    duration, or 10 s.
    """
    last = max(2.0 * record.duration, 1.0)
    return np.geomspace(FIRST_PERIOD, min(last, 10.0) if record.duration > 1.0 else last, 150)


def smooth_acceleration(run: Run, name: str) -> tuple[Record, Record, float]:
    """Return an acceleration raw and low-passed, with the corner [Hz].

    The filter is Butterworth's of order 4, forward and backward.

    That of column v_<axis>_<label> where it was recorded: it has the jumps of an impact law.
    """
    speed = "v" + name[1:]
    raw = recorded_motion(run.history, speed if speed in run.history else name)
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
    lines = Line(f"below {corner:.3g} Hz", t, values[0]), Line("raw", t, values[1], pale=True)
    return Chart(f"{name}, low-passed and raw", "time [s]", f"[{unit}]", lines)


def chart_energy(run: Run) -> Chart | None:
    """Return the terms of the ledger; None where there is no energy."""
    if "energy_defect" not in run.history or not np.any(
        run.history["energy_kinetic"] + run.history["energy_strain"]
    ):
        return None
    sizes = {
        name: float(np.max(np.abs(run.history[name]))) for name, *_ in LEDGER if name in run.history
    }
    present = [
        entry for entry in LEDGER if sizes.get(entry[0], 0.0) > NOTHING * max(sizes.values())
    ]
    values, unit = scale_values(np.array([run.history[name] for name, *_ in present]), "J")
    lines = [
        Line(label, run.history["t"], one, colour=colour, style=style)
        for one, (_, label, colour, style) in zip(values, present, strict=True)
    ]
    return Chart("energy", "time [s]", f"[{unit}]", tuple(lines))


def chart_certificate(run: Run) -> Chart:
    """Return the worst residual of every step, and the tolerance.

    Exact zeros are drawn at the bottom, at 1e-18.
    """
    worst = Line(
        "worst residual",
        run.history["t"][1:],
        np.maximum(run.history["certificate"][1:], 1e-18),
        style=".",
    )
    bound = run.facts.get("tolerance") or None
    return Chart(
        "certificate of every step",
        "time [s]",
        "worst residual [-]",
        (worst,),
        log_y=True,
        bound=bound,
    )


def draw_chart(axis: Any, chart: Chart) -> None:
    """Draw a chart with its title on the left and the legend beside it."""
    colours: dict[str, Any] = {}
    for line in chart.lines:
        look: dict[str, Any] = {
            "lw": 0.8,
            "ls": line.style,
            "label": line.name,
            "color": line.colour,
        }
        if line.style == ".":
            look = {"ls": "none", "marker": ".", "ms": 2, "color": "black"}
        if line.pale:
            look |= {"alpha": 0.35, "zorder": 1.5, "color": colours.get(line.name), "label": None}
            look |= {} if chart.log_x else {"label": line.name, "color": "0.3"}
        (drawn,) = axis.plot(
            line.x, line.y, **{name: value for name, value in look.items() if value is not None}
        )
        colours[line.name] = drawn.get_color()
    if chart.log_x:
        axis.set_xscale("log")
        plain_numbers(axis.xaxis)
        axis.set_ylim(bottom=0.0)
    if chart.log_y and any(np.any(line.y > 0.0) for line in chart.lines):
        axis.set_yscale("log")
        # powers of ten are formulas, which the page does not read
        axis.yaxis.set_major_formatter("{x:.0e}")
    if chart.bound is not None:
        axis.axhline(
            chart.bound, color="tab:red", ls="--", lw=0.8, label=f"tolerance {chart.bound:g}"
        )
    axis.set_title(chart.title, loc="left")
    labels = len(axis.get_legend_handles_labels()[1])
    if labels:
        columns = -(-labels // (1 if labels < 6 else 2))
        axis.legend(
            fontsize=6 if columns < 4 else 5.5,
            ncol=columns,
            loc="lower right",
            bbox_to_anchor=(1.0, 0.99),
            frameon=False,
            handlelength=0.8,
            handletextpad=0.4,
            columnspacing=0.7,
            borderpad=0.1,
        )
    if not chart.log_x:
        axis.margins(x=0.0)
    axis.set(xlabel=chart.x, ylabel=chart.y)


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
    probes = [name for name in run.history if name.startswith("u_")][:CURVES]
    charts = [chart_columns(run, probes, "displacement")] if probes else []
    charts += (
        [chart_columns(run, ["contact_resultant"], "contact force")]
        if "contact_resultant" in run.history
        else []
    )
    charts += [*filter(None, [chart_energy(run)]), chart_certificate(run)]
    figure, axes = panels(len(charts), (9.0, 2.0 * len(charts)))
    for axis, chart in zip(axes, charts, strict=True):
        draw_chart(axis, chart)
        axis.set_xlabel(chart.x if axis is axes[-1] else "")
    return figure
