"""Draw ground motions, response spectra and a target.

Transfer functions, and loops of force and deformation, are drawn too.
"""

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
from .histories import canvas, length_unit, panels, plain, plain_numbers, save, scaled

SAMPLES_A_PERIOD = (
    10  # a spectrum is drawn pale at periods with fewer samples of the record than this
)


@check_arguments
def plot_motion(
    record: Record, path: str | Path, *, title: str | None = None, units: str = "m/s2"
) -> Path:
    """Draw acceleration in `units`, velocity, displacement and the Husid curve.

    Peaks are marked and D5-95 is shaded.

    title: default the record's. Nothing is corrected: a drift of the record shows.
    """
    units = canonical_units("plot_motion: units", units)
    figure, axes = panels(4, (9.0, 8.0))
    velocity, displacement = integrated(record)
    _line(
        axes[0],
        record.times,
        record.acceleration / UNITS[units],
        f"acceleration [{_pretty(units)}]",
    )
    quantities = (velocity, "velocity", "/s"), (displacement, "displacement", "")
    for axis, (values, quantity, per_second) in zip(axes[1:3], quantities, strict=True):
        metres, unit = _size(values)
        _line(axis, record.times, values / metres, f"{quantity} [{unit}{per_second}]")
    _husid(axes[3], record)
    axes[0].set_title(
        plain(title if title is not None else record.title or record.source), fontsize=10
    )
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
    """Draw pseudo-acceleration in `units` and displacement over the period.

    There is one line for each label; the target is dashed.

    steps: time step [s] of the record behind each label; below ten of them its line is pale.
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
    shown = np.concatenate([spectrum.periods for spectrum in spectra.values()])
    metres, unit = length_unit(
        max(float(np.max(spectrum.displacement)) for spectrum in spectra.values())
    )
    # period that is trusted
    first = {label: SAMPLES_A_PERIOD * (steps or {}).get(label, 0.0) for label in spectra}
    for label, spectrum in spectra.items():
        colour = None
        for axis, values in (
            (top, spectrum.psa / UNITS[units]),
            (bottom, spectrum.displacement / metres),
        ):
            known = np.where(spectrum.periods >= first[label], values, np.nan)
            (line,) = axis.plot(spectrum.periods, known, lw=1.2, color=colour, label=plain(label))
            colour = line.get_color()
            axis.plot(spectrum.periods, values, lw=0.8, color=colour, alpha=0.35)
    if target is not None:
        periods = np.geomspace(shown.min(), shown.max(), 500)
        name = f"EC8 target, {100.0 * target.damping:g} %"
        top.plot(periods, target.acceleration(periods) / UNITS[units], "k--", lw=1.2, label=name)
        code = periods <= 4.0  # beyond, the code gives another displacement spectrum
        bottom.plot(
            periods[code], target.displacement(periods[code]) / metres, "k--", lw=1.2, label=name
        )
    if any(np.min(spectrum.periods) < first[label] for label, spectrum in spectra.items()):
        top.plot(
            [],
            [],
            color="0.5",
            lw=0.8,
            alpha=0.5,
            label=f"pale: under {SAMPLES_A_PERIOD} samples a period",
        )
    top.legend(fontsize=8)
    for axis in (top, bottom):
        axis.set_ylim(bottom=0.0)
    top.set(ylabel=f"pseudo-acceleration [{_pretty(units)}]", title=plain(title))
    bottom.set(
        ylabel=f"displacement [{unit}]", xlabel="period [s]", xlim=(shown.min(), shown.max())
    )
    return save(figure, path)


@check_arguments
def plot_loop(
    loop: Loop,
    path: str | Path,
    *,
    x: tuple[str, str],
    y: tuple[str, str],
    title: str | None = None,
) -> Path:
    """Draw force over deformation; ``x``, ``y``: (name, SI unit) of the two.

    The title says the work at the end.
    """
    figure, ((axis,),) = canvas(1, 1, (6.4, 4.8))
    across, x_unit = scaled(loop.deformation, x[1])
    up, y_unit = scaled(loop.force, y[1])
    axis.axhline(0.0, color="0.6", lw=0.6)
    axis.axvline(0.0, color="0.6", lw=0.6)
    axis.plot(across, up, color="black", lw=0.8)
    axis.plot(across[:1], up[:1], "o", color="tab:green", ms=5, label="start")
    axis.plot(across[-1:], up[-1:], "s", color="tab:red", ms=5, label="end")
    axis.legend(fontsize=8)
    work, unit = scaled(loop.work[-1:], "J")
    title = title or f"work {work[0]:.3g} {unit}"
    axis.set(
        xlabel=plain(f"{x[0]} [{x_unit}]"), ylabel=plain(f"{y[0]} [{y_unit}]"), title=plain(title)
    )
    return save(figure, path)


@check_arguments
def plot_transfer(found: TransferFunction, path: str | Path, *, title: str) -> Path:
    """Draw the amplitude over frequency, both logarithmic."""
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
    axis.set(xlabel="frequency [Hz]", ylabel="|surface / base| [-]", title=plain(title))
    return save(figure, path)


def _line(axis: Any, times: Array, values: Array, label: str) -> None:
    """Return a history with its peak marked and written."""
    axis.plot(times, values, color="black", lw=0.7)
    peak = int(np.argmax(np.abs(values)))
    axis.plot(times[peak], values[peak], "o", ms=4, color="tab:red", clip_on=False)
    side, outwards = -1 if times[peak] > 0.75 * times[-1] else 1, -1 if values[peak] < 0.0 else 1
    axis.annotate(
        f"{values[peak]:.3g} at {times[peak]:g} s",
        (times[peak], values[peak]),
        xytext=(6 * side, 4 * outwards),
        textcoords="offset points",
        fontsize=8,
        color="tab:red",
        va="center",
        ha="left" if side > 0 else "right",
    )
    axis.axhline(0.0, color="0.6", lw=0.6)
    axis.margins(y=0.12)
    axis.set_ylabel(label)


def _husid(axis: Any, record: Record) -> None:
    """Accumulated Arias intensity in percent, the significant duration shaded."""
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


def _size(values: Array) -> tuple[float, str]:
    """Return the unit of length that fits.

    There are centimetres in place of hundreds of millimetres, as is usual for ground motions.
    """
    peak = float(np.max(np.abs(values)))
    return (0.01, "cm") if 0.001 <= peak < 10.0 else length_unit(peak)


def _pretty(units: str) -> str:
    return units.replace("s2", "s²")
