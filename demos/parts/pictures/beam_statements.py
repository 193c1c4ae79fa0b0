"""Draw what the readings of the beam's normal force make of the two statements of its source."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from demos.parts.problems.beam_statements import EPS, FACTORS, NEGLIGIBLE, Row
from vi_contact.plots.histories import canvas, plain_numbers, save

COLOURS = {"A": "tab:blue", "B": "tab:orange", "C": "tab:green"}


def plot_statements(rows: Sequence[Row], path: str | Path) -> Path:
    """Draw how often the tip swings over the normal force.

    The friction loss is drawn over the viscous loss.
    """
    figure, axes = canvas(1, 2, (11.0, 4.2))
    swings, losses = axes[0]
    viscosities = sorted({row.a2 for row in rows})
    for row in rows:
        style = "o-" if row.a2 == viscosities[0] else "s--"
        swings.plot(
            FACTORS,
            row.swings,
            style,
            color=COLOURS[row.reading],
            label=f"reading {row.reading}, a2 = {row.a2:g} s",
        )
    swings.set(
        xscale="log",
        xlabel="normal force over that of the reading [-]",
        ylim=(0.0, None),
        ylabel=f"swings of the tip above {1e3 * EPS:g} mm [-]",
        title="Does a larger force swing the tip more?",
    )
    plain_numbers(swings.xaxis)
    swings.legend(fontsize=9)
    places = np.arange(len(rows))
    losses.bar(places, [row.ratio for row in rows], color=[COLOURS[row.reading] for row in rows])
    losses.axhline(
        NEGLIGIBLE, color="k", ls="--", lw=1.2, label=f"{NEGLIGIBLE:g}: negligible below"
    )
    losses.set(
        yscale="log",
        ylabel="friction loss over viscous loss [-]",
        title="Does friction take little?",
        xlabel="reading of the normal force, and viscosity a2 [s]",
    )
    losses.set_xticks(places, [f"{row.reading}\n{row.a2:g}" for row in rows])
    losses.legend(fontsize=9)
    return save(figure, path)
