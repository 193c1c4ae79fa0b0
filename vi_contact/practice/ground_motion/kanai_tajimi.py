"""Make stochastic motions: white noise that the ground has filtered, after Kanai and Tajimi.

A second filter, Clough and Penzien's, leaves long periods out.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments, check_fields
from ...core.checks import check_count
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, NotNegative, Positive, Unit
from .record import Record


@dataclass(frozen=True)
class KanaiTajimi:
    """Describe a two-sided power spectral density of the ground acceleration [m²/s³].

    Its integral is the variance:

        S = S0 (wg⁴ + 4 zg² wg² w²) / ((wg² - w²)² + 4 zg² wg² w²)
            · w⁴ / ((wf² - w²)² + 4 zf² wf² w²)

    The last factor (Clough and Penzien, 1975) is there only when omega_f > 0. The default is firm
    ground.

    Attributes:
        s0: density of the rock's white noise, S0 [m²/s³].
        omega_g: frequency of the ground, wg [rad/s].
        zeta_g: damping ratio of the ground, zg.
        omega_f: frequency of the second filter, wf [rad/s].
        zeta_f: damping ratio of the second filter, zf.
    """

    s0: Annotated[float, Positive, Unit("m²/s³")]
    omega_g: Annotated[float, Positive, Unit("rad/s")] = 15.6
    zeta_g: Annotated[float, Positive, RATIO] = 0.6
    omega_f: Annotated[float, NotNegative, Unit("rad/s")] = 1.5
    zeta_f: Annotated[float, Positive, RATIO] = 0.6

    def __post_init__(self) -> None:
        check_fields(self)

    def density(self, omega: Array) -> Array:
        """Return S(omega) [m²/s³], shape as omega [rad/s]."""
        square = np.asarray(omega, dtype=float) ** 2
        ground = self.omega_g**2
        damped = 4.0 * self.zeta_g**2 * ground * square
        values = self.s0 * (ground**2 + damped) / ((ground - square) ** 2 + damped)
        if self.omega_f == 0.0:
            return values
        corner = self.omega_f**2
        denominator = (corner - square) ** 2 + 4.0 * self.zeta_f**2 * corner * square
        return values * square**2 / denominator


@dataclass(frozen=True)
class Envelope:
    """Describe the envelope of Jennings, Housner and Tsai (1968).

    It is (t/rise)², then 1, then exp(-decay (t - end)).

    Attributes:
        rise: until when it rises [s].
        end: until when it is 1 [s], no earlier than ``rise``.
        decay: of what follows [1/s], zero or more.

    Raises:
        InputError: other numbers.
    """

    rise: Annotated[float, Unit("s")]
    end: Annotated[float, Unit("s")]
    decay: Annotated[float, Unit("1/s")]

    def __post_init__(self) -> None:
        check_fields(self)
        if not 0.0 <= self.rise <= self.end < math.inf or not 0.0 <= self.decay < math.inf:
            raise InputError(f"{self!r}: give 0 <= rise <= end in seconds and decay >= 0 in 1/s")

    def __call__(self, times: Array) -> Array:
        """Return the factor at each time [s]."""
        rising = (times / self.rise) ** 2 if self.rise > 0.0 else np.ones_like(times)
        falling = np.exp(-self.decay * np.maximum(times - self.end, 0.0))
        return np.where(times < self.rise, rising, falling)


@check_arguments
def synthetic(
    spectrum: KanaiTajimi,
    duration: Annotated[float, Unit("s")],
    dt: Annotated[float, Unit("s")],
    *,
    seed: Annotated[int, Between(0, 2**63 - 1)],
    envelope: Envelope | None = None,
) -> Record:
    """Make a motion of this density by spectral representation (Shinozuka and Deodatis, 1991).

    It is a = sum sqrt(4 S(w_k) dw) cos(w_k t + phi_k) with w_k = k dw and dw = 2 pi / period. The
    period, the next power of two of steps from twice the duration, keeps the motion from repeating.
    Without an envelope it is stationary over all seeds, of mean 0 and variance 2 sum S(w_k) dw. One
    seed gives one motion on all ranks. Scale with `scaled_to_pga`; correct the baseline where
    displacements are prescribed.

    Args:
        spectrum: S.
        duration: of the motion [s].
        dt: time step [s].
        seed: of the phases phi_k, which are uniform.
        envelope: that the motion is multiplied by; None for none.

    Raises:
        InputError: a step and a duration without 0 < dt < duration.
    """
    if not 0.0 < dt < duration < math.inf:
        raise InputError(f"synthetic: duration={duration!r}, dt={dt!r} s; give 0 < dt < duration")
    seed = int(seed)
    check_count("synthetic", f"duration={duration!r} and dt={dt!r} s", 4.0 * duration / dt)
    count = math.floor(duration / dt * (1.0 + 1e-12)) + 1
    size = 2 ** math.ceil(math.log2(2 * count))
    step = 2.0 * math.pi / (size * dt)
    omega = step * np.arange(1, size // 2)
    phases = np.random.Generator(np.random.PCG64(seed)).uniform(0.0, 2.0 * math.pi, omega.size)

    # The sum of cosines is one inverse transform.
    amplitudes = np.sqrt(4.0 * spectrum.density(omega) * step)
    lines = np.zeros(size // 2 + 1, dtype=complex)
    lines[1:-1] = amplitudes * np.exp(1j * phases) * size / 2.0
    samples = np.fft.irfft(lines, size)[:count]
    if envelope is not None:
        samples = samples * envelope(dt * np.arange(count))
    return Record(
        acceleration=samples,
        dt=dt,
        title=f"{spectrum}, seed {seed}",
        format="synthetic",
        notes=(f"synthetic: {spectrum}", f"seed {seed}, envelope {envelope}"),
    )
