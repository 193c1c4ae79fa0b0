#!/usr/bin/env python3
"""Find the time schemes that create energy in contact when a wave crosses many elements in a step.

    python3 benchmarks/long_steps.py [--t-end 3] [--only HHT]
    python3 benchmarks/long_steps.py --others     # a stockier wall, a free block and two bars

The wall of docs/notebooks/shaken_wall.md on 2 x 12 bilinear elements, beside rigid ground, is
shaken at 3 m/s². The table of docs/guide/schemes.md has a row for each scheme and a column for each
time step: the energy that contact and scheme created, as a share of the largest energy of the run.
Growth is chaotic, so that shares are printed in classes.
"""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.bar import Bar, build
from vi_contact import fem, ground_motion
from vi_contact.exact import BouncingBar, PeriodicBar
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.wall import WallMesh

SCHEMES: dict[str, Any] = {
    "`Trapezoidal()`, the default": vc.Trapezoidal(),
    "`HHT(-0.1)`": vc.HHT(-0.1),
    "`GeneralisedAlpha`, rho 0.8": vc.GeneralisedAlpha.spectral_radius(0.8),
    "`GeneralisedAlpha`, rho 0.5, which is `HHT(-1/3)`": vc.GeneralisedAlpha.spectral_radius(0.5),
    "`GeneralisedAlpha`, rho 0": vc.GeneralisedAlpha.spectral_radius(0.0),
    "`Houbolt()`": vc.Houbolt(),
    "`ContactStabilisedNewmark()`": vc.ContactStabilisedNewmark(),
    "`Midpoint()`": vc.Midpoint(),
    "`MoreauJean()`": vc.MoreauJean(),
}
STEPS = (10e-3, 5e-3, 2.5e-3, 1.25e-3, 0.6e-3, 0.3e-3)  # s
MASONRY = vc.LinearElastic(E=5.0e9, nu=0.2, rho=2000.0)  # pressure waves of 1667 m/s
SHORTEST = 0.25  # m: edge of an element across the wall


def wall(divisions: tuple[int, int] = (2, 12), degree: int = 1) -> vc.ContactProblem:
    """Return the wall beside the ground, with 3 % of damping."""
    mesh, groups = fem.build_mesh(
        WallMesh(height=6.0, width=0.5, divisions=divisions), MPI.COMM_WORLD
    )
    w1, w2 = 2.0 * np.pi * 3.5, 2.0 * np.pi * 25.0
    damping = vc.Rayleigh(alpha=0.06 * w1 * w2 / (w1 + w2), beta=0.06 / (w1 + w2))
    system = fem.assemble(mesh, MASONRY, degree=degree, clamped=groups["base"], damping=damping)
    envelope = ground_motion.Envelope(rise=1.0, end=4.0, decay=1.0)
    record = ground_motion.synthetic(
        ground_motion.KanaiTajimi(s0=0.01), 6.0, 0.005, seed=3, envelope=envelope
    )
    shaking = vc.GroundMotion(ground_motion.scaled_to_pga(record, 3.0), direction=(1.0, 0.0))
    return vc.ContactProblem(
        system, fem.contact_surface(system, groups["face"]), excitation=shaking
    )


def readme_wall() -> vc.ContactProblem:
    """Return the wall of README, of 8 x 12 elements.

    A wave needs 0.26 ms for the shorter edge of an element.
    """
    mesh, tags = fem.build_mesh(WallMesh(height=9.0, width=6.0, divisions=(8, 12)), MPI.COMM_WORLD)
    concrete = vc.LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    system = fem.assemble(
        mesh, concrete, section=vc.PlaneStress(thickness=0.20), clamped=tags["base"]
    )
    ground = fem.contact_surface(
        system, tags["face"], obstacle=vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0))
    )
    return vc.ContactProblem(
        system, ground, excitation=vc.Harmonic(3.0, 14.0, direction=(1.0, 0.0))
    )


def block() -> vc.ContactProblem:
    """Return a unit square of 16 x 16 elements that falls on the ground.

    A wave needs 1.7 ms for an element.
    """
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(16, 16)), MPI.COMM_WORLD)
    rubber = vc.LinearElastic(E=1000.0, nu=0.3, rho=1.0)
    weight = fem.BodyForce((0.0, -10.0))
    system = fem.assemble(
        mesh, rubber, section=vc.PlaneStrain(), loads=weight, initial_velocity=(0.1, -1.0)
    )
    ground = vc.HalfSpace(point=(0.0, -0.05), normal=(0.0, 1.0))
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=ground))


def bar(case: Any) -> vc.ContactProblem:
    """Return a bar of 100 elements in one dimension, thrown or bouncing as its case says."""
    return build(Bar(case, elements=100, dimension=1), MPI.COMM_WORLD).problem()


# name -> problem, time of a wave through an element [s], duration [s]
OTHERS: dict[str, tuple[Any, float, float]] = {
    "wall of README": (readme_wall, 0.75 / 2887.0, 2.0),
    "free block": (block, 1.0 / 16.0 / 36.69, 3.0),
    "clamped bar, ten bounces": (lambda: bar(PeriodicBar()), 0.01, 30.0),
    "bouncing bar, ten periods": (lambda: bar(BouncingBar()), 1.0 / 300.0, 160.0 / 3.0),
}


def run(scheme: Any, dt: float, t_end: float, problem: Any = wall) -> vc.Solution:
    """Run a problem with this scheme and time step [s], with energies and contact kept."""
    return vc.simulate(
        problem(),
        scheme=scheme,
        dt=dt,
        t_end=t_end,
        record=[vc.Energy(), vc.Contact()],
        progress=False,
    )


def told(created: float) -> str:
    """Return the class of a share of the largest energy, as growth is chaotic."""
    return "none" if created < 1e-4 else "below 1 %" if created < 0.01 else "**grows**"


def main() -> None:
    """Print the table, a row for each scheme."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--t-end", type=float, default=3.0, help="of the motion [s]")
    parser.add_argument(
        "--others", action="store_true", help="other bodies at other Courant numbers"
    )
    parser.add_argument("--only", default="", help="schemes whose name contains this")
    options = parser.parse_args()
    logging.getLogger("vi_contact").setLevel(logging.ERROR)  # the warning is what is measured
    for title, (problem, crossing, t_end) in OTHERS.items() if options.others else ():
        for name, scheme in SCHEMES.items():
            for courant in (2.0, 8.0, 10.0, 16.0, 20.0, 32.0) if options.only in name else ():
                done = run(scheme, courant * crossing, t_end, problem)
                end = {
                    what: done.facts["energy"][what]
                    for what in ("energy_kinetic", "energy_strain", "work_input")
                }
                print(
                    title,
                    name,
                    f"Courant number {courant:g}: created "
                    f"{100.0 * done.facts['energy_created']:.2g} %,",
                    ", ".join(f"{what} {value:.3g} J" for what, value in end.items()),
                    flush=True,
                )
    if options.others:
        return
    speed = np.sqrt(
        MASONRY.E
        * (1.0 - MASONRY.nu)
        / ((1.0 + MASONRY.nu) * (1.0 - 2.0 * MASONRY.nu) * MASONRY.rho)
    )
    heads = (f"{1e3 * dt:g} ms ({speed * dt / SHORTEST:.2g})" for dt in STEPS)
    print(f"| scheme | {' | '.join(heads)} |\n|---|{len(STEPS) * '---|'}")
    for name, scheme in SCHEMES.items():
        if options.only in name:
            row = (told(run(scheme, dt, options.t_end).facts["energy_created"]) for dt in STEPS)
            print(f"| {name} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
