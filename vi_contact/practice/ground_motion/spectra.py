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
from ...core.arguments import check_arguments
from ...core.checks import check_count
from ...core.errors import InputError
from .record import Record

# Looks at the response in a period of the oscillator, and in a step of the record. The one that
# makes more of them counts.
PER_PERIOD = 64
PER_STEP = 4

SHORTEST = 1000  # periods of the shortest oscillator in a step of the record, at most
MOST = 10**10  # samples times periods, at most

_SMALL = 0.3  # below this omega t the closed forms lose digits, and a series is summed
_TERMS = 14  # of the series
_BLOCK = 512  # samples marched before their peaks are taken: bounds the memory


@dataclass(frozen=True, eq=False)
class ResponseSpectrum:
    """Hold the peaks of the response of m damped oscillators that are at rest at t = 0.

    Attributes:
        periods: (m,) [s].
        damping: ratio zeta.
        displacement: (m,) relative, SD [m].
        velocity: (m,) relative, SV [m/s].
        acceleration: (m,) absolute, SA = max |u'' + a| [m/s²].
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


def _compute_factors(
    time: Array | float, length: Array | float, omega: Array, zeta: float
) -> Array:
    """Return what u, v, a0 and a1 add to displacement and velocity after a time, (4, 2, m).

    The acceleration goes from a0 to a1; the oscillator vibrates about -(a0 + s t)/omega² + 2 zeta
    s/omega³, where s is the slope.

    Args:
        time: since u and v [s].
        length: in which the acceleration goes from a0 to a1 [s].
        omega: (m,), circular frequencies [rad/s].
        zeta: damping ratio.
    """
    # Free vibration from u = 1 and from v = 1: displacement and velocity.
    root = math.sqrt(1.0 - zeta**2)
    decay = np.exp(-zeta * omega * time)
    angle = root * omega * time
    sine = np.sin(angle)
    cosine = np.cos(angle)
    of_u = decay * np.array([cosine + zeta / root * sine, -omega / root * sine])
    of_v = decay * np.array([sine / (root * omega), cosine - zeta / root * sine])

    # Particular motions: under a = 1, and under a = t at 0 and at `time`. Free vibrations are
    # added that make them start from rest.
    ones = np.ones_like(omega)
    constant = np.array([-ones / omega**2, np.zeros_like(omega)])
    ramp0 = np.array([2.0 * zeta / omega**3, -ones / omega**2])
    ramp = np.array([2.0 * zeta / omega**3 - time / omega**2, -ones / omega**2])
    of_one = constant - of_u * constant[0] - of_v * constant[1]
    of_ramp = ramp - of_u * ramp0[0] - of_v * ramp0[1]
    # Of oscillators that hardly swing, the differences above keep few digits.
    small = omega * time < _SMALL
    if small.any():
        of_one = np.where(small, _sum_series(time, omega, zeta, 2), of_one)
        of_ramp = np.where(small, _sum_series(time, omega, zeta, 3), of_ramp)
    of_slope = of_ramp / length
    return np.array([of_u, of_v, of_one - of_slope, of_slope])


def _move(factors: Array, u: Array, v: Array, a0: Array | float, a1: Array | float) -> Array:
    """Return (displacement, velocity), shape (2, ..., m), from ``_compute_factors``.

    Args:
        factors: (4, 2, m), or of a shape that fits.
        u: displacements at the start [m].
        v: velocities at the start [m/s].
        a0: acceleration of the ground at the start of the step [m/s²].
        a1: acceleration of the ground at its end [m/s²].
    """
    return factors[0] * u + factors[1] * v + factors[2] * a0 + factors[3] * a1


def _sum_series(time: Array | float, omega: Array, zeta: float, first: int) -> Array:
    """Return the motion (2, m) under a = 1 (first = 2) or a = t (first = 3) from rest.

    It is a power series: u = sum c_k t^k with c_first = -1/first! and k (k-1) c_k = -2 zeta omega
    (k-1) c_{k-1} - omega² c_{k-2}.

    Args:
        time: since the start [s].
        omega: (m,), circular frequencies [rad/s].
        zeta: damping ratio.
        first: power of the first term.
    """
    term = -(np.asarray(time, dtype=float) ** first) / math.factorial(first) * np.ones_like(omega)
    before = np.zeros_like(term)
    total = term
    rate = first * term / time
    for k in range(first + 1, first + _TERMS):
        damped = 2.0 * zeta * omega * time * (k - 1) * term
        elastic = (omega * time) ** 2 * before
        before = term
        term = -(damped + elastic) / (k * (k - 1))
        total = total + term
        rate = rate + k * term / time
    return np.array([total, rate])


@check_arguments
def response_spectrum(record: Record, periods: Array, *, damping: float = 0.05) -> ResponseSpectrum:
    """Return the peaks of relative displacement and velocity and of absolute acceleration.

    A record says little about periods below ten of its steps: between its samples nothing is known
    but the straight line assumed here.

    Args:
        record: the motion.
        periods: (m,) of the oscillators [s].
        damping: ratio zeta, from 0 to below 1.

    Raises:
        InputError: periods that are not positive; another damping.
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
    numbers = float(row.size) * record.acceleration.size
    check_count("response_spectrum", f"{row.size} periods", numbers, most=MOST)

    # Oscillators that need the same number of looks a step go together.
    least_parts = 2 ** np.ceil(np.log2(PER_PERIOD * record.dt / row))
    parts = np.maximum(PER_STEP, least_parts).astype(int)
    peaks = np.zeros((3, row.size))
    for count in np.unique(parts):
        group = parts == count
        peaks[:, group] = _find_peaks(record, 2.0 * math.pi / row[group], damping, int(count))
    return ResponseSpectrum(row, damping, *peaks)


@check_arguments
def fourier_spectrum(record: Record) -> tuple[Array, Array]:
    """Return the frequencies [Hz], up to the Nyquist frequency, and the amplitudes |A(f)| [m/s].

    A(f) is the integral of a(t) exp(-2 pi i f t), by the rectangle rule: dt times the discrete
    transform, no window. Two-sided: the integral of |A|² over all f, negative ones too, is dt sum
    a² (Parseval).
    """
    amplitudes = record.dt * np.abs(np.fft.rfft(record.acceleration))
    return np.fft.rfftfreq(record.acceleration.size, record.dt), amplitudes


def _find_peaks(record: Record, omega: Array, zeta: float, parts: int) -> Array:
    """Return the largest |u|, |v| and |u'' + a|, (3, m).

    Args:
        record: the motion.
        omega: (m,), circular frequencies [rad/s].
        zeta: damping ratio.
        parts: how often a step is looked at.
    """
    dt = record.dt
    looks = [_compute_factors(dt * part / parts, dt, omega, zeta) for part in range(1, parts + 1)]
    peaks = np.zeros((3, omega.size))
    x = np.zeros((2, omega.size))  # displacement and velocity at the start of a step

    # Block by block: march from sample to sample, then look between the samples.
    for start in range(0, record.acceleration.size - 1, _BLOCK):
        a = record.acceleration[start : start + _BLOCK + 1]
        states = np.empty((2, a.size - 1, omega.size))
        for k in range(a.size - 1):
            states[:, k] = x
            x = _move(looks[-1], x[0], x[1], a[k], a[k + 1])
        for look in looks:
            between = _move(look[:, :, None, :], states[0], states[1], a[:-1, None], a[1:, None])
            peaks = np.maximum(peaks, _measure(between, omega, zeta).max(axis=1))

    # Free vibration behind the record: its first period holds its peaks.
    period = 2.0 * math.pi / omega
    for part in range(1, PER_PERIOD + 1):
        look = _compute_factors(period * part / PER_PERIOD, period, omega, zeta)
        free = _move(look, x[0], x[1], 0.0, 0.0)
        peaks = np.maximum(peaks, _measure(free, omega, zeta))
    return peaks


def _measure(x: Array, omega: Array, zeta: float) -> Array:
    """Return |u|, |v| and |u'' + a| = |2 zeta omega v + omega² u|, shape (3, ..., m)."""
    return np.abs(np.array([x[0], x[1], 2.0 * zeta * omega * x[1] + omega**2 * x[0]]))
