"""The usual steps of preparing a record, in the usual order."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.errors import InputError
from .baseline import baseline_corrected
from .filters import filtered, tapered, without_mean
from .processing import resampled, scaled, scaled_to_pga
from .record import Record
from .scaling import scaled_to_arias, scaled_to_psa
from .window import padded, trimmed


@dataclass(frozen=True)
class Processing:
    """What to do with a record; calling it gives the new one. The order is that of the fields, each step optional.

    trim: (start, end) [s]; pad: zeros (before, after) [s]; mean: remove the mean; taper: fraction of the duration at
    each end; low, high: Butterworth corners [Hz] with order and causal; resample: time step [s]; baseline: degree of
    `baseline_corrected`; then one of scale (factor), pga [m/s²], arias [m/s], psa (value [m/s²], period [s]).
    Filtering and tapering need the record's own step, the baseline the final samples; scaling commutes with all.
    Raises InputError when more than one scaling is asked for; calling raises that of the steps.
    """

    trim: tuple[float, float | None] | None = None
    pad: tuple[float, float] | None = None
    mean: bool = False
    taper: float | None = None
    low: float | None = None
    high: float | None = None
    order: int = 4
    causal: bool = False
    resample: float | None = None
    baseline: int | None = None
    scale: float | None = None
    pga: float | None = None
    arias: float | None = None
    psa: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        asked = [name for name in ("scale", "pga", "arias", "psa") if getattr(self, name) is not None]
        if len(asked) > 1:
            raise InputError(f"Processing: {' and '.join(asked)} were both asked for; scale a record once")

    def __call__(self, record: Record) -> Record:
        """The processed record; its notes tell every step taken."""
        if self.trim is not None:
            record = trimmed(record, *self.trim)
        if self.pad is not None:
            record = padded(record, *self.pad)
        if self.mean:
            record = without_mean(record)
        if self.taper is not None:
            record = tapered(record, fraction=self.taper)
        if self.low is not None or self.high is not None:
            record = filtered(record, low=self.low, high=self.high, order=self.order, causal=self.causal)
        if self.resample is not None and self.resample != record.dt:
            record = resampled(record, self.resample)
        if self.baseline is not None:
            record = baseline_corrected(record, degree=self.baseline)
        return self._scaled(record)

    def _scaled(self, record: Record) -> Record:
        if self.scale is not None:
            return scaled(record, factor=self.scale)
        if self.pga is not None:
            return scaled_to_pga(record, self.pga)
        if self.arias is not None:
            return scaled_to_arias(record, self.arias)
        return record if self.psa is None else scaled_to_psa(record, *self.psa)
