"""Correct baselines: a polynomial is taken from the acceleration so that the motion ends at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.errors import InputError
from .processing import integrated
from .record import Record

HIGHEST = 6
"""Highest degree: beyond it a polynomial follows the shaking itself."""


def baseline_corrected(record: Record, *, degree: int = 2, displacement: bool = False, at_rest: bool = True) -> Record:
    """Return the record minus p(t) = sum c_k (t/T)^k, k = 0..degree, T its duration; c fits the integrated motion.

    c minimises the sum of squares of the velocity left over (of the displacement, if `displacement`), subject to
    v(T) = u(T) = 0 if at_rest; v and u are those of `integrated`, so both end at zero to round-off. A second correction
    changes nothing, and a record that is itself such a polynomial becomes zero.
    Raises InputError unless degree is a whole number from 1 (0 without at_rest) to 6 and below the number of samples.
    """
    lowest = 1 if at_rest else 0
    if degree not in range(lowest, min(HIGHEST, record.acceleration.size - 1) + 1):
        raise InputError(f"baseline_corrected: degree is {degree!r}; give a whole number from {lowest} to {HIGHEST}, "
                         "below the number of samples")
    powers = (record.times / record.duration)[:, None] ** np.arange(degree + 1)
    motions = [integrated(replace(record, acceleration=column)) for column in powers.T]
    basis = np.array([motion[int(displacement)] for motion in motions]).T
    target = integrated(record)[int(displacement)]
    coefficients = np.zeros(degree + 1)
    free = np.eye(degree + 1)
    if at_rest:  # c = one that satisfies the two equations + combinations of those that change neither
        ends = np.array([[motion[k][-1] for motion in motions] for k in (0, 1)])
        scale = np.array([[record.duration], [record.duration**2]])
        wanted = np.array([[part[-1]] for part in integrated(record)]) / scale
        coefficients = np.linalg.lstsq(ends / scale, wanted, rcond=None)[0][:, 0]
        free = np.linalg.svd(ends / scale)[2][2:].T
    if free.shape[1]:
        rest = np.linalg.lstsq(basis @ free, target - basis @ coefficients, rcond=None)[0]
        coefficients = coefficients + free @ rest
    kind = "displacement" if displacement else "velocity"
    note = f"baseline: polynomial of degree {degree} fitted to the {kind}{', v = u = 0 at the end' if at_rest else ''}"
    return record.changed(record.acceleration - powers @ coefficients, note)
