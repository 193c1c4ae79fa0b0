"""Shake the body: scalar ground accelerations a(t) [m/s²] along a fixed direction.

An excitation is a frozen value with `acceleration(t)` (a float), `direction` (a tuple of d
components) and `duration` (the time [s] after which it is zero, or negligible, for good); called,
it returns the vector a(t) · direction of shape (d,). The direction is used as given, never
normalised: (1, 0.5) shakes the second axis half as much. The vector is the acceleration of the
ground; in the frame that moves with the ground it loads the body with -M r a(t). Horizontal and
vertical motion together are a sequence of excitations.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

from ..core.errors import InputError
from ..core.protocols import Direction, check_excitation, finite_tuple, vector
from ..core.quantities import Finite, NotNegative, Positive, Unit

Acceleration = Annotated[float, Finite, Unit("m/s²")]


@dataclass(frozen=True)
class Harmonic:
    """Shake with a(t) = amplitude · sin(2 pi frequency t + phase) at all times.

    Attributes:
        amplitude: the largest acceleration [m/s²].
        frequency: of the sine [Hz].
        phase: of the sine at t = 0 [rad].
        direction: (d,) along which the ground moves.
        duration: infinite.
    """

    amplitude: Acceleration
    frequency: Annotated[float, Positive, Unit("Hz")]
    phase: Annotated[float, Finite, Unit("rad")] = 0.0
    direction: Direction = (1.0, 0.0)
    duration: ClassVar[float] = math.inf

    def __post_init__(self) -> None:
        check_excitation(self)

    def acceleration(self, t: float) -> float:
        """Return amplitude · sin(2 pi frequency t + phase) [m/s²]."""
        return self.amplitude * math.sin(2.0 * math.pi * self.frequency * t + self.phase)

    __call__ = vector


@dataclass(frozen=True)
class Ricker:
    """Shake with a Ricker wavelet (Ricker, Geophysics 18, 1953).

    a(t) = amplitude (1 - 2 x) exp(-x), x = (pi frequency (t - peak_time))². Velocity and
    displacement both return to zero.

    Attributes:
        amplitude: the peak [m/s²].
        frequency: where the spectrum peaks [Hz].
        delay: time of the peak [s]. None: 1.5 / frequency, which makes |a(0)| < 1e-8 |amplitude|; a
            smaller one starts with a jump.
        direction: (d,) along which the ground moves.
    """

    amplitude: Acceleration
    frequency: Annotated[float, Positive, Unit("Hz")]
    delay: Annotated[float | None, NotNegative, Unit("s")] = None
    direction: Direction = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_excitation(self)

    @property
    def peak_time(self) -> float:
        """Return the time of the peak [s]: the delay, or 1.5 / frequency when none was given."""
        return 1.5 / self.frequency if self.delay is None else self.delay

    @property
    def duration(self) -> float:
        """Return peak_time + 1.5 / frequency [s]: beyond it |a| < 1e-8 |amplitude|."""
        return self.peak_time + 1.5 / self.frequency

    def acceleration(self, t: float) -> float:
        """Return amplitude · (1 - 2 x) exp(-x) [m/s²]."""
        x = (math.pi * self.frequency * (t - self.peak_time)) ** 2
        return self.amplitude * (1.0 - 2.0 * x) * math.exp(-x)

    __call__ = vector


@dataclass(frozen=True)
class Pulse:
    """Hold what one-sided and two-sided pulses share.

    Attributes:
        amplitude: the largest acceleration [m/s²].
        duration: of the pulse [s], which begins at t = 0.
        direction: (d,) along which the ground moves.
    """

    amplitude: Acceleration
    duration: Annotated[float, Positive, Unit("s")]
    direction: Direction = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_excitation(self)

    def acceleration(self, t: float) -> float:
        """Return the acceleration [m/s²] inside the pulse, 0 outside.

        The value at a jump is the one after it.
        """
        return self.amplitude * self._shape(t) if 0.0 <= t < self.duration else 0.0

    def _shape(self, t: float) -> float:
        """Return the acceleration at a time [s] inside the pulse, over the amplitude."""
        return 1.0

    __call__ = vector


@dataclass(frozen=True)
class HalfSine(Pulse):
    """Shake with half a period of a sine.

    a(t) = amplitude · sin(pi t / duration) for 0 <= t < duration [s], zero elsewhere.
    """

    def _shape(self, t: float) -> float:
        """Return sin(pi t / duration)."""
        return math.sin(math.pi * t / self.duration)


@dataclass(frozen=True)
class FullSine(Pulse):
    """Shake with a period of a sine.

    a(t) = amplitude · sin(2 pi t / duration) for 0 <= t < duration [s]; the velocity ends at zero.
    """

    def _shape(self, t: float) -> float:
        """Return sin(2 pi t / duration)."""
        return math.sin(2.0 * math.pi * t / self.duration)


@dataclass(frozen=True)
class Rectangular(Pulse):
    """Shake with a(t) = amplitude for 0 <= t < duration [s], zero elsewhere."""


@dataclass(frozen=True)
class Tabulated:
    """Shake with accelerations at given times, straight lines between them, and zero elsewhere.

    Attributes:
        times: at least two times [s], strictly increasing; kept as a tuple.
        values: as many accelerations [m/s²]; kept as a tuple.
        direction: (d,) along which the ground moves.
    """

    times: Annotated[Sequence[float], Finite, Unit("s")]
    values: Annotated[Sequence[float], Finite, Unit("m/s²")]
    direction: Direction = (1.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            object.__setattr__(self, name, finite_tuple("Tabulated", name, getattr(self, name)))
        check_excitation(self)
        if len(self.times) != len(self.values) or len(self.times) < 2:
            raise InputError(
                f"Tabulated: there are {len(self.times)} times and {len(self.values)} values; "
                "give one value per time and at least two of each"
            )
        for k, (before, after) in enumerate(pairwise(self.times)):
            if after <= before:
                raise InputError(
                    f"Tabulated: times[{k + 1}] = {after!r} does not come after times[{k}] = "
                    f"{before!r}; give strictly increasing times"
                )

    @property
    def duration(self) -> float:
        """Return the last time [s]."""
        return self.times[-1]

    def acceleration(self, t: float) -> float:
        """Return the linear interpolation [m/s²]; the values at both end times are included."""
        times = self.times
        values = self.values
        if not times[0] <= t <= times[-1]:
            return 0.0
        k = min(bisect_right(times, t), len(times) - 1)  # t is in the interval before times[k]
        w = (t - times[k - 1]) / (times[k] - times[k - 1])
        return (1.0 - w) * values[k - 1] + w * values[k]

    __call__ = vector
