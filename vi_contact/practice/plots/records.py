"""Draw ground motions, response spectra, transfer functions, and loops of force and deformation."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY
from ..engineering.floor_spectra import TransferFunction
from ..engineering.peak_values import Loop
from ..ground_motion.ec8 import EC8Spectrum
from ..ground_motion.intensity import arias, d5_95, husid, pga
from ..ground_motion.processing import integrated
from ..ground_motion.record import UNITS, Record, canonical_units
from ..ground_motion.spectra import ResponseSpectrum
from .histories import (
    canvas,
    draw_curve,
    escape_dollars,
    length_unit,
    panels,
    plain_numbers,
    put_legend_above,
    save,
    scale_values,
)

# A spectrum is drawn pale at periods with fewer samples of the record than this.
SAMPLES_A_PERIOD = 10
TARGET = {"color": "black", "ls": (0, (8, 3))}  # long dashes, which no other curve has


@check_arguments
def plot_motion(
    record: Record, path: str | Path, *, title: str | None = None, units: str = "m/s2"
) -> Path:
    """Draw acceleration, velocity, displacement and the Husid curve of a record.

    Peaks are marked and D5-95 is shaded. Nothing is corrected: a drift of the record shows.

    Args:
        record: the ground motion.
        path: the picture; its ending says the format.
        title: stands above it; None: that of the record, or where it comes from.
        units: of the acceleration.

    Returns:
        the path.
    """
    units = canonical_units("plot_motion: units", units)
    figure, axes = panels(4, (9.0, 8.0))
    velocity, displacement = integrated(record)
    _draw_history(
        axes[0],
        record.times,
        record.acceleration / UNITS[units],
        f"acceleration [{_typeset_unit(units)}]",
    )
    metres, unit = _choose_length_unit(velocity)
    _draw_history(axes[1], record.times, velocity / metres, f"velocity [{unit}/s]")
    metres, unit = _choose_length_unit(displacement)
    _draw_history(axes[2], record.times, displacement / metres, f"displacement [{unit}]")
    _draw_husid(axes[3], record)
    if title is None:
        title = record.title or record.source
    axes[0].set_title(escape_dollars(title), fontsize=10)
    axes[-1].set_xlim(0.0, record.duration)
    return save(figure, path)


@check_arguments
def plot_spectra(
    spectra: Mapping[str, ResponseSpectrum],
    path: str | Path,
    *,
    target: EC8Spectrum | None = None,
    steps: Mapping[str, float] | None = None,
    title: str = "Response spectra",
    units: str = "g",
) -> Path:
    """Draw pseudo-acceleration and displacement over the period.

    Args:
        spectra: label of a line -> spectrum.
        path: the picture; its ending says the format.
        target: spectrum of Eurocode 8, which is dashed.
        steps: time step [s] of the record behind each label; at periods below ten of them its line
            is pale.
        title: stands above the picture.
        units: of the pseudo-acceleration.

    Returns:
        the path.

    Raises:
        InputError: there is no spectrum, or such a unit does not exist.
    """
    units = canonical_units("plot_spectra: units", units)
    if not spectra:
        raise InputError(
            "plot_spectra: spectra is empty; give one response spectrum or more, each with its "
            "label"
        )
    figure, ((top,), (bottom,)) = canvas(2, 1, (8.0, 7.5), sharex=True)
    bottom.set_xscale("log")
    plain_numbers(bottom.xaxis)
    periods = np.concatenate([spectrum.periods for spectrum in spectra.values()])
    metres, unit = length_unit(
        max(float(np.max(spectrum.displacement)) for spectrum in spectra.values())
    )
    # The least period of each label that its record resolves.
    trusted = {label: SAMPLES_A_PERIOD * (steps or {}).get(label, 0.0) for label in spectra}
    for place, (label, spectrum) in enumerate(spectra.items()):
        psa = spectrum.psa / UNITS[units]
        _draw_spectrum(top, spectrum.periods, psa, trusted[label], label, place)
        displacement = spectrum.displacement / metres
        _draw_spectrum(bottom, spectrum.periods, displacement, trusted[label], label, place)
    if target is not None:
        name = f"EC8 target, {100.0 * target.damping:g} %"
        grid = np.geomspace(periods.min(), periods.max(), 500)
        top.plot(grid, target.acceleration(grid) / UNITS[units], lw=1.6, **TARGET, label=name)
        code = grid[grid <= 4.0]  # beyond, the code gives another displacement spectrum
        bottom.plot(code, target.displacement(code) / metres, lw=1.6, **TARGET, label=name)
    if any(np.min(spectrum.periods) < trusted[label] for label, spectrum in spectra.items()):
        pale = f"pale: under {SAMPLES_A_PERIOD} samples a period"
        top.plot([], [], color="0.5", lw=0.8, alpha=0.5, label=pale)
    legend = put_legend_above(top, 8.0)
    for axis in (top, bottom):
        axis.set_ylim(bottom=0.0)
    top.set(
        ylabel=f"pseudo-acceleration [{_typeset_unit(units)}]",
    )
    top.set_title(escape_dollars(title), pad=legend + 4.0)
    bottom.set(
        ylabel=f"displacement [{unit}]",
        xlabel="period [s]",
        xlim=(periods.min(), periods.max()),
    )
    return save(figure, path)


def _draw_spectrum(
    axis: Any, periods: Array, values: Array, trusted: float, label: str, place: int
) -> None:
    """Draw the spectrum number ``place``, pale at periods below the least trusted one [s]."""
    resolved = np.where(periods >= trusted, values, np.nan)
    line = draw_curve(axis, periods, resolved, place, lw=1.2, label=escape_dollars(label))
    axis.plot(periods, values, lw=0.8, color=line.get_color(), alpha=0.35)


@check_arguments
def plot_loop(
    loop: Loop,
    path: str | Path,
    *,
    x: tuple[str, str],
    y: tuple[str, str],
    title: str | None = None,
) -> Path:
    """Draw force over deformation.

    Args:
        loop: what ``hysteresis`` returned.
        path: the picture; its ending says the format.
        x: name and SI unit of the deformation.
        y: name and SI unit of the force.
        title: stands above the picture; None: the work at the end.

    Returns:
        the path.
    """
    figure, ((axis,),) = canvas(1, 1, (6.4, 4.8))
    x_name, x_si = x
    y_name, y_si = y
    deformation, x_unit = scale_values(loop.deformation, x_si)
    force, y_unit = scale_values(loop.force, y_si)
    axis.axhline(0.0, color="0.6", lw=0.6)
    axis.axvline(0.0, color="0.6", lw=0.6)
    axis.plot(deformation, force, color="black", lw=0.8)
    axis.plot(deformation[:1], force[:1], "o", color="tab:green", ms=5, label="start")
    axis.plot(deformation[-1:], force[-1:], "s", color="tab:red", ms=5, label="end")
    legend = put_legend_above(axis, 8.0)
    work, unit = scale_values(loop.work[-1:], "J")
    axis.set(
        xlabel=escape_dollars(f"{x_name} [{x_unit}]"),
        ylabel=escape_dollars(f"{y_name} [{y_unit}]"),
    )
    axis.set_title(escape_dollars(title or f"work {work[0]:.3g} {unit}"), pad=legend + 4.0)
    return save(figure, path)


@check_arguments
def plot_transfer(found: TransferFunction, path: str | Path, *, title: str) -> Path:
    """Draw the amplitude of a transfer function over frequency, both logarithmic.

    Args:
        found: what ``transfer_function`` returned.
        path: the picture; its ending says the format.
        title: stands above it.

    Returns:
        the path.
    """
    figure, ((axis,),) = canvas(1, 1, (7.5, 4.5))
    axis.loglog(found.frequencies, found.amplitude, color="black", lw=1.0)
    plain_numbers(axis.xaxis)
    axis.axhline(1.0, color="0.6", lw=0.6)
    frequency, amplitude = found.peak
    axis.plot(frequency, amplitude, "o", color="tab:blue", ms=4)
    axis.annotate(
        f"{amplitude:.3g} at {frequency:.3g} Hz",
        (frequency, amplitude),
        xytext=(6, 4),
        textcoords="offset points",
        fontsize=8,
    )
    finite = found.amplitude[np.isfinite(found.amplitude) & (found.amplitude > 0.0)]
    axis.set_ylim(0.5 * float(finite.min()), 2.0 * float(finite.max()))
    axis.set(xlabel="frequency [Hz]", ylabel="|surface / base| [-]", title=escape_dollars(title))
    return save(figure, path)


def _draw_history(axis: Any, times: Array, values: Array, label: str) -> None:
    """Draw a history with its peak marked and written."""
    axis.plot(times, values, color="black", lw=0.7)
    row = int(np.argmax(np.abs(values)))
    instant = times[row]
    peak = values[row]
    axis.plot(instant, peak, "o", ms=4, color="tab:red", clip_on=False)

    # The text is to the right of the peak, except near the end, and away from the zero line.
    late = instant > 0.75 * times[-1]
    axis.annotate(
        f"{peak:.3g} at {instant:g} s",
        (instant, peak),
        xytext=(-6 if late else 6, -4 if peak < 0.0 else 4),
        textcoords="offset points",
        fontsize=8,
        color="tab:red",
        va="center",
        ha="right" if late else "left",
    )
    axis.axhline(0.0, color="0.6", lw=0.6)
    axis.margins(y=0.12)
    axis.set_ylabel(label)


def _draw_husid(axis: Any, record: Record) -> None:
    """Draw the accumulated Arias intensity in percent, the significant duration shaded."""
    curve = husid(record)
    if curve[-1] > 0.0:
        curve = 100.0 * curve / curve[-1]
        start, end = np.interp((5.0, 95.0), curve, record.times)
        axis.axvspan(start, end, color="tab:blue", alpha=0.12)
    axis.plot(record.times, curve, color="black", lw=0.9)
    text = (
        f"Arias {arias(record):.3g} m/s, D5-95 {d5_95(record):.3g} s, PGA "
        f"{pga(record) / STANDARD_GRAVITY:.3g} g"
    )
    axis.text(0.98, 0.08, text, transform=axis.transAxes, ha="right", fontsize=8)
    axis.set(ylabel="Arias intensity [%]", ylim=(-3.0, 103.0))


def _choose_length_unit(values: Array) -> tuple[float, str]:
    """Return (metres per unit, name) that fits lengths.

    Centimetres take the place of hundreds of millimetres, as is usual for ground motions.
    """
    peak = float(np.max(np.abs(values)))
    return (0.01, "cm") if 0.001 <= peak < 10.0 else length_unit(peak)


def _typeset_unit(units: str) -> str:
    """Return a unit with its square raised."""
    return units.replace("s2", "s²")
