"""Draw a bar that warms up against a wall, and the path of a spring that is damaged."""

from __future__ import annotations

from pathlib import Path

from vi_contact.practice.plots.histories import canvas, save

Curve = tuple[list[float], list[float]]


def plot_couplings(
    pressures: Curve,
    steady: float,
    path: Curve,
    known: tuple[float, float, float],
    picture: str | Path,
) -> Path:
    """Draw pressures (times [s], Pa) beside the steady one, and a path (shortening [m], N).

    known: shortening [m] at which the damage begins, the force there [N], the largest shortening.
    """
    figure, axes = canvas(1, 2, (11.0, 4.2))
    heat, spring = axes[0]
    times, values = pressures
    heat.axhline(1e-6 * steady, color="0.6", lw=3.0, label="steady, closed form")
    heat.plot(times, [1e-6 * p for p in values], "k.-", label="computed")
    heat.set(xlabel="t [s]", ylabel="pressure [MPa]", title="A hot bar on a cold wall")
    heat.legend(fontsize=9)
    begin, force, end = known
    corners = [0.0, 1e3 * begin, 1e3 * end, 0.0]
    spring.plot(
        corners, [0.0, 1e-3 * force, 1e-3 * force, 0.0], color="0.6", lw=3.0, label="closed form"
    )
    x, forces = path
    spring.plot([1e3 * a for a in x], [1e-3 * f for f in forces], "k-", lw=0.8, label="computed")
    spring.set(xlabel="shortening [mm]", ylabel="force [kN]", title="A spring that is damaged")
    spring.legend(fontsize=9)
    return save(figure, picture)
