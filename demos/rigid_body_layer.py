#!/usr/bin/env python3
"""Throw a spinning rigid body on a plane with a boundary layer.

It is the second example of the paper on b-geometry (ENOC 2017).

The first body has one contact point. Its motion through thinner and thinner layers tends to the
impact map of rigid body dynamics. The second body is an ellipsoid that tumbles down on the plane.
Every bounce has the wanted restitution at the point that touches, and turns spin into flight and
back.

    bash demos/run.sh rigid_body_layer      # into results/rigid_body_layer

All quantities are SI; docs/theory/boundary_layer.md explains them. One process is enough.
"""

from __future__ import annotations

import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np

from demos.parts.pictures.layer import plot_bounces_of_body, plot_thin_limit
from vi_contact.cli import status_of
from vi_contact.layer import Ellipsoid, Layer, RigidBody, layer_for, layer_motion

# Parameters
# --------------------------------------------------------------------------------------------------
BODY = RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.4), point=(0.3, -0.2, -0.5))
BEFORE = np.array([0.3, 0.0, -1.0, 0.5, -0.4, 0.2])  # velocity of the mass centre, spin in the body
RESTITUTION = 0.593624
WIDTHS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # b [m]
EGG = RigidBody(
    mass=2.0,
    inertia=(0.1, 0.136, 0.164),
    point=Ellipsoid((0.5, 0.4, 0.3)),
    gravity=(0.0, 0.0, -9.81),
)
START = np.array([0.0, 0.0, 1.5, 0.92, 0.25, -0.2, 0.2])  # mass centre, quaternion
THROW = np.array([0.3, 0.0, 0.0, 0.5, -0.4, 3.0])
EGG_E, EGG_WIDTH, T_END = 0.8, 1e-4, 3.0
OUT = Path("results/rigid_body_layer")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run both bodies (``quick``: two widths, one bounce); return the key numbers."""
    out.mkdir(parents=True, exist_ok=True)
    numbers = thin_limit(WIDTHS[1:4:2] if quick else WIDTHS, out)
    numbers |= tumbling(0.8 if quick else T_END, out)
    if progress:
        print(f"\nFigures are in {out}.")
    return numbers


def thin_limit(widths: tuple[float, ...], out: Path) -> dict[str, float]:
    """Compare velocities behind the layer with the impact map with the layer's e."""
    at_plane = np.array([0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0])
    rate = BODY.gradient(at_plane) @ BEFORE
    exact = BODY.after_impact(at_plane, BEFORE, RESTITUTION)
    print(
        f"A = {BODY.gradient(at_plane)}, g_11 = {BODY.normal_mass(at_plane):g} kg, rate {rate:g} "
        "m/s\n"
        f"impact map with e = {RESTITUTION:g}: {np.round(exact, 6)}\n"
        f"energy {BODY.kinetic_energy(BEFORE):.6f} -> {BODY.kinetic_energy(exact):.6f} J\n\n"
        "  b [m]        e    duration/b   largest difference of velocities"
    )
    errors = []
    for width in widths:
        layer = layer_for(RESTITUTION, mass=BODY.normal_mass(at_plane), speed=-rate, width=width)
        motion = layer_motion(
            BODY.system(),
            layer,
            q0=at_plane + np.eye(7)[2] * width,
            v0=BEFORE,
            t_end=1.0,
            contacts=1,
        )
        errors.append(float(np.max(np.abs(motion.v[-1] - exact))))
        contact = motion.contacts[0]
        print(
            f"{width:7.0e} {contact.restitution:10.6f} {contact.duration / width:10.4f} "
            f"{errors[-1]:18.2e}"
        )
    plot_thin_limit(
        {"velocities": (np.array(widths), np.array(errors))},
        out / "thin_limit.png",
        quantity="largest difference to the impact map [m/s, rad/s]",
    )
    return {
        "loss": BODY.kinetic_energy(BEFORE) - BODY.kinetic_energy(exact),
        "error": errors[-1],
        "order": float(np.log(errors[0] / errors[-1]) / np.log(widths[0] / widths[-1])),
    }


def tumbling(t_end: float, out: Path) -> dict[str, float]:
    """Follow the ellipsoid: contacts, and its energy beside the losses of the impact map."""
    wanted = layer_for(EGG_E, mass=1.0, speed=5.0, width=EGG_WIDTH)
    # V is the speed of each impact: e is the same in all
    layer = Layer(EGG_WIDTH, k=wanted.k, c=wanted.c)
    q0 = START.copy()
    q0[3:] /= np.linalg.norm(q0[3:])
    motion = layer_motion(EGG.system(), layer, q0=q0, v0=THROW, t_end=t_end, rtol=1e-9, refine=8)
    energy = np.array([EGG.energy(q, v) for q, v in zip(motion.q, motion.v, strict=True)])
    still = np.full(len(energy), energy[0])
    print(
        "\n   t [s]   rate in [m/s]      e     g_11 [kg]   energy lost [J]   ½ g_11 (1 - e²) ρ̇²   "
        "deepest/b"
    )
    worst = 0.0
    for contact in motion.contacts:
        first, last = (int(np.argmin(np.abs(motion.t - t))) for t in (contact.start, contact.end))
        g = EGG.normal_mass(motion.q[first])
        lost = 0.5 * g * (1.0 - EGG_E**2) * contact.rate_in**2
        still[motion.t >= contact.end] -= lost
        worst = max(worst, abs(contact.restitution / EGG_E - 1.0))
        print(
            f"{contact.start:8.4f} {contact.rate_in:12.4f} {contact.restitution:12.5f} {g:9.4f} "
            f"{energy[first] - energy[last]:14.5f} {lost:17.5f} {contact.deepest / EGG_WIDTH:16.3f}"
        )
    plot_bounces_of_body(
        motion,
        energy,
        out / "tumbling.png",
        still=still,
        title=f"An ellipsoid tumbles down on a plane, e = {EGG_E:g}",
    )
    return {
        "contacts": float(len(motion.contacts)),
        "worst_restitution": worst,
        "energy": float(energy[-1]),
        "energy_error": float(abs(energy[-1] - still[-1]) / energy[0]),
    }


# Things to try: vc.Metric.FULL in layer_motion (another restitution for the same k and c); EGG_E =
# 1.0, which bounces for ever and loses nothing; axes (0.3, 0.3, 0.3), a ball whose spin no impact
# can change; EGG_WIDTH = 1e-2, soft skin.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
