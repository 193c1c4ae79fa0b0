"""Shake the ground with the velocity pulse that is seen close to a fault.

The pulse is that of Mavroeidis and Papageorgiou, A mathematical representation of near-fault ground
motions, Bulletin of the Seismological Society of America 93 (2003), 1099-1131.
"""

import math
from dataclasses import dataclass
from typing import Annotated

from ..core.protocols import Direction, check_excitation, vector
from ..core.quantities import RATIO, Between, Finite, NotNegative, Positive, Unit


@dataclass(frozen=True)
class NearFaultPulse:
    """Shake with a cosine in a bell, four numbers that describe a near-fault velocity pulse.

    With w = 2 pi frequency, s = t - start - duration/2 and the duration cycles / frequency,

        v(t) = ½ velocity (1 + cos(w s / cycles)) cos(w s + phase)    inside, zero outside
        a(t) = dv/dt

    Positive velocities are along the direction. The acceleration is continuous: where the pulse
    begins and ends, the bell and its slope are zero. The velocity returns to zero; the displacement
    does so where cos(phase) sin(pi cycles) is zero.

    Attributes:
        velocity: the height of the bell [m/s], which the peak comes close to.
        frequency: of the cosine [Hz].
        cycles: how many of its periods the pulse lasts, the gamma of the source, where it lies
            between 1 and 3 for most records.
        phase: of the cosine [rad]; 0 is a pulse that is even in time, pi/2 an odd one.
        start: when the pulse begins [s].
        direction: (d,) along which the ground moves.
    """

    velocity: Annotated[float, Finite, Unit("m/s")]
    frequency: Annotated[float, Positive, Unit("Hz")]
    cycles: Annotated[float, Between(1.0, math.inf, "(]"), RATIO]
    phase: Annotated[float, Finite, Unit("rad")] = 0.0
    start: Annotated[float, NotNegative, Unit("s")] = 0.0
    direction: Direction = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_excitation(self)

    @property
    def duration(self) -> float:
        """Return start + cycles / frequency [s], the end of the pulse."""
        return self.start + self.cycles / self.frequency

    def acceleration(self, t: float) -> float:
        """Return dv/dt [m/s²] inside the pulse, 0 outside."""
        if not self.start <= t <= self.duration:
            return 0.0
        w = 2.0 * math.pi * self.frequency
        s = t - 0.5 * (self.start + self.duration)
        bell = 1.0 + math.cos(w * s / self.cycles)
        slope = -math.sin(w * s / self.cycles) * w / self.cycles
        wave = math.cos(w * s + self.phase)
        rise = -math.sin(w * s + self.phase) * w
        return 0.5 * self.velocity * (slope * wave + bell * rise)

    __call__ = vector
