"""Tell what a record holds, as the text printed by `vi-contact motion info FILE`."""

from __future__ import annotations

from ..core.units import STANDARD_GRAVITY
from . import intensity
from .processing import integrated
from .record import UNITS, Record


def record_info(record: Record) -> str:
    """Return the table of a record: where it comes from, peaks, intensities, what is left at its end, notes."""
    peak = intensity.pga(record)
    velocity, displacement = integrated(record)
    rows = [
        ("file", record.source),
        ("format", record.format),
        ("title", record.title or "(none)"),
        ("station", record.station or "(not stated)"),
        ("component", record.component or "(not stated)"),
        ("units", f"{record.units} (1 {record.units} = {UNITS[record.units]:g} m/s2)"),
        ("samples", f"{record.acceleration.size}"),
        ("dt", f"{record.dt:g} s"),
        ("duration", f"{record.duration:g} s"),
        ("PGA", f"{peak:.4g} m/s2 = {peak / STANDARD_GRAVITY:.4g} g at t = {intensity.pga_time(record):g} s"),
        ("PGV", f"{intensity.pgv(record):.4g} m/s"),
        ("PGD", f"{intensity.pgd(record):.4g} m"),
        ("Arias intensity", f"{intensity.arias(record):.4g} m/s"),
        ("D5-95", f"{intensity.d5_95(record):.4g} s"),
        ("CAV", f"{intensity.cav(record):.4g} m/s"),
        ("RMS", f"{intensity.rms(record):.4g} m/s2"),
        ("Housner intensity", f"{intensity.housner_intensity(record):.4g} m, 5 % damping, 0.1 to 2.5 s"),
        ("predominant period", f"{intensity.predominant_period(record):.3g} s" if peak > 0.0 else "(all zero)"),
        ("mean period", f"{intensity.mean_period(record):.3g} s" if peak > 0.0 else "(all zero)"),
        ("final velocity", f"{velocity[-1]:.4g} m/s"),
        ("final displacement", f"{displacement[-1]:.4g} m"),
        ("sha256", record.sha256),
    ]
    rows += [("note", note) for note in record.notes]
    return "\n".join(f"{name:<20}{value}" for name, value in rows)
