"""Make upgoing waves out of recorded motions: what a compliant base expects.

A record from an outcrop, where up- and downgoing waves are equal, is twice the upgoing wave; a
record from within a profile holds what came back down and is of no use here without deconvolution.
Wording as in PLAXIS: a fixed base expects the *within* motion, a compliant base the *upgoing* one
(Mejia and Dawson 2006).
"""

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np

from ...core.algebra import Array
from ...core.checks import flag, number, provides
from ...core.errors import InputError
from ...core.protocols import EXCITATION, Excitation
from ...core.quantities import RATIO, Unit
from ..ground_motion.excitation import GroundMotion
from ..ground_motion.record import Record


class UpgoingVelocity:
    """Give v_up(t), a share of the velocity of an excitation that is at rest before t = 0.

    It is exact where a is a straight line between multiples of dt: v(k dt + s) = v_k + a_k s +
    (a_{k+1} - a_k) s²/(2 dt).

    Attributes:
        excitation: whose velocity it is.
        dt: step of the integration [s].
        share: of the velocity.
    """

    def __init__(self, excitation: Excitation, dt: float, share: float) -> None:
        """Note what is integrated.

        Args:
            excitation: gives an acceleration [m/s²] along a direction.
            dt: step of the integration [s].
            share: of the velocity.
        """
        number("UpgoingVelocity", "dt", dt, positive=True, unit="s")
        number("UpgoingVelocity", "share", share)
        needed = ("acceleration", "direction")
        provides("UpgoingVelocity", "excitation", excitation, needed, "give GroundMotion(…)")
        self.excitation = excitation
        self.dt = dt
        self.share = share

        # Acceleration and velocity at the multiples of dt that somebody has asked for so far.
        self._a = [excitation.acceleration(0.0)]
        self._v = [0.0]

    def __call__(self, t: float) -> Array:
        """Return v_up (d,) [m/s] at time t [s]."""
        t = max(t, 0.0)
        k = int(t / self.dt)
        while len(self._v) < k + 2:
            self._a.append(self.excitation.acceleration(len(self._a) * self.dt))
            self._v.append(self._v[-1] + 0.5 * self.dt * (self._a[-2] + self._a[-1]))
        s = t - k * self.dt
        speed = self._v[k] + self._a[k] * s + 0.5 * (self._a[k + 1] - self._a[k]) / self.dt * s**2
        return self.share * speed * np.asarray(self.excitation.direction, dtype=float)


def upgoing(
    motion: Record | Excitation | Sequence[Excitation],
    *,
    direction: Annotated[tuple[float, ...], RATIO] = (1.0, 0.0),
    dt: Annotated[float | None, Unit("s")] = None,
    outcrop: bool = True,
) -> Callable[[float], Array]:
    """Return the upgoing velocity of a motion: half the velocity of an outcrop.

    A record keeps its drift: correct its baseline first (``baseline_corrected``).

    Args:
        motion: a record; an excitation; or several excitations that act together, such as the
            components of an earthquake.
        direction: of a record. Excitations have their own.
        dt: step of the integration [s]; None for that of the record.
        outcrop: whether the motion is that of an outcrop. False is for one that is upgoing already,
            whose whole velocity is returned.

    Returns:
        A function of the time [s] that returns the velocity (d,) [m/s].

    Raises:
        InputError: an excitation other than a record without dt; a dt that is not positive; no
            excitation; records in a list; directions of different numbers of components.
    """
    flag("upgoing", "outcrop", outcrop)
    if isinstance(motion, Sequence) and not isinstance(motion, str):
        if any(isinstance(each, Record) for each in motion):
            raise InputError(
                "upgoing: a record in a list has no direction; give GroundMotion(record, "
                "direction=...) for each"
            )
        waves = [upgoing(each, direction=direction, dt=dt, outcrop=outcrop) for each in motion]
        if len({len(wave(0.0)) for wave in waves}) != 1:
            raise InputError(
                "upgoing needs one or more excitations with directions of the same number of "
                "components"
            )
        return lambda t: np.asarray(np.sum([wave(t) for wave in waves], axis=0))
    if isinstance(motion, Record):
        excitation: Excitation = GroundMotion(motion, direction=direction)
    else:
        remedy = "give a Record or an excitation, or a list of excitations"
        provides("upgoing", "motion", motion, EXCITATION, remedy)
        excitation = motion
    if dt is None and isinstance(excitation, GroundMotion):
        dt = excitation.record.dt
    unit = f"seconds, the step with which {type(excitation).__name__} is to be integrated"
    step = number("upgoing", "dt", dt, positive=True, unit=unit)
    return UpgoingVelocity(excitation, step, 0.5 if outcrop else 1.0)
