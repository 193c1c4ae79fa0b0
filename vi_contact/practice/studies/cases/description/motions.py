"""Describe what shakes a model: records with their peaks and spectra, and other excitations."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .....core.errors import InputError
from .....core.quantities import read_quantities
from ....ground_motion.design_spectrum import DesignSpectrum
from ....ground_motion.excitation import GroundMotion
from ....ground_motion.intensity import arias, d5_95, mean_period
from ....ground_motion.processing import integrated
from ....ground_motion.record import Record
from ....ground_motion.spectra import response_spectrum
from ..table_calls import Call, build, walk_nodes

ENERGY = 0.95  # of a record, the integral of |A(f)|², below the frequency that is told
PERIODS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0)  # [s] of the spectra that are told
RESOLVED = 10.0  # steps of a record in the shortest period of which it says something
DAMPING = 0.05  # of these spectra, where no design spectrum has another


def list_motions(case: Any, system: Any) -> list[Any]:
    """Return the excitations of a case, and the motions that come up through its base alone."""
    system_nodes = walk_nodes(case.nodes.get("system", ()))
    calls = [node for node in system_nodes if isinstance(node, Call)]
    motions = list(case.excitations(system=system))
    for call in calls:
        if call.callee.name == "upgoing":
            rising = build(call.arguments.get("motion", ()), {"system": system})
            direction = call.arguments.get("direction", (1.0, 0.0))
            for motion in rising if isinstance(rising, tuple) else (rising,):
                is_record = isinstance(motion, Record)
                motions.append(GroundMotion(motion, direction) if is_record else motion)
    return motions


def describe_records(
    motions: list[Any], design: DesignSpectrum | None = None
) -> list[dict[str, Any]]:
    """Return the records among motions, each once.

    Args:
        motions: as of ``list_motions``.
        design: the design spectrum of the case, whose damping the spectra of the records have.
    """
    descriptions: list[dict[str, Any]] = []
    for motion in motions:
        if isinstance(motion, GroundMotion):
            description = _describe_record(motion, design)
            if description not in descriptions:
                descriptions.append(description)
    return descriptions


def describe_excitations(motions: list[Any]) -> list[dict[str, Any]]:
    """Return the motions that are no records: kind, direction, and their numbers with units."""
    descriptions: list[dict[str, Any]] = []
    for motion in motions:
        if isinstance(motion, GroundMotion):
            continue
        numbers = []
        for name, quantity in _read_quantities(type(motion)).items():
            value: Any = getattr(motion, name, None)
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if is_number and np.isfinite(value):
                unit = "-" if quantity.unit is None else quantity.unit.symbol.replace("1", "-")
                numbers.append({"name": name, "value": float(value), "unit": unit})
        description = {
            "kind": type(motion).__name__,
            "direction": _list_numbers(getattr(motion, "direction", ())),
            "numbers": numbers,
        }
        if description not in descriptions:
            descriptions.append(description)
    return descriptions


def describe_design_spectrum(design: DesignSpectrum | None) -> dict[str, Any]:
    """Return a design spectrum at the periods at which spectra are told; {} for none."""
    if design is None:
        return {}
    values = design.acceleration(np.array(PERIODS))
    return {
        "name": design.name,
        "damping": design.damping,
        "periods": list(PERIODS),
        "accelerations": [None if np.isnan(value) else float(value) for value in values],
    }


def _read_quantities(kind: type) -> Mapping[str, Any]:
    """Return what the annotations of a class say; {} where they say nothing."""
    try:
        return read_quantities(kind)
    except (NameError, TypeError):  # annotations of a user's class that nobody can read
        return {}


def _list_numbers(values: Any) -> list[float]:
    """Return numbers as a list; a motion of the user's may have none."""
    return [float(value) for value in np.ravel(np.asarray(values, dtype=float))]


def _describe_record(motion: GroundMotion, design: DesignSpectrum | None) -> dict[str, Any]:
    """Return a record with its peaks, which have the scale in them.

    f_95 is the frequency [Hz] below which ENERGY of its energy is. A synthetic record is named by
    its seed.
    """
    record = motion.record
    scale = abs(motion.scale)
    power = np.cumsum(np.abs(np.fft.rfft(record.acceleration)) ** 2)
    frequencies = np.fft.rfftfreq(record.acceleration.size, record.dt)
    highest = frequencies[np.searchsorted(power, ENERGY * power[-1])]
    velocity, displacement = integrated(record)
    return {
        "file": Path(record.source).name or f"synthetic, {record.title.rpartition(', ')[2]}",
        "sha256": record.sha256,
        "units": record.units if record.source else "",
        "direction": _list_numbers(motion.direction),
        "scale": motion.scale,
        "dt": record.dt,
        "duration": record.duration,
        "pga": scale * float(np.abs(record.acceleration).max()),
        "pgv": scale * float(np.abs(velocity).max()),
        "pgd": scale * float(np.abs(displacement).max()),
        "last_displacement": motion.scale * float(displacement[-1]),
        "arias": scale**2 * arias(record),
        "d5_95": d5_95(record),
        "f_95": float(highest),
        "mean_period": _find_mean_period(record),
        "spectrum": _describe_spectrum(motion, DAMPING if design is None else design.damping),
    }


def _describe_spectrum(motion: GroundMotion, damping: float) -> dict[str, Any]:
    """Return the pseudo-accelerations [m/s²] of a motion at those periods that it resolves."""
    periods = [period for period in PERIODS if period >= RESOLVED * motion.record.dt]
    values: list[float] = []
    if periods:
        spectrum = response_spectrum(motion.record, np.array(periods), damping=damping)
        values = (abs(motion.scale) * spectrum.psa).tolist()
    return {"damping": damping, "periods": periods, "accelerations": values}


def _find_mean_period(record: Record) -> float | None:
    """Return the mean period of a record [s]; None where it has no motion from 0.25 to 20 Hz."""
    try:
        return mean_period(record)
    except InputError:
        return None
