"""``vi-contact post peaks|spectrum|transfer|loop|checks|profile``: options and what each does."""

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError
from ...core.files import write_csv
from ..engineering import (
    floor_spectrum,
    hysteresis,
    peaks,
    recorded_motion,
    transfer_function,
    write_peaks,
)
from ..plots.records import plot_loop, plot_spectra, plot_transfer
from ..plots.report_numbers import ReportNumbers
from ..units.report_units import write_number
from .options import add_actions, add_command, add_folder, space_numbers
from .profile import add_profile
from .tables import add_table, choose_table

if TYPE_CHECKING:
    from ...run.files.reading import RunFolder
    from ..engineering.checks.comparison import Comparison
    from ..ground_motion.spectra import ResponseSpectrum

CHECKS_HEADER = (
    "name",
    "formula",
    "source",
    "range",
    "inputs",
    "expected",
    "found",
    "unit",
    "ratio",
    "applies",
    "lasted_s",
    "reading",
    "notes",
)


def add_post_commands(commands: Any) -> None:
    """Add ``post`` with its actions to the commands of the top parser."""
    actions = add_actions(
        commands, "post", help="compute numbers and draw pictures from the folder of a run"
    )
    _add_peaks(actions)
    _add_spectrum(actions)
    _add_transfer(actions)
    _add_checks(actions)
    add_profile(actions)
    _add_loop(actions)


def _add_peaks(actions: Any) -> None:
    """Add ``peaks`` with its options."""
    largest = add_command(
        actions,
        "peaks",
        _tabulate_peaks,
        help="print the largest and the smallest value of every column, as a table",
    )
    add_folder(largest)
    add_table(largest, "peaks")
    largest.add_argument(
        "columns", metavar="COLUMN", nargs="*", help="columns of history.csv (default: all)"
    )


def _add_spectrum(actions: Any) -> None:
    """Add ``spectrum`` with its options."""
    spectrum = add_command(
        actions,
        "spectrum",
        _compute_spectra,
        help=(
            "compute floor response spectra of recorded accelerations, as a CSV table and a picture"
        ),
    )
    add_folder(spectrum)
    add_table(spectrum, "spectrum")
    spectrum.add_argument(
        "columns",
        metavar="COLUMN",
        nargs="+",
        help=(
            "columns of history.csv: accelerations such as a_x_top or a_g_x, or a "
            "velocity such as v_x_top when the run has an impact law"
        ),
    )
    spectrum.add_argument(
        "--damping", type=float, default=0.05, metavar="Z", help="damping ratio (default 0.05)"
    )
    spectrum.add_argument(
        "--periods",
        type=float,
        nargs=3,
        default=[0.02, 4.0, 200],
        metavar=("FROM", "TO", "N"),
        help="N periods [s], logarithmically spaced (default 0.02 4 200)",
    )
    spectrum.add_argument(
        "--relative",
        action="store_true",
        help="use the motion relative to the ground instead of the absolute motion",
    )


def _add_transfer(actions: Any) -> None:
    """Add ``transfer`` with its options."""
    transfer = add_command(
        actions,
        "transfer",
        _compute_transfer,
        help=(
            "compute the transfer function between two recorded accelerations, as a CSV table "
            "and a picture"
        ),
    )
    add_folder(transfer)
    add_table(transfer, "transfer")
    transfer.add_argument(
        "surface", metavar="COLUMN", help="acceleration of the upper point, such as a_x_top"
    )
    transfer.add_argument(
        "base",
        metavar="BASE",
        nargs="?",
        default="a_g_x",
        help="acceleration of the lower point (default a_g_x)",
    )
    transfer.add_argument(
        "--bandwidth",
        type=float,
        default=40.0,
        metavar="B",
        help=("bandwidth of the smoothing of Konno and Ohmachi (default 40); 0 means no smoothing"),
    )
    transfer.add_argument(
        "--frequencies",
        type=float,
        nargs=3,
        metavar=("FROM", "TO", "N"),
        help=(
            "N frequencies [Hz], logarithmically spaced (default: 200 from 4/duration to "
            "1/(4 dt), or all of them without smoothing)"
        ),
    )


def _add_checks(actions: Any) -> None:
    """Add ``checks`` with its options."""
    checks = add_command(
        actions,
        "checks",
        _compare_with_formulas,
        help="compare the run with the formulas of its [[check]] tables",
    )
    add_folder(checks)
    add_table(checks, "checks")


def _add_loop(actions: Any) -> None:
    """Add ``loop`` with its options."""
    loop = add_command(
        actions,
        "loop",
        _draw_loop,
        help=(
            "draw a force over a deformation, with the work of the force, as a CSV table and a "
            "picture"
        ),
    )
    add_folder(loop)
    add_table(loop, "loop")
    loop.add_argument(
        "deformation", metavar="DEFORMATION", help="column such as u_x_top or theta_base"
    )
    loop.add_argument("force", metavar="FORCE", help="column such as reaction_x_base or M_base")
    loop.add_argument("--turn", action="store_true", help="change the sign of the force")


def _read_folder(options: argparse.Namespace) -> "RunFolder":
    """Read the run of which a command has the folder."""
    from ...run.files.reading import read_run  # late: h5py, which records do not need

    return read_run(options.folder)


def _tabulate_peaks(options: argparse.Namespace) -> str:
    """Carry out ``post peaks``: write the table, and return it for people."""
    run = _read_folder(options)
    rows = peaks(run.history, run.columns, options.columns or None)
    table = write_peaks(choose_table(options), rows)
    lines = [f"{'column':<28}{'unit':>6}{'max':>13}{'t [s]':>10}{'min':>13}{'t [s]':>10}"]
    for row in rows:
        lines.append(
            f"{row.name:<28}{row.unit:>6}{row.max:>13.4e}{row.t_max:>10.4g}"
            f"{row.min:>13.4e}{row.t_min:>10.4g}"
        )
    lines.append(f"table: {table}")
    return "\n".join(lines)


def _compute_spectra(options: argparse.Namespace) -> str:
    """Carry out ``post spectrum``: write table and picture, and return their paths."""
    run = _read_folder(options)
    periods = space_numbers("--periods", options.periods)
    table = choose_table(options)
    spectra = {}
    steps = {}
    for column in options.columns:
        spectra[column] = floor_spectrum(
            run.history, column, periods, damping=options.damping, relative=options.relative
        )
        steps[column] = recorded_motion(run.history, column).dt
    _write_spectra(table, spectra, options.damping)
    kind = "relative" if options.relative else "absolute"
    title = f"Response spectra of {kind} motions, {100.0 * options.damping:g} %"
    picture = plot_spectra(spectra, table.with_suffix(".png"), steps=steps, title=title)
    return f"table: {table}\npicture: {picture}"


def _write_spectra(path: Path, spectra: Mapping[str, "ResponseSpectrum"], damping: float) -> None:
    """Write one row for each column and period, in SI units."""
    rows: list[list[Any]] = []
    for column, spectrum in spectra.items():
        for numbers in zip(
            spectrum.periods,
            spectrum.displacement,
            spectrum.velocity,
            spectrum.acceleration,
            spectrum.psa,
            strict=True,
        ):
            rows.append([column, damping, *(f"{number:.8g}" for number in numbers)])
    header = ["column", "damping", "period_s", "sd_m", "sv_m/s", "sa_m/s2", "psa_m/s2"]
    write_csv(path, header, rows)


def _compute_transfer(options: argparse.Namespace) -> str:
    """Carry out ``post transfer``: write table and picture, and return the peak."""
    run = _read_folder(options)
    table = choose_table(options)
    frequencies = None
    if options.frequencies is not None:
        frequencies = space_numbers("--frequencies", options.frequencies)
    transfer = transfer_function(
        run.history,
        options.surface,
        options.base,
        bandwidth=options.bandwidth or None,
        frequencies=frequencies,
    )
    rows = []
    for frequency, amplitude in zip(transfer.frequencies, transfer.amplitude, strict=True):
        rows.append([f"{frequency:.8g}", f"{amplitude:.8g}"])
    write_csv(table, ["frequency_Hz", "amplitude"], rows)
    title = f"|{options.surface}| / |{options.base}|"
    picture = plot_transfer(transfer, table.with_suffix(".png"), title=title)
    frequency, amplitude = transfer.peak
    return f"largest: {amplitude:.4g} at {frequency:.4g} Hz\ntable: {table}\npicture: {picture}"


def _draw_loop(options: argparse.Namespace) -> str:
    """Carry out ``post loop``: write table and picture, and return the work."""
    run = _read_folder(options)
    table = choose_table(options)
    sign = -1.0 if options.turn else 1.0
    loop = hysteresis(run.history, options.deformation, options.force, sign=sign)
    write_csv(
        table,
        ["t_s", options.deformation, options.force, "work"],
        zip(run.history["t"], loop.deformation, loop.force, loop.work, strict=True),
    )
    picture = plot_loop(
        loop,
        table.with_suffix(".png"),
        x=(options.deformation, run.columns[options.deformation][0]),
        y=(options.force, run.columns[options.force][0]),
    )
    return (
        f"work: {loop.work[-1]:.6g} J, secant stiffness {loop.stiffness:.6g}\ntable: "
        f"{table}\npicture: {picture}"
    )


def _compare_with_formulas(options: argparse.Namespace) -> str:
    """Carry out ``post checks``: write the table, and return it for people."""
    from ..studies.report import comparisons

    results = comparisons(options.folder)
    table = choose_table(options)
    if not results:
        raise InputError(
            f"{options.folder}: its case has no [[check]]: add one, docs/guide/checks.md lists them"
        )
    write_csv(table, CHECKS_HEADER, [_make_row(result) for result in results])

    # A check that compares a thrust and its moment says its formula once.
    lines: list[str] = []
    before = ""
    for result in results:
        lines.append(f"{result.name}: {_describe_outcome(result)}")
        about = (
            f"    {result.formula}   ({result.source})\n"
            f"    for {result.range}\n"
            f"    {_list_inputs(result)}"
        )
        if about != before:
            lines.append(about)
        before = about
        lines += [f"    note: {note}" for note in result.notes]

    # What the ratios mean, once for all checks of which it is the same.
    names: dict[str, list[str]] = {}
    for result in results:
        if result.reading and not result.applies:
            names.setdefault(result.reading, []).append(result.name)
    lines += [f"{'; '.join(owners)}: {reading}" for reading, owners in names.items()]
    return "\n".join([*lines, f"table: {table}"])


def _make_row(result: "Comparison") -> list[Any]:
    """Return the row of a comparison in the table of checks."""
    return [
        result.name,
        result.formula,
        result.source,
        result.range,
        _list_inputs(result),
        result.expected,
        result.found,
        result.unit,
        result.ratio,
        result.applies,
        result.lasted,
        result.reading,
        "; ".join(result.notes),
    ]


def _describe_outcome(result: "Comparison") -> str:
    """Return both numbers and their ratio, or why they are not compared."""
    if result.applies:
        return f"does not apply: {result.applies}"
    factor, unit = ReportNumbers().choose_unit("", result.unit, abs(result.found))
    found = f"{write_number(factor * result.found)} {unit}".removesuffix(" -")
    outcome = (
        f"expected {write_number(factor * result.expected)}, found {found}, "
        f"ratio {write_number(result.ratio)}"
    )
    if math.isfinite(result.lasted):
        outcome += f", above 90 % of it for {result.lasted:.3g} s"
    return outcome


def _list_inputs(result: "Comparison") -> str:
    """Return what a formula takes, with units."""
    return "; ".join(
        f"{name} = {value:.6g} {unit}".removesuffix(" -")
        for name, (value, unit) in result.inputs.items()
    )
