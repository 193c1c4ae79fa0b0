#!/usr/bin/env python3
"""Shake a tower that stands on soil, lifts off and slides.

It is above a compliant base and between free-field sides.

There are three stages, as in practice. In the first, gravity acts on firm supports. In the second,
the supports are released and their reactions are kept as forces. In the third, an earthquake comes
up from below. A compliant base takes the upgoing motion, which is half of an outcrop record, so the
motion of the base differs from the record that is put in. docs/guide/soil.md explains these
boundaries.

    bash demos/run.sh tower_on_soil         # into results/tower_on_soil
    bash demos/run.sh -n 2 tower_on_soil    # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.histories import plot_certificate, plot_energy
from vi_contact import fem, soil
from vi_contact.cli import status_of
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

# Parameters
# --------------------------------------------------------------------------------------------------
SOIL = vc.LinearElastic.from_wave_speeds(500.0, 250.0, 1900.0)  # c_P, c_S [m/s], rho [kg/m³]
ROCK = vc.LinearElastic.from_wave_speeds(1600.0, 800.0, 2400.0)  # below the base
TOWER = vc.LinearElastic(E=1.5e9, nu=0.2, rho=500.0)  # a building seen as one block
LAYER, HOUSE = (48.0, 16.0), (6.0, 18.0)  # width and height [m]
MU = 0.6
OUTCROP = vc.Ricker(amplitude=3.0, frequency=2.0)  # what a station on the rock would record [m/s²]
# 3 % at 4 Hz; alpha would brake the rocking
DAMPING = vc.Rayleigh(alpha=0.0, beta=0.03 / (np.pi * 4.0))
DT, T_END = 2.5e-3, 3.0
OUT = Path("results/tower_on_soil")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Return the key numbers of all three stages (``quick``: cells of 2 m, 110 steps of 10 ms)."""
    comm = MPI.COMM_WORLD
    h, dt, t_end = (2.0, 1e-2, 1.1) if quick else (1.0, DT, T_END)
    lower, upper = (
        BlockMesh(lengths=size, divisions=tuple(round(x / h) for x in size))
        for size in (LAYER, HOUSE)
    )
    mesh, tags = fem.build_mesh(
        TwoBlocks(lower=lower, upper=upper, offset=(0.5 * (LAYER[0] - HOUSE[0]),)), comm
    )
    static, state, problem = stages(mesh, tags, dt)
    problem, start = fem.release(static, state, problem)

    middle = 0.5 * LAYER[0]
    top = LAYER[1]
    points = {
        "base": (0.0, 0.0),
        "surface": (0.0, top),
        "foot": (middle, top),
        "roof": (middle, top + HOUSE[1]),
    }
    solution = vc.simulate(
        problem,
        dt=dt,
        t_end=t_end,
        state=start,
        out=out,
        progress=progress,
        record=(vc.Energy(), vc.Contact(), vc.Probe(points, velocity=True, acceleration=True)),
        fields=fem.XDMF(every=20),
    )
    history = solution.history
    peak = {name: float(np.abs(history[f"a_x_{name}"]).max()) for name in points}
    numbers = {
        "outcrop": OUTCROP.amplitude,
        **peak,
        "uplift": float(history["contact_uplift"].max()),
        "slip": float(np.nanmax(history["contact_max_slip"])),
        "worst": solution.facts["worst_certificate"],
    }
    if comm.rank == 0:
        print(f"{solution.summary()}\n\nLargest horizontal acceleration [m/s²]:")
        print(f"  outcrop {OUTCROP.amplitude:.2f} (upgoing wave {0.5 * OUTCROP.amplitude:.2f})")
        print("".join(f"  {name} {value:.2f}\n" for name, value in peak.items()))
        print(
            f"Largest share of the foot that is open {numbers['uplift']:.2f}, slip "
            f"{1e3 * numbers['slip']:.1f} mm"
        )
        draw(history, out / "motions.png")
        plot_energy(history, out / "energy.png")
        plot_certificate(history, out / "certificate.png")
        print(f"\nFigures, histories and ParaView files are in {out}.")
    return numbers


def stages(
    mesh: Any, tags: Any, dt: float
) -> tuple[vc.ContactProblem, vc.State, vc.ContactProblem]:
    """Return (gravity stage, its state, dynamic problem before the release)."""
    cells = [(tags["lower"], SOIL), (tags["upper"], TOWER)]
    sides = [tags["lower_left"], tags["lower_right"]]
    rollers = [fem.Prescribed(side, components=(0,)) for side in sides]
    gravity = fem.assemble(mesh, cells, clamped=tags["lower_bottom"], prescribed=rollers)
    base = fem.CompliantBase(tags["lower_bottom"], ROCK, motion=soil.upgoing(OUTCROP, dt=1e-3))
    free_field = [soil.FreeField(side, base=base) for side in sides]
    dynamic = fem.assemble(mesh, cells, dashpots=[base, *free_field], damping=DAMPING)
    static, problem = (
        vc.ContactProblem(
            system,
            fem.contact_pair(
                system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
            ),
            friction=vc.Coulomb(MU),
        )
        for system in (vc.with_weight(gravity), vc.with_weight(dynamic))
    )
    return static, vc.static_equilibrium(static, solver=vc.Condensed()), problem


def draw(history: Any, path: Path) -> None:
    """Draw input and response."""
    from matplotlib.figure import Figure

    t = history["t"]
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    upper.plot(
        t,
        [OUTCROP.acceleration(s) for s in t],
        color="0.6",
        label="outcrop (twice the upgoing wave)",
    )
    for name, style in (("base", "-"), ("surface", "--")):
        upper.plot(t, history[f"a_x_{name}"], style, label=f"{name}, at the side")
    upper.set_ylabel("a_x [m/s²]")
    upper.legend()
    for name in ("foot", "roof"):
        middle.plot(
            t, 1e3 * (history[f"u_x_{name}"] - history["u_x_surface"]), label=f"{name} less surface"
        )
    middle.set_ylabel("u_x [mm]")
    middle.legend()
    lower.plot(t, history["contact_uplift"], color="k")
    lower.set(xlabel="time [s]", ylabel="open share of the foot [-]")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    raise SystemExit(status_of(lambda: main(quick="--quick" in sys.argv)))

# Things to try:
# - MU = 0.2 slides instead of rocking; a smaller amplitude keeps the foot closed and the response
#   linear.
# - fem.CompliantBase without ROCK: the soil goes on below, the surface moves with the outcrop
#   record itself.
# - tied=fem.Tied(...) in place of the free-field sides: what the tower radiates comes back in from
#   the other side.
# - DAMPING with alpha: see docs/reference/faq.md.
