"""Draw what the demos of the boundary layer show.

They show impacts, parameters, cut-offs, bounces of a body, and thin layers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.layer import Layer, ParticleImpact, Trajectory
from vi_contact.plots.histories import canvas, save

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple")


def plot_particle(
    impacts: Mapping[str, Sequence[tuple[str, ParticleImpact]]], path: str | Path
) -> Path:
    """Draw Fig. 1: distance and velocity against t/t_f.

    There is a row of panels for each group; group -> (label, impact).
    """
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


def plot_parameters(values: Sequence[float], dampers: Sequence[float], path: str | Path) -> Path:
    """Draw Fig. 2: duration and restitution against k for several c.

    The units are those where a = b = V = m = 1.
    """
    figure, axes = canvas(1, 2, (10.0, 3.8))
    duration, rebound = axes[0]
    for c, colour in zip(dampers, COLOURS, strict=False):
        impacts = [ParticleImpact(Layer(1.0, k=k, c=c), 1.0, 1.0) for k in values]
        duration.plot(
            values, [one.duration for one in impacts], color=colour, lw=1.2, label=f"c = {c:g}"
        )
        rebound.plot(
            values, [one.restitution for one in impacts], color=colour, lw=1.2, label=f"c = {c:g}"
        )
        rebound.plot(
            values, [one.poisson_covector for one in impacts], color=colour, lw=1.0, ls="--"
        )
    duration.set(xlabel="k [m V²/a²]", ylabel="duration t_f [a/V]", ylim=(0.0, 5.0))
    rebound.set(
        xlabel="k [m V²/a²]",
        ylabel="restitution [-]",
        ylim=(0.0, 1.05),
        title="Newton's (solid), Poisson's with $\\hat f_1$ (dashed)",
    )
    duration.legend(fontsize=8)
    return save(figure, path)


def plot_cut_off(
    motions: Mapping[str, Trajectory], exact: ParticleImpact, path: str | Path
) -> Path:
    """Draw Fig. 3: distance and velocity against time for several a/b.

    The closed form is behind them; label -> motion.
    """
    figure, axes = canvas(1, 2, (10.0, 3.8))
    place, speed = axes[0]
    t = np.linspace(0.0, exact.duration, 400)
    place.plot(t, exact.position(t), color="0.75", lw=4.0, label="closed form")
    speed.plot(t, exact.velocity(t), color="0.75", lw=4.0)
    for (label, motion), colour in zip(motions.items(), COLOURS, strict=False):
        place.plot(motion.t, motion.rho, color=colour, lw=1.2, label=label)
        speed.plot(motion.t, motion.v[:, 0], color=colour, lw=1.2)
    place.set(xlabel="time [s]", ylabel="distance x [m]")
    speed.set(xlabel="time [s]", ylabel="velocity [m/s]")
    place.legend(fontsize=8)
    return save(figure, path)


def plot_bounces_of_body(
    motion: Trajectory, energy: Array, path: str | Path, *, title: str, still: Array | None = None
) -> Path:
    """Draw a rigid body before a plane z = 0.

    There are the height of its mass centre and of its lowest point, energy and spin.

    energy: (m,) [J]; still: (m,) what the energy would be with the impact map's losses.
    """
    figure, axes = canvas(3, 1, (9.0, 8.0), sharex=True)
    place, ledger, spin = axes[:, 0]
    place.plot(motion.t, motion.q[:, 2], color="black", lw=1.2, label="mass centre")
    place.plot(motion.t, motion.rho, color="tab:blue", lw=1.2, label="lowest point")
    place.set(ylabel="height [m]", title=title, ylim=(0.0, None))
    place.legend(fontsize=8)
    ledger.plot(motion.t, energy, color="black", lw=1.2, label="through the layer")
    if still is not None:
        ledger.plot(
            motion.t,
            still,
            color="tab:red",
            lw=1.2,
            ls="--",
            label="½ g₁₁ (1 - e²) ρ̇² less at every impact",
        )
    ledger.set(ylabel="energy [J]", ylim=(0.0, None))
    ledger.legend(fontsize=8)
    for axis, name, colour in zip(range(3), "123", COLOURS, strict=False):
        spin.plot(motion.t, motion.v[:, 3 + axis], color=colour, lw=1.2, label=f"Ω{name}")
    spin.set(xlabel="time [s]", ylabel="spin in the body [rad/s]")
    spin.legend(fontsize=8, ncol=3)
    return save(figure, path)


def plot_thin_limit(
    errors: Mapping[str, tuple[Array, Array]],
    path: str | Path,
    *,
    quantity: str,
    slope: str = "order 1",
) -> Path:
    """Draw an error over the width of the layer; label -> (widths [m], errors).

    A line of order 1 beside them.
    """
    figure, axes = canvas(1, 1, (6.5, 4.2))
    axis = axes[0, 0]
    for (label, (width, error)), colour in zip(errors.items(), COLOURS, strict=False):
        axis.loglog(width, error, "o-", color=colour, lw=1.2, ms=4.0, label=label)
    width, error = next(iter(errors.values()))
    axis.loglog(width, 0.5 * error[0] * width / width[0], color="0.6", ls="--", lw=1.0, label=slope)
    axis.set(xlabel="width of the layer b [m]", ylabel=quantity)
    axis.legend(fontsize=8)
    return save(figure, path)


def plot_layered_bar(
    runs: Mapping[str, tuple[Array, Array, Array]],
    exact: tuple[Array, Array, Array],
    path: str | Path,
) -> Path:
    """Draw the height of a bar's foot [m] and contact pressure [Pa] against time.

    The argument is label -> (t, height, pressure).
    """
    figure, axes = canvas(1, 2, (11.0, 4.0))
    height, force = axes[0]
    height.plot(exact[0], exact[1], color="0.75", lw=4.0, label="exact inequality, closed form")
    force.plot(exact[0], exact[2], color="0.75", lw=4.0)
    for (label, (t, y, p)), colour in zip(runs.items(), COLOURS, strict=False):
        height.plot(t, y, color=colour, lw=1.0, label=label)
        force.plot(t, p, color=colour, lw=1.0)
    height.set(xlabel="time [s]", ylabel="height of the foot [m]")
    force.set(xlabel="time [s]", ylabel="contact pressure [Pa]")
    height.legend(fontsize=8, ncol=3, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return save(figure, path)
