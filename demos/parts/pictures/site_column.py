"""Draw site columns side by side: spectra of the surface, strains over the depth, and a loop."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from demos.parts.problems.site_column import DEPTH, Shaken
from vi_contact.core.algebra import Array
from vi_contact.practice.ground_motion import Record, response_spectrum
from vi_contact.practice.plots.histories import canvas, draw_curve, plain_numbers, save

GRAVITY = 9.80665  # [m/s²]
PERIODS = np.geomspace(0.1, 3.0, 120)  # of the spectra [s]


def find_spectrum(record: Record) -> Array:
    """Return the pseudo-acceleration at ``PERIODS``, 5 % [g]."""
    psa: Array = response_spectrum(record, PERIODS).psa
    return psa / GRAVITY


def plot_columns(columns: Mapping[str, Shaken], outcrop: Record, path: Path) -> Path:
    """Draw columns beside the outcrop; return the path.

    Args:
        columns: name -> what was found.
        outcrop: the motion of the rock.
        path: of the picture.
    """
    figure, ((spectra, profile, loops),) = canvas(1, 3, (12.0, 4.2))
    for place, (name, found) in enumerate(columns.items()):
        draw_curve(spectra, PERIODS, find_spectrum(found.surface), place, label=name)

        # a step over the height of each cell
        edges = np.linspace(0.0, DEPTH, len(found.strain) + 1)
        depths = np.repeat(edges, 2)[1:-1]
        draw_curve(profile, 100.0 * np.repeat(found.strain, 2), depths, place, label=name)
        if found.loop is not None:
            strain, stress = found.loop
            draw_curve(loops, 100.0 * strain, 1e-3 * stress, place, marker="", lw=0.6)
    spectra.plot(PERIODS, find_spectrum(outcrop), color="0.6", lw=0.9, label="outcrop of the rock")
    spectra.set(xscale="log", xlabel="period [s]", ylabel="pseudo-acceleration, 5 % [g]")
    plain_numbers(spectra.xaxis)
    spectra.set_title("surface")
    spectra.legend(fontsize=8)
    profile.set(xlabel="largest shear strain [%]", ylabel="depth [m]", ylim=(DEPTH, 0.0))
    profile.set_title("strain")
    loops.set(xlabel="shear strain [%]", ylabel="shear stress [kPa]")
    loops.locator_params(axis="x", nbins=6)
    loops.set_title("soil that yields, half-way down")
    return save(figure, path)
