"""``vi-contact motion info|convert|plot|spectrum``: options and what each action does."""

import argparse
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.files import write_csv
from ..ground_motion.chain import Processing
from ..ground_motion.ec8 import EC8Spectrum
from ..ground_motion.formats.reader import read_record
from ..ground_motion.formats.writer import write_at2, write_columns, write_path_series
from ..ground_motion.intensity import pga, record_info
from ..ground_motion.record import LARGEST_PEAK, UNITS, Record, canonical_units
from ..ground_motion.spectra import response_spectrum
from ..plots.records import plot_motion, plot_spectra
from .options import add_actions, output_file, spaced

_FORMATS = {".at2": "at2", ".th": "path", ".g3": "path", ".acc": "path"}
_QUANTITY = re.compile(r"([-+]?[\d.]++(?:[eE][-+]?\d++)?)(.*+)")
_SHOWN = (0.1, 0.2, 0.5, 1.0, 2.0)  # periods of the printed table [s]
_SPELLING = {"units": "--units", "dt": "--dt", "channel": "--channel", "largest": "--largest", "resample_dt": "--even"}


def add_motion_commands(commands: Any) -> None:
    """Add ``motion`` with its actions to the commands of the top parser."""
    parsers = add_actions(commands, "motion", "ground motion files", {
        "info": (_info, "what a record file holds: units, peaks, intensities, duration, drift"),
        "convert": (_convert, "process a record and write it as columns, PEER AT2 or OpenSees path series"),
        "plot": (_plot, "picture of acceleration, velocity, displacement and Husid's curve"),
        "spectrum": (_spectrum, "response spectra as CSV and picture, with the spectrum of Eurocode 8"),
    })
    for name, one in parsers.items():
        one.set_defaults(spelling=_SPELLING)
        one.add_argument("file", nargs="+" if name in ("info", "spectrum") else None,
                         help="AT2, COSMOS/CSMIP V2, SMC, K-NET, ESM, AFAD, columns, path series")
    parsers["convert"].add_argument("out", help="file to write")
    for one in parsers.values():
        _add_reading(one)
        _add_processing(one)
    convert = parsers["convert"].add_argument_group("output")
    convert.add_argument("--to", choices=("columns", "at2", "path"),
                         help="format (default by the name: .at2, .th .g3 .acc: path series, else columns)")
    convert.add_argument("--out-units", metavar="UNITS", help="default g in AT2, else m/s2")
    plot = parsers["plot"].add_argument_group("output")
    plot.add_argument("--out", metavar="PNG", help="picture (default: name of the record file with .png, here)")
    plot.add_argument("--out-units", default="m/s2", metavar="UNITS", help="of the accelerations drawn (default m/s2)")
    _add_spectrum(parsers["spectrum"])


def _add_reading(one: argparse.ArgumentParser) -> None:
    group = one.add_argument_group("reading")
    group.add_argument("--units", help="m/s2, cm/s2, gal, g, ...: required where the file does not say")
    group.add_argument("--dt", type=float, help="time step [s], where the file does not say")
    group.add_argument("--channel", type=int, metavar="K", help="which one of a file that holds several, from 1")
    group.add_argument("--largest", type=acceleration, default=LARGEST_PEAK, metavar="A",
                       help="accept peaks up to this (default 10g: beyond it the units are doubted)")
    group.add_argument("--even", type=float, metavar="DT", help="bring uneven times of a column file to this step [s]")


def _add_processing(one: argparse.ArgumentParser) -> None:
    group = one.add_argument_group("processing, in this order", "accelerations as 3.0 (m/s2) or with units, as 0.3g")
    group.add_argument("--trim", type=float, nargs=2, metavar=("START", "END"), help="keep this part [s]")
    group.add_argument("--pad", type=float, nargs=2, metavar=("BEFORE", "AFTER"), help="add zeros [s]")
    group.add_argument("--remove-mean", action="store_true", dest="mean", help="remove the mean")
    group.add_argument("--taper", type=float, nargs="?", const=0.05, metavar="PART",
                       help="cosine taper over this part of the duration at each end (0.05 if no number follows)")
    group.add_argument("--low", type=float, metavar="HZ", help="Butterworth high-pass corner")
    group.add_argument("--high", type=float, metavar="HZ", help="Butterworth low-pass corner")
    group.add_argument("--order", type=int, default=4, help="order of the filter (default 4)")
    group.add_argument("--causal", action="store_true", help="filter forward only instead of with zero phase")
    group.add_argument("--resample", type=float, metavar="DT", help="resample to this step [s], band-limited")
    group.add_argument("--baseline", type=int, nargs="?", const=2, metavar="DEGREE",
                       help="remove a polynomial so that the ground ends at rest where it began (degree 2)")
    scale = group.add_mutually_exclusive_group()
    scale.add_argument("--scale", type=float, metavar="F", help="multiply by F")
    scale.add_argument("--pga", type=acceleration, metavar="A", help="scale to this peak acceleration")
    scale.add_argument("--arias", type=float, metavar="I", help="scale to this Arias intensity [m/s]")
    scale.add_argument("--psa", nargs=2, metavar=("A", "T"),
                       help="scale to this pseudo-acceleration (5 %% damping) at period T [s]")


def _add_spectrum(one: argparse.ArgumentParser) -> None:
    group = one.add_argument_group("spectrum")
    group.add_argument("--damping", type=float, nargs="+", default=[0.05], metavar="Z", help="ratios (default 0.05)")
    group.add_argument("--periods", type=float, nargs=3, default=(0.02, 10.0, 200), metavar=("FROM", "TO", "N"),
                       help="logarithmically spaced [s] (default 0.02 10 200)")
    target = one.add_argument_group("target")
    target.add_argument("--ec8", metavar="GROUND", help="ground type A, B, C, D or E; needs --ag")
    target.add_argument("--ag", type=acceleration, metavar="A", help="design ground acceleration on ground A")
    target.add_argument("--ec8-type", type=int, choices=(1, 2), default=1, help="spectrum type (default 1)")
    output = one.add_argument_group("output")
    output.add_argument("--csv", metavar="FILE", help="default: name of the first record file with _spectrum.csv, here")
    output.add_argument("--png", metavar="FILE", help="picture, default the same with .png")
    output.add_argument("--out-units", default="g", metavar="UNITS", help="of the picture and the table (default g)")


def acceleration(text: str) -> float:
    """Read metres per second squared from "3.0", "0.3g", "0.3 g" or "300gal"."""
    match = _QUANTITY.fullmatch(text.strip())
    try:
        if match is None:
            raise ValueError(text)
        return float(match[1]) * UNITS[canonical_units("option", match[2].strip() or "m/s2")]
    except ValueError:  # InputError is one
        raise argparse.ArgumentTypeError(f"{text!r} is no acceleration such as 3.0 or 0.3g") from None


def _read(options: argparse.Namespace, path: str) -> Record:
    """Return the record of a file after the processing asked for."""
    asked = {one.name: getattr(options, one.name) for one in fields(Processing)}
    if (words := options.psa) is not None:
        try:
            asked["psa"] = acceleration(words[0]), float(words[1])
        except (argparse.ArgumentTypeError, ValueError):
            raise InputError(f"--psa {' '.join(words)}: give an acceleration such as 0.5g, a period in seconds"
                             ) from None
    return Processing(**asked)(read_record(path, options.units, dt=options.dt, channel=options.channel,
                                           resample_dt=options.even, largest=options.largest))


def _info(options: argparse.Namespace) -> str:
    return "\n\n".join(record_info(_read(options, path)) for path in options.file)


def _convert(options: argparse.Namespace) -> str:
    output_file(options.out, reads=[options.file])
    record = _read(options, options.file)
    form = options.to or _FORMATS.get(Path(options.out).suffix.lower(), "columns")
    units = options.out_units or ("g" if form == "at2" else "m/s2")
    {"columns": write_columns, "at2": write_at2, "path": write_path_series}[form](record, options.out, units)
    lines = [f"{options.out}: {form}, {record.acceleration.size} samples, dt = {record.dt:.10g} s, in {units}, "
             f"PGA = {pga(record):.4g} m/s2"]
    if form == "path":
        lines.append(f"OpenSees: timeSeries Path 1 -dt {record.dt:.10g} -filePath {options.out} -factor 1.0  "
                     f"# -factor: your unit of acceleration per {units}")
    return "\n".join(lines + [f"note: {note}" for note in record.notes])


def _plot(options: argparse.Namespace) -> str:
    out = output_file(options.out or Path(options.file).stem + ".png", reads=[options.file], picture=True)
    record = _read(options, options.file)
    units = canonical_units("--out-units", options.out_units)
    return f"picture: {plot_motion(record, out, units=units)}"


def _spectrum(options: argparse.Namespace) -> str:
    units = canonical_units("--out-units", options.out_units)
    target = _target(options)
    periods = spaced("--periods", options.periods)
    spectra, steps, rows = {}, {}, []
    for path in options.file:
        record = _read(options, path)
        for damping in options.damping:
            label = f"{Path(path).stem}, {100.0 * damping:g} %"
            if label in spectra:
                raise InputError(f"{path}: two spectra are called {label!r}; give each file and damping once")
            spectra[label] = response_spectrum(record, periods, damping=damping)
            steps[label] = record.dt
            at = response_spectrum(record, np.array(_SHOWN), damping=damping).psa / UNITS[units]
            rows.append(f"{label:<44}" + "".join(f"{value:>10.4g}" for value in at))
    stem = Path(options.file[0]).stem
    table = output_file(options.csv or f"{stem}_spectrum.csv", reads=options.file)
    picture = output_file(options.png or f"{stem}_spectrum.png", reads=options.file, picture=True)
    if table == picture:
        raise InputError(f"{table}: the table would be overwritten by its picture; give each a name of its own")
    _write_csv(table, spectra, target)
    plot_spectra(spectra, picture, target=target, steps=steps, units=units)
    if target is not None:
        rows.append(f"{'EC8 target':<44}" + "".join(f"{v / UNITS[units]:>10.4g}" for v in target.acceleration(_SHOWN)))
    head = f"{f'PSA [{units}] at period [s]':<44}" + "".join(f"{period:>10g}" for period in _SHOWN)
    return "\n".join([head, *rows, f"table: {table}", f"picture: {picture}"])


def _target(options: argparse.Namespace) -> Any:
    """Return the Eurocode 8 spectrum asked for, at the first damping, or None."""
    if (options.ec8 is None) != (options.ag is None):
        raise InputError("--ec8 and --ag belong together: give the ground type and the design ground acceleration")
    if options.ec8 is None:
        return None
    return EC8Spectrum.on_ground(options.ec8.upper(), ag=options.ag, kind=options.ec8_type, damping=options.damping[0])


def _write_csv(path: Path, spectra: Any, target: Any) -> None:
    """Write one row for each record, damping and period, in SI units."""
    rows = []
    for label, one in spectra.items():
        columns = [one.periods, one.displacement, one.velocity, one.acceleration, one.psv, one.psa]
        columns += [] if target is None else [target.acceleration(one.periods)]
        rows += [[label.rpartition(",")[0], one.damping, *(f"{value:.8g}" for value in row)]
                 for row in zip(*columns, strict=True)]
    header = ["record", "damping", "period_s", "sd_m", "sv_m/s", "sa_m/s2", "psv_m/s", "psa_m/s2"]
    write_csv(path, header if target is None else [*header, "ec8_m/s2"], rows)
