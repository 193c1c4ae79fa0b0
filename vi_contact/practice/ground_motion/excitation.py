"""Shake a body with a recorded ground motion."""

from dataclasses import dataclass
from typing import Annotated

from ...core.checks import instance
from ...core.protocols import Direction, check_excitation, vector
from ...core.quantities import RATIO, Finite
from .record import Record


@dataclass(frozen=True)
class GroundMotion:
    """Describe a recorded motion a(t): straight lines between the samples, times a factor.

    It is zero before the first and after the last sample. Use a time step no longer than that of
    the record, or resample the record first.

    Attributes:
        record: whose sample k is at k · dt.
        direction: unit vector.
        scale: the factor; for a peak use `scaled_to_pga(record, pga)`.
    """

    record: Record
    direction: Direction = (1.0, 0.0)
    scale: Annotated[float, Finite, RATIO] = 1.0

    def __post_init__(self) -> None:
        remedy = "pass a Record, such as read_record(path)"
        instance("GroundMotion", "record", self.record, Record, remedy)
        check_excitation(self)

    @property
    def duration(self) -> float:
        """Return the time of the last sample [s]."""
        return self.record.duration

    def acceleration(self, t: float) -> float:
        """Return scale · record at t [m/s²], linear between the two samples around t."""
        record = self.record
        if not 0.0 <= t <= record.duration:
            return 0.0
        position = t / record.dt
        k = min(int(position), record.acceleration.size - 2)
        w = position - k
        before, after = record.acceleration[k : k + 2]
        return self.scale * float((1.0 - w) * before + w * after)

    __call__ = vector
