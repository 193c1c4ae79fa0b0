#!/usr/bin/env python3
"""Shake an array of 9 x 9 bricks with gaps in a frame, seen from above, for ten seconds.

Bricks of graphite stand on a smooth table, with a gap round each. The table carries a frame, which
an earthquake moves in both directions. Bricks strike their neighbours and the frame, and rub.

    bash demos/run.sh bricks               # a table, pictures and a film, into results/bricks
    bash demos/run.sh -n 2 bricks          # the same on two ranks

Units are SI; docs/gallery/bricks.md explains the model and what it prints.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.histories import plot_energy
from vi_contact import fem, ground_motion
from vi_contact.meshes import BricksMesh
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
SIDE = 0.2  # m, of a brick
GAP = 0.01  # m, between bricks, and between bricks and the frame
GRAPHITE = vc.LinearElastic(E=1e8, nu=0.2, rho=1800.0)  # soft, so that steps see the blows
MU = 0.3
PEAKS = (3.0, 2.0)  # m/s², of the motion along x and y
SEEDS = (11, 12)
DURATION = 10.0  # s
DT = 0.01  # s
FRAMES = 60  # of the film
OUT = Path("results/bricks")


def make_problem(comm: MPI.Comm, count: int, duration: float) -> vc.ContactProblem:
    """Return count x count bricks in their frame.

    Args:
        comm: the ranks.
        count: bricks along each side.
        duration: of the earthquake [s].
    """
    array = BricksMesh(
        counts=(count, count), lengths=(SIDE, SIDE), gaps=(GAP, GAP), divisions=(1, 1)
    )
    mesh, tags = fem.build_mesh(array, comm)
    system = fem.assemble(mesh, GRAPHITE)
    between = fem.contact_pairs(system, within=1.5 * GAP, tags=tags)

    # the frame stands still: motions are those relative to it
    far = count * (SIDE + GAP)
    inside = {
        "left": vc.HalfSpace(point=(-GAP, 0.0), normal=(1.0, 0.0)),
        "right": vc.HalfSpace(point=(far, 0.0), normal=(-1.0, 0.0)),
        "bottom": vc.HalfSpace(point=(0.0, -GAP), normal=(0.0, 1.0)),
        "top": vc.HalfSpace(point=(0.0, far), normal=(0.0, -1.0)),
    }
    frame = [
        fem.contact_surface(system, tags[name], obstacle=side) for name, side in inside.items()
    ]
    return vc.ContactProblem(
        system,
        fem.joined_surfaces(between, *frame),
        mass=vc.ConsistentMass(),  # bricks of one cell have nodes of contact only
        friction=vc.Coulomb(MU),
        excitation=make_earthquake(duration),
    )


def make_earthquake(duration: float) -> list[vc.GroundMotion]:
    """Return two made-up components of the motion of the table, each of its seed."""
    ground = ground_motion.KanaiTajimi(s0=0.01)
    envelope = ground_motion.Envelope(rise=1.0, end=6.0, decay=0.8)  # [s], [1/s]
    components = []
    for axis, peak, seed in zip(np.eye(2), PEAKS, SEEDS, strict=True):
        record = ground_motion.synthetic(ground, duration, DT, seed=seed, envelope=envelope)
        record = ground_motion.Processing(low=0.3, baseline=2, pga=peak)(record)
        components.append(vc.GroundMotion(record, direction=tuple(axis)))
    return components


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Shake the array (``quick``: 3 x 3 bricks for 1.6 seconds); return key numbers."""
    comm = MPI.COMM_WORLD
    count = 3 if quick else 9
    duration = 2.0 if quick else DURATION
    steps = 160 if quick else round(DURATION / DT)

    begin = perf_counter()
    problem = make_problem(comm, count, duration)
    set_up = perf_counter() - begin
    middle = (0.5 * count - 0.5) * (SIDE + GAP)
    begin = perf_counter()
    solution = vc.simulate(
        problem,
        scheme=vc.MoreauJean(),
        dt=DT,
        steps=steps,
        record=[
            vc.Energy(),
            vc.Contact(arrays=False),
            vc.Probe({"first": (0.0, 0.0), "middle": (middle, middle)}),
        ],
        out=out / "run",
        fields=fem.XDMF(every=max(steps // FRAMES, 1)),
        progress=progress,
    )
    seconds = perf_counter() - begin

    facts = solution.facts
    numbers = {
        "bricks": float(count**2),
        "contact points": float(comm.allreduce(len(problem.surface.gap0))),
        "set-up [s]": set_up,
        "ms a step": 1e3 * seconds / steps,
        "certificate": facts["worst_certificate"],
        "energy defect": facts["energy_defect"],
    }
    if comm.rank == 0:
        history = solution.history
        numbers["most points closed"] = float(history["contact_active"].max())
        numbers["first brick, way [mm]"] = 1e3 * float(np.ptp(history["u_x_first"]))
        numbers["middle brick, way [mm]"] = 1e3 * float(np.ptp(history["u_x_middle"]))
        for name, value in numbers.items():
            print(f"{name:28s} {value:.6g}")
        draw(out, quick)
    comm.Barrier()  # nobody leaves before the figures are there
    return numbers


def draw(out: Path, quick: bool) -> None:
    """Draw the array when most points touch, energies, and the film, as large as they are."""
    run = vc.read_run(out / "run")
    most = float(run.history["t"][np.argmax(run.history["contact_active"])])
    vc.plots.plot_deformed(run, out / "bricks.png", times=[0.0, most], magnified=1.0)
    plot_energy(run.history, out / "energy.png")
    if not quick:
        times = np.linspace(0.0, DURATION, FRAMES)
        vc.plots.film(run, out / "bricks.gif", times=times, magnified=1.0)


# Things to try: gaps of 20 mm; PEAKS ten times smaller, at which bricks hardly touch;
# impact=vc.Elastic(), after which they bounce on; unlike=1 in the mesh.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
