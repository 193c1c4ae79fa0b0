"""Draw engineering quantities: loops of force and deformation, transfer functions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..engineering.floor_spectra import TransferFunction
from ..engineering.peak_values import Loop
from .histories import canvas, plain, plain_numbers, save, scaled


def plot_loop(
    loop: Loop, path: str | Path, *, x: tuple[str, str], y: tuple[str, str], title: str | None = None
) -> Path:
    """Draw force over deformation; ``x``, ``y``: (name, SI unit) of the two. The title says the work at the end."""
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
    axis.set(xlabel=plain(f"{x[0]} [{x_unit}]"), ylabel=plain(f"{y[0]} [{y_unit}]"), title=plain(title))
    return save(figure, path)


def plot_transfer(
    found: TransferFunction, path: str | Path, *, title: str, theory: TransferFunction | None = None
) -> Path:
    """Draw the amplitude over frequency, both logarithmic; a theory dashed."""
    figure, ((axis,),) = canvas(1, 1, (7.5, 4.5))
    axis.loglog(found.frequencies, found.amplitude, color="black", lw=1.0, label="computed")
    if theory is not None:
        axis.loglog(theory.frequencies, theory.amplitude, "--", color="tab:red", lw=1.0, label="theory")
        axis.legend(fontsize=8)
    plain_numbers(axis.xaxis)
    axis.axhline(1.0, color="0.6", lw=0.6)
    frequency, amplitude = found.peak
    axis.plot(frequency, amplitude, "o", color="tab:blue", ms=4)
    axis.annotate(f"{amplitude:.3g} at {frequency:.3g} Hz", (frequency, amplitude), xytext=(6, 4),
                  textcoords="offset points", fontsize=8)
    finite = found.amplitude[np.isfinite(found.amplitude) & (found.amplitude > 0.0)]
    axis.set_ylim(0.5 * float(finite.min()), 2.0 * float(finite.max()))
    axis.set(xlabel="frequency [Hz]", ylabel="|surface / base| [-]", title=plain(title))
    return save(figure, path)
