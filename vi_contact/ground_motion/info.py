"""What a record file holds, as the text printed by `vi-contact motion info FILE`."""

from __future__ import annotations

import os

from .intensity import arias, d5_95, pga, pga_time, pgd, pgv
from .processing import integrated
from .reader import read_record
from .record import STANDARD_GRAVITY, UNITS


def motion_info(path: str | os.PathLike[str], units: str | None = None, *, dt: float | None = None,
                resample_dt: float | None = None) -> str:
    """A table of one quantity a line; the options and the InputError raised are those of `read_record`."""
    record = read_record(path, units, dt=dt, resample_dt=resample_dt)
    velocity, displacement = integrated(record)
    rows = [
        ("file", record.source),
        ("format", record.format),
        ("title", record.title or "(none)"),
        ("units", f"{record.units} (1 {record.units} = {UNITS[record.units]:g} m/s2)"),
        ("samples", f"{record.acceleration.size}"),
        ("dt", f"{record.dt:g} s"),
        ("duration", f"{record.duration:g} s"),
        ("PGA", f"{pga(record):.4g} m/s2 = {pga(record) / STANDARD_GRAVITY:.4g} g at t = {pga_time(record):g} s"),
        ("PGV", f"{pgv(record):.4g} m/s"),
        ("PGD", f"{pgd(record):.4g} m"),
        ("Arias intensity", f"{arias(record):.4g} m/s"),
        ("D5-95", f"{d5_95(record):.4g} s"),
        ("final velocity", f"{velocity[-1]:.4g} m/s"),
        ("final displacement", f"{displacement[-1]:.4g} m"),
        ("sha256", record.sha256),
    ]
    rows += [("note", note) for note in record.notes]
    return "\n".join(f"{name:<20}{value}" for name, value in rows)
