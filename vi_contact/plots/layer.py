"""Draw the impact of a particle on a boundary layer: Fig. 1 of the paper on b-geometry (ENOC 2017)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..boundary_layer.particle import ParticleImpact
from .histories import canvas, save

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple")


def plot_particle(impacts: Mapping[str, Sequence[tuple[str, ParticleImpact]]], path: str | Path) -> Path:
    """Draw Fig. 1: distance and velocity against t/t_f, a row of panels for each group; group -> (label, impact)."""
    figure, axes = canvas(len(impacts), 2, (10.0, 3.3 * len(impacts) + 0.3))
    for (place, speed), (title, group) in zip(axes, impacts.items(), strict=True):
        for (label, impact), colour in zip(group, COLOURS, strict=False):
            part = np.linspace(0.0, 1.0, 301)
            x, v = impact.position(part * impact.duration), impact.velocity(part * impact.duration)
            place.plot(part, x / impact.layer.a, color=colour, lw=1.2, label=label)
            speed.plot(part, v / impact.speed, color=colour, lw=1.2, label=label)
        place.set(xlabel="t / t_f [-]", ylabel="x / a [-]", title=title)
        speed.set(xlabel="t / t_f [-]", ylabel="velocity / V [-]", title=title)
        speed.axhline(0.0, color="0.5", lw=0.8)
        place.legend(fontsize=8)
    return save(figure, path)
