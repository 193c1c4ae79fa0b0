"""Compute response spectra by exact integration of accelerations, and Fourier spectra.

The accelerations are piecewise linear.

Nigam and Jennings (1969): between samples the acceleration is a straight line, so the oscillator
u'' + 2 zeta omega u' + omega² u = -a(t) has a closed solution from one sample to the next, exact
for any period and step. Peaks between samples are found too: the same solution is read at 64
instants a period or more, and 4 a step, so the peak of a vibration is at most 1 - cos(pi/64) = 0.12
% low. The free vibration after the last sample counts.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.arguments import checked
from ...core.checks import counted
from ...core.errors import InputError
from .record import Record

PER_PERIOD, PER_STEP = 64, 4
"""Looks at the response in a period of the oscillator, and in a step of the record.

The one of the two that makes more of them counts.
"""

SHORTEST, MOST = 1000, 10**10
"""Steps of the record in the shortest period that is looked at, at most.

The second number is that of samples times periods, at most.
"""

# below this omega t the closed forms lose digits; the series of so many terms does not
_SMALL, _TERMS = (0.3, 14)

_BLOCK = 512  # samples marched before their peaks are taken: bounds the memory


@dataclass(frozen=True, eq=False)
class ResponseSpectrum:
    """Hold the peaks of the response of damped oscillators at rest at t = 0, each of shape (m,).

    periods [s]; damping: ratio zeta; displacement: relative, SD [m]; velocity: relative, SV [m/s];
    acceleration: absolute, SA = max |u'' + a| [m/s²].
    """

    periods: Array
    damping: float
    displacement: Array
    velocity: Array
    acceleration: Array

    @property
    def psv(self) -> Array:
        """Return the pseudo-velocity omega SD [m/s]."""
        return 2.0 * math.pi / self.periods * self.displacement

    @property
    def psa(self) -> Array:
        """Return the pseudo-acceleration omega² SD [m/s²]."""
        return (2.0 * math.pi / self.periods) ** 2 * self.displacement


def _factors(time: Array | float, length: Array | float, omega: Array, zeta: float) -> Array:
    """Return (4, 2, m).

    They are what u, v, a0 and a1 add to displacement and velocity after `time`, for each omega.

    The acceleration goes from a0 to a1 in `length`; free vibration about -(a0 + s t)/omega² + 2
    zeta s/omega³.
    """
    root = math.sqrt(1.0 - zeta**2)
    decay, angle = np.exp(-zeta * omega * time), root * omega * time
    sine, cosine = np.sin(angle), np.cos(angle)
    of_u = decay * np.array([cosine + zeta / root * sine, -omega / root * sine])
    of_v = decay * np.array([sine / (root * omega), cosine - zeta / root * sine])
    one, zero = np.ones_like(omega), np.zeros_like(omega)
    # particular motion under a = 1, at 0 and at `time`
    constant = np.array([-one / omega**2, zero])
    ramp0 = np.array([2.0 * zeta / omega**3, -one / omega**2])  # under a = t, at 0
    # under a = t, at `time`
    ramp = np.array([2.0 * zeta / omega**3 - time / omega**2, -one / omega**2])
    of_one = constant - of_u * constant[0] - of_v * constant[1]
    of_ramp = ramp - of_u * ramp0[0] - of_v * ramp0[1]
    small = omega * time < _SMALL
    of_one = np.where(small, _series(time, omega, zeta, 2), of_one)
    of_slope = np.where(small, _series(time, omega, zeta, 3), of_ramp) / length
    return np.array([of_u, of_v, of_one - of_slope, of_slope])


def _moved(factors: Array, u: Array, v: Array, a0: Array | float, a1: Array | float) -> Array:
    """Return (displacement, velocity), shape (2, ..., m)."""
    return factors[0] * u + factors[1] * v + factors[2] * a0 + factors[3] * a1


def _series(time: Array | float, omega: Array, zeta: float, first: int) -> Array:
    """Return the motion at `time` under a = 1 (first = 2) or a = t (first = 3) from rest.

    It is a power series (2, m): u = sum c_k t^k with c_first = -1/first! and k (k-1) c_k = -2 zeta
    omega (k-1) c_{k-1} - omega² c_{k-2}.
    """
    term = -(np.asarray(time, dtype=float) ** first) / math.factorial(first) * np.ones_like(omega)
    before = np.zeros_like(term)
    total, rate = term, first * term / time
    for k in range(first + 1, first + _TERMS):
        after = -(2.0 * zeta * omega * time * (k - 1) * term + (omega * time) ** 2 * before) / (
            k * (k - 1)
        )
        term, before = after, term
        total, rate = total + term, rate + k * term / time
    return np.array([total, rate])


@checked
def response_spectrum(record: Record, periods: Array, *, damping: float = 0.05) -> ResponseSpectrum:
    """Return the peaks of the responses at each period [s].

    They are the peaks of relative displacement, relative velocity and absolute acceleration at each
    period.

    A record says little about periods below ten of its steps: between its samples nothing is known
    but the straight line assumed here. Raises InputError unless every period is positive and 0 <=
    damping < 1.
    """
    row = np.atleast_1d(np.asarray(periods, dtype=float))
    if row.ndim != 1 or not row.size or not np.all(np.isfinite(row)) or np.any(row <= 0.0):
        raise InputError(
            f"response_spectrum: periods are {periods!r}; give a row of positive numbers of seconds"
        )
    if not 0.0 <= damping < 1.0:
        raise InputError(
            f"response_spectrum: damping is {damping!r}; give a ratio from 0 to below 1, 0.05 for "
            "5 %"
        )
    if record.dt > SHORTEST * row.min():
        raise InputError(
            f"response_spectrum: a period of {row.min():g} s is below a {SHORTEST}th of the step "
            f"{record.dt:g} s and has the peak acceleration alone; begin with longer periods"
        )
    counted(
        "response_spectrum",
        f"{row.size} periods",
        float(row.size) * record.acceleration.size,
        most=MOST,
    )
    parts = np.maximum(PER_STEP, 2 ** np.ceil(np.log2(PER_PERIOD * record.dt / row))).astype(int)
    peaks = np.zeros((3, row.size))
    # oscillators that need the same number of looks a step go together
    for count in np.unique(parts):
        same = parts == count
        peaks[:, same] = _peaks(record, 2.0 * math.pi / row[same], damping, int(count))
    return ResponseSpectrum(row, damping, *peaks)


@checked
def fourier_spectrum(record: Record) -> tuple[Array, Array]:
    """Return the frequencies [Hz] and Fourier amplitudes |A(f)| [m/s].

    They go from 0 to the Nyquist frequency.

    A(f) is the integral of a(t) exp(-2 pi i f t), by the rectangle rule: dt times the discrete
    transform, no window. Two-sided: the integral of |A|² over all f, negative ones too, is dt sum
    a² (Parseval).
    """
    amplitudes = record.dt * np.abs(np.fft.rfft(record.acceleration))
    return np.fft.rfftfreq(record.acceleration.size, record.dt), amplitudes


def _peaks(record: Record, omega: Array, zeta: float, parts: int) -> Array:
    """Return the largest |u|, |v| and |u'' + a|, shape (3, m), looked at `parts` times a step."""
    dt = record.dt
    looks = [_factors(dt * part / parts, dt, omega, zeta) for part in range(1, parts + 1)]
    peaks, x = np.zeros((3, omega.size)), np.zeros((2, omega.size))
    for start in range(0, record.acceleration.size - 1, _BLOCK):
        a = record.acceleration[start : start + _BLOCK + 1]
        states = np.empty((2, a.size - 1, omega.size))
        for k in range(a.size - 1):
            states[:, k] = x
            x = _moved(looks[-1], x[0], x[1], a[k], a[k + 1])
        for look in looks:
            seen = _moved(look[:, :, None, :], states[0], states[1], a[:-1, None], a[1:, None])
            peaks = np.maximum(peaks, _sizes(seen, omega, zeta).max(axis=1))
    period = 2.0 * math.pi / omega
    for part in range(1, PER_PERIOD + 1):  # free vibration: its first period holds its peaks
        free = _moved(
            _factors(period * part / PER_PERIOD, period, omega, zeta), x[0], x[1], 0.0, 0.0
        )
        peaks = np.maximum(peaks, _sizes(free, omega, zeta))
    return peaks


def _sizes(x: Array, omega: Array, zeta: float) -> Array:
    """Return |u|, |v| and |u'' + a| = |2 zeta omega v + omega² u|, shape (3, ..., m)."""
    return np.abs(np.array([x[0], x[1], 2.0 * zeta * omega * x[1] + omega**2 * x[0]]))
