"""``vi-contact motion info|convert|plot|spectrum``: options and what each action does."""

import argparse
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.files import write_csv
from ..ground_motion.chain import Processing
from ..ground_motion.ec8 import EC8Spectrum
from ..ground_motion.formats.reader import read_record
from ..ground_motion.formats.writer import write_at2, write_columns, write_path_series
from ..ground_motion.intensity import pga, record_info
from ..ground_motion.record import LARGEST_PEAK, UNITS, Record, canonical_units
from ..ground_motion.spectra import ResponseSpectrum, response_spectrum
from ..plots.records import plot_motion, plot_spectra
from .options import add_actions, add_command, output_file, space_numbers

# Ending of a file -> format.
_FORMATS = {".at2": "at2", ".th": "path", ".g3": "path", ".acc": "path"}
_WRITERS = {"columns": write_columns, "at2": write_at2, "path": write_path_series}
_QUANTITY = re.compile(r"([-+]?[\d.]++(?:[eE][-+]?\d++)?)(.*+)")
_SHOWN = (0.1, 0.2, 0.5, 1.0, 2.0)  # periods of the printed table [s]
# Arguments of read_record -> the options that stand for them.
_SPELLING = {
    "units": "--units",
    "dt": "--dt",
    "channel": "--channel",
    "largest": "--largest",
    "resample_dt": "--even",
}
_RECORD_FILE = (
    "record file: PEER AT2, COSMOS/CSMIP, SMC, K-NET, ESM, AFAD, GeoNet, BHRC, "
    "RENADIC, USC, UNAM, CWA, columns of numbers, or an OpenSees path series"
)


def add_motion_commands(commands: Any) -> None:
    """Add ``motion`` with its actions to the commands of the top parser."""
    actions = add_actions(commands, "motion", help="read, process and draw ground motion files")

    info = add_command(
        actions,
        "info",
        _describe_files,
        help="print what a record file holds: units, peaks, intensities, duration, drift",
    )
    info.add_argument("file", nargs="+", help=_RECORD_FILE)
    _add_reading(info)
    _add_processing(info)

    convert = add_command(
        actions,
        "convert",
        _convert,
        help="process a record and write it as columns, PEER AT2 or OpenSees path series",
    )
    convert.add_argument("file", help=_RECORD_FILE)
    convert.add_argument("out", help="file to write")
    _add_reading(convert)
    _add_processing(convert)
    _add_convert_output(convert)

    plot = add_command(
        actions,
        "plot",
        _plot,
        help="draw the acceleration, velocity, displacement and Husid curve of a record",
    )
    plot.add_argument("file", help=_RECORD_FILE)
    _add_reading(plot)
    _add_processing(plot)
    _add_plot_output(plot)

    spectrum = add_command(
        actions,
        "spectrum",
        _compute_spectra,
        help=(
            "compute response spectra, as a CSV table and a picture, beside the spectrum of "
            "Eurocode 8"
        ),
    )
    spectrum.add_argument("file", nargs="+", help=_RECORD_FILE)
    _add_reading(spectrum)
    _add_processing(spectrum)
    _add_spectrum(spectrum)
    _add_target(spectrum)
    _add_spectrum_output(spectrum)

    for parser in (info, convert, plot, spectrum):
        parser.set_defaults(spelling=_SPELLING, largest=LARGEST_PEAK)


def _add_reading(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what a file of a record does not say."""
    group = parser.add_argument_group("reading a file")
    group.add_argument(
        "--units",
        help=(
            "unit of the accelerations, for example m/s2, cm/s2, gal or g; required when "
            "the file does not state it"
        ),
    )
    group.add_argument(
        "--dt", type=float, help="time step [s]; required when the file does not state it"
    )
    group.add_argument(
        "--channel",
        metavar="K",
        help=(
            "number of the channel, from 1, or its name in the file, when the file holds several"
        ),
    )
    group.add_argument(
        "--largest",
        type=read_acceleration,
        metavar="A",
        help=(
            "accept peaks up to this acceleration (default 10g; a larger peak usually "
            "means wrong units)"
        ),
    )
    group.add_argument(
        "--even",
        type=float,
        metavar="DT",
        help="interpolate a file with unequal time steps to this time step [s]",
    )


def _add_processing(parser: argparse.ArgumentParser) -> None:
    """Add the options of the chain of processing, in its order."""
    group = parser.add_argument_group(
        "processing, in this order", "Give accelerations as 3.0 (in m/s2), or with a unit as 0.3g."
    )
    _add_windows(group)
    _add_filters(group)
    _add_scaling(group)


def _add_windows(group: Any) -> None:
    """Add the options of the parts of a record that are kept, and of its ends."""
    group.add_argument(
        "--trim",
        type=float,
        nargs=2,
        metavar=("START", "END"),
        help="keep the part from START to END [s]",
    )
    group.add_argument(
        "--pad",
        type=float,
        nargs=2,
        metavar=("BEFORE", "AFTER"),
        help="add zeros for these times [s] before and after the record",
    )
    group.add_argument("--remove-mean", action="store_true", dest="mean", help="remove the mean")
    group.add_argument(
        "--taper",
        type=float,
        nargs="?",
        const=0.05,
        metavar="PART",
        help=(
            "apply a cosine taper to this part of the duration at each end (0.05 if no "
            "number follows)"
        ),
    )


def _add_filters(group: Any) -> None:
    """Add the options of the filter, of the time step and of the baseline."""
    group.add_argument(
        "--low",
        type=float,
        metavar="HZ",
        help=(
            "lower corner frequency of the Butterworth filter: slower motions are "
            "removed (high-pass)"
        ),
    )
    group.add_argument(
        "--high",
        type=float,
        metavar="HZ",
        help=(
            "upper corner frequency of the Butterworth filter: faster motions are "
            "removed (low-pass)"
        ),
    )
    group.add_argument("--order", type=int, default=4, help="order of the filter (default 4)")
    group.add_argument(
        "--causal",
        action="store_true",
        help=("filter forward in time only; without this option the filter has zero phase shift"),
    )
    group.add_argument(
        "--resample",
        type=float,
        metavar="DT",
        help="resample to this time step [s] with a band-limited filter",
    )
    group.add_argument(
        "--baseline",
        type=int,
        nargs="?",
        const=2,
        metavar="DEGREE",
        help=(
            "remove a polynomial of this degree (default 2) so that the ground ends at "
            "rest where it began"
        ),
    )


def _add_scaling(group: Any) -> None:
    """Add the options of the size of a record, of which a command takes one at most."""
    choice = group.add_mutually_exclusive_group()
    choice.add_argument("--scale", type=float, metavar="F", help="multiply the record by F")
    choice.add_argument(
        "--pga", type=read_acceleration, metavar="A", help="scale to this peak acceleration"
    )
    choice.add_argument(
        "--arias", type=float, metavar="I", help="scale to this Arias intensity [m/s]"
    )
    choice.add_argument(
        "--psa",
        nargs=2,
        metavar=("A", "T"),
        help="scale to this pseudo-acceleration (5 %% damping) at period T [s]",
    )


def _add_convert_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of the file that is written."""
    group = parser.add_argument_group("output")
    group.add_argument(
        "--to",
        choices=["columns", "at2", "path"],
        help=(
            "format of the file (default by its name: at2 for .at2, path for .th, .g3 "
            "and .acc, columns for others)"
        ),
    )
    group.add_argument(
        "--out-units",
        metavar="UNITS",
        help="unit of the accelerations (default g in AT2 files, m/s2 in others)",
    )


def _add_plot_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of the picture of a record."""
    group = parser.add_argument_group("output")
    group.add_argument(
        "--out",
        metavar="PNG",
        help=(
            "file of the picture (default: the name of the record file with .png, in the "
            "current folder)"
        ),
    )
    group.add_argument(
        "--out-units",
        default="m/s2",
        metavar="UNITS",
        help="unit of the accelerations in the picture (default m/s2)",
    )


def _add_spectrum(parser: argparse.ArgumentParser) -> None:
    """Add the options of response spectra."""
    group = parser.add_argument_group("spectrum")
    group.add_argument(
        "--damping",
        type=float,
        nargs="+",
        default=[0.05],
        metavar="Z",
        help="damping ratios (default 0.05)",
    )
    group.add_argument(
        "--periods",
        type=float,
        nargs=3,
        default=[0.02, 10.0, 200],
        metavar=("FROM", "TO", "N"),
        help="N periods [s], logarithmically spaced (default 0.02 10 200)",
    )


def _add_target(parser: argparse.ArgumentParser) -> None:
    """Add the options of the spectrum of Eurocode 8."""
    group = parser.add_argument_group("target")
    group.add_argument(
        "--ec8",
        metavar="GROUND",
        help=(
            "draw the elastic spectrum for this ground type, A, B, C, D or E; --ag is needed too"
        ),
    )
    group.add_argument(
        "--ag",
        type=read_acceleration,
        metavar="A",
        help="design ground acceleration on ground type A",
    )
    group.add_argument(
        "--ec8-type", type=int, choices=[1, 2], default=1, help="spectrum type (default 1)"
    )


def _add_spectrum_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of the table and the picture of spectra."""
    group = parser.add_argument_group("output")
    group.add_argument(
        "--csv",
        metavar="FILE",
        help=(
            "file of the table (default: the name of the first record file with "
            "_spectrum.csv, in the current folder)"
        ),
    )
    group.add_argument(
        "--png",
        metavar="FILE",
        help="file of the picture (default: the name of the table with .png)",
    )
    group.add_argument(
        "--out-units",
        default="g",
        metavar="UNITS",
        help="unit of the accelerations in the picture and the table (default g)",
    )


def read_acceleration(text: str) -> float:
    """Read metres per second squared from "3.0", "0.3g", "0.3 g" or "300gal"."""
    match = _QUANTITY.fullmatch(text.strip())
    try:
        if match is None:
            raise ValueError(text)
        return float(match[1]) * UNITS[canonical_units("option", match[2].strip() or "m/s2")]
    except ValueError:  # InputError is one
        raise argparse.ArgumentTypeError(
            f"{text!r} is not an acceleration: give 3.0 or 0.3g, for example"
        ) from None


def _read(options: argparse.Namespace, path: str) -> Record:
    """Return the record of a file after the processing asked for."""
    steps = {field.name: getattr(options, field.name) for field in fields(Processing)}
    if options.psa is not None:
        steps["psa"] = _read_psa(options.psa)
    process = Processing(**steps)
    return process(
        read_record(
            path,
            options.units,
            dt=options.dt,
            channel=options.channel,
            resample_dt=options.even,
            largest=options.largest,
        )
    )


def _read_psa(words: Sequence[str]) -> tuple[float, float]:
    """Read pseudo-acceleration [m/s²] and period [s]."""
    try:
        acceleration = read_acceleration(words[0])
        period = float(words[1])
        if not 0.0 < period < math.inf:
            raise ValueError(words[1])
    except (argparse.ArgumentTypeError, ValueError):
        raise InputError(
            f"--psa {' '.join(words)}: give an acceleration such as 0.5g, and a period in seconds"
        ) from None
    return acceleration, period


def _describe_files(options: argparse.Namespace) -> str:
    """Carry out ``motion info``: return a table for each file."""
    return "\n\n".join(_describe_record(_read(options, path)) for path in options.file)


def _describe_record(record: Record) -> str:
    """Return the table of a record, and where its data come from.

    These are its units, its time step and its number of samples.
    """
    origins = {
        "units": record.units_from.replace("option", "--units"),
        "dt": record.dt_from.replace("option", "--dt"),
        "samples": record.samples_from,
    }
    rows = [f"{f'{name} from':<20}{origin}" for name, origin in origins.items()]
    table = record_info(record).split("\n")
    # between what the file holds and the notes about it
    end = next(k for k, row in enumerate(table) if row.startswith("sha256")) + 1
    return "\n".join([*table[:end], *rows, *table[end:]])


def _convert(options: argparse.Namespace) -> str:
    """Carry out ``motion convert``: write the record, and return what was written."""
    output_file(options.out, reads=[options.file])
    record = _read(options, options.file)
    form = options.to or _FORMATS.get(Path(options.out).suffix.lower(), "columns")
    units = options.out_units or ("g" if form == "at2" else "m/s2")
    _WRITERS[form](record, options.out, units)
    lines = [
        f"{options.out}: {form}, {record.acceleration.size} samples, dt = {record.dt:.10g} s, in "
        f"{units}, PGA = {pga(record):.4g} m/s2"
    ]
    if form == "path":
        lines.append(
            f"OpenSees: timeSeries Path 1 -dt {record.dt:.10g} -filePath {options.out} -factor 1.0 "
            f" # -factor: your unit of acceleration per {units}"
        )
    lines += [f"doubt: {doubt}" for doubt in record.doubts]
    lines += [f"note: {note}" for note in record.notes]
    return "\n".join(lines)


def _plot(options: argparse.Namespace) -> str:
    """Carry out ``motion plot``: draw the record, and return the path of the picture."""
    out = output_file(
        options.out or Path(options.file).stem + ".png", reads=[options.file], picture=True
    )
    record = _read(options, options.file)
    units = canonical_units("--out-units", options.out_units)
    return f"picture: {plot_motion(record, out, units=units)}"


def _compute_spectra(options: argparse.Namespace) -> str:
    """Carry out ``motion spectrum``: write table and picture, and return a few values."""
    units = canonical_units("--out-units", options.out_units)
    target = _read_target(options)
    periods = space_numbers("--periods", options.periods)

    # All spectra; of each a row with its values at a few periods is printed.
    spectra: dict[str, ResponseSpectrum] = {}
    steps: dict[str, float] = {}
    lines = [
        f"{f'PSA [{units}] at period [s]':<44}" + "".join(f"{period:>10g}" for period in _SHOWN)
    ]
    for path in options.file:
        record = _read(options, path)
        for damping in options.damping:
            label = f"{Path(path).stem}, {100.0 * damping:g} %"
            if label in spectra:
                raise InputError(
                    f"{path}: two spectra are called {label!r}; give each file and damping once"
                )
            spectra[label] = response_spectrum(record, periods, damping=damping)
            steps[label] = record.dt
            psa = response_spectrum(record, np.array(_SHOWN), damping=damping).psa / UNITS[units]
            lines.append(f"{label:<44}" + "".join(f"{value:>10.4g}" for value in psa))

    # The names of the files are checked before the first is written.
    stem = Path(options.file[0]).stem
    table = output_file(options.csv or f"{stem}_spectrum.csv", reads=options.file)
    picture = output_file(options.png or f"{stem}_spectrum.png", reads=options.file, picture=True)
    if table == picture:
        raise InputError(
            f"{table}: the table would be overwritten by its picture; give --csv and --png two "
            "names"
        )
    _write_table(table, spectra, target)
    plot_spectra(spectra, picture, target=target, steps=steps, units=units)
    if target is not None:
        values = target.acceleration(np.array(_SHOWN)) / UNITS[units]
        lines.append(f"{'EC8 target':<44}" + "".join(f"{value:>10.4g}" for value in values))
    return "\n".join([*lines, f"table: {table}", f"picture: {picture}"])


def _read_target(options: argparse.Namespace) -> EC8Spectrum | None:
    """Return the Eurocode 8 spectrum asked for, at the first damping, or None."""
    if (options.ec8 is None) != (options.ag is None):
        raise InputError(
            "--ec8 and --ag need each other: give both ground type and design ground acceleration"
        )
    if options.ec8 is None:
        return None
    return EC8Spectrum.on_ground(
        options.ec8.upper(), ag=options.ag, kind=options.ec8_type, damping=options.damping[0]
    )


def _write_table(
    path: Path, spectra: Mapping[str, ResponseSpectrum], target: EC8Spectrum | None
) -> None:
    """Write one row for each record, damping and period, in SI units."""
    header = ["record", "damping", "period_s", "sd_m", "sv_m/s", "sa_m/s2", "psv_m/s", "psa_m/s2"]
    if target is not None:
        header.append("ec8_m/s2")
    rows: list[list[Any]] = []
    for label, spectrum in spectra.items():
        name, _, _ = label.rpartition(",")  # without the damping
        columns = [
            spectrum.periods,
            spectrum.displacement,
            spectrum.velocity,
            spectrum.acceleration,
            spectrum.psv,
            spectrum.psa,
        ]
        if target is not None:
            columns.append(target.acceleration(spectrum.periods))
        for numbers in zip(*columns, strict=True):
            rows.append([name, spectrum.damping, *(f"{number:.8g}" for number in numbers)])
    write_csv(path, header, rows)
