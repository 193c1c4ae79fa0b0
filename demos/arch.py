#!/usr/bin/env python3
"""Shake a masonry arch of voussoirs by an earthquake, and film how its joints open.

The voussoirs of a round arch stand on two abutments that shake. Contact and friction alone hold
them. Joints open at hinges, on the inside and the outside in turn, and close again.

    bash demos/run.sh arch                 # a table, pictures and a film, into results/arch
    bash demos/run.sh -n 2 arch            # the same on two ranks
    bash demos/run.sh arch elcentro.at2    # a record of your own

Units are SI; docs/gallery/arch.md explains the model and what it prints.
"""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path
from time import perf_counter

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.histories import plot_energy
from vi_contact import fem, ground_motion
from vi_contact.meshes import ArchMesh
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
RADIUS = 4.0  # m, of the centre line
THICKNESS = 0.7  # m, of the ring
OPENING = 150.0 * pi / 180.0  # rad
STONE = vc.LinearElastic(E=2e9, nu=0.2, rho=2200.0)
MU = 0.6
PEAK = 6.0  # m/s², of the motion
DURATION = 5.0  # s
DT = 0.00125  # s; with longer steps friction gives energy (docs/gallery/arch.md)
FRAMES = 60  # of the film
MAGNIFIED = 20.0  # times, of displacements in pictures
OUT = Path("results/arch")


def make_problem(comm: MPI.Comm, voussoirs: int, record: ground_motion.Record) -> vc.ContactProblem:
    """Return the arch on its abutments, under its weight and the earthquake.

    Args:
        comm: the ranks.
        voussoirs: of the arch.
        record: of the motion along the span.
    """
    arch = ArchMesh(
        voussoirs=voussoirs,
        radius=RADIUS,
        thickness=THICKNESS,
        opening=OPENING,
        abutment=0.5,
        divisions=(1, 4),
    )
    mesh, tags = fem.build_mesh(arch, comm)
    ends = [tags["left_end"], tags["right_end"]]
    system = vc.with_weight(fem.assemble(mesh, STONE, clamped=ends))
    return vc.ContactProblem(
        system,
        fem.contact_pairs(system, tags=tags),
        mass=vc.ConsistentMass(),  # stones of one cell have nodes of contact only
        friction=vc.Coulomb(MU),
        excitation=vc.GroundMotion(record, direction=(1.0, 0.0)),
    )


def make_earthquake(path: Path | None = None) -> ground_motion.Record:
    """Return the record of a file, or a made-up motion, with the peak ``PEAK``."""
    if path is None:
        envelope = ground_motion.Envelope(rise=0.5, end=3.0, decay=1.0)  # [s], [1/s]
        record = ground_motion.synthetic(
            ground_motion.KanaiTajimi(s0=0.01), DURATION, 0.01, seed=1940, envelope=envelope
        )
    else:
        record = ground_motion.read_record(path)
    return ground_motion.Processing(low=0.2, baseline=2, pga=PEAK)(record)


def main(
    quick: bool = False,
    out: Path = OUT,
    progress: bool = True,
    record: Path | None = None,
) -> dict[str, float]:
    """Shake the arch (``quick``: 6 voussoirs for a third of a second) and return key numbers."""
    comm = MPI.COMM_WORLD
    steps = 60 if quick else round(DURATION / DT)
    begin = perf_counter()
    problem = make_problem(comm, 6 if quick else 16, make_earthquake(record))
    set_up = perf_counter() - begin

    # the arch stands before the earthquake, and the crown is watched above and below
    at_rest = vc.static_equilibrium(problem)
    crown = {"above": (0.0, RADIUS + 0.5 * THICKNESS), "below": (0.0, RADIUS - 0.5 * THICKNESS)}
    begin = perf_counter()
    solution = vc.simulate(
        problem,
        scheme=vc.MoreauJean(),
        state=at_rest,
        dt=DT,
        steps=steps,
        record=[vc.Energy(), vc.Contact(arrays=False), vc.Probe(crown)],
        out=out / "run",
        fields=fem.XDMF(every=max(steps // (4 * FRAMES), 1)),
        progress=progress,
    )
    seconds = perf_counter() - begin

    facts = solution.facts
    numbers = {
        "contact points": float(comm.allreduce(len(problem.surface.gap0))),
        "certificate at rest": at_rest.certificate,
        "certificate": facts["worst_certificate"],
        "energy defect": facts["energy_defect"],
        "set-up [s]": set_up,
        "ms a step": 1e3 * seconds / steps,
    }
    if comm.rank == 0:
        history = solution.history
        closed = history["contact_active"]
        crown_y = history["u_y_above"]
        numbers["closed points at rest"] = float(closed[0])
        numbers["fewest closed points"] = float(closed.min())
        numbers["crown rises by [mm]"] = 1e3 * float(crown_y.max() - crown_y[0])
        numbers["crown falls by [mm]"] = 1e3 * float(crown_y[0] - crown_y.min())
        numbers["friction work [J]"] = float(history["loss_friction"][-1])
        for name, value in numbers.items():
            print(f"{name:28s} {value:.6g}")
        draw(out, quick)
    comm.Barrier()  # nobody leaves before the figures are there
    return numbers


def draw(out: Path, quick: bool) -> None:
    """Draw the arch at rest and when most joints are open, energies, and the film around that."""
    run = vc.read_run(out / "run")
    history = run.history
    widest = float(history["t"][np.argmin(history["contact_active"])])
    vc.plots.plot_deformed(run, out / "arch.png", times=[0.0, widest], magnified=MAGNIFIED)
    plot_energy(history, out / "energy.png")
    if not quick:
        begin = min(max(widest - 1.5, 0.0), DURATION - 3.0)
        times = np.linspace(begin, begin + 3.0, FRAMES)
        vc.plots.film(run, out / "arch.gif", times=times, magnified=MAGNIFIED)


# Things to try: THICKNESS = 0.5, an arch that is nearer to its limit; MU = 0.3, at which voussoirs
# slide; DT = 0.005 with PEAK = 3.0, at which the log warns that friction gives energy: this alone
# lets the arch fall; a record of your own.
if __name__ == "__main__":
    given = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    raise SystemExit(status_of(lambda: main(record=given)))
