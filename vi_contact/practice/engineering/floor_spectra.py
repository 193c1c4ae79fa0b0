"""Compute floor and soil response spectra and transfer functions.

The motions are those that probes recorded.

Which motion: a column a_x_<label> of ``Probe(..., acceleration=True)`` is the absolute
acceleration, that of the equations, relative to the ground, plus that of the ground. Equipment on a
floor and a layer on rock feel the absolute one, so it is the default; with ``relative`` the
ground's is taken off again. In a run whose ground moves by prescribed displacements no ground
acceleration is recorded, and both are the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.checks import array, check_count, flag, instance, number, optional
from ...core.errors import InputError
from ..ground_motion.record import Record
from ..ground_motion.spectra import ResponseSpectrum, response_spectrum
from .peak_values import column_of

BANDWIDTH = 40.0


def recorded_motion(history: Mapping[str, Array], column: str, *, relative: bool = False) -> Record:
    """Return the acceleration of a column as a record with even steps.

    The spectra, intensities and writers take it.

    Uneven steps (halved at impacts) are interpolated linearly to the most frequent one. Columns
    a_<axis>_<label> are means over the step that ends at t, so their instants are half a step
    before t; spectra and ratios of columns of the same kind do not see that, and a_g_<axis> is
    brought to the same instants. A column v_<axis>_<label> of ``Probe(..., velocity=True)`` gives
    the same from differences of velocities, with the jumps that an impact law makes: they are not
    in a_<axis>_<label>, whose integral drifts off.

    Args:
        history: column -> values (rows,) of a run.
        column: a_<axis>_<label>, v_<axis>_<label>, or a_g_<axis> for the ground.
        relative: whether the ground acceleration a_g_<axis> of the run is subtracted.

    Raises:
        InputError: a column that is no acceleration, that the history does not have, or of fewer
            than three rows.
    """
    flag("recorded_motion", "relative", relative)
    instance(
        "recorded_motion", "column", column, str, "give the name of a column, such as 'a_x_top'"
    )
    kind, _, place = column.partition("_")  # place: x_<label>, or g_x for the ground
    first, _, second = place.partition("_")
    axis = second if first == "g" else first
    if kind not in ("a", "v") or "_" not in place:
        raise InputError(
            f"column '{column}' is not an acceleration: record Probe(..., acceleration=True) "
            "and give a_x_<label>, or give a_g_x for the ground"
        )
    values = column_of(history, column)
    t = column_of(history, "t")
    if len(t) < 3:
        raise InputError(f"the history has {len(t)} rows: give one of three or more")

    # The ground's acceleration as the mean over each step, as probes have theirs.
    ground = np.asarray(history.get(f"a_g_{axis}", np.zeros(len(t))), dtype=float)
    ground = np.append(ground[:1], 0.5 * (ground[1:] + ground[:-1]))
    if kind == "v":
        values = np.append(0.0, np.diff(values) / np.diff(t)) + ground
    elif column == f"a_g_{axis}":
        values = ground
    if relative:
        values = values - ground

    # Even steps for the record.
    steps = np.diff(t)
    dt = float(np.median(steps))
    if np.ptp(steps) > 1e-6 * dt:
        number_of_steps = (t[-1] - t[0]) / dt * (1.0 + 1e-12)
        step_in_words = f"the step of {dt:g} s in {t[-1] - t[0]:g} s"
        check_count(f"column '{column}'", step_in_words, number_of_steps)
        even_times = t[0] + dt * np.arange(int(np.floor(number_of_steps)) + 1)
        values = np.interp(even_times, t, values)
    frame = "relative" if relative else "absolute"
    return Record(
        values,
        dt,
        title=f"{column}, {frame}",
        source=column,
        notes=(f"{frame} acceleration of a run",),
    )


def floor_spectrum(
    history: Mapping[str, Array],
    column: str,
    periods: Array,
    *,
    damping: float = 0.05,
    relative: bool = False,
) -> ResponseSpectrum:
    """Return the response spectrum of oscillators that stand where the column was recorded.

    Args:
        history: column -> values (rows,) of a run.
        column: as for ``recorded_motion``.
        periods: (m,) of the oscillators [s].
        damping: their ratio.
        relative: whether the ground's acceleration is subtracted.

    Raises:
        InputError: as for ``recorded_motion`` and ``response_spectrum``.
    """
    return response_spectrum(
        recorded_motion(history, column, relative=relative), periods, damping=damping
    )


@dataclass(frozen=True)
class TransferFunction:
    """Hold frequencies [Hz] and |surface/base| [-], (m,).

    It is nan where the base has no motion to divide by.
    """

    frequencies: Array
    amplitude: Array

    @property
    def peak(self) -> tuple[float, float]:
        """Return (frequency [Hz], amplitude) of the largest value."""
        k = int(np.nanargmax(self.amplitude))
        return float(self.frequencies[k]), float(self.amplitude[k])


def transfer_function(
    history: Mapping[str, Array],
    surface: str,
    base: str = "a_g_x",
    *,
    frequencies: Array | None = None,
    bandwidth: float | None = BANDWIDTH,
    floor: float = 1e-3,
) -> TransferFunction:
    """Return |A_surface(f)| / |A_base(f)|, from the Fourier amplitudes of absolute accelerations.

    Amplitudes are smoothed alike with Konno and Ohmachi's window (1998), which widens peaks, before
    they are divided. The motion has to die away before the run ends, or be periodic, else its end
    leaks into all frequencies.

    Args:
        history: column -> values (rows,) of a run.
        surface: column of the motion that is divided, as for ``recorded_motion``.
        base: column of the motion that divides.
        frequencies: (m,) [Hz]; None: 200, from four periods in the run to four samples in a period,
            or all those of the transform where amplitudes are raw.
        bandwidth: of the window; None: amplitudes stay raw.
        floor: share of the base's peak amplitude below which the ratio is nan.

    Raises:
        InputError: a base without motion, frequencies that the run does not resolve, and as for
            ``recorded_motion``.
    """
    number("transfer_function", "floor", floor, positive=True)
    optional(number, "transfer_function", "bandwidth", bandwidth, positive=True)
    top = recorded_motion(history, surface)
    below = recorded_motion(history, base)

    # Fourier amplitudes at all frequencies of the transform but zero.
    raw = np.fft.rfftfreq(len(top.acceleration), top.dt)[1:]
    top_amplitudes = np.abs(np.fft.rfft(top.acceleration))[1:]
    base_amplitudes = np.abs(np.fft.rfft(below.acceleration))[1:]
    if frequencies is not None:
        row = np.atleast_1d(np.asarray(frequencies))
        centres = array("transfer_function", "frequencies", row, (None,), unit="Hz")
    elif bandwidth is None:
        centres = raw
    else:
        centres = np.geomspace(4.0 * raw[0], 0.5 * raw[-1], 200)
    if np.any(centres <= 0.0) or np.any(centres > raw[-1] * (1.0 + 1e-9)):
        raise InputError(
            f"transfer_function: give frequencies above 0 and up to {raw[-1]:.4g} Hz, half the "
            "sampling"
        )
    if not float(base_amplitudes.max()) > 0.0:
        raise InputError(
            f"transfer_function: column '{base}' is zero throughout: name the motion at the base"
        )

    # Smooth both, then divide where the base moves enough.
    if bandwidth is None:
        numerator = np.interp(centres, raw, top_amplitudes)
        denominator = np.interp(centres, raw, base_amplitudes)
    else:
        numerator = konno_ohmachi(raw, top_amplitudes, centres, bandwidth=bandwidth)
        denominator = konno_ohmachi(raw, base_amplitudes, centres, bandwidth=bandwidth)
    ratio = np.full(len(centres), np.nan)
    np.divide(numerator, denominator, out=ratio, where=denominator > floor * denominator.max())
    return TransferFunction(centres, ratio)


def konno_ohmachi(
    frequencies: Array, amplitudes: Array, centres: Array, *, bandwidth: float = BANDWIDTH
) -> Array:
    """Smooth amplitudes at the centres with Konno and Ohmachi's weights.

    The weights are (sin x / x)⁴, x = b log10(f / f_c) (Konno, Ohmachi 1998).

    Args:
        frequencies: (n,), f [Hz].
        amplitudes: (n,), at these.
        centres: (m,), f_c [Hz].
        bandwidth: b.

    Returns:
        The smooth amplitudes (m,).
    """
    smooth = np.empty(len(centres))
    for k, centre in enumerate(centres):
        weights = np.sinc(bandwidth * np.log10(frequencies / centre) / np.pi) ** 4
        smooth[k] = weights @ amplitudes / weights.sum()
    return smooth
