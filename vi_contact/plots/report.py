"""Draw one page about a run, from the files in its folder: facts, input motion, histories, contact, energies, peaks."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.units import STANDARD_GRAVITY
from ..engineering.floor_spectra import recorded_motion
from ..engineering.peak_values import Peak, peaks
from ..ground_motion.record import Record
from ..ground_motion.spectra import response_spectrum
from ..run.files.reading import RunFolder
from .histories import LEDGER, STYLE, log_axis, plain_numbers, scaled, shaken
from .maps import arc_position, draw_map, thinned
from .records import SAMPLES_A_PERIOD

PAGE = (8.27, 11.69)  # inches, A4
SIDES, TOP = (0.085, 0.95), 0.87  # of the page's width and height: where the panels are
GAP = 0.62  # inches between panels above each other
TABLE_ROWS, OF_A_KIND = 14, 3
NOTHING = 1e-6  # of the largest energy: terms below it are not drawn; of the size of a column: that is constant
NO_GAP = 1e-15  # of the length of the contact line
_GROUPS = (  # (title, prefixes of columns); the first four that move are drawn
    ("displacement", ("u_",)),
    ("contact force", ("contact_resultant", "N_", "contact_force_")),
    ("uplift ratio", ("contact_uplift", "uplift_")),
    ("force of the support", ("reaction_x_", "reaction_y_", "reaction_z_")),
    ("racking and rocking", ("racking_", "theta_")),
    ("shear force", ("V_",)),
    ("bending moment", ("M_", "reaction_M")),
    ("slip", ("contact_max_slip", "slip_")),
    ("absolute acceleration", ("a_x_", "a_y_", "a_z_")),
    ("contact pressure", ("contact_max_pressure",)),
)
_LINES = 4  # of a panel: those that move most
_PEAKS = (
    "a_g_", "u_", "a_x_", "contact_uplift", "contact_resultant", "contact_max_pressure", "reaction_x_", "reaction_M",
    "N_", "V_", "M_", "racking_", "theta_", "opening_", "slip_", "contact_max_slip", "uplift_", "height_", "T_", "a_y_",
    "reaction_y_",
)
Drawing = Callable[[Any], None]  # draws on one axis, half of the page's width


def plot_report(
    run: RunFolder, path: str | Path, *, title: str | None = None, columns: Sequence[Sequence[str]] | None = None
) -> Path:
    """Draw the page as PNG, PDF or SVG, by the name of the file. Panels that would be empty are left out.

    ``columns``: groups of columns of one unit, a panel each, in place of those the page chooses. InputError for columns
    that do not exist, a run of one row, or another kind of file.
    """
    import matplotlib
    from matplotlib.figure import Figure

    path = Path(path)
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"'{path}': a report is a .png, .pdf or .svg file")
    if len(run.history["t"]) < 2:
        raise InputError(f"the run in '{run.folder}' has no steps yet: there is nothing to report")
    rows = table_rows(run)
    panels = _panels_of(run, columns)
    lines = (len(panels) + 1) // 2
    table = 0.15 * (len(rows) + 1) / PAGE[1]  # of the page's height
    height = (TOP - table - 0.06) * PAGE[1] / lines - GAP
    fonts = {"font.size": 7, "axes.titlesize": 8, "axes.labelsize": 7}
    with matplotlib.rc_context(STYLE | fonts | {"text.parse_math": False}):  # a dollar of a title is no formula
        figure = Figure(figsize=PAGE)
        grid = figure.add_gridspec(lines, 2, left=SIDES[0], right=SIDES[1], top=TOP,
                                   bottom=table + 0.06 + GAP / PAGE[1] - 0.05, hspace=GAP / height, wspace=0.24)
        _header(figure, run, title or f"Run {run.folder.resolve().name}")
        for i, panel in enumerate(panels):
            last_alone = i == len(panels) - 1 and i % 2 == 0
            panel(figure.add_subplot(grid[i // 2, :] if last_alone else grid[i // 2, i % 2]))
        if rows:
            _table(figure.add_axes((SIDES[0], 0.015, SIDES[1] - SIDES[0], table)), rows)
        figure.savefig(path, dpi=150)
    return path


def _panels_of(run: RunFolder, columns: Sequence[Sequence[str]] | None) -> list[Drawing]:
    ground = [f"a_g_{axis}" for axis in shaken(run.history)]
    panels: list[Drawing] = []
    if ground:
        panels.append(partial(_lines, run=run, names=ground, title="ground acceleration"))
    if ground and len(run.history["t"]) > 2:
        panels.append(partial(_spectrum, run=run, names=ground))
    maps = _maps(run)
    mapped = ("contact pressure",) if maps else ()
    groups = _given(run, columns) if columns is not None else _moving(run, without=mapped)
    for name, found in groups:
        panels.append(partial(_lines, run=run, names=found, title=name))
    panels += maps
    if "energy_defect" in run.history and np.any(run.history["energy_kinetic"] + run.history["energy_strain"]):
        panels.append(partial(_energies, run=run))
    panels.append(partial(_certificate, run=run))
    return panels


def _maps(run: RunFolder) -> list[Drawing]:
    """Return the maps of a contact line: of its pressure, and of its opening where there is one."""
    contact, history = run.contact, run.history
    if contact is None or "pressure" not in history or contact.points.shape[1] != 2 or len(contact.points) < 3:
        return []
    found: list[Drawing] = [partial(_map, run=run, column="pressure", unit="Pa")] if np.any(history["pressure"]) else []
    size = float(np.ptp(contact.points, axis=0).max())
    if float(np.max(history["gap"])) > NO_GAP * size:
        found.append(partial(_map, run=run, column="gap", unit="m"))
    return found


def _given(run: RunFolder, columns: Sequence[Sequence[str]]) -> list[tuple[str, list[str]]]:
    for name in (name for group in columns for name in group):
        if name not in run.columns or np.ndim(run.history.get(name, 0)) != 1:
            raise InputError(f"the run has no column '{name}': see columns.json in its folder")
    for group in columns:
        if len({run.columns[name][0] for name in group}) > 1:
            raise InputError(f"columns {', '.join(group)} have different units: give a panel to each unit")
    return [(", ".join(group) if len(group) < 3 else run.columns[group[0]][1], list(group)) for group in columns]


def _moving(run: RunFolder, without: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Up to four groups, each with the columns of one unit that vary most."""
    groups = []
    for title, prefixes in (group for group in _GROUPS if group[0] not in without):
        found = next(filter(None, (_varying(run, prefix) for prefix in prefixes)), [])
        if found:
            unit = run.columns[found[0]][0]
            groups.append((title, [name for name in found if run.columns[name][0] == unit][:_LINES]))
    return groups[:4]


def _varying(run: RunFolder, prefix: str) -> list[str]:
    """The columns of this beginning that are not constant, those that vary most first."""
    names = [name for name in run.columns if name.startswith(prefix) and _range(run, name) > 0.0]
    return sorted(names, key=lambda name: -_range(run, name))


def _range(run: RunFolder, name: str) -> float:
    values = run.history.get(name)
    if values is None or values.ndim != 1 or np.isnan(values).all():
        return 0.0
    way = float(np.nanmax(values) - np.nanmin(values))
    return way if way > NOTHING * float(np.nanmax(np.abs(values))) else 0.0


def _lines(axis: Any, run: RunFolder, names: Sequence[str], title: str) -> None:
    """Histories in one unit, with a prefix that fits."""
    values, unit = scaled(np.array([run.history[name] for name in names]), run.columns[names[0]][0])
    for one, name in zip(values, names, strict=True):
        axis.plot(run.history["t"], one, lw=0.7, label=name)
    _label(axis, title)
    axis.margins(x=0.0)
    axis.set(xlabel="time [s]", ylabel=f"[{unit}]")


def _label(axis: Any, title: str, rows: int = 1) -> None:
    """Title on the left, legend beside it."""
    axis.set_title(title, loc="left")
    columns = -(-len(axis.get_lines()) // rows)
    axis.legend(fontsize=6 if columns < 4 else 5.5, ncol=columns, loc="lower right", bbox_to_anchor=(1.0, 0.99),
                frameon=False, handlelength=0.8, handletextpad=0.4, columnspacing=0.7, borderpad=0.1)


def _spectrum(axis: Any, run: RunFolder, names: Sequence[str]) -> None:
    """Pseudo-acceleration of the ground's motion, 5 % damping; pale at periods that its steps do not resolve."""
    for name in names:
        record = recorded_motion(run.history, name)
        periods = shown_periods(record)
        psa = response_spectrum(record, periods).psa / STANDARD_GRAVITY
        (line,) = axis.semilogx(periods, psa, lw=0.8, alpha=0.35)
        trusted = periods >= SAMPLES_A_PERIOD * record.dt
        axis.semilogx(periods[trusted], psa[trusted], lw=0.9, color=line.get_color(), label=name)
    _label(axis, "response spectrum of the ground, 5 %")
    plain_numbers(axis.xaxis)
    axis.set_ylim(bottom=0.0)
    axis.set(xlabel="period [s]", ylabel="pseudo-acceleration [g]")


def shown_periods(record: Record) -> Array:
    """Return the periods [s] of the page's spectrum: from four steps of the run to twice its duration, or 10 s.

    What is short is what structures with contact feel, so the first period follows from the step, not the duration.
    """
    last = max(2.0 * record.duration, 1.0)
    return np.geomspace(4.0 * record.dt, min(last, 10.0) if record.duration > 1.0 else last, 150)


def _map(axis: Any, run: RunFolder, column: str, unit: str) -> None:
    assert run.contact is not None
    position, label = arc_position(run.contact.points, run.contact.normals)
    values = np.reshape(run.history[column], (len(run.history["t"]), -1))
    open_gap = column == "gap"
    t, shown = thinned(run.history["t"], np.maximum(values, 0.0) if open_gap else values)
    draw_map(axis, t, position, shown, unit, title="opening" if open_gap else "contact pressure", axis_label=label,
             colours="Blues" if open_gap else "magma_r")


def _energies(axis: Any, run: RunFolder) -> None:
    sizes = {name: float(np.max(np.abs(run.history[name]))) for name, *_ in LEDGER if name in run.history}
    present = [entry for entry in LEDGER if sizes.get(entry[0], 0.0) > NOTHING * max(sizes.values())]
    values, unit = scaled(np.array([run.history[name] for name, *_ in present]), "J")
    for one, (_, label, colour, style) in zip(values, present, strict=True):
        axis.plot(run.history["t"], one, color=colour, ls=style, lw=0.8, label=label)
    _label(axis, "energy", rows=1 if len(present) < 6 else 2)
    axis.margins(x=0.0)
    axis.set(xlabel="time [s]", ylabel=f"[{unit}]")


def _certificate(axis: Any, run: RunFolder) -> None:
    log_axis(axis, run.history["t"][1:], run.history["certificate"][1:])
    axis.yaxis.set_major_formatter("{x:.0e}")  # powers of ten are formulas, which the page does not read
    tolerance = run.facts.get("tolerance")
    if tolerance:
        axis.axhline(tolerance, color="tab:red", ls="--", lw=0.8, label=f"tolerance {tolerance:g}")
        _label(axis, "certificate of every step")
    else:
        axis.set_title("certificate of every step", loc="left")
    axis.margins(x=0.0)
    axis.set(xlabel="time [s]", ylabel="worst residual [-]")


def _header(figure: Any, run: RunFolder, title: str) -> None:
    """Facts in two columns."""
    figure.text(0.04, 0.985, title, fontsize=13, weight="bold", va="top")
    for k, (name, value) in enumerate(header_facts(run)):
        x, y = (0.04 if k < 6 else 0.68), 0.96 - 0.0115 * (k % 6)
        figure.text(x, y, name, color="0.35", va="top")
        figure.text(x + (0.09 if k < 6 else 0.13), y, value, va="top")


def header_facts(run: RunFolder) -> list[tuple[str, str]]:
    """Return (name, value) of what the page says first: six of the method, six of the outcome; a dash for unknown."""
    t, iterations = run.history["t"], run.facts.get("iterations_per_step") or {}
    facts = {**run.facts, "mean": iterations.get("mean"), "own": (run.facts.get("versions") or {}).get("vi_contact")}

    def fact(name: str, form: str = "{}") -> str:
        value = facts.get(name)
        return "-" if value is None else form.format(value)

    return [
        ("scheme", shorten(fact("scheme"), 78, placeholder=" …")),
        ("mass", shorten(fact("mass"), 78, placeholder=" …")),
        ("solver", shorten(fact("solver"), 78, placeholder=" …")),
        ("time step", fact("dt") if isinstance(facts.get("dt"), str) else fact("dt", "{:.6g} s")),
        ("steps", f"{len(t) - 1}, t = {t[0]:g} to {t[-1]:g} s"),
        ("version", f"vi_contact {fact('own')}, ranks {fact('ranks')}"),
        ("status", fact("status") if run.facts else "not ended"),
        ("unknowns", fact("unknowns")),
        ("contact points", fact("contact_points")),
        ("iterations a step", fact("mean", "{:.2f}")),
        ("worst certificate", f"{np.max(run.history['certificate']):.2e}"),
        ("energy defect", fact("energy_defect", "{:.2e}")),
    ]


def table_rows(run: RunFolder) -> list[Peak]:
    """Return the peaks on the page: of each kind that engineers ask for those that vary most; peaks.csv has all."""
    kinds = [_varying(run, prefix)[:OF_A_KIND] for prefix in _PEAKS]
    chosen: list[str] = []
    for place in range(max(map(len, kinds), default=0)):  # the first of every kind before the second of any
        chosen += [names[place] for names in kinds if len(names) > place and names[place] not in chosen]
    shown = [name for name in run.columns if name in chosen[:TABLE_ROWS]]
    return peaks(run.history, run.columns, shown)


def _table(axis: Any, rows: Sequence[Peak]) -> None:
    axis.set_axis_off()
    cells = [
        [row.name, shorten(row.quantity, 62, placeholder=" …"), row.unit, f"{row.max:.4g}", f"{row.t_max:.4g}",
         f"{row.min:.4g}", f"{row.t_min:.4g}"]
        for row in rows
    ]
    table = axis.table(cellText=cells, colLabels=["column", "quantity", "unit", "max", "at t [s]", "min", "at t [s]"],
                       colWidths=[0.18, 0.42, 0.06, 0.09, 0.08, 0.09, 0.08], cellLoc="left", colLoc="left",
                       bbox=(0.0, 0.0, 1.0, 1.0), edges="horizontal")
    for cell in table.get_celld().values():
        cell.set_linewidth(0.3)
        cell.PAD = 0.02
    table.auto_set_font_size(False)
    table.set_fontsize(6.5)
