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
    in a_<axis>_<label>, whose integral drifts off. ``relative``: minus the ground acceleration
    a_g_<axis> of the run. InputError for columns that are no accelerations.
    """
    flag("recorded_motion", "relative", relative)
    instance(
        "recorded_motion", "column", column, str, "give the name of a column, such as 'a_x_top'"
    )
    kind, _, rest = column.partition("_")
    axis = rest.partition("_")[2 if rest.startswith("g_") else 0]
    if kind not in ("a", "v") or "_" not in rest:
        raise InputError(
            f"column '{column}' is not an acceleration: record Probe(..., acceleration=True) "
            "and give a_x_<label>, or give a_g_x for the ground"
        )
    values, t = column_of(history, column), column_of(history, "t")
    if len(t) < 3:
        raise InputError(f"the history has {len(t)} rows: give one of three or more")
    ground = np.asarray(history.get(f"a_g_{axis}", np.zeros(len(t))), dtype=float)
    # mean over the step, as probes have it
    ground = np.append(ground[:1], 0.5 * (ground[1:] + ground[:-1]))
    if kind == "v":
        values = np.append(0.0, np.diff(values) / np.diff(t)) + ground
    elif column == f"a_g_{axis}":
        values = ground
    values = values - ground if relative else values
    steps = np.diff(t)
    dt = float(np.median(steps))
    if np.ptp(steps) > 1e-6 * dt:
        asked = (t[-1] - t[0]) / dt * (1.0 + 1e-12)
        check_count(f"column '{column}'", f"the step of {dt:g} s in {t[-1] - t[0]:g} s", asked)
        even = t[0] + dt * np.arange(int(np.floor(asked)) + 1)
        values = np.interp(even, t, values)
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
    """Return the response spectrum of an oscillator of each period [s].

    The oscillator stands where the column was recorded.
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
    """Return |A_surface(f)| / |A_base(f)| of absolute accelerations.

    It comes from the Fourier amplitudes of two columns.

    Amplitudes are smoothed alike with Konno and Ohmachi's window (1998), which widens peaks, before
    they are divided; ``bandwidth=None`` takes the raw ones. The motion has to die away before the
    run ends, or be periodic, else its end leaks into all frequencies. ``frequencies`` None: 200,
    from four periods in the run to four samples in a period; raw all of the transform. nan where
    the base has below ``floor`` of its peak. InputError for a base without motion.
    """
    number("transfer_function", "floor", floor, positive=True)
    optional(number, "transfer_function", "bandwidth", bandwidth, positive=True)
    top, below = recorded_motion(history, surface), recorded_motion(history, base)
    raw = np.fft.rfftfreq(len(top.acceleration), top.dt)[1:]
    spectra = [np.abs(np.fft.rfft(one.acceleration))[1:] for one in (top, below)]
    if frequencies is None:
        wanted = raw if bandwidth is None else np.geomspace(4.0 * raw[0], 0.5 * raw[-1], 200)
    else:
        wanted = array(
            "transfer_function",
            "frequencies",
            np.atleast_1d(np.asarray(frequencies)),
            (None,),
            unit="Hz",
        )
    if np.any(wanted <= 0.0) or np.any(wanted > raw[-1] * (1.0 + 1e-9)):
        raise InputError(
            f"transfer_function: give frequencies above 0 and up to {raw[-1]:.4g} Hz, half the "
            "sampling"
        )
    if bandwidth is None:
        smooth = [np.interp(wanted, raw, one) for one in spectra]
    else:
        smooth = [konno_ohmachi(raw, one, wanted, bandwidth=bandwidth) for one in spectra]
    largest = float(spectra[1].max())
    if not largest > 0.0:
        raise InputError(
            f"transfer_function: column '{base}' is zero throughout: name the motion at the base"
        )
    ratio = np.full(len(wanted), np.nan)
    np.divide(smooth[0], smooth[1], out=ratio, where=smooth[1] > floor * smooth[1].max())
    return TransferFunction(wanted, ratio)


def konno_ohmachi(
    frequencies: Array, amplitudes: Array, centres: Array, *, bandwidth: float = BANDWIDTH
) -> Array:
    """Smooth amplitudes at the centres with Konno and Ohmachi's weights.

    The weights are (sin x / x)⁴, x = b log10(f / f_c) (Konno, Ohmachi 1998).
    """
    smooth = np.empty(len(centres))
    for k, centre in enumerate(centres):
        weights = np.sinc(bandwidth * np.log10(frequencies / centre) / np.pi) ** 4
        smooth[k] = weights @ amplitudes / weights.sum()
    return smooth
