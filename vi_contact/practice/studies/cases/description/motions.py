"""Describe the records that shake a model."""

from pathlib import Path
from typing import Any

import numpy as np

from ....ground_motion.excitation import GroundMotion
from ....ground_motion.record import Record
from ..table_calls import Call, build, walk_nodes

ENERGY = 0.95  # of a record, the integral of |A(f)|², below the frequency that is told


def describe_records(case: Any, system: Any) -> list[dict[str, Any]]:
    """Return the records of the excitations, each once.

    Those of motions that come up through the base alone are among them.
    """
    system_nodes = walk_nodes(case.nodes.get("system", ()))
    calls = [node for node in system_nodes if isinstance(node, Call)]
    motions = list(case.excitations(system=system))
    for call in calls:
        if call.callee.name == "upgoing":
            rising = build(call.arguments.get("motion", ()), {"system": system})
            motions += rising if isinstance(rising, tuple) else (rising,)

    descriptions: list[dict[str, Any]] = []
    for motion in motions:
        shaking = GroundMotion(motion) if isinstance(motion, Record) else motion
        if isinstance(shaking, GroundMotion):
            description = _describe_record(shaking)
            if description not in descriptions:
                descriptions.append(description)
    return descriptions


def _describe_record(motion: GroundMotion) -> dict[str, Any]:
    """Return a record and the frequency [Hz] below which ENERGY of its energy is.

    A synthetic one is named by its seed.
    """
    record = motion.record
    power = np.cumsum(np.abs(np.fft.rfft(record.acceleration)) ** 2)
    frequencies = np.fft.rfftfreq(record.acceleration.size, record.dt)
    highest = frequencies[np.searchsorted(power, ENERGY * power[-1])]
    return {
        "file": Path(record.source).name or f"synthetic, {record.title.rpartition(', ')[2]}",
        "scale": motion.scale,
        "dt": record.dt,
        "duration": record.duration,
        "f_95": float(highest),
        "pga": float(np.abs(motion.scale * record.acceleration).max()),
    }
