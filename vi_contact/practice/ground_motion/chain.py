"""Prepare records by the usual steps in the usual order, and scale them to a measure at last."""

import math
from dataclasses import dataclass
from typing import Annotated

from ...core.arguments import check_arguments
from ...core.errors import InputError
from ...core.quantities import RATIO, Positive, Unit
from .intensity import arias, pga, psa
from .processing import (
    baseline_corrected,
    filtered,
    padded,
    resampled,
    scaled,
    tapered,
    trimmed,
    without_mean,
)
from .record import Record


@dataclass(frozen=True)
class Processing:
    """Say what to do with a record; calling it gives the new one.

    The steps are taken in the order of the fields, and each is optional. Filtering and tapering
    need the record's own step, the baseline the final samples; scaling commutes with all.

    Attributes:
        trim: (start, end) of what is kept [s].
        pad: zeros (before, after) [s].
        mean: whether the mean is removed.
        taper: fraction of the duration that is tapered at each end.
        low: corner of a Butterworth high-pass [Hz].
        high: corner of a Butterworth low-pass [Hz].
        order: of the filter.
        causal: whether the filter runs forward only.
        resample: time step of the new record [s].
        baseline: degree of `baseline_corrected`.
        scale: a factor. Only one of the four scalings may be given.
        pga: largest |acceleration| [m/s²].
        arias: Arias intensity [m/s].
        psa: (pseudo-acceleration [m/s²], period [s]).

    Raises:
        InputError: more than one scaling. Calling raises the errors of the steps.
    """

    trim: Annotated[tuple[float, float | None] | None, Unit("s")] = None
    pad: Annotated[tuple[float, float] | None, Unit("s")] = None
    mean: bool = False
    taper: Annotated[float | None, RATIO] = None
    low: Annotated[float | None, Unit("Hz")] = None
    high: Annotated[float | None, Unit("Hz")] = None
    order: int = 4
    causal: bool = False
    resample: Annotated[float | None, Unit("s")] = None
    baseline: int | None = None
    scale: Annotated[float | None, RATIO] = None
    pga: Annotated[float | None, Unit("m/s²")] = None
    arias: Annotated[float | None, Unit("m/s")] = None
    psa: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        scalings = ("scale", "pga", "arias", "psa")
        chosen = [name for name in scalings if getattr(self, name) is not None]
        if len(chosen) > 1:
            raise InputError(
                f"Processing: {' and '.join(chosen)} were both given; scale a record only once"
            )

    def __call__(self, record: Record) -> Record:
        """Return the processed record; its notes tell every step taken."""
        return self._scale(self._filter(self._cut(record)))

    def _cut(self, record: Record) -> Record:
        """Choose the time, remove the mean and taper the ends."""
        if self.trim is not None:
            record = trimmed(record, *self.trim)
        if self.pad is not None:
            record = padded(record, *self.pad)
        if self.mean:
            record = without_mean(record)
        if self.taper is not None:
            record = tapered(record, fraction=self.taper)
        return record

    def _filter(self, record: Record) -> Record:
        """Filter, change the time step and correct the baseline."""
        if self.low is not None or self.high is not None:
            record = filtered(
                record, low=self.low, high=self.high, order=self.order, causal=self.causal
            )
        if self.resample is not None and self.resample != record.dt:
            record = resampled(record, self.resample)
        if self.baseline is not None:
            record = baseline_corrected(record, degree=self.baseline)
        return record

    def _scale(self, record: Record) -> Record:
        """Scale by what was asked for."""
        if self.scale is not None:
            record = scaled(record, factor=self.scale)
        if self.pga is not None:
            record = scaled_to_pga(record, self.pga)
        if self.arias is not None:
            record = scaled_to_arias(record, self.arias)
        if self.psa is not None:
            record = scaled_to_psa(record, *self.psa)
        return record


@check_arguments
def scaled_to_pga(record: Record, target: Annotated[float, Positive, Unit("m/s²")]) -> Record:
    """Scale a record so that its largest |acceleration| is `target`, and keep its sign.

    Raises InputError for a record that is all zero.
    """
    return scaled(record, factor=_ratio(record, target, pga(record)))


@check_arguments
def scaled_to_psa(
    record: Record,
    target: Annotated[float, Positive, Unit("m/s²")],
    period: float,
    *,
    damping: float = 0.05,
) -> Record:
    """Scale a record so that its pseudo-acceleration is `target`, and keep its sign.

    Args:
        record: that is not all zero.
        target: pseudo-acceleration [m/s²].
        period: of the oscillator [s].
        damping: its ratio.

    Raises:
        InputError: a record that is all zero.
    """
    return scaled(record, factor=_ratio(record, target, psa(record, period, damping=damping)))


@check_arguments
def scaled_to_arias(record: Record, target: Annotated[float, Positive, Unit("m/s")]) -> Record:
    """Scale a record so that its Arias intensity is `target`, and keep its sign.

    Raises InputError for a record that is all zero.
    """
    return scaled(record, factor=math.sqrt(_ratio(record, target, arias(record))))


def _ratio(record: Record, target: float, value: float) -> float:
    """Return target / value, or raise InputError where the record is all zero."""
    if value == 0.0:
        raise InputError(f"{record.source or 'Record'}: every sample is zero; scale another record")
    return target / value
