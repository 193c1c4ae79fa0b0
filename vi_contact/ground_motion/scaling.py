"""Scaling to a spectral value or an Arias intensity; `scaled` and `scaled_to_pga` are in processing."""

from __future__ import annotations

import math

from ..core.errors import InputError
from .intensity import arias
from .processing import scaled
from .record import Record
from .spectral_intensity import psa


def scaled_to_psa(record: Record, target: float, period: float, *, damping: float = 0.05) -> Record:
    """Scaled so that the pseudo-acceleration at `period` [s] is `target` [m/s²]; the sign of the motion is kept.

    Raises InputError unless target > 0 and the record is not all zero.
    """
    return scaled(record, factor=_ratio(record, "scaled_to_psa", target, psa(record, period, damping=damping)))


def scaled_to_arias(record: Record, target: float) -> Record:
    """Scaled so that the Arias intensity is `target` [m/s]; the sign of the motion is kept.

    Raises InputError unless target > 0 and the record is not all zero.
    """
    return scaled(record, factor=math.sqrt(_ratio(record, "scaled_to_arias", target, arias(record))))


def _ratio(record: Record, name: str, target: float, value: float) -> float:
    """target / value."""
    if not math.isfinite(target) or target <= 0.0:
        raise InputError(f"{name}: target is {target!r}; give a positive number")
    if value == 0.0:
        raise InputError(f"{record.source or 'Record'}: every sample is zero and scaling stays so; use another record")
    return target / value
