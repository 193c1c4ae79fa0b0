"""``vi-contact motion info|convert|plot|spectrum``: options and what each action does."""

import argparse
import math
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
from .options import add_actions, add_command, output_file, spaced

_FORMATS = {".at2": "at2", ".th": "path", ".g3": "path", ".acc": "path"}
_QUANTITY = re.compile(r"([-+]?[\d.]++(?:[eE][-+]?\d++)?)(.*+)")
_SHOWN = (0.1, 0.2, 0.5, 1.0, 2.0)  # periods of the printed table [s]
_SPELLING = {
    "units": "--units",
    "dt": "--dt",
    "channel": "--channel",
    "largest": "--largest",
    "resample_dt": "--even",
}


def add_motion_commands(commands: Any) -> None:
    """Add ``motion`` with its actions to the commands of the top parser."""
    actions = add_actions(commands, "motion")
    for action, run, more in (
        ("info", _info, ()),
        ("convert", _convert, ("convert output",)),
        ("plot", _plot, ("plot output",)),
        ("spectrum", _spectrum, ("spectrum", "target", "spectrum output")),
    ):
        one = add_command(
            actions,
            f"motion {action}",
            run,
            f"motion {action}",
            "reading",
            "processing",
            *more,
            words={"acceleration": acceleration},
        )
        one.set_defaults(spelling=_SPELLING, largest=LARGEST_PEAK)


def acceleration(text: str) -> float:
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
    asked = {one.name: getattr(options, one.name) for one in fields(Processing)}
    if (words := options.psa) is not None:
        try:
            asked["psa"] = acceleration(words[0]), (period := float(words[1]))
            if not 0.0 < period < math.inf:
                raise ValueError(words[1])
        except (argparse.ArgumentTypeError, ValueError):
            raise InputError(
                f"--psa {' '.join(words)}: give an acceleration such as 0.5g, and a period in "
                "seconds"
            ) from None
    return Processing(**asked)(
        read_record(
            path,
            options.units,
            dt=options.dt,
            channel=options.channel,
            resample_dt=options.even,
            largest=options.largest,
        )
    )


def _info(options: argparse.Namespace) -> str:
    return "\n\n".join(_told(_read(options, path)) for path in options.file)


def _told(record: Record) -> str:
    """Return the table of a record, and where its data come from.

    These are its units, its time step and its number of samples.
    """
    spelled = {
        "units": record.units_from.replace("option", "--units"),
        "dt": record.dt_from.replace("option", "--dt"),
        "samples": record.samples_from,
    }
    rows = [f"{f'{name} from':<20}{origin}" for name, origin in spelled.items()]
    table = record_info(record).split("\n")
    notes = next(k for k, row in enumerate(table) if row.startswith("sha256")) + 1
    return "\n".join([*table[:notes], *rows, *table[notes:]])


def _convert(options: argparse.Namespace) -> str:
    output_file(options.out, reads=[options.file])
    record = _read(options, options.file)
    form = options.to or _FORMATS.get(Path(options.out).suffix.lower(), "columns")
    units = options.out_units or ("g" if form == "at2" else "m/s2")
    {"columns": write_columns, "at2": write_at2, "path": write_path_series}[form](
        record, options.out, units
    )
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
    return "\n".join(lines + [f"note: {note}" for note in record.notes])


def _plot(options: argparse.Namespace) -> str:
    out = output_file(
        options.out or Path(options.file).stem + ".png", reads=[options.file], picture=True
    )
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
                raise InputError(
                    f"{path}: two spectra are called {label!r}; give each file and damping once"
                )
            spectra[label] = response_spectrum(record, periods, damping=damping)
            steps[label] = record.dt
            at = response_spectrum(record, np.array(_SHOWN), damping=damping).psa / UNITS[units]
            rows.append(f"{label:<44}" + "".join(f"{value:>10.4g}" for value in at))
    stem = Path(options.file[0]).stem
    table = output_file(options.csv or f"{stem}_spectrum.csv", reads=options.file)
    picture = output_file(options.png or f"{stem}_spectrum.png", reads=options.file, picture=True)
    if table == picture:
        raise InputError(
            f"{table}: the table would be overwritten by its picture; give --csv and --png two "
            "names"
        )
    _write_csv(table, spectra, target)
    plot_spectra(spectra, picture, target=target, steps=steps, units=units)
    if target is not None:
        rows.append(
            f"{'EC8 target':<44}"
            + "".join(f"{v / UNITS[units]:>10.4g}" for v in target.acceleration(_SHOWN))
        )
    head = f"{f'PSA [{units}] at period [s]':<44}" + "".join(f"{period:>10g}" for period in _SHOWN)
    return "\n".join([head, *rows, f"table: {table}", f"picture: {picture}"])


def _target(options: argparse.Namespace) -> Any:
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


def _write_csv(path: Path, spectra: Any, target: Any) -> None:
    """Write one row for each record, damping and period, in SI units."""
    rows = []
    for label, one in spectra.items():
        columns = [one.periods, one.displacement, one.velocity, one.acceleration, one.psv, one.psa]
        columns += [] if target is None else [target.acceleration(one.periods)]
        rows += [
            [label.rpartition(",")[0], one.damping, *(f"{value:.8g}" for value in row)]
            for row in zip(*columns, strict=True)
        ]
    header = ["record", "damping", "period_s", "sd_m", "sv_m/s", "sa_m/s2", "psv_m/s", "psa_m/s2"]
    write_csv(path, header if target is None else [*header, "ec8_m/s2"], rows)
