#!/usr/bin/env python3
"""Throw a particle on a wall with a boundary layer.

See Figs. 1, 2 and 3 of the paper on b-geometry (ENOC 2017).

There is no impact law. The particle slows down in a thin layer before the wall, by Newton's law in
a metric that grows without bound there, and comes back. Restitution and duration are results in
closed form. Beside them stand motions by integration in time: with the force that begins smoothly,
and with the other readings of the law.

    bash demos/run.sh particle_layer        # into results/particle_layer

All quantities are SI; docs/theory/boundary_layer.md explains them. One process is enough.
"""

from __future__ import annotations

import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np

from demos.parts.pictures.layer import plot_cut_off, plot_parameters, plot_particle
from vi_contact.cli import status_of
from vi_contact.layer import (
    ConstrainedSystem,
    Layer,
    Metric,
    ParticleImpact,
    layer_for,
    layer_motion,
)

# Parameters
# --------------------------------------------------------------------------------------------------
STIFFNESSES = (0.5, 1.0, 2.0, 5.0, 10.0)  # k [N/m]
DAMPERS = (0.0, 0.5, 1.0, 2.0, 5.0)  # c [N]
MASS, SPEED, WIDTH = 1.0, 1.0, 1.0  # m [kg], V [m/s], b [m]
RATIOS = (0.8, 0.9, 0.95)  # a/b of Fig. 3
WANTED = 0.7  # a restitution, and the layer that has it
OUT = Path("results/particle_layer")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Make table and figures (``quick``: one k in the table, one a/b below 1).

    It returns the key numbers.
    """
    out.mkdir(parents=True, exist_ok=True)
    numbers = table(STIFFNESSES[2:3] if quick else STIFFNESSES)
    plot_particle(
        {
            "c = 0": [(f"k = {k:g}", impact(k, 0.0)) for k in STIFFNESSES],
            "k = 1": [(f"c = {c:g}", impact(1.0, c)) for c in DAMPERS],
        },
        out / "figure_1.png",
    )
    plot_parameters(np.linspace(0.25, 10.0, 12 if quick else 79), DAMPERS, out / "figure_2.png")
    numbers |= readings(RATIOS[:1] if quick else RATIOS, out)
    layer = layer_for(WANTED, mass=MASS, speed=SPEED, width=WIDTH)
    numbers["wanted"] = ParticleImpact(layer, MASS, SPEED).restitution
    print(
        f"\nFor e = {WANTED:g} at half the layer's depth: k = {layer.k:.6f} N/m, c = {layer.c:.6f} "
        "N"
    )
    if progress:
        print(f"Figures are in {out}.")
    return numbers


def impact(k: float, c: float) -> ParticleImpact:
    """Return the particle against this layer, a = b."""
    return ParticleImpact(Layer(WIDTH, k=k, c=c), MASS, SPEED)


def table(stiffnesses: tuple[float, ...]) -> dict[str, float]:
    """Print restitution, duration and compression of all pairs.

    They are in closed form, with its distance from integration.
    """
    numbers = {}
    worst = 0.0
    print("     k      c        e      e_p(f̂)   t_c [s]    t_f [s]  x_min [m]")
    for k in stiffnesses:
        for c in DAMPERS:
            one = impact(k, c)
            found = collide(one.layer)
            worst = max(
                worst, abs(found.restitution - one.restitution), abs(found.duration - one.duration)
            )
            print(
                f"{k:6g} {c:6g} {one.restitution:10.6f} {one.poisson_covector:9.6f} "
                f"{one.compression_time:9.6f} {one.duration:10.6f} {one.deepest:10.6f}"
            )
            numbers |= {f"e {k:g} {c:g}": one.restitution, f"t_f {k:g} {c:g}": one.duration}
    print(f"largest difference between closed form and integration: {worst:.1e}")
    return numbers | {"closed form - integration": worst}


def motion(layer: Layer, metric: Metric = Metric.DOMINANT):
    """Follow a particle that enters the layer, until it has left it."""
    wall = ConstrainedSystem(np.array([[MASS]]), lambda q: q[0], lambda q: np.ones(1))
    return layer_motion(
        wall, layer, q0=[layer.width], v0=[-SPEED], t_end=50.0, contacts=1, metric=metric, refine=8
    )


def collide(layer: Layer, metric: Metric = Metric.DOMINANT):
    """Return the contact of such a particle."""
    return motion(layer, metric).contacts[0]


def readings(ratios: tuple[float, ...], out: Path) -> dict[str, float]:
    """Draw Fig. 3, and what the cut-off and the readings of the metric change; k = c = 1."""
    numbers = {}
    print("\n reading      a/b         e    t_f [s]  x_min [m]   (k = c = 1)")
    for metric in Metric:
        for ratio in (*ratios, 1.0):
            found = collide(Layer(WIDTH, k=1.0, c=1.0, start=ratio * WIDTH), metric)
            print(
                f" {metric.name:9s} {ratio:6g} {found.restitution:9.5f} {found.duration:10.5f} "
                f"{found.deepest:10.5f}"
            )
            numbers[f"{metric.name} {ratio:g}"] = found.restitution
    layers = {ratio: Layer(WIDTH, k=1.0, c=1.0, start=ratio * WIDTH) for ratio in ratios}
    curves = {f"a/b = {ratio:g}": motion(layer) for ratio, layer in layers.items()}
    plot_cut_off(curves, impact(1.0, 1.0), out / "figure_3.png")
    return numbers


# Things to try: a particle twice as fast in a layer with a speed of its own, vc.Layer(1.0, k=1.0,
# c=1.0, speed=1.0): c counts twice; WIDTH = 1e-3 with k = 1e6 (b cancels: the same restitution); c
# = 100, an almost plastic impact; gravity as the system's force, and t_end instead of contacts=1.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
