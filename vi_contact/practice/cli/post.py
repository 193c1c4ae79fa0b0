"""``vi-contact post peaks|spectrum|transfer|loop|checks``: options and what each does."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError
from ...core.files import write_csv
from ...run.files.folder import FILES
from ..engineering import (
    floor_spectrum,
    hysteresis,
    peaks,
    recorded_motion,
    transfer_function,
    write_peaks,
)
from ..plots.records import plot_loop, plot_spectra, plot_transfer
from .options import PICTURES, add_actions, add_command, add_folder, output_file, space_numbers

if TYPE_CHECKING:
    from ...run.files.reading import RunFolder


def add_post_commands(commands: Any) -> None:
    """Add ``post`` to the commands of the top parser."""
    actions = add_actions(
        commands, "post", help="compute numbers and draw pictures from the folder of a run"
    )

    largest = add_command(
        actions,
        "peaks",
        _peaks,
        help="print the largest and the smallest value of every column, as a table",
    )
    add_folder(largest)
    _add_table(largest, "peaks")
    largest.add_argument(
        "columns", metavar="COLUMN", nargs="*", help="columns of history.csv (default: all)"
    )

    spectrum = add_command(
        actions,
        "spectrum",
        _spectrum,
        help=(
            "compute floor response spectra of recorded accelerations, as a CSV table and a picture"
        ),
    )
    add_folder(spectrum)
    _add_table(spectrum, "spectrum")
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

    transfer = add_command(
        actions,
        "transfer",
        _transfer,
        help=(
            "compute the transfer function between two recorded accelerations, as a CSV table "
            "and a picture"
        ),
    )
    add_folder(transfer)
    _add_table(transfer, "transfer")
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

    checks = add_command(
        actions, "checks", _checks, help="compare the run with the formulas of its [[check]] tables"
    )
    add_folder(checks)
    _add_table(checks, "checks")

    loop = add_command(
        actions,
        "loop",
        _loop,
        help=(
            "draw a force over a deformation, with the work of the force, as a CSV table and a "
            "picture"
        ),
    )
    add_folder(loop)
    _add_table(loop, "loop")
    loop.add_argument(
        "deformation", metavar="DEFORMATION", help="column such as u_x_top or theta_base"
    )
    loop.add_argument("force", metavar="FORCE", help="column such as reaction_x_base or M_base")
    loop.add_argument("--turn", action="store_true", help="change the sign of the force")


def _add_table(parser: argparse.ArgumentParser, action: str) -> None:
    """Add the option of the file of the table; ``action`` names it otherwise."""
    parser.add_argument(
        "--out",
        metavar="CSV",
        help=f"file of the table (default: DIR/{action}.csv); the picture is written beside it",
    )


def _run(options: argparse.Namespace) -> "RunFolder":
    from ...run.files.reading import read_run  # late: h5py, which records do not need

    return read_run(options.folder)


def _peaks(options: argparse.Namespace) -> str:
    run = _run(options)
    rows = peaks(run.history, run.columns, options.columns or None)
    table = write_peaks(_table_path(options), rows)
    lines = [
        f"{row.name:<28}{row.unit:>6}{row.max:>13.4e}{row.t_max:>10.4g}"
        f"{row.min:>13.4e}{row.t_min:>10.4g}"
        for row in rows
    ]
    head = f"{'column':<28}{'unit':>6}{'max':>13}{'t [s]':>10}{'min':>13}{'t [s]':>10}"
    return "\n".join([head, *lines, f"table: {table}"])


def _spectrum(options: argparse.Namespace) -> str:
    run, periods, table = (
        _run(options),
        space_numbers("--periods", options.periods),
        _table_path(options),
    )
    more = {"damping": options.damping, "relative": options.relative}
    spectra = {name: floor_spectrum(run.history, name, periods, **more) for name in options.columns}
    write_csv(
        table,
        ["column", "damping", "period_s", "sd_m", "sv_m/s", "sa_m/s2", "psa_m/s2"],
        (
            [name, options.damping, *(f"{x:.8g}" for x in row)]
            for name, one in spectra.items()
            for row in zip(
                one.periods, one.displacement, one.velocity, one.acceleration, one.psa, strict=True
            )
        ),
    )
    dt = {name: recorded_motion(run.history, name).dt for name in spectra}
    kind = "relative" if options.relative else "absolute"
    title = f"Response spectra of {kind} motions, {100.0 * options.damping:g} %"
    picture = plot_spectra(spectra, table.with_suffix(".png"), steps=dt, title=title)
    return f"table: {table}\npicture: {picture}"


def _transfer(options: argparse.Namespace) -> str:
    run, table = _run(options), _table_path(options)
    given = (
        None if options.frequencies is None else space_numbers("--frequencies", options.frequencies)
    )
    found = transfer_function(
        run.history,
        options.surface,
        options.base,
        bandwidth=options.bandwidth or None,
        frequencies=given,
    )
    rows = zip(found.frequencies, found.amplitude, strict=True)
    write_csv(table, ["frequency_Hz", "amplitude"], ([f"{x:.8g}" for x in row] for row in rows))
    picture = plot_transfer(
        found, table.with_suffix(".png"), title=f"|{options.surface}| / |{options.base}|"
    )
    frequency, amplitude = found.peak
    return f"largest: {amplitude:.4g} at {frequency:.4g} Hz\ntable: {table}\npicture: {picture}"


def _loop(options: argparse.Namespace) -> str:
    run, table = _run(options), _table_path(options)
    loop = hysteresis(
        run.history, options.deformation, options.force, sign=-1.0 if options.turn else 1.0
    )
    write_csv(
        table,
        ["t_s", options.deformation, options.force, "work"],
        zip(run.history["t"], loop.deformation, loop.force, loop.work, strict=True),
    )
    x, y = ((name, run.columns[name][0]) for name in (options.deformation, options.force))
    picture = plot_loop(loop, table.with_suffix(".png"), x=x, y=y)
    return (
        f"work: {loop.work[-1]:.6g} J, secant stiffness {loop.stiffness:.6g}\ntable: "
        f"{table}\npicture: {picture}"
    )


def _checks(options: argparse.Namespace) -> str:
    from ..studies.report import comparisons

    found, table = comparisons(options.folder), _table_path(options)
    if not found:
        raise InputError(
            f"{options.folder}: its case has no [[check]]: add one, docs/guide/checks.md lists them"
        )
    inputs = [
        "; ".join(f"{key} = {value:.6g} {unit}" for key, (value, unit) in one.inputs.items())
        for one in found
    ]
    head = (
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
    )
    write_csv(
        table,
        head,
        (
            [
                one.name,
                one.formula,
                one.source,
                one.range,
                given,
                one.expected,
                one.found,
                one.unit,
                one.ratio,
                one.applies,
            ]
            for one, given in zip(found, inputs, strict=True)
        ),
    )
    said = [
        f"{one.name}: "
        + (
            f"does not apply: {one.applies}"
            if one.applies
            else f"expected {one.expected:.5g}, "
            f"found {one.found:.5g} {one.unit}, ratio {one.ratio:.4g}"
        )
        + f"\n    {one.formula}   ({one.source})\n    "
        f"for {one.range}\n    {given}"
        for one, given in zip(found, inputs, strict=True)
    ]
    return "\n".join([*said, f"table: {table}"])


def _table_path(options: argparse.Namespace) -> Path:
    """Return the table that a command is about to write.

    A picture of the same name is written beside it. It raises InputError where a file may not be
    written.
    """
    folder = Path(options.folder)
    out = output_file(
        options.out or folder / f"{options.action}.csv", reads=[folder / name for name in FILES]
    )
    if out.suffix.lower() in PICTURES:
        raise InputError(
            f"{out}: the table would be overwritten by its picture; give a name such as "
            f"{out.stem}.csv"
        )
    output_file(out.with_suffix(PICTURES[0]))
    return out
